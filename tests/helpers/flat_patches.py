"""Frames of flat patches whose colour every converter must find: what they show, and the codes that say so."""

import dataclasses
from typing import Any

import numpy as np

from helpers.raw_frame import COLOR_MATRIX, random_frame
from simulator.raw.raw_image import Raw

# IEC 61966-2-1: linear sRGB to XYZ, white D65.
SRGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
# Linear sRGB, two rows of four: greys, then colours that no converter clips.
PATCHES = np.array(
    [(0.8, 0.8, 0.8), (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), (0.05, 0.05, 0.05)]
    + [(0.5, 0.2, 0.15), (0.2, 0.5, 0.2), (0.15, 0.2, 0.5), (0.5, 0.45, 0.1)]
)


def patch_frame(
    height: int, width: int, cfa: str, bit_depth: int, light: float = 1.0, **changes: Any
) -> tuple[Raw, np.ndarray]:
    """A frame without noise, and the linear sRGB (8, 3) that its codes stand for, their rounding included.

    The light is D65, for which ColorMatrix1 holds, so that no two ways of adapting to a white can differ.
    A MONO frame has the green values. Optical black has the black level of its place.
    light: factor on the patches. changes: to the other fields of the frame; black_offsets_dn whole and not below 0.
    """
    to_camera = COLOR_MATRIX @ SRGB_TO_XYZ
    white = to_camera.sum(axis=1)
    signal = PATCHES[:, 1:2] if cfa == "MONO" else PATCHES @ to_camera.T / white.max()
    raw = random_frame(height, width, cfa, bit_depth, **changes)
    black, span = raw.black_level_dn, raw.white_level_dn - raw.black_level_dn
    codes = np.rint(black + span * light * signal).astype(np.uint16)
    block = np.array([max("RGB".find(letter), 0) for letter in (cfa if cfa != "MONO" else 4 * "W")]).reshape(2, 2)
    channel = np.tile(block, (-(-height // 2), -(-width // 2)))[:height, :width]
    stored = (codes - float(black)) / span
    shown = np.repeat(stored, 3, axis=1) if cfa == "MONO" else white.max() * stored @ np.linalg.inv(to_camera).T
    neutral = (1.0,) if cfa == "MONO" else tuple(white / white.max())
    offsets = np.reshape(raw.black_offsets_dn, (2, 2)).astype(np.uint16)
    dn = black + offsets[np.ix_(np.arange(height) % 2, np.arange(width) % 2)]
    rows, columns = dn[raw.active].shape
    dn[raw.active] += codes[patch_index(rows, columns), channel[:rows, :columns]] - np.uint16(black)
    return dataclasses.replace(raw, dn=dn, as_shot_neutral=neutral), shown


def patch_index(height: int, width: int) -> np.ndarray:
    """Number of the patch at each pixel, (height, width)."""
    return np.add.outer(4 * (2 * np.arange(height) // height), 4 * np.arange(width) // width)


def patch_means(picture: np.ndarray) -> np.ndarray:
    """Means (8, channels) of the middle of each patch in a developed picture, whatever border the converter cut off."""
    height, width = picture.shape[:2]
    rows, columns = (np.arange(count) * side / count for count, side in ((2, height), (4, width)))
    cut = [slice(int(row + 0.15 * height), int(row + 0.35 * height)) for row in rows]
    across = [slice(int(column + 0.075 * width), int(column + 0.175 * width)) for column in columns]
    return np.array([picture[down, over].mean(axis=(0, 1), dtype=np.float64) for down in cut for over in across])
