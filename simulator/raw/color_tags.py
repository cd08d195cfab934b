"""Colour tags of a DNG (DNG 1.4, "Mapping Camera Color Space to CIE XYZ Space").

Illuminant A stands first and D65 second, as camera makers' files have it: dcraw 9.28 takes the second matrix whatever
its illuminant, LibRaw and rawspeed the one of D65, Adobe's reader both.
"""

import math

import numpy as np

from simulator.errors import PhotositeError
from simulator.frame import Raw
from simulator.raw import tiff

_A, _D65 = 17, 21  # Exif LightSource
_COLOR_MATRIX, _FORWARD_MATRIX, _ILLUMINANT = (50721, 50722), (50964, 50965), (50778, 50779)
_AS_SHOT_NEUTRAL = 50728


def color_tags(raw: Raw) -> dict[int, tiff.Field]:
    """Tags of IFD 0 by number; none for MONO.

    Raises PhotositeError for colour that would make converters divide by zero or guess.
    """
    if raw.cfa == "MONO":
        return {}
    _check_neutral(raw)
    known = [(_A, raw.color_matrix_a, raw.forward_matrix_a)] if raw.color_matrix_a is not None else []
    known.append((_D65, raw.color_matrix, raw.forward_matrix_d65))
    tags = {_AS_SHOT_NEUTRAL: tiff.rational(*raw.as_shot_neutral)}
    for place, (light, matrix, forward) in enumerate(known):
        tags[_ILLUMINANT[place]] = tiff.short(light)
        tags[_COLOR_MATRIX[place]] = _matrix(raw, "color_matrix", matrix)
        if all(each is not None for *_, each in known):
            tags[_FORWARD_MATRIX[place]] = _matrix(raw, "forward_matrix", forward)
    return tags


def _matrix(raw: Raw, name: str, values: object) -> tiff.Field:
    """Row by row."""
    matrix = np.asarray(values if values is not None else np.nan, dtype=np.float64)
    if matrix.shape != (3, 3) or not np.abs(matrix).max() < 2000:  # numerators are 32 bits wide
        shown = f"{np.asarray(values).tolist()}"
        raise PhotositeError("a colour camera needs 3 x 3 finite numbers", part=raw.name, key=name, value=shown)
    return tiff.signed_rational(*np.ravel(matrix))


def _check_neutral(raw: Raw) -> None:
    neutral = raw.as_shot_neutral
    if len(neutral) != 3 or not all(math.isfinite(value) and value > 0 for value in neutral):
        raise PhotositeError(
            "a colour camera sees white in three values above 0", part=raw.name, key="as_shot_neutral", value=neutral
        )
