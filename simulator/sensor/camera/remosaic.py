"""Remosaic: a pattern of groups of one colour becomes a Bayer pattern of the same size, on the codes."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from simulator.sensor.camera.cfa import Cfa


@dataclass(frozen=True)
class Remosaic:
    """Each photosite gets the code of the colour that the Bayer pattern of the groups has there.

    Photosites of that colour keep their code. Elsewhere it is the value there of the plane that fits the codes of this colour
    up to one group's side away, weighted by a Gaussian of half that side: kernel regression of order 1 (Takeda, Farsiu and
    Milanfar 2007, IEEE Transactions on Image Processing 16, 349-366). Even light and slopes are kept but for rounding, and
    noise falls where photosites are combined. Methods of makers, which follow edges, are not published.
    """


@cache
def remosaic_weights(pattern: Cfa) -> np.ndarray:
    """Return the weights of the photosites around each place of a pattern of groups: (period, period, taps, taps) float32.

    Taps run over offsets from -group to group, [row][column]. Weights of a place add up to 1.
    """
    group, target, (period, _) = pattern.group, pattern.of_groups(), pattern.period
    offsets = np.arange(-group, group + 1)
    down, right = np.meshgrid(offsets, offsets, indexing="ij")
    near = np.exp(-2.0 * (down**2 + right**2) / group**2)  # a Gaussian of standard deviation group / 2
    weights = np.zeros((period, period, len(offsets), len(offsets)))
    for row in range(period):
        for column in range(period):
            wanted = target.planes[row % 2][column % 2]
            if pattern.planes[row][column] == wanted:
                weights[row, column, group, group] = 1.0
                continue
            planes = np.array([[pattern.planes[(row + y) % period][(column + x) % period] for x in offsets] for y in offsets])
            same = planes == wanted
            terms = np.stack([np.ones(same.sum()), right[same], down[same]])
            moments = (terms * near[same]) @ terms.T
            weights[row, column, same] = (np.linalg.inv(moments)[0] @ terms) * near[same]
    found = weights.astype(np.float32)
    found.flags.writeable = False
    return found
