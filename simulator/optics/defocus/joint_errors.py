"""Predicts the error of points of the aperture that carry instants (`joint_motion`), from its measured laws."""

import math
from dataclasses import dataclass, replace

import numpy as np

from simulator.optics.defocus.accuracy import MOST, hidden_error
from simulator.optics.defocus.aperture_samples import sample_count
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, CLASS_UNIT_PX, LEAST_APART_PX, Defocus
from simulator.optics.defocus.edge_laws import LITS, edge_error, share_of_squares
from simulator.optics.defocus.lamp_laws import mixed_lamp_error, mixed_lamp_share
from simulator.optics.defocus.scene_contrast import SceneContrast
from simulator.optics.error_term import Limit, together

EDGE_STEP_PX = 0.5  # change of the blur radius between scene pixels from which they belong to two surfaces [photosites]
WORST: SceneContrast = SceneContrast()  # detail that varies between zero and the brightest light, without steps in depth
TURNING, LEAST_LEAN = 0.22, 0.65  # growth of the error with slope times shift, and from which on
ASIDE = 0.3  # error of one point that is read aside, 99.9 % of photosites, per way between slabs and second difference
# What points leave at borders of several samples per photosite: at most this in five shots of the audit, 32 to 4096 points.
BORDERS, OF_1024 = 0.85, 1.3
BESIDE = 0.25  # error at the border of a scene whose light is read between samples, per second difference and square of samples
SAME_SCALE = 1e-6  # difference of scales that are the same
FINEST = 1e-6  # tolerance at which samples per photosite are as many as they can be [standard deviations of the noise]
STAYS_PX = 0.5  # longest way of a lamp beside which the light is known: `SceneContrast.around_lamps` looks so far [photosites]
RADII = 33  # blur radii between a lamp's and the largest at which samples are counted
RAYS = "give tolerance: 0 for rays"
TIGHTER = "give a smaller tolerance, or tolerance: 0 for rays"
LESS_TURN = "focus or stop the lens down until all is sharp, turn the picture less, or tolerance: 0 for rays"
LESS_SHIFT = "move the camera less, give a smaller aperture, or tolerance: 0 for rays"
LAYERS = "give the scene as layers, which hold what lies behind edges"


@dataclass(frozen=True)
class JointTerm:
    """One cause of error of points that carry instants. share: of the brightest light. The others are those of `ErrorTerm`."""

    cause: str
    share: float
    fix: str
    limit: Limit = "method"
    falls: bool = False


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
    detail = sampled_detail(contrast, has_edges)
    path_px = float(motion.path_px(np.array(defocus.largest_px)))
    own = defocus.of_scene()
    smallest = np.array([min(least for least, _ in own.ranges_px)])
    samples = int(own.samples_per_axis(smallest, np.array([own.largest_px]))[0])
    sampled = detail * moving_points_error(points, defocus.largest_px, path_px, samples)
    found = [JointTerm(f"{points} points of aperture and time", sampled, TIGHTER, falls=points < 3 * MOST // 2)]
    if not has_edges:  # whose detail has all of this
        radius_px = np.array([defocus.largest_px])
        finest = float(defocus.samples_per_axis(radius_px, radius_px)[0])
        beside = BESIDE * max(contrast.curvature - contrast.texture, 0.0) / finest**2
        found.append(JointTerm("samples beside the border of the scene", beside, TIGHTER))
    found += _edge_terms(defocus, contrast)
    cell_px = motion.cells(BLOCK_COLUMNS, BLOCK_ROWS).error_px
    found.append(JointTerm("turns of the picture within cells", cell_px / (path_px + 2.0), LESS_TURN))
    if maps:
        lean = defocus.scale * max(map(_typical_slope, maps)) * (1.0 + motion.largest_aperture)
        jitter = contrast.texture * float(_slab_jitter(defocus, points).max())
        found.append(
            JointTerm(
                f"slabs {defocus.apart_px:.2g} photosites apart", jitter, TIGHTER, falls=defocus.apart_px > LEAST_APART_PX
            )
        )
        away = TURNING * max(lean - LEAST_LEAN, 0.0)
        found.append(JointTerm(f"surfaces that turn away, slope times shift {lean:.2g}", away, LESS_SHIFT))
    if accuracy.has_lamps:
        found.append(JointTerm("dots of lamps", _lamp_error(defocus, points), TIGHTER))
        found += _mixed_lamp_terms(defocus, contrast)
    if contrast.behind > 0.0:
        share = hidden_error(contrast.behind)
        found.append(JointTerm("background behind edges, which the scene does not show", share, LAYERS, "input"))
    return found


def _edge_terms(defocus: Defocus, contrast: SceneContrast) -> list[JointTerm]:
    """Predict what rays leave that read between samples at edges of a scene whose pixels are not the photosites.

    That of the smallest circle, at rest: an edge along which the image moves is as sharp as one that stands.
    """
    own, motion = defocus.of_scene(), defocus.motion
    assert motion is not None  # of points that carry instants
    smallest = np.array([min(least for least, _ in own.ranges_px)])
    if is_sampled_alike(own.scale):
        return []
    finest = int(own.samples_per_axis(smallest, np.array([own.largest_px]))[0])
    share = edge_error(float(smallest[0]), finest, own.scale, contrast.edges)
    if own.area.has_squares(finest) and own.area.open_side == 1.0:  # else points do not lie in their middles
        share *= share_of_squares(motion.lean)
    cause = f"edges between {finest} x {finest} samples per photosite"
    return [JointTerm(cause, share, TIGHTER, falls=finest < most_samples_per_axis(own, smallest))]


def _mixed_lamp_terms(defocus: Defocus, contrast: SceneContrast) -> list[JointTerm]:
    """Predict what samples that mix the pixels of a fine scene leave of a lamp: light of it in photosites beside it.

    Those are as dark as where the lamp lies at rest, if it moves by less than is looked at around it; else they may be black.
    """
    own, motion, accuracy = defocus.of_scene(), defocus.motion, defocus.accuracy
    if own.scale < 1.0 + SAME_SCALE or contrast.lamp_px > own.largest_px:
        return []
    assert motion is not None  # else there is no instant
    radii_px = np.linspace(contrast.lamp_px, own.largest_px, RADII)
    counts = own.samples_per_axis(radii_px, np.full(RADII, own.largest_px)).tolist()
    share = max(mixed_lamp_share(own.scale, *pair) for pair in zip(counts, radii_px.tolist(), strict=True))
    is_near = motion.reach_px(own.largest_px) <= STAYS_PX and not motion.rest_px.any()
    dark = contrast.around_lamps if is_near and contrast.lamp > 0.0 and contrast.lamp_px > accuracy.sharp_px else 0.0
    left = mixed_lamp_error(share, own.scale, own.area.open_side, accuracy, dark)
    return [JointTerm(f"lamps between {counts[0]} x {counts[0]} samples per photosite", left, RAYS)]


def sampled_detail(contrast: SceneContrast, has_edges: bool) -> float:
    """Contrast of what points sample, in units of the brightest light and seen by the noise at its place.

    has_edges: whether surfaces end before others. A photosite that gets the share s of an edge's light gets or lacks some of it
    by the root of s (1 - s), and sees that in the noise of this share.
    """
    if not has_edges:
        return 1.3 * math.sqrt(contrast.texture)
    edges = max(edge * 2.0 * math.sqrt(lit * (1.0 - lit)) for edge, lit in zip(contrast.edges, LITS, strict=True))
    return max(1.3 * math.sqrt(contrast.texture), 1.0, edges)


def is_sampled_alike(scale: float) -> bool:
    """Whether the scene's pixels are the samples that rays read between; scale: pixels per photosite."""
    return abs(scale - 1.0) < SAME_SCALE


def most_samples_per_axis(defocus: Defocus, radius_px: np.ndarray) -> int:
    """Return the samples per photosite and axis that the smallest tolerance takes for blur circles of this radius, (1,)."""
    return int(at_finest(defocus).samples_per_axis(radius_px, radius_px)[0])


def at_finest(defocus: Defocus) -> Defocus:
    """Return the same blur with the smallest tolerance."""
    return replace(defocus, accuracy=replace(defocus.accuracy, tolerance=FINEST))


def moving_points_error(points: int, radius_px: float, path_px: float, samples_per_axis: int = 1) -> float:
    """Error of points that sample a circle on its path, for detail between zero and the brightest light.

    While points lie within a photosite of each other the error falls as their number to the power of -0.72. It grows as the
    root of the area for each of them where they lie farther apart, up to that of places at random in fine detail. It bounds
    99.5 % of the photosites behind disks of random squares in float64; 1024 points leave more than the others.

    With several samples per photosite points are places in it, too. Borders cut the dimensions of aperture, time and photosite
    in two: of n even points in d dimensions those whose cells a border cuts, a share of n^(-1/d), are on either side by chance,
    so that their mean is wrong by n^(-1/2 - 1/2d) at best (Beck and Chen, Irregularities of Distribution, 1987). Light between
    samples is linear, and the five dimensions are found to leave at most what three do, BORDERS n^(-2/3).
    """
    area_px = math.pi * radius_px**2 + 2.0 * radius_px * path_px
    apart = math.sqrt(max(2.0 * area_px / points, 1.0))
    smooth = 0.47 * (OF_1024 if points == 1024 else 1.0) * points**-0.72
    borders = BORDERS * points ** (-2.0 / 3.0) if samples_per_axis > 1 else 0.0
    return min(max(smooth * apart, borders), points**-0.5)


def joint_error(defocus: Defocus, contrast: SceneContrast = WORST) -> float:
    """All `joint_terms` together, as a share of the brightest light."""
    return together(term.share for term in joint_terms(defocus, contrast))


def _radii(defocus: Defocus) -> np.ndarray:
    """Signed radii of all surfaces, at most 0.5 photosites apart near the focus, (radii,)."""
    least, greatest = math.asinh(defocus.least_px / 4.0), math.asinh(defocus.greatest_px / 4.0)
    return 4.0 * np.sinh(np.linspace(least, greatest, max(math.ceil((greatest - least) / 0.125), 1) + 1))


def _slab_jitter(defocus: Defocus, points: int) -> np.ndarray:
    """Error of reading surfaces of `_radii` at the middles of slabs, for detail with a second difference of 1, (radii,).

    In focus and at rest it is the mean of a kink over the way between slabs. Blur and motion leave of it what lies at the
    border of the area that a photosite gathers. Each of the points reads aside by its own share of a slab: where these shares
    mix badly with places in the aperture their errors add as those of numbers at random.
    """
    motion, radii = defocus.motion, _radii(defocus)
    assert motion is not None  # else slabs are read where rays meet them
    border_px = 2.0 * np.pi * np.abs(radii) + 4.0
    left = np.minimum(np.sqrt(border_px) / _swept_area(radii, motion.least_path_px(radii)), 1.0)
    return _slab_ways(defocus, radii) * np.maximum(left / 32.0, ASIDE / math.sqrt(points))


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
