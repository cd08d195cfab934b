"""White balance of a development: multipliers of red, green and blue from the user's choice."""

import difflib
import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from simulator.color.spectra import ILLUMINANTS, blackbody_temperature_k, check_illuminant, illuminant, tristimulus
from simulator.errors import PhotositeError, require
from simulator.raw.filter_pattern import color_index

if TYPE_CHECKING:
    import rawpy

WhiteBalance = Literal["camera", "daylight"] | str | tuple[float, float, float] | tuple[int, int, int, int]
# Linear sRGB to XYZ under D65 as LibRaw has it (ITU-R BT.709 primaries).
SRGB_TO_XYZ = np.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])
_KEY = "develop.white_balance"


def check_white_balance(choice: WhiteBalance) -> None:
    """Raise PhotositeError for a choice that is not a white balance; reads no file and no tables."""
    if isinstance(choice, str):
        if choice in ("camera", "daylight"):
            return
        if choice in ILLUMINANTS or blackbody_temperature_k(choice) is not None:
            return check_illuminant(choice, _KEY)
        words = ("camera", "daylight", *ILLUMINANTS)
        near = difflib.get_close_matches(choice, words, 1, 0.4)
        hint = f"did you mean {near[0]}? " if near else ""
        raise PhotositeError(
            f'unknown; {hint}Known: {", ".join(words)}, or a blackbody such as "3200 K"', key=_KEY, value=f"{choice!r}"
        )
    numbers = len(choice) == 3 and all(0 < value < math.inf for value in choice)
    box = (
        len(choice) == 4
        and all(math.isfinite(value) and value == int(value) for value in choice)
        and min(choice) >= 0
        and min(choice[2:]) >= 2
    )
    rule = "give camera, daylight, an illuminant, three multipliers above 0 for R, G, B, or a grey patch x, y, width, height"
    require(numbers or box, _KEY, choice, rule)


def white_balance_options(frame: "rawpy.RawPy", choice: WhiteBalance, label: str) -> dict[str, object]:
    """Parameters of `rawpy.postprocess` for a choice of white balance.

    frame: an opened file that was not developed yet: developing changes rawpy's black level and pattern.
    Raises PhotositeError when the choice cannot be computed from the file.
    """
    check_white_balance(choice)
    if choice in ("camera", "daylight"):
        return {"use_camera_wb": choice == "camera"}
    if frame.num_colors == 1:
        return {"use_camera_wb": False}
    rule = "the file has four colours, and LibRaw takes three multipliers; give camera or daylight"
    require(frame.num_colors == 3, _KEY, choice, rule, file=label)
    if isinstance(choice, str):
        red, green, blue = _multipliers_for_illuminant(frame, choice, label)
    else:
        red, green, blue = map(float, choice) if len(choice) == 3 else _multipliers_for_patch(frame, choice, label)
    return {"use_camera_wb": False, "user_wb": [red, green, blue, green]}


def _multipliers_for_illuminant(frame: "rawpy.RawPy", name: str, label: str) -> np.ndarray:
    """Multipliers that render a white surface in this light neutral: 1 / (colour matrix * XYZ of the light).

    DNG 1.4, chapter 6.
    """
    matrix = xyz_to_camera(frame)
    if matrix is None:
        raise PhotositeError(
            "the file holds no colour matrix; give a grey patch or multipliers", file=label, key=_KEY, value=name
        )
    neutral = matrix @ tristimulus(illuminant(name))
    if not (neutral > 0).all():
        raise PhotositeError(
            "the file's colour matrix cannot see this light; give a grey patch", file=label, key=_KEY, value=name
        )
    return neutral.max() / neutral


def xyz_to_camera(frame: "rawpy.RawPy") -> np.ndarray | None:
    """Return the colour matrix of a file under D65, (3, 3) like DNG's ColorMatrix; None where the file has none.

    LibRaw gives it as two factors: daylight multipliers, and white-balanced camera to linear sRGB.
    frame: an opened file that was not developed yet.
    """
    to_srgb = np.asarray(frame.color_matrix, dtype=np.float64)[:3, :3]
    daylight = np.asarray(frame.daylight_whitebalance, dtype=np.float64)[:3]
    if np.linalg.matrix_rank(to_srgb) < 3 or not (daylight > 0).all():
        return None
    return np.linalg.inv(SRGB_TO_XYZ @ to_srgb) / daylight[:, None]


def _multipliers_for_patch(frame: "rawpy.RawPy", box: tuple[int, int, int, int], label: str) -> np.ndarray:
    """Multipliers that render the mean of a patch neutral: 1 / mean signal above black in each colour."""
    x, y, width, height = map(int, box)
    rows, columns = frame.raw_image_visible.shape[:2]
    inside = x + width <= columns and y + height <= rows
    require(inside, _KEY, box, f"x, y, width, height reach past the {columns} x {rows} px of {label}")
    codes = frame.raw_image_visible[y : y + height, x : x + width]
    index = color_index(frame, label)
    if index is None:  # a linear DNG has all three colours in each pixel, and room for a fourth
        codes, colours = codes[..., :3], np.broadcast_to(np.arange(3), (height, width, 3))
    else:
        period = index.shape
        colours = index[np.ix_(np.arange(y, y + height) % period[0], np.arange(x, x + width) % period[1])]
    signal = codes - np.asarray(frame.black_level_per_channel, dtype=np.float64)[colours]
    require(int(codes.max()) < frame.white_level, _KEY, box, f"the patch of {label} is overexposed; choose a darker one")
    letters = np.array(list(frame.color_desc.decode("ascii")))[colours]
    missing = [letter for letter in "RGB" if letter not in letters]
    require(not missing, _KEY, box, f"the patch of {label} has no photosite of {', '.join(missing)}; choose a larger one")
    means = np.array([signal[letters == letter].mean() for letter in "RGB"])
    require(bool((means > 0).all()), _KEY, box, f"the patch of {label} is no brighter than black; choose a brighter one")
    return means.max() / means
