"""Points of a round aperture that lie as evenly as points can whose first 32, 64, 128 ... lie evenly, too.

The mean squared error of means over n points, of all half-planes, is the energy distance of the points to the disk: twice the
mean distance of a point from the disk's area, less the mean distance of two points (Stolarsky's principle). The first two
dimensions of Sobol' points on the disk begin as 32 points, which move until that is least; then the next 32 do beside them,
then 64, and so on.
"""

from functools import cache
from pathlib import Path

import numpy as np

from simulator.errors import reading

FIRST = 32  # points that move together first
MOST = 8192
_FILE = Path(__file__).with_suffix(".npy")  # (MOST, 2) uint16: x, y from -1 to 1
_STEPS_PER_RADIUS = 32767.5
_RINGS, _TURNS = 400, 400  # of the mean distance from the disk


def relaxed_points(count: int) -> np.ndarray:
    """Return the first points, (count, 2) float64: x, y in the unit disk. Raises ValueError for a count above MOST."""
    if count > MOST:
        raise ValueError(f"{count} points; there are {MOST}")
    return _all_points()[:count]


@cache
def _all_points() -> np.ndarray:
    with reading(_FILE, "install Photosite again"):
        steps = np.load(_FILE)
    points = np.asarray(steps / _STEPS_PER_RADIUS - 1.0)
    points.flags.writeable = False
    return points


def relax(start: np.ndarray, most_steps: int = 300) -> np.ndarray:
    """Move points (n, 2) in the unit disk, n of FIRST times a power of two, as the module says."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize

    places = np.linspace(0.0, 1.2, 241)
    radius = np.sqrt((np.arange(_RINGS) + 0.5) / _RINGS)[:, None]
    angle = np.pi * (np.arange(_TURNS) + 0.5) / _TURNS
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    to_disk = CubicSpline(places, [np.hypot(x - place, y).mean() for place in places])
    slope, moved = to_disk.derivative(), start[:0]

    def energy(free: np.ndarray, fixed: np.ndarray) -> tuple[float, np.ndarray]:
        """Energy distance without the disk's own part, and its gradient."""
        own = free.reshape(-1, 2)
        count, away = len(own) + len(fixed), np.hypot(*own.T) + 1e-12
        found = 2.0 / count * float(to_disk(away).sum())
        pull = 2.0 / count * (slope(away) / away)[:, None] * own
        for others, times in ((own, 1.0), (fixed, 2.0)):
            for first in range(0, len(own), 512):
                apart = own[first : first + 512, None] - others
                distance = np.hypot(apart[..., 0], apart[..., 1])
                found -= times / count**2 * float(distance.sum())
                pull[first : first + 512] -= 2.0 / count**2 * (apart / np.maximum(distance, 1e-12)[..., None]).sum(axis=1)
        return found, pull.ravel()

    while len(moved) < len(start):
        some = start[len(moved) : max(2 * len(moved), FIRST)]
        steps = max(min(most_steps, most_steps * 1024 // len(some)), 40)
        options = {"maxiter": steps, "maxcor": 20, "ftol": 1e-15, "gtol": 1e-12}
        best = minimize(energy, some.ravel(), (moved,), method="L-BFGS-B", jac=True, options=options)
        moved = np.concatenate([moved, best.x.reshape(-1, 2)])
    return moved
