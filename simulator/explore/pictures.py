"""Developed pictures of frames for the page, and histograms of their electrons."""

from dataclasses import dataclass

import numpy as np

from simulator.explore.figures import color_names
from simulator.raw.development import develop
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa

LARGEST_WIDTH_PX = 1400  # columns of a picture on the page, at most
BINS = 96  # of a histogram


@dataclass(frozen=True)
class Histogram:
    """Counts of photosites by the electrons that their codes tell, for each colour.

    edges_e: (BINS + 1,) electrons above black, per photosite. counts: colour -> (BINS,) photosites; the ends hold all beyond.
    """

    edges_e: np.ndarray
    counts: dict[str, np.ndarray]


def paint(raw: Raw) -> np.ndarray:
    """Return the developed frame, (height, width, 4) uint8, at most LARGEST_WIDTH_PX wide; larger ones as means of blocks."""
    height, width = raw.dn.shape
    is_large = width > LARGEST_WIDTH_PX
    picture = develop(raw, bits=8, demosaic="linear", half_size=is_large)
    block = -(-picture.shape[1] // LARGEST_WIDTH_PX)
    if block > 1:
        rows, columns = (side // block * block for side in picture.shape[:2])
        blocks = picture[:rows, :columns].reshape(rows // block, block, columns // block, block, 3)
        picture = np.rint(blocks.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)
    painted = np.full((*picture.shape[:2], 4), 255, np.uint8)
    painted[..., :3] = picture
    return painted


def histogram(raw: Raw, gain_dn_per_e: float, largest_e: float) -> Histogram:
    """Return the histogram of a frame from below black to `largest_e`.

    gain_dn_per_e: of the codes per electron of one photosite [DN/e-].
    """
    electrons = raw.dn.astype(np.float32)
    for place, offset_dn in enumerate(raw.black_offsets_dn):
        electrons[place // 2 :: 2, place % 2 :: 2] -= np.float32(raw.black_level_dn + offset_dn)
    electrons /= np.float32(gain_dn_per_e)
    edges = np.linspace(-0.04 * largest_e, 1.04 * largest_e, BINS + 1)
    planes, inside = color_planes(raw), np.clip(electrons, edges[0], edges[-1])
    found = {
        name: np.histogram(inside[planes == plane], edges)[0]
        for plane, name in enumerate(color_names(raw.cfa))
        if (planes == plane).any()
    }
    return Histogram(edges, found)


def color_planes(raw: Raw) -> np.ndarray:
    """Return the colour plane of each pixel of a frame, (height, width) int."""
    pattern = np.array(Cfa.named(raw.cfa).planes)
    rows, columns = (np.arange(side) % period for side, period in zip(raw.dn.shape, pattern.shape, strict=True))
    planes: np.ndarray = pattern[np.ix_(rows, columns)]
    return planes
