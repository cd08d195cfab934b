"""Colour tags of a DNG (DNG 1.4, "Mapping Camera Color Space to CIE XYZ Space").

Illuminant A is first and D65 second, as in camera makers' files: dcraw 9.28 uses the second matrix whatever its
illuminant, LibRaw and rawspeed that of D65, Adobe's reader both.
"""

import math

import numpy as np

from simulator.errors import PhotositeError
from simulator.raw.dng import tiff
from simulator.raw.dng.tags import LightSource, Tag
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa

_COLOR_MATRIX = Tag.COLOR_MATRIX_1, Tag.COLOR_MATRIX_2
_FORWARD_MATRIX = Tag.FORWARD_MATRIX_1, Tag.FORWARD_MATRIX_2
_ILLUMINANT = Tag.CALIBRATION_ILLUMINANT_1, Tag.CALIBRATION_ILLUMINANT_2


def color_tags(raw: Raw) -> dict[Tag, tiff.Field]:
    """Return the colour tags of IFD 0; none for MONO.

    Raises PhotositeError for colour data with which converters would divide by zero or guess.
    """
    if raw.cfa == "MONO":
        return {}
    _check_neutral(raw)
    known: list[tuple[LightSource, np.ndarray | None, np.ndarray | None]] = []
    if raw.color_matrix_a is not None:
        known.append((LightSource.STANDARD_LIGHT_A, raw.color_matrix_a, raw.forward_matrix_a))
    known.append((LightSource.D65, raw.color_matrix, raw.forward_matrix_d65))
    tags = {Tag.AS_SHOT_NEUTRAL: tiff.rational(*raw.as_shot_neutral)}
    for place, (light, matrix, forward) in enumerate(known):
        tags[_ILLUMINANT[place]] = tiff.short(light)
        tags[_COLOR_MATRIX[place]] = _matrix(raw, "color_matrix", matrix)
        if all(each is not None for *_, each in known):
            tags[_FORWARD_MATRIX[place]] = _matrix(raw, "forward_matrix", forward)
    return tags


def _matrix(raw: Raw, name: str, values: object) -> tiff.Field:
    """Encode a matrix row by row: 3 x 3, or 4 x 3 of a camera with four colours."""
    colors = len(raw.as_shot_neutral)
    matrix = np.asarray(values if values is not None else np.nan, dtype=np.float64)
    if matrix.shape != (colors, 3) or not np.abs(matrix).max() < 2000:  # numerators are 32 bits wide
        shown = f"{np.asarray(values).tolist()}"
        raise PhotositeError(f"a colour camera needs {colors} x 3 finite numbers", part=raw.name, key=name, value=shown)
    return tiff.signed_rational(*np.ravel(matrix))


def _check_neutral(raw: Raw) -> None:
    neutral = raw.as_shot_neutral
    count = len(Cfa.named(raw.cfa).letters)
    if len(neutral) != count or not all(math.isfinite(value) and value > 0 for value in neutral):
        raise PhotositeError(
            f"a colour camera sees white in {'three' if count == 3 else 'four'} values above 0",
            part=raw.name,
            key="as_shot_neutral",
            value=neutral,
        )
