"""Predicts the error of the planned lens blur from its measured laws, before the frame is computed.

The prediction is the sum of named terms, one for each cause. It shall not lie below what 99 % of the photosites have.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import (
    LAMP_PEAK,
    WAVE_CURVATURE,
    WIDE_PX,
    Accuracy,
    copy_error,
    crossing_error,
    grid_error,
    hidden_error,
    occlusion_error,
    points_error,
    slab_error,
    slope_error,
    spot_error,
    wide_error,
)
from simulator.optics.defocus.aperture_samples import sample_count
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, CLASS_UNIT_PX, Defocus
from simulator.optics.defocus.scene_contrast import SceneContrast

EDGE_STEP_PX = 0.5  # change of the blur radius between scene pixels from which they belong to two surfaces [photosites]
WORST = SceneContrast()  # detail that varies between zero and the brightest light, without steps in depth
FINER_SCENE = "give a scene of more pixels, or tolerance: 0 for rays"
TIGHTER = "give a smaller tolerance, or tolerance: 0 for rays"
SHORTER = "give a shorter exposure.time, or tolerance: 0 for rays"
LESS_SHIFT = "move the camera less, give a smaller aperture, or tolerance: 0 for rays"
TURNING, LEAST_LEAN = 0.22, 0.65  # growth of the error with slope times shift, and from which on
LAYERS = "give the scene as layers, which hold what lies behind edges"


@dataclass(frozen=True)
class ErrorTerm:
    """One cause of error. method: what causes it. sigma: size [standard deviations at the brightest light]. fix: what helps."""

    method: str
    sigma: float
    fix: str


def error_terms(defocus: Defocus, contrast: SceneContrast = WORST) -> list[ErrorTerm]:
    """Predict the error of each method that the scene may need. Without tolerance, rays have none of them.

    defocus: blur of the scene's layers, with a background that is assumed. contrast: of the scene (`scene_contrast`).
    """
    accuracy = defocus.accuracy
    if accuracy.tolerance == 0.0:
        return []
    if defocus.motion is not None:
        return [ErrorTerm(term.method, accuracy.in_sigma(term.share), term.fix) for term in joint_terms(defocus, contrast)]
    own = defocus.of_scene()
    radii, ranges = own.radii_px, own.ranges_px
    ignored = [min(most, own.copied_px) for least, most in ranges if least <= own.copied_px]
    blurred = [max(least, own.copied_px) for least, most in ranges if most > own.copied_px]
    detail = min(contrast.curvature / WAVE_CURVATURE, 1.0)
    terms: list[ErrorTerm] = []

    def add(method: str, share: float, fix: str) -> None:
        terms.append(ErrorTerm(method, accuracy.in_sigma(share), fix))

    if max(ignored, default=0.0) > 0.0:
        left_out = max(detail * copy_error(max(ignored)), crossing_error(max(ignored), accuracy.detail))
        add(f"no blur up to a radius of {max(ignored):.2g}", left_out, TIGHTER)
    if not blurred:
        return terms
    smallest, is_sloped = np.array([min(blurred)]), any(np.ndim(radius) > 0 for radius in radii)
    finest = int(own.samples_per_axis(smallest, smallest)[0])
    if len(defocus.radii_px) == 1 and own.gathers_scene(smallest, smallest).any():
        add("means over the scene's pixels", accuracy.gathering_error(), TIGHTER)
    else:
        smooth = contrast.curvature / (12.0 * finest**2)  # a parabola in both directions, against its values at the points
        grid = min(smooth, grid_error(min(blurred), finest, defocus.scale))
        if accuracy.detail:  # even squares, whose weights are exact where nothing hides any of them
            squares = float(accuracy.sampling_error(smallest, finest, defocus.scale)[0])
            grid = squares if len(defocus.radii_px) == 1 and not is_sloped else max(squares, grid)
        add(f"means on {finest} x {finest} points per photosite", grid, FINER_SCENE)
    if is_sloped:
        add(f"slopes in steps of {accuracy.slope_step:.2g}", slope_error(accuracy.slope_step), TIGHTER)
    if contrast.lamp > 0.0:
        add("edges of the spots of lamps", spot_error(contrast.lamp), FINER_SCENE)
    wide_or_not = np.array([own.largest_px, min(own.largest_px, 0.999 * WIDE_PX)])
    points = int(sample_count(wide_or_not, defocus).min())
    if contrast.has_steps:
        add(f"{points} points of the aperture beside steps in depth", occlusion_error(points), TIGHTER)
        add(f"{defocus.classes_per_unit:.2g} slabs of radius", slab_error(defocus.classes_per_unit), TIGHTER)
        if own.largest_px >= defocus.wide_px:
            add("wider photosites", wide_error(defocus.wide_px), TIGHTER)
    elif len(radii) > 1:
        add(f"{points} points of the aperture", points_error(points, finest), TIGHTER)
    if contrast.behind > 0.0:
        is_extended = len(defocus.radii_px) > len(radii)
        add("background behind edges, which the scene does not show", hidden_error(contrast.behind, is_extended), LAYERS)
    return terms


def predicted_error(defocus: Defocus, contrast: SceneContrast = WORST) -> float:
    """Sum of the terms [standard deviations at the brightest light]."""
    return sum(term.sigma for term in error_terms(defocus, contrast))


@dataclass(frozen=True)
class JointTerm:
    """One cause of error of points that carry instants. method, fix: as in `ErrorTerm`. share: of the brightest light."""

    method: str
    share: float
    fix: str


def joint_terms(defocus: Defocus, contrast: SceneContrast = WORST) -> list[JointTerm]:
    """Predict the errors of aperture samples that carry instants.

    They bound 99.9 % of the photosites of bars before a wall that move apart, and of tilted and wavy surfaces of smooth, random
    and hard-edged detail and with lamps: slopes up to 0.2, shifts up to 14 pupil radii, radii up to 24, paths up to 90 px.
    contrast: of the scene.
    """
    motion, accuracy = defocus.motion, defocus.accuracy
    assert motion is not None  # else there is no instant
    points = int(sample_count(np.array([defocus.largest_px]), defocus)[0])
    maps = [radius for radius in defocus.of_scene().radii_px if isinstance(radius, np.ndarray)]
    has_edges = contrast.has_steps or len(defocus.of_scene().radii_px) > 1
    detail = max(1.3 * math.sqrt(contrast.texture), 1.0 if has_edges else 0.0)
    found = [JointTerm(f"{points} points of aperture and time", 0.4 * points**-0.72 * detail, TIGHTER)]
    cell_px = motion.cell_error_px(BLOCK_COLUMNS, BLOCK_ROWS)
    path_px = float(motion.path_px(np.array(defocus.largest_px)))
    found.append(JointTerm("turns of the picture within cells", cell_px / (path_px + 2.0), SHORTER))
    if maps:
        lean = defocus.scale * max(map(_typical_slope, maps)) * (1.0 + motion.largest_aperture)
        jitter = contrast.texture * float(_slab_jitter(defocus).max())
        found.append(JointTerm(f"slabs {defocus.apart_px:.2g} photosites apart", jitter, TIGHTER))
        away = TURNING * max(lean - LEAST_LEAN, 0.0)
        found.append(JointTerm(f"surfaces that turn away, slope times shift {lean:.2g}", away, LESS_SHIFT))
    if accuracy.peak >= LAMP_PEAK:
        found.append(JointTerm("dots of lamps", _lamp_error(defocus, points), TIGHTER))
    if contrast.behind > 0.0:
        is_extended = len(defocus.radii_px) > len(defocus.of_scene().radii_px)
        share = hidden_error(contrast.behind, is_extended)
        found.append(JointTerm("background behind edges, which the scene does not show", share, LAYERS))
    return found


def joint_error(defocus: Defocus, contrast: SceneContrast = WORST) -> float:
    """Sum of `joint_terms`, as a share of the brightest light."""
    return sum(term.share for term in joint_terms(defocus, contrast))


def _radii(defocus: Defocus) -> np.ndarray:
    """Signed radii of all surfaces, at most 0.5 photosites apart near the focus, (radii,)."""
    least, greatest = math.asinh(defocus.least_px / 4.0), math.asinh(defocus.greatest_px / 4.0)
    return 4.0 * np.sinh(np.linspace(least, greatest, max(math.ceil((greatest - least) / 0.125), 1) + 1))


def _slab_jitter(defocus: Defocus) -> np.ndarray:
    """Error of reading surfaces of `_radii` at the middles of slabs, for detail with a second difference of 1, (radii,).

    In focus and at rest it is the mean of a kink over the way between slabs. Blur and motion leave of it what lies at the
    border of the area that a photosite gathers.
    """
    motion, radii = defocus.motion, _radii(defocus)
    assert motion is not None  # else slabs are read where rays meet them
    border_px = 2.0 * np.pi * np.abs(radii) + 4.0
    left = np.minimum(np.sqrt(border_px) / _swept_area(radii, motion.least_path_px(radii)), 1.0)
    return _slab_ways(defocus, radii) / 32.0 * left


def _slab_ways(defocus: Defocus, radii_px: np.ndarray) -> np.ndarray:
    """Way of a ray from slab to slab at signed radii [photosites]."""
    return defocus.apart_px * np.sqrt(1.0 + (radii_px / CLASS_UNIT_PX) ** 2)


def _swept_area(radii_px: np.ndarray, paths_px: np.ndarray) -> np.ndarray:
    """Area over which blur circles of signed radii and paths spread a photosite [photosites]."""
    size = np.abs(radii_px)
    return np.pi * size**2 + 2.0 * np.maximum(size, 0.5) * paths_px + 1.0


def _lamp_error(defocus: Defocus, points: int) -> float:
    """Error of a lamp of one pixel, whose light comes as a dot for each point, and is read aside of its place by slabs.

    It counts in the noise of the lamp's own light, on the area over which that is spread.
    """
    motion, radii, peak = defocus.motion, _radii(defocus), defocus.accuracy.peak
    assert motion is not None  # else lamps have spots of their own
    area = _swept_area(radii, motion.least_path_px(radii))
    dots = 0.5 * peak / np.sqrt(points * np.minimum(area, points)) / np.sqrt(0.1 + 0.25 * peak / area)  # at the spot's border
    ways_px = _slab_ways(defocus, radii) if defocus.maps else np.zeros(len(radii))
    aside = peak / area * np.minimum(ways_px / 16.0, 0.25) / np.sqrt(0.1 + peak / area)
    return float(dots.max() + aside.max())


def _typical_slope(radius_px: np.ndarray) -> float:
    """Change of the radius from a scene pixel to the next that 99 % of them stay below, steps in depth left out."""
    found = [np.abs(np.diff(radius_px, axis=axis)).ravel() for axis in (0, 1)]
    smooth = np.concatenate([steps[steps < EDGE_STEP_PX] for steps in found])
    return float(np.quantile(smooth, 0.99)) if smooth.size else 0.0


def describe_ignored(accuracy: Accuracy, radius_px: float) -> str:
    """Describe why no blur is computed where the largest blur circle has this radius [photosites], with the predicted error."""
    told = f"no blur circle has a radius above {accuracy.sharp_px:.2g} photosites"
    if radius_px == 0.0:
        return told
    error = accuracy.in_sigma(accuracy.ignoring_error(radius_px))
    return f"{told}; without that of radius {radius_px:.2g} the light is off by up to {error:.2g} sigma"


def describe_errors(defocus: Defocus, contrast: SceneContrast = WORST) -> str:
    """Describe the light that the errors refer to, and the predicted errors, for the printed plan."""
    accuracy = defocus.accuracy
    light = f"brightest light {accuracy.electrons:.3g} e-, noise {accuracy.sigma * accuracy.electrons:.3g} e-"
    if accuracy.tolerance == 0.0:
        return f"{light}; every photosite by rays, until their standard error is {accuracy.ray_error:g} sigma of its own light"
    errors = ", ".join(f"{term.method} {term.sigma:.2g}" for term in error_terms(defocus, contrast))
    return f"{light}; predicted errors up to, in sigma: {errors}"


def error_warning(defocus: Defocus, contrast: SceneContrast) -> str | None:
    """Warn of a prediction above the tolerance: key, value, largest cause and fix; None: it is not above."""
    terms, tolerance = error_terms(defocus, contrast), defocus.accuracy.tolerance
    total = sum(term.sigma for term in terms)
    if total <= tolerance:
        return None
    worst = max(terms, key=lambda term: term.sigma)
    return (
        f"tolerance = {tolerance:g}: the lens blur may be wrong by {total:.2g} sigma at the brightest light, "
        f"{worst.sigma:.2g} of it by {worst.method}; {worst.fix}"
    )
