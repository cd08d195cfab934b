"""Raw frame to DNG 1.4: thumbnail in IFD 0, mosaic in a SubIFD, exposure in the Exif IFD.

No available library writes such a file in full conformance: libtiff-based writers lose CFA tags in a SubIFD,
tifffile writes no Exif IFD, PiDNG puts all tags into IFD 0. `simulator/raw/dng/payload.py` encodes the mosaic in the
layouts that dcraw, LibRaw, darktable, RawTherapee and Adobe's reader all read.
Tag meanings: Adobe DNG 1.4 (2012), TIFF/EP (ISO 12234-2), Exif 2.3.
"""

import os

import numpy as np

from simulator.atomic_files import atomic_write, write_buffers
from simulator.errors import PhotositeError, require
from simulator.raw.disk_arrays import in_blocks
from simulator.raw.dng import tiff
from simulator.raw.dng.areas import areas
from simulator.raw.dng.color_tags import color_tags
from simulator.raw.dng.exif import exif_directory
from simulator.raw.dng.levels import levels
from simulator.raw.dng.opcodes import opcodes
from simulator.raw.dng.payload import MosaicData, mosaic_data
from simulator.raw.dng.tags import CfaColor, CfaLayout, Compression, Photometric, PlanarConfiguration, SubfileType, Tag
from simulator.raw.dng.thumbnail import thumbnail
from simulator.raw.dng.xmp import xmp_packet
from simulator.raw.raw_image import Raw
from simulator.raw.software import software
from simulator.sensor.camera.cfa import Cfa

SMALLEST_SIDE_PX = 22  # LibRaw refuses smaller frames
LARGEST_SIDE_PX = 64000  # LibRaw refuses larger ones
COLOURS = {"R": CfaColor.RED, "G": CfaColor.GREEN, "B": CfaColor.BLUE, "C": CfaColor.WHITE, "W": CfaColor.WHITE}


def write_dng(raw: Raw, path: str | os.PathLike) -> None:
    """Write a raw frame as DNG; the file appears complete or not at all.

    Raises PhotositeError for a frame that a DNG cannot store and for a path that cannot be written.
    """
    pieces = dng_pieces(raw)
    with atomic_write(path) as temporary:
        write_pieces(pieces, temporary)


def dng_bytes(raw: Raw) -> bytes:
    """Return the content that `write_dng` would write. Raises PhotositeError as it does."""
    return b"".join(dng_pieces(raw))


def write_pieces(pieces: list[bytes | memoryview], path: str | os.PathLike) -> None:
    """Write buffers one after the other. Raises OSError."""
    write_buffers(path, (block.data for piece in pieces for block in in_blocks(np.frombuffer(piece, np.uint8))))


def dng_pieces(raw: Raw) -> list[bytes | memoryview]:
    """Return the DNG as buffers in file order; the mosaic itself is not copied."""
    _check(raw)
    picture, mosaic = thumbnail(raw), mosaic_data(raw)
    main, mosaic_tags = _main_directory(raw, picture), _raw_directory(raw, mosaic)
    directories: dict[str, tiff.Directory] = {"main": main, "raw": mosaic_tags, "exif": exif_directory(raw)}
    return tiff.assemble(directories, {"thumbnail": picture, "mosaic": mosaic.buffer})


def _check(raw: Raw) -> None:
    """Raise PhotositeError for a frame that a DNG cannot store or its readers cannot read."""
    if raw.dn.dtype != np.uint16 or raw.dn.ndim != 2:
        raise PhotositeError(
            f"is {raw.dn.dtype} {raw.dn.shape}: a raw frame is uint16 (height, width)", part=raw.name, key="raw.dn", joint=" "
        )
    for side, pixels in zip(("height", "width"), raw.dn[raw.active].shape, strict=True):
        rule = f"raw converters read frames of {SMALLEST_SIDE_PX} to {LARGEST_SIDE_PX} px a side; set camera.window"
        require(SMALLEST_SIDE_PX <= pixels <= LARGEST_SIDE_PX, f"camera.{side}", f"{pixels} px", rule, part=raw.name)
    height, width = raw.dn.shape
    check_size(height, width, raw.name)
    color_tags(raw)  # raises for neutral values of 0, by which the thumbnail would divide


def check_size(height: int, width: int, name: str) -> None:
    """Raise PhotositeError for a frame that is too large for a DNG. name: of the shot."""
    if 2 * height * width + 2**20 > tiff.LARGEST_FILE_BYTES:  # thumbnail and tags stay well below 1 MiB
        raise PhotositeError(
            f"frame of {width} x {height} px: a DNG ends at 4 GiB; use a smaller window of the sensor (camera.window)",
            part=name,
        )


def _main_directory(raw: Raw, picture: np.ndarray) -> dict[Tag, tiff.Field | tiff.Pointer]:
    """Tags of IFD 0: thumbnail, camera, colour."""
    tags: dict[Tag, tiff.Field | tiff.Pointer] = {
        Tag.NEW_SUBFILE_TYPE: tiff.long(SubfileType.REDUCED_RESOLUTION),
        Tag.BITS_PER_SAMPLE: tiff.short(8, 8, 8),
        Tag.COMPRESSION: tiff.short(Compression.NONE),
        Tag.PHOTOMETRIC_INTERPRETATION: tiff.short(Photometric.RGB),
        Tag.STRIP_OFFSETS: tiff.Pointer("thumbnail"),
        Tag.ORIENTATION: tiff.short(raw.format.orientation),
        Tag.SAMPLES_PER_PIXEL: tiff.short(3),
        Tag.SOFTWARE: tiff.text(software()),
        Tag.SUB_IFDS: tiff.Pointer("raw"),
        Tag.EXIF_IFD: tiff.Pointer("exif"),
        Tag.DNG_VERSION: tiff.byte(1, 4, 0, 0),
        Tag.DNG_BACKWARD_VERSION: tiff.byte(1, 1, 0, 0),
        Tag.UNIQUE_CAMERA_MODEL: tiff.text(f"{raw.make} {raw.model}".strip() or "Photosite"),
    }
    tags |= {code: tiff.text(value) for code, value in ((Tag.MAKE, raw.make), (Tag.MODEL, raw.model)) if value}
    if raw.baseline_exposure_ev is not None:
        tags[Tag.BASELINE_EXPOSURE] = tiff.signed_rational(raw.baseline_exposure_ev)
    if packet := xmp_packet(raw):
        tags[Tag.XMP] = tiff.packet(packet)
    height, width = picture.shape[:2]
    return {**tags, **color_tags(raw), **_strip(height, width, picture.nbytes)}


def _raw_directory(raw: Raw, mosaic: MosaicData) -> dict[Tag, tiff.Field | tiff.Pointer]:
    """Tags of the SubIFD: mosaic, levels and noise profile."""
    height, width = raw.dn.shape
    mono = raw.cfa == "MONO"
    tags: dict[Tag, tiff.Field | tiff.Pointer] = {
        Tag.NEW_SUBFILE_TYPE: tiff.long(SubfileType.FULL_RESOLUTION),
        Tag.BITS_PER_SAMPLE: tiff.short(mosaic.bits_per_sample),  # of the storage; WhiteLevel gives the range of codes
        Tag.COMPRESSION: tiff.short(mosaic.compression),
        Tag.PHOTOMETRIC_INTERPRETATION: tiff.short(Photometric.LINEAR_RAW if mono else Photometric.CFA),
        Tag.STRIP_OFFSETS: tiff.Pointer("mosaic"),
        Tag.SAMPLES_PER_PIXEL: tiff.short(1),
        Tag.NOISE_PROFILE: tiff.double(*np.ravel(raw.noise_profile)),
    }
    if not mono:
        pattern = Cfa.named(raw.cfa)
        tags[Tag.CFA_REPEAT_PATTERN_DIM] = tiff.short(*pattern.period)
        planes = [COLOURS[letter] for letter in pattern.letters]
        tags[Tag.CFA_PATTERN] = tiff.byte(*[planes[plane] for row in pattern.planes for plane in row])
        tags[Tag.CFA_PLANE_COLOR] = tiff.byte(*planes)
        tags[Tag.CFA_LAYOUT] = tiff.short(CfaLayout.RECTANGULAR)
    strip = _strip(height, width, mosaic.size_bytes)
    return {**tags, **areas(raw), **opcodes(raw), **levels(raw, mosaic.bits_per_sample), **strip}


def _strip(height: int, width: int, size_bytes: int) -> dict[Tag, tiff.Field]:
    """Tags of a picture that is stored in one strip."""
    return {
        Tag.IMAGE_WIDTH: tiff.long(width),
        Tag.IMAGE_LENGTH: tiff.long(height),
        Tag.ROWS_PER_STRIP: tiff.long(height),
        Tag.STRIP_BYTE_COUNTS: tiff.long(size_bytes),
        Tag.PLANAR_CONFIGURATION: tiff.short(PlanarConfiguration.CHUNKY),
    }
