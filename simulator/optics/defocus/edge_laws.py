"""Error of samples at an edge of the scene, in the noise of the light that its penumbra truly brings there.

A sample does not tell where in it light is: what rays read between four samples lies up to two of them beside its place. At an
edge in the dark that is light where there is little noise, so that the error is largest where the penumbra ends. Both are
profiles across a straight edge. The light that is true is its step behind the blur circle and the photosite, a mean over a
width of 1. Samples are such means over a sample's width, of which the places of the aperture's points in the photosite make
the same mean again. What is found has that of a bilinear read as well, which is two means over a sample's width.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from simulator.optics.defocus.around_contrast import AROUND_PX
from simulator.optics.defocus.defocus import FINE_NODES_PER_PX, FINE_NODES_PX, STEEPEST_PX, Defocus

LITS = (0.0, *(2.0**-power for power in range(15, 1, -1)))  # shares of a step that photosites see, for which it is counted
SIDES = 2.5  # edges beside a photosite, with as many times the error and the light: random squares have up to 2.45 times both
# Radii that are less and their errors, of `nodes_error`: found are 0.0191, 0.0049 and 0.0016; beyond, over the radius: 0.019.
NODES_NEAR = (0.5 + 1.0 / FINE_NODES_PER_PX, 0.02), (0.5 + 2.0 / FINE_NODES_PER_PX, 0.005), (FINE_NODES_PX, 0.002)
NODES_FAR = 0.02
# The same of even squares that samples divide, of FINE_NODES_PER_PX: found are 0.00173, 0.00069, 0.00045 and 0.00013.
EVEN_NEAR, EVEN_FAR = ((0.375, 0.0018), (0.75, 0.0008), (2.0, 0.0005)), 0.00015
FINE = 128  # parts of a photosite in which profiles are summed
WIDEST_PX = 12.0  # larger blur circles count as these
TURNED = 0.15  # part of an edge's error that even squares leave where a picture turns by 30 degrees and more


def edge_error(radius_px: float, samples_per_axis: int, scale: float, edges: Sequence[float]) -> float:
    """Error of rays that read between so many samples per photosite and axis, as a share of the brightest light.

    radius_px: of the blur circle. scale: scene pixels per photosite. edges: contrast of the scene's edges as photosites see it
    that get LITS of their step (`SceneContrast.edges`).
    """
    size_px, ramp_px = round(min(abs(radius_px), WIDEST_PX), 2), round(max(1.0 / scale - 1.0, 0.0), 2)
    return SIDES * float(np.max(_largest(size_px, samples_per_axis, ramp_px) * np.asarray(edges)))


def share_of_squares(lean: float) -> float:
    """Return the part of `edge_error` that rays leave that read samples which are even squares, in the middles of those.

    They are read without error however far aside, since the mean of four of them by area is bilinear. In a photosite that
    leans, as where a picture turns, upright parts stand for leaning ones: up to 0.08 sin(2 angle) is left beside long edges and
    in random squares, at 2 and 4 samples per axis, in float64.
    lean: largest change of a way per photosite: the sine of the angle.
    """
    return TURNED * min(2.0 * lean, 1.0)


def inside_px(corner_radius: float) -> float:
    """Blur radius up to which all tabulated images of an aperture lie inside a photosite, whose pixel they are [photosites].

    corner_radius: of its shape [blur radii].
    """
    return math.floor(0.5 * FINE_NODES_PER_PX / corner_radius) / FINE_NODES_PER_PX


def nodes_error(least_px: float, greatest_px: float, around: Sequence[float], curvature: float) -> float:
    """Error of means that are interpolated between tabulated radii, as a share of the brightest light.

    least_px, greatest_px: of the radii that occur, where photosites read pixels beyond `inside_px`. around, curvature: of
    `SceneContrast`. A circle that has just left its photosite begins to see its neighbours, by an area that grows as the 1.5th
    power of the way: between the nodes around that radius a cubic misses the dark most. It bounds 99.9 % of the photosites of
    random pixels in float64, black, white and grey, in the noise of their own light. Images are even, so that light which does
    not bend is exact: they reach half of a diagonal of a photosite beyond a circle.
    """
    borders = [up_to for up_to, _ in NODES_NEAR if least_px < up_to < greatest_px]
    far = np.geomspace(max(least_px, FINE_NODES_PX), greatest_px, 9) if greatest_px > FINE_NODES_PX else ()
    radii = np.unique([least_px, *(one for one in AROUND_PX if least_px < one < greatest_px), *borders, *far, greatest_px])
    found = [0.0]
    for from_px, to_px in pairwise(radii.tolist()):
        near = [error for up_to, error in NODES_NEAR if up_to > from_px]
        error = near[0] if near else NODES_FAR / from_px
        range_ = around[int(np.searchsorted(AROUND_PX, to_px))]
        found.append(error * min(range_, 0.5 * curvature * (to_px + math.sqrt(0.5)) ** 2))
    return max(found)


def nodes_of_squares(defocus: Defocus, around: Sequence[float], curvature: float, *, is_alone: bool) -> float:
    """`nodes_error` of a fine scene, whose even squares are samples (`PhotositeArea.has_squares`), or whose samples mix them.

    is_alone: whether nothing is assumed or known behind a single surface; circles that are then gathered from squares are not
    interpolated. It bounds 99.9 % of the photosites of random squares, black and white, in float64, for 1, 2 and 4 samples per
    photosite and axis.
    """
    varied = [pair for pair, radius in zip(defocus.ranges_px, defocus.radii_px, strict=True) if np.ndim(radius) > 0]
    least_px, greatest_px = min(least for least, _ in varied), max(most for _, most in varied)
    radii = np.unique(np.concatenate([np.geomspace(max(least_px, 0.05), max(greatest_px, 0.05), 33), [greatest_px]]))
    if is_alone:
        radii = radii[~defocus.gathers_scene(radii, radii)]
    if not len(radii):
        return 0.0
    counts = defocus.samples_per_axis(radii, radii)
    is_even = np.array([defocus.area.has_squares(int(count)) for count in counts])
    is_fine = (defocus.nodes_per_px == FINE_NODES_PER_PX) & ~defocus.is_coarse(radii, radii)
    even = np.select([radii <= up_to for up_to, _ in EVEN_NEAR], [error for _, error in EVEN_NEAR], EVEN_FAR)
    even = np.where(is_fine, even, 0.0056 * (2.0 / counts) ** 0.6 * (2.0 / radii) ** 1.4)
    mixed = np.where(counts == 1, 0.085 * radii**-1.65, 0.068 / counts * radii**-1.5)
    ranges = np.asarray(around)[np.searchsorted(AROUND_PX, radii)]
    seen = np.minimum(ranges, 0.5 * curvature * (radii + math.sqrt(0.5)) ** 2)
    return float((np.where(is_even, even, np.minimum(mixed, 0.16)) * seen).max())


def radii_in_focus(radius_px: np.ndarray, scale: float) -> np.ndarray:
    """Radius that tabulated images of even squares have too much at borders near the focus, (height, width) [photosites].

    Light crosses a photosite's borders in proportion to the radius there, which falls to the focus and rises beyond it. Images
    that are tabulated have the slope g of a surface on either side of their middle. The mean of that in focus and the next, at
    1/8, has at a border nearer to the focus than the middle, of the radius r, up to 2r (1 - 4g) too much, or g (1 - 8r).

    radius_px: of a map, (height, width). scale: its pixels per photosite. Slopes above STEEPEST_PX are steps. Both axes add.
    """
    found, near, nodes = np.zeros(radius_px.shape), np.abs(radius_px), FINE_NODES_PER_PX
    for axis, size in enumerate(radius_px.shape):
        slope = scale * np.abs(np.diff(radius_px, axis=axis, append=radius_px.take([size - 1], axis)))
        more = np.minimum(2.0 * near * (1.0 - 0.5 * nodes * slope), slope * (1.0 - nodes * near))
        found += np.where(slope <= STEEPEST_PX, np.maximum(more, 0.0), 0.0)
    return found


@lru_cache(maxsize=256)
def _largest(radius_px: float, samples_per_axis: int, ramp_px: float) -> np.ndarray:
    """Largest error where photosites see from each of LITS on to the next of an edge's step of 1, (LITS,).

    ramp_px: width over which the scene's own pixels end an edge, beside that of a photosite.
    """
    half = math.ceil(FINE * (radius_px + ramp_px + 4.0))
    across = (np.arange(-half, half) + 0.5) / FINE
    chord = np.sqrt(np.maximum(radius_px**2 - across**2, 0.0))
    penumbra = (across > 0.0).astype(np.float64) if radius_px * FINE < 1.0 else np.cumsum(chord) / chord.sum()
    before = _mean(penumbra, ramp_px)
    true, found, side = _mean(before, 1.0), before, 1.0 / samples_per_axis
    for width in (1.0, side, side):
        found = _mean(found, width)
    error, lit = np.abs(found - true), SIDES * np.clip(true, 0.0, 1.0)
    number = np.searchsorted(LITS, lit, side="right") - 1
    largest = np.zeros(len(LITS))
    np.maximum.at(largest, number, error)
    return largest


def _mean(profile: np.ndarray, width_px: float) -> np.ndarray:
    """Running mean of a profile over a width, of an odd number of parts."""
    beside = round(0.5 * FINE * width_px)
    sums = np.concatenate([np.zeros(1), np.cumsum(np.pad(profile, beside, "edge"))])
    count = 2 * beside + 1
    return (sums[count:] - sums[:-count]) / count
