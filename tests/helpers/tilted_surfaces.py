"""Surfaces whose distance varies, behind a lens and before a camera that moves: their picture by dense sums in float64.

A ray through the point u of the aperture [pupil radii] at the instant t sees the place
    p = x + R(p) (u + shift(t)) - pivot shift(t)
of a surface with the signed blur radius R(p). It is found by regula falsi in R, without slabs of radius.
"""

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.stats import qmc

from helpers.lens_error import ErrorStatistics, statistics, z_scores
from helpers.lens_frame import LENS
from helpers.lens_truths import Case
from helpers.moving_layers import image_distance_px, moving_picture, moving_plan
from simulator.exposure.camera_motion import SteadyMotion
from simulator.pipeline.planner import Plan

MARGIN = 56
ROWS, COLUMNS = 160, 192
AT_INFINITY, AT_A_METRE = (float(LENS.blur_radius_um(depth_m)) / 5.0 for depth_m in (np.inf, 1.0))
STEPS = 8  # of regula falsi (Illinois); a plane is met by the first


def plane(middle_px: float, slope: np.ndarray) -> np.ndarray:
    """Blur radii of a tilted plane, (ROWS, COLUMNS) [photosites]. slope: (2,) to the right and down."""
    y, x = np.mgrid[:ROWS, :COLUMNS] + 0.5
    return middle_px + slope[0] * (x - 0.5 * COLUMNS) + slope[1] * (y - 0.5 * ROWS)


def texture(rng: np.random.Generator, kind: int) -> np.ndarray:
    """Light up to 0.95 (ROWS, COLUMNS): smooth (0), random pixels (1), squares of five (2), and smooth with lamps (3)."""
    if kind == 2:
        return 0.05 + 0.9 * np.kron(rng.random((ROWS // 5 + 1, COLUMNS // 5 + 1)), np.ones((5, 5)))[:ROWS, :COLUMNS]
    light = rng.random((ROWS, COLUMNS))
    light = light if kind == 1 else gaussian_filter(light, 1.0)
    light = 0.05 + 0.9 * (light - light.min()) / np.ptp(light)
    if kind == 3:
        light *= 0.3
        light[rng.integers(0, ROWS, 12), rng.integers(0, COLUMNS, 12)] += rng.choice([2.0, 5.0, 30.0, 100.0], 12)
    return light


def surface_case(light: np.ndarray, radius_px: np.ndarray) -> Case:
    """One picture with these blur radii."""
    truth = np.zeros((ROWS - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    return Case("surface", light[None], np.ones((1, ROWS, COLUMNS)), radius_px[None], truth, MARGIN, 1, False)


def shifted_plan(case: Case, way: np.ndarray, pivot_px: float, start_s: float = 0.0) -> Plan:
    """Plan of a case before a camera that shifts the aperture by `way` in a second, from `start_s` s for 1 s.

    The picture is moved along, so that places of the blur radius `pivot_px` rest.
    """
    per_radius = (AT_INFINITY - AT_A_METRE) / image_distance_px()
    camera = SteadyMotion(right_m_per_s=-way[0] * per_radius, up_m_per_s=way[1] * per_radius)
    along = (pivot_px - AT_INFINITY) * way
    return moving_plan(case, camera, ((float(along[0]), float(along[1])),), start_s=start_s)


def dense_surface(
    case: Case, way: np.ndarray, pivot_px: float, start_s: float = 0.0, points: int = 1 << 12, steps: int = STEPS
) -> np.ndarray:
    """Picture of the case, of the shape of its truth, at `points` pairs of a point of the aperture and an instant."""
    light, radius = case.colour[0], case.radius_px[0]
    y, x = np.mgrid[: case.truth.shape[0], : case.truth.shape[1]] + case.margin
    least, greatest = float(radius.min()) - 1e-3, float(radius.max()) + 1e-3
    total = np.zeros(case.truth.shape)
    for first, second, share in qmc.Sobol(3, seed=9).random(points):
        shift = (start_s + share) * way
        across, down = np.sqrt(first) * np.array([np.cos(2 * np.pi * second), np.sin(2 * np.pi * second)]) + shift

        def seen(
            plane: np.ndarray, at: np.ndarray, right: float = across, below: float = down, by: np.ndarray = shift
        ) -> np.ndarray:
            return map_coordinates(plane, [y + at * below - pivot_px * by[1], x + at * right - pivot_px * by[0]], order=1)

        low, high = np.full(total.shape, least), np.full(total.shape, greatest)
        over, under = seen(radius, low) - low, seen(radius, high) - high
        for _ in range(steps):
            middle = (low * under - high * over) / np.where(under == over, 1.0, under - over)
            middle = np.where(under == over, high, middle)
            off = seen(radius, middle) - middle
            crosses = off * under < 0
            low, over = np.where(crosses, high, low), np.where(crosses, under, 0.5 * over)
            high, under = middle, off
        total += seen(light, high)
    return total / points


def surface_error(
    case: Case, way: np.ndarray, pivot_px: float, start_s: float = 0.0, points: int = 1 << 12, steps: int = STEPS
) -> ErrorStatistics:
    """Error of the pipeline's picture of a case in units of the noise at 2000 e-."""
    found = moving_picture(case, shifted_plan(case, way, pivot_px, start_s))
    return statistics(z_scores(found, dense_surface(case, way, pivot_px, start_s, points, steps), 2000.0))
