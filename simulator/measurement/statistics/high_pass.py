"""High pass of EMVA 1288 against uneven light: what changes slowly over the frame is no nonuniformity of photosites.

EMVA 1288 Release 4.0 Linear, 8.1 (correction for uneven illumination), and Release 3.1: the mean frame smoothed by a box of
7 x 7, one of 11 x 11 and a binomial filter of 3 x 3 photosites is subtracted from it. Here photosites are those of one colour
plane, and the MARGIN at which the filter reaches over the edge is cut off.
"""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from simulator.errors import require
from simulator.measurement.statistics.spatial_variance import LEAST_SIDE_PX, Stack

BOXES_PX = (7, 11)
BINOMIAL = (0.25, 0.5, 0.25)
MARGIN_PX = sum(side // 2 for side in (*BOXES_PX, len(BINOMIAL)))


def high_pass(stack: Stack) -> Stack:
    """Return the stack with the high pass of its mean frame, whose mean it keeps; MARGIN_PX smaller on each side.

    Raises PhotositeError for a plane that the filter does not fit in.
    """
    least = LEAST_SIDE_PX + 2 * MARGIN_PX
    rows, columns = stack.mean_dn.shape
    rule = f"the high pass needs {least} photosites of a colour or more; use larger frames, or leave it out"
    require(min(rows, columns) >= least, "plane", f"{rows} x {columns} photosites", rule)
    smooth = stack.mean_dn
    for side in BOXES_PX:
        smooth = ndimage.uniform_filter(smooth, side)
    for axis in (0, 1):
        smooth = ndimage.correlate1d(smooth, np.array(BINOMIAL), axis)
    inside = slice(MARGIN_PX, -MARGIN_PX)
    kept = stack.mean_dn - smooth + stack.mean_dn.mean()
    return replace(stack, mean_dn=kept[inside, inside], kept_shares=kept_shares())


def kept_shares() -> tuple[float, float]:
    """Return which shares of the variance the filter leaves: of a pattern of independent photosites, and of one of lines.

    For a smoothing filter h they are sum((delta - h)^2) = 1 - 2 h(0) + sum(h^2), over the frame and across the lines.
    """
    line = np.array(BINOMIAL)
    for side in BOXES_PX:
        line = np.convolve(line, np.full(side, 1.0 / side))
    middle, energy = float(line[MARGIN_PX]), float(line @ line)
    return 1.0 - 2.0 * middle**2 + energy**2, 1.0 - 2.0 * middle + energy
