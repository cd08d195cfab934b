"""A small developed picture of a raw frame, in a time that hardly depends on its size."""

from dataclasses import replace

import numpy as np

from simulator.errors import require
from simulator.raw.development import develop
from simulator.raw.dng.writer import SMALLEST_SIDE_PX
from simulator.raw.raw_format import RawFormat
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa

PREVIEW_PX = 480  # of the longer side of a preview, at most


def preview(raw: Raw, most_px: int = PREVIEW_PX) -> np.ndarray:
    """Return the active area developed as sRGB, (height, width, 3) uint8, neither side longer than most_px.

    A larger frame is binned before it is developed: each code becomes the mean of the nearest codes of its colour. Then each
    2 x 2 cell gives one pixel, where the pattern has such cells.
    Raises PhotositeError for a frame that LibRaw does not develop to sRGB, and for one of which a strip would be left.
    """
    rows, columns = Cfa.named(raw.cfa).period
    halved = (rows, columns) == (2, 2) and max(raw.dn[raw.active].shape) > most_px
    return develop(_binned(raw, most_px * (2 if halved else 1)), bits=8, demosaic="linear", half_size=halved)


def _binned(raw: Raw, most_px: int) -> Raw:
    """Return the active area of a frame without its truth, with blocks of whole periods of the pattern as one period each."""
    period = Cfa.named(raw.cfa).period
    top, left, bottom, right = raw.edges
    codes = raw.dn[-(-top // period[0]) * period[0] : bottom, -(-left // period[1]) * period[1] : right]
    nothing = np.zeros((1, 1), np.float32)
    return replace(
        raw,
        dn=_means(codes, period, -(-max(codes.shape) // most_px)),
        mean_electrons=nothing,
        noise_free_dn=nothing,
        linearization=None,
        format=RawFormat(),
        active_area=None,
        warp_rectilinear=None,
        truth={},
        resolved={},
    )


def _means(codes: np.ndarray, period: tuple[int, int], side: int) -> np.ndarray:
    """Return the mean of side x side codes of each place of the pattern, uint16; an incomplete block at the end is left out.

    period: rows and columns of the pattern.
    """
    if side == 1:
        return np.ascontiguousarray(codes)
    rows, columns = period
    tall, wide = codes.shape[0] // (side * rows), codes.shape[1] // (side * columns)
    narrow = f"{codes.shape[1]} x {codes.shape[0]} photosites"
    require(
        SMALLEST_SIDE_PX <= min(tall * rows, wide * columns),
        "preview",
        narrow,
        "too narrow for a small picture; develop the frame",
    )
    whole = codes[: tall * side * rows, : wide * side * columns]
    found = np.empty((tall * rows, wide * columns), np.uint16)
    for row in range(rows):
        sums = whole[row::rows].reshape(tall, side, -1).sum(axis=1, dtype=np.uint32)  # `reduceat` takes 20 times as long
        for column in range(columns):
            blocks = sums[:, column::columns].reshape(tall, wide, side).sum(axis=2, dtype=np.float64)
            found[row::rows, column::columns] = np.rint(blocks / side**2)
    return found
