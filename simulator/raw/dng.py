"""Raw frame to DNG 1.4: thumbnail in IFD 0, mosaic in a SubIFD, exposure in the Exif IFD.

An own writer: no library at hand writes such a file to the letter. libtiff-based writers lose CFA tags
in a SubIFD, tifffile writes no Exif IFD, PiDNG puts all in IFD 0. `payload.py` stores the
mosaic in the layouts that dcraw, LibRaw, darktable, RawTherapee and Adobe's reader all take.
Tag meanings: Adobe DNG 1.4 (2012), TIFF/EP (ISO 12234-2), Exif 2.3.
"""

import os

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.frame import Raw
from simulator.raw import software, tiff
from simulator.raw.areas import areas
from simulator.raw.color_tags import color_tags
from simulator.raw.exif import exif_directory
from simulator.raw.files import atomic_write
from simulator.raw.levels import levels
from simulator.raw.opcodes import opcodes
from simulator.raw.payload import MosaicData, mosaic_data
from simulator.raw.thumbnail import thumbnail
from simulator.raw.xmp import xmp_packet

SMALLEST_SIDE_PX = 22  # LibRaw refuses smaller frames
LARGEST_SIDE_PX = 64000  # LibRaw refuses larger ones
CFA_COLOURS = {"RGGB": (0, 1, 1, 2), "BGGR": (2, 1, 1, 0), "GRBG": (1, 0, 2, 1), "GBRG": (1, 2, 0, 1)}
_PHOTOMETRIC_RGB, _PHOTOMETRIC_CFA, _PHOTOMETRIC_LINEAR_RAW = 2, 32803, 34892


def write_dng(raw: Raw, path: str | os.PathLike) -> None:
    """Write a raw frame as DNG; the file appears complete or not at all.

    Raises PhotositeError for a frame a DNG cannot hold and for a path that cannot be written.
    """
    pieces = dng_pieces(raw)
    with atomic_write(path) as temporary:
        write_pieces(pieces, temporary)


def dng_bytes(raw: Raw) -> bytes:
    """Return the content that `write_dng` would write. Raises PhotositeError as it does."""
    return b"".join(dng_pieces(raw))


def write_pieces(pieces: list[bytes | np.ndarray], path: str | os.PathLike) -> None:
    """Write buffers one after the other."""
    with open(path, "wb") as file:
        for piece in pieces:
            file.write(piece)


def dng_pieces(raw: Raw) -> list[bytes | np.ndarray]:
    """Return the DNG as buffers in file order; the mosaic itself is not copied."""
    _check(raw)
    picture, mosaic = thumbnail(raw), mosaic_data(raw)
    directories = {"main": _main_directory(raw, picture), "raw": _raw_directory(raw, mosaic), "exif": exif_directory(raw)}
    return tiff.assemble(directories, {"thumbnail": picture, "mosaic": mosaic.buffer})


def _check(raw: Raw) -> None:
    """Refuse what a DNG or its readers cannot hold."""
    if raw.dn.dtype != np.uint16 or raw.dn.ndim != 2:
        raise PhotositeError(
            f"is {raw.dn.dtype} {raw.dn.shape}: a raw frame is uint16 (height, width)", part=raw.name, key="raw.dn", joint=" "
        )
    for side, pixels in zip(("height", "width"), raw.dn[raw.active].shape, strict=True):
        rule = f"raw converters read frames of {SMALLEST_SIDE_PX} to {LARGEST_SIDE_PX} px a side; set camera.window"
        require(SMALLEST_SIDE_PX <= pixels <= LARGEST_SIDE_PX, f"camera.{side}", f"{pixels} px", rule, part=raw.name)
    if raw.dn.nbytes + 2**20 > tiff.LARGEST_FILE_BYTES:  # thumbnail and tags stay well below 1 MiB
        size = f"{raw.dn.shape[1]} x {raw.dn.shape[0]} px"
        raise PhotositeError(f"frame of {size}: a DNG ends at 4 GiB; use a smaller window of the sensor", part=raw.name)
    color_tags(raw)  # refuses what the thumbnail would divide by


def _main_directory(raw: Raw, picture: np.ndarray) -> dict[int, tiff.Field | tiff.Pointer]:
    """IFD 0: thumbnail, camera, colour."""
    tags = {
        254: tiff.long(1),  # NewSubfileType: reduced resolution
        258: tiff.short(8, 8, 8),  # BitsPerSample
        259: tiff.short(1),  # Compression: none
        262: tiff.short(_PHOTOMETRIC_RGB),
        273: tiff.Pointer("thumbnail"),  # StripOffsets
        274: tiff.short(raw.format.orientation),
        277: tiff.short(3),  # SamplesPerPixel
        305: tiff.text(software()),
        330: tiff.Pointer("raw"),  # SubIFDs
        34665: tiff.Pointer("exif"),
        50706: tiff.byte(1, 4, 0, 0),  # DNGVersion
        50707: tiff.byte(1, 1, 0, 0),  # DNGBackwardVersion
        50708: tiff.text(f"{raw.make} {raw.model}".strip() or "Photosite"),  # UniqueCameraModel
    }
    tags |= {code: tiff.text(value) for code, value in ((271, raw.make), (272, raw.model)) if value}
    if raw.baseline_exposure_ev is not None:
        tags[50730] = tiff.signed_rational(raw.baseline_exposure_ev)
    if packet := xmp_packet(raw):
        tags[700] = tiff.packet(packet)
    return tags | color_tags(raw) | _strip(*picture.shape[:2], picture.nbytes)


def _raw_directory(raw: Raw, mosaic: MosaicData) -> dict[int, tiff.Field | tiff.Pointer]:
    """SubIFD: the mosaic, its levels and its noise."""
    height, width = raw.dn.shape
    mono = raw.cfa == "MONO"
    tags = {
        254: tiff.long(0),  # NewSubfileType: the full picture
        258: tiff.short(mosaic.bits_per_sample),  # of the storage; WhiteLevel tells the range
        259: tiff.short(mosaic.compression),
        262: tiff.short(_PHOTOMETRIC_LINEAR_RAW if mono else _PHOTOMETRIC_CFA),
        273: tiff.Pointer("mosaic"),  # StripOffsets
        277: tiff.short(1),  # SamplesPerPixel
        51041: tiff.double(*np.ravel(raw.noise_profile)),
    }
    if not mono:
        tags[33421] = tiff.short(2, 2)  # CFARepeatPatternDim
        tags[33422] = tiff.byte(*CFA_COLOURS[raw.cfa])
        tags[50710] = tiff.byte(0, 1, 2)  # CFAPlaneColor
        tags[50711] = tiff.short(1)  # CFALayout: rectangular
    return tags | areas(raw) | opcodes(raw) | levels(raw, mosaic.bits_per_sample) | _strip(height, width, mosaic.size_bytes)


def _strip(height: int, width: int, size_bytes: int) -> dict[int, tiff.Field]:
    """Tags that any picture in one strip has."""
    return {
        256: tiff.long(width),
        257: tiff.long(height),
        278: tiff.long(height),  # RowsPerStrip
        279: tiff.long(size_bytes),  # StripByteCounts
        284: tiff.short(1),  # PlanarConfiguration
    }
