"""Development of raw files to pictures with rawpy (LibRaw), without LibRaw's picture-dependent defaults."""

import difflib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.raw.dng.writer import dng_bytes
from simulator.raw.filter_pattern import color_index
from simulator.raw.image_files import write_picture
from simulator.raw.raw_image import Raw
from simulator.raw.raw_reader import open_raw
from simulator.raw.white_balance import WhiteBalance, check_white_balance, white_balance_options

if TYPE_CHECKING:
    import rawpy

OUTPUTS = {"srgb": "sRGB", "linear_srgb": "sRGB", "xyz": "XYZ", "camera": "raw", "metric": "raw"}  # name in rawpy.ColorSpace
DEMOSAICS = ("linear", "vng", "ppg", "ahd", "dcb", "dht", "aahd")  # methods of LibRaw without its GPL packs
PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr")
_WHITE = 65535
_ANY_PATTERN = ("linear", "vng")  # methods of LibRaw that read any pattern; the others are one method for X-Trans
_TILE_PX = 512  # side of a tile of LibRaw's X-Trans method, which refuses smaller frames


def develop(
    raw: Raw | str | os.PathLike[str],
    *,
    output: Literal["srgb", "linear_srgb", "xyz", "camera", "metric"] = "srgb",
    half_size: bool = False,
    demosaic: str = "ahd",
    white_balance: WhiteBalance = "camera",
    exposure_ev: float = 0.0,
    bits: Literal[8, 16] = 16,
    codes: np.ndarray | None = None,
) -> np.ndarray:
    """Develop a raw frame or file: (height, width, 3) uint8 or uint16, float32 for "metric", rows as the sensor has them.

    A camera of four colours gives four planes, R, G, B, W, as "camera" and "metric".

    output: "srgb" encoded by IEC 61966-2-1; "linear_srgb"; "xyz" (CIE 1931, D65 white); "camera", the sensor's own colours;
        "metric", the sensor's own colours as measured: 0 at black, 1 at the white level, noise below black kept, no white
        balance, no tone; photosites keep (code - black) / (white - black) of their own place exactly, but where half_size
        averages two greens it cuts off half a code. LibRaw tells black levels as whole numbers; where they differ between the
        colours it clips below black.
    half_size: one pixel per 2x2 cell, no demosaicing; an odd last row or column still gives a pixel.
    demosaic: one of DEMOSAICS. "dht" and "aahd" are wrong near the border; measure with the others. Of an X-Trans frame all but
        "linear" and "vng" are LibRaw's one method for that pattern, which needs 512 px a side.
    white_balance: "camera" as the file says, "daylight" (D65), the name of an illuminant such as "A" or "3200 K" (as the file's
        colour matrix sees it), multipliers for R, G, B, or a grey patch (x, y, width, height) in pixels of the frame.
    exposure_ev: lightens by 2^ev after white balance; what the sensor clipped stays clipped.
    bits: 8 or 16 per value. Full scale is the white level in the channel with the smallest multiplier, which is set to 1.
    codes: (height, width) uint16 in place of the file's own, for example those without noise, of the whole frame or of its
        active area; white balance and black of the optical black stay the file's.
    Signals below black become 0 unless "metric", so noise statistics of the dark belong to the raw codes, not to a development.
    A MONO frame gives three equal planes and takes no white balance.
    Raises PhotositeError for an unknown choice and for a file that is missing, no raw file, or cut short.
    """
    _check_choice("develop.output", output, OUTPUTS)
    _check_choice("develop.demosaic", demosaic, DEMOSAICS)
    require(bits in (8, 16), "develop.bits", bits, "give 8 or 16")
    require(abs(exposure_ev) <= 16, "develop.exposure_ev", exposure_ev, "give -16 to 16 EV")
    check_white_balance(white_balance)
    linear = _develop_linear(raw, output, white_balance, codes, {"half_size": half_size, "demosaic": demosaic})
    if output == "metric":
        require(exposure_ev == 0, "develop.exposure_ev", exposure_ev, "metric output is not lightened; leave it out")
        return linear
    return linear if (output, exposure_ev, bits) in _AS_IT_IS else _tone_table(output == "srgb", exposure_ev, bits)[linear]


def write_image(path: str | os.PathLike[str], pixels: np.ndarray) -> None:
    """Write a picture, the format chosen by the suffix: PNG, JPEG, TIFF or EXR.

    pixels: (height, width[, channel]) uint8, uint16 or float. EXR holds float32 (integers divided by their full scale),
    JPEG 8 bits, PNG floats as 16 bits; floats are clipped to 0 ... 1 there.
    Raises PhotositeError for an unknown suffix, an array that is no picture, and a path that cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in PICTURE_SUFFIXES:
        raise PhotositeError(f"unknown kind of picture {suffix!r}; use one of {', '.join(PICTURE_SUFFIXES)}", file=path)
    pixels = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4) or 0 in pixels.shape or pixels.dtype.kind not in "uf":
        raise PhotositeError(
            f"{pixels.dtype} {pixels.shape} is no picture: give (height, width[, 1, 3 or 4]) numbers", file=path
        )
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise PhotositeError("the picture holds NaN or infinite values; remove them", file=path)
    attributes = {"compression": "jpeg:95", "jpeg:subsampling": "4:4:4"} if suffix in (".jpg", ".jpeg") else {}
    write_picture(path, _convert_pixels(pixels, suffix), (), **attributes)


def srgb_encoded(linear: np.ndarray) -> np.ndarray:
    """Encode linear values 0 ... 1 by the sRGB curve (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


_AS_IT_IS = [(output, 0.0, 16) for output in OUTPUTS if output not in ("srgb", "metric")]


def _check_choice(key: str, value: str, choices: tuple[str, ...] | dict[str, str]) -> None:
    """Raise PhotositeError for an unknown name, with the nearest known one."""
    if value not in choices:
        near = difflib.get_close_matches(str(value).lower(), choices, 1, 0.4)
        hint = f"did you mean {near[0]}? " if near else ""
        raise PhotositeError(f"unknown; {hint}Known: {', '.join(choices)}", key=key, value=f"{value!r}")


def _develop_linear(
    raw: Raw | str | os.PathLike[str], output: str, white_balance: WhiteBalance, codes: np.ndarray | None, options: dict
) -> np.ndarray:
    """Develop with LibRaw: (height, width, 3), uint16 linear; "metric": float32 signal, 0 at black and 1 at white."""
    import rawpy

    label = raw.name if isinstance(raw, Raw) else os.fspath(raw)
    with open_raw(dng_bytes(raw) if isinstance(raw, Raw) else label, label) as frame:
        pattern = None if frame.num_colors == 1 else color_index(frame, label, of_development=True)
        black_dn, white_dn = _black_levels(frame, pattern), frame.white_level
        scaling: dict[str, Any]
        if output == "metric":
            scaling = {"no_auto_scale": True}
        else:
            scaling = white_balance_options(frame, white_balance, label)
        is_linear = pattern is None and frame.num_colors > 1
        if len({*black_dn.values()}) == 1 and (output == "metric" or is_linear):
            # LibRaw takes the unused fourth level of a linear DNG for the common one, and leaves its white level as it is.
            scaling |= {"user_black": 0 if output == "metric" else black_dn[0], "user_cblack": [0, 0, 0, 0]}
        if codes is not None:
            _replace_codes(frame, codes, label)
        _check_pattern(frame, pattern, options, label)
        picture = frame.postprocess(
            output_color=rawpy.ColorSpace[OUTPUTS[output]],
            demosaic_algorithm=rawpy.DemosaicAlgorithm[options["demosaic"].upper()],
            half_size=options["half_size"],
            adjust_maximum_thr=0.0,  # otherwise LibRaw takes the brightest pixel of the picture as white
            no_auto_bright=True,
            gamma=(1, 1),
            output_bps=16,
            user_flip=0,
            **scaling,
        )
    picture = picture if picture.shape[2] > 1 else _grey_planes(picture[..., 0], output, options["half_size"])
    return picture if output != "metric" else _measured(picture, black_dn, white_dn, None if options["half_size"] else pattern)


def _black_levels(frame: "rawpy.RawPy", pattern: np.ndarray | None) -> dict[int, int]:
    """Return the black level [DN] of each colour index of LibRaw that a photosite or a sample of a pixel has.

    LibRaw tells four levels. Only patterns of 2 x 2 have a fourth index: of the second green, or of a fourth colour.
    """
    has_four = pattern is not None and pattern.shape == (2, 2)
    return dict(enumerate(frame.black_level_per_channel[: 4 if has_four else frame.num_colors]))


def _measured(picture: np.ndarray, black_dn: dict[int, int], white_dn: int, pattern: np.ndarray | None) -> np.ndarray:
    """Return (code - black) / (white - black), float32, of codes that LibRaw developed without scaling them.

    picture: black included where all levels are the same; LibRaw has subtracted those that differ.
    black_dn: level of each colour index. An index beyond the planes is the second green.
    pattern: colour index by place in the period. With it photosites have the range of their own level, and interpolated green
        that of the mean of both greens; None: so has all green.
    """
    if len({*black_dn.values()}) == 1:
        return (picture - np.float32(black_dn[0])) / np.float32(white_dn - black_dn[0])
    planes = picture.shape[2]
    plane_of = {index: index if index < planes else 1 for index in black_dn}
    means = [np.mean([black_dn[index] for index in black_dn if plane_of[index] == plane]) for plane in range(planes)]
    measured = picture / (white_dn - np.array(means)).astype(np.float32)
    if pattern is not None and pattern.shape == (2, 2):
        for (y, x), index in np.ndenumerate(pattern):
            own = slice(y, None, 2), slice(x, None, 2), plane_of[int(index)]
            measured[own] = picture[own] / np.float32(white_dn - black_dn[int(index)])
    return measured


def _check_pattern(frame: "rawpy.RawPy", pattern: np.ndarray | None, options: dict[str, Any], label: str) -> None:
    """Raise PhotositeError for a pattern that LibRaw does not develop, before it does so wrongly or fails without a reason."""
    sides = frame.raw_image_visible.shape
    if pattern is None or pattern.shape != (6, 6):
        return
    is_x_trans = max(frame.sizes.top_margin, frame.sizes.left_margin) > 6 or (pattern == 1).sum() == 20
    rule = "LibRaw does not halve this pattern, whose cells of 2 x 2 see one colour; leave it out"
    require(is_x_trans or not options["half_size"], "develop.half_size", True, rule, file=label)
    if options["half_size"] or options["demosaic"] in _ANY_PATTERN:
        return
    rule = f"LibRaw takes this pattern for X-Trans; give {' or '.join(_ANY_PATTERN)}"
    require(is_x_trans, "develop.demosaic", options["demosaic"], rule, file=label)
    refused = min(sides) < _TILE_PX
    rule = f"LibRaw develops X-Trans frames of less than {_TILE_PX} px a side by {' or '.join(_ANY_PATTERN)} alone; give one"
    require(not refused, "develop.demosaic", options["demosaic"], rule, file=label)


def _replace_codes(frame: "rawpy.RawPy", codes: np.ndarray, label: str) -> None:
    """Replace the codes of the active area of an opened file."""
    mosaic, sizes = frame.raw_image_visible, frame.sizes
    if codes.shape == frame.raw_image.shape:
        rows, columns = mosaic.shape[:2]
        codes = codes[sizes.top_margin : sizes.top_margin + rows, sizes.left_margin : sizes.left_margin + columns]
    if codes.shape != mosaic.shape or codes.dtype != np.uint16:
        raise PhotositeError(
            f"codes are {codes.dtype} {codes.shape}, the mosaic uint16 {mosaic.shape}: they must agree", file=label
        )
    mosaic[:] = codes


def _grey_planes(plane: np.ndarray, output: str, half_size: bool) -> np.ndarray:
    """Return three equal planes of a MONO frame; for half size, 2x2 means are computed here, since LibRaw does not."""
    if output == "xyz":
        raise PhotositeError(
            "a MONO sensor measures no colour; use srgb, linear_srgb or camera", key="develop.output", value="'xyz'"
        )
    if half_size:
        height, width = plane.shape
        even = np.pad(plane, ((0, height % 2), (0, width % 2)), mode="edge")
        plane = np.rint(even.reshape(-(-height // 2), 2, -(-width // 2), 2).mean(axis=(1, 3))).astype(np.uint16)
    return np.repeat(plane[..., np.newaxis], 3, axis=2)


def _tone_table(encode: bool, exposure_ev: float, bits: int) -> np.ndarray:
    """Return the output code for each of the 65536 linear codes."""
    linear = np.minimum(np.arange(_WHITE + 1) / _WHITE * 2.0**exposure_ev, 1.0)
    scale = 2**bits - 1
    return np.rint(scale * (srgb_encoded(linear) if encode else linear)).astype(np.uint8 if bits == 8 else np.uint16)


def _convert_pixels(pixels: np.ndarray, suffix: str) -> np.ndarray:
    """Convert an array to a type that the format can store, with no loss but that of its bit depth."""
    if suffix == ".exr" or (pixels.dtype.kind == "f" and suffix in (".tif", ".tiff")):
        return (pixels / np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else pixels).astype(np.float32)
    wanted = np.uint8 if suffix in (".jpg", ".jpeg") else np.uint16 if pixels.dtype.kind == "f" else pixels.dtype
    if pixels.dtype == wanted:
        return pixels
    full_scale = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1.0
    return np.rint(np.clip(pixels / full_scale, 0.0, 1.0) * np.iinfo(wanted).max).astype(wanted)
