"""Sample points of the aperture that all photosites of a block share."""

import math
from functools import lru_cache

import numpy as np

from simulator.optics.defocus.accuracy import FEWEST, MOST, MOST_WIDE, WIDE_PX
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.joint_motion import Cells, JointMotion
from simulator.optics.defocus.lattice_points import lattice_points
from simulator.optics.defocus.relaxed_points import relaxed_points
from simulator.optics.defocus.sobol_points import sobol_points
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.pupil.pupil_points import points_of

LEAST_SCALE = 0.25  # scene pixels per photosite that count at least: edges in depth are as sharp as the photosites
SAVED_WITHOUT_BACKGROUND = 4  # divides the number where no layer holds the occluded background, whose lack is the larger error
# Times as many samples where images move, and up to 3/2 MOST of them: edges pass all of the area that a circle sweeps.
MOVING = 1.5
ROUNDED_DOWN = 0.05  # octaves by which a number may be below the wanted one, so that read noise alone does not double it
FEWEST_OF_ALL, MOST_OF_ALL = 32, 8192  # at any tolerance
# Divides the aperture samples of a correction at one sample per photosite: they do not sample its area too. Of relaxed points
# twice as many are cheaper than a smaller tolerance, since few blocks take them.
POINTS_SAVED, RELAXED_SAVED = 4, 2
FEWEST_CORRECTED = 64  # samples of a correction, if there are so many: of 32 too few see past the end of a penumbra
# Share of the allowed disagreement at which a correction suffices: the means it corrects err, too. Relaxed points are nearer to
# the truth than to their first half, by more than others are.
CORRECTION_AGREES, RELAXED_AGREES = 0.25, 0.45
CORRECTION_LEAST = 8  # divides the number after which a correction is compared first: beside an edge few points agree by chance
HARDEST = 2  # times the number of points for blocks that do not agree on their light (`most_samples`)


def sample_count(radius_px: np.ndarray, defocus: Defocus) -> np.ndarray:
    """Aperture samples for blur circles of this radius [photosites]: several per scene pixel or photosite in it, powers of two.

    With motion, the area that counts is that which the circle sweeps, in photosites of the camera on wider ones, too: blocks
    that move take all of their points. The number follows the tolerance; it is not raised where the occluded background is
    assumed (`Defocus.guessed`).
    Where nothing is even assumed, circles at rest that are not wide take a quarter.
    """
    each = 4.0 * min(max(2.0 * defocus.scale, 0.5), 1.0)  # fewer where a scene pixel covers several photosites
    finest = min(max(defocus.scale, LEAST_SCALE), 1.0)
    most = MOST if defocus.wider == 1 else MOST_WIDE
    area = np.pi * (radius_px * finest + 1.0) ** 2
    if defocus.motion is not None:
        area = MOVING * (area + 2.0 * (radius_px * finest + 1.0) * finest * defocus.motion.path_px(radius_px))
        area, most = area * defocus.wider**2, 2 * most
    target = np.clip(each * area, FEWEST, most)
    count, factor = 2.0 ** np.ceil(np.log2(target)), defocus.accuracy.points_factor
    if defocus.guessed:
        factor = min(factor, 1.0)
        if (
            len(defocus.radii_px) == 1 and defocus.wider == 1 and defocus.motion is None
        ):  # copies of edges are seen where circles are wide
            count = np.where(radius_px < WIDE_PX, np.maximum(count / SAVED_WITHOUT_BACKGROUND, FEWEST), count)
    below = ROUNDED_DOWN if defocus.motion is None else 1e-9
    count = 2 ** np.ceil(np.log2(np.clip(factor * count, FEWEST_OF_ALL, MOST_OF_ALL)) - below).astype(int)
    return count if defocus.motion is None else np.where(count == 2 * MOST, 3 * MOST // 2, count)


def most_samples(radius_px: np.ndarray, defocus: Defocus) -> np.ndarray:
    """Most aperture samples of blocks that take as many as they need, in which surfaces occlude parts of themselves.

    A block takes FEWEST_OF_ALL, and twice as many until its light agrees (`Accuracy.allowed_disagreement`). Where the brightest
    light is unknown, it has `sample_count`.
    """
    count = sample_count(radius_px, defocus)
    return np.minimum(HARDEST * count, MOST_OF_ALL) if takes_as_needed(defocus) else count


def has_relaxed(samples_per_axis: int | np.ndarray, defocus: Defocus) -> np.ndarray:
    """Whether corrections take points of the aperture that are relaxed (`relaxed_points`): those that sample nothing else."""
    return np.equal(samples_per_axis, 1) & (defocus.pupil.is_round and defocus.eyes is None and defocus.motion is None)


def correction_agrees(samples_per_axis: int, defocus: Defocus) -> float:
    """Share of the allowed disagreement at which a correction suffices."""
    return RELAXED_AGREES if has_relaxed(samples_per_axis, defocus) else CORRECTION_AGREES


def correction_count(count: np.ndarray, samples_per_axis: int | np.ndarray, defocus: Defocus) -> np.ndarray:
    """Return how many of the samples that blur circles have a correction takes (`Method.CORRECTED`)."""
    divided = count // np.where(has_relaxed(samples_per_axis, defocus), RELAXED_SAVED, POINTS_SAVED)
    saved = np.maximum(divided, np.minimum(count, FEWEST_CORRECTED))
    return np.where(np.equal(samples_per_axis, 1), saved, count)


def takes_as_needed(defocus: Defocus) -> bool:
    """Whether blocks take as many aperture samples as they need; those that move take all, which lie evenly only together."""
    return defocus.accuracy.brightest > 0.0 and defocus.motion is None


def fewest_samples(count: int, correction: bool, samples_per_axis: int, defocus: Defocus) -> int:
    """Aperture samples after which a block's light is compared for the first time; `count` where it takes all of them.

    Corrections take all where their samples are places in the photosite, too, whose error is not seen in the agreement.
    """
    if not takes_as_needed(defocus) or (correction and samples_per_axis > 1):
        return count
    return max(FEWEST_OF_ALL, count // CORRECTION_LEAST) if correction else FEWEST_OF_ALL


@lru_cache
def aperture_samples(
    pupil: Pupil, count: int, samples_per_axis: int, open_side: float = 1.0, *, relaxed: bool = False
) -> np.ndarray:
    """Samples of low discrepancy, (count, 5) float32: x, y in the pupil; x, y in the photosite; phase from 0 to 1.

    They are Sobol' points in five dimensions, of which two are mapped to the pupil: others lie as evenly there, but not
    together with places and phases. relaxed: these two are `relaxed_points`, of a round pupil: better alone, too. Places in
    the photosite are the middles of its samples_per_axis x samples_per_axis samples, or have their variance less what lies
    outside its light-sensitive square of this side [photosites]. count: a power of two.
    """
    square = sobol_points(count)
    if relaxed:
        x, y = relaxed_points(count).T
    elif pupil.is_round:
        y, x = disk_of_square(square[:, 0], square[:, 1])
    else:
        x, y = pupil.map_unit_square(square[:, 0], square[:, 1])
    place = _places(square[:, 2:4], samples_per_axis, open_side)
    return np.stack([x, y, *place.T, square[:, 4]], axis=-1).astype(np.float32)


def aperture_points(pupil: Pupil, fields: np.ndarray, count: int) -> np.ndarray:
    """x, y of aperture samples at each field (n, 2) as in `Pupil`, (n, count, 2) float32; they move continuously with it."""
    return points_of(pupil, fields, sobol_points(count)[:, :2]).astype(np.float32)


def disk_of_square(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Equal-area map of the square onto the disk that keeps neighbours (Shirley and Chiu 1997)."""
    a, b = 2.0 * first - 1.0, 2.0 * second - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    ratio = np.where(wide, b, a) / np.where(radius == 0.0, 1.0, radius)
    angle = np.where(wide, 0.25 * math.pi * ratio, 0.5 * math.pi - 0.25 * math.pi * ratio)
    return radius * np.sin(angle), radius * np.cos(angle)


@lru_cache
def moving_samples(pupil: Pupil, count: int, samples_per_axis: int, open_side: float = 1.0) -> np.ndarray:
    """Samples of aperture, photosite and time, (count, 6) float32: as `aperture_samples`, and the share of the light so far.

    They are points of a lattice in six dimensions, so that the instants are evenly spread and mix well with the aperture.
    """
    square = lattice_points(count, 6)
    if pupil.is_round:
        y, x = disk_of_square(square[:, 0], square[:, 1])
    else:
        x, y = pupil.map_unit_square(square[:, 0], square[:, 1])
    place = _places(square[:, 4:6], samples_per_axis, open_side)
    return np.stack([x, y, *place.T, square[:, 3], square[:, 2]], axis=-1).astype(np.float32)


def move_samples(
    samples: np.ndarray, shares: np.ndarray, motion: JointMotion, middles_px: np.ndarray, cells: Cells
) -> np.ndarray:
    """Aperture samples of cells whose images move, (cells, layers, count, 5, 9 or 17) float32, as in kernels/occlusion.cl.

    samples: (cells or 1, count, 5) of an aperture at rest. shares: (count,) of the light that has come at the sample's instant.
    middles_px: (cells, 2), x and y, from the sensor's corner [photosites]. cells: how points differ within them. After the five
    numbers of a sample follows how the first four grow: from one pair of rows to the next; or per photosite to the right, down,
    and both.
    """
    if cells.points == "places":
        return _turn_samples(samples, shares, motion, middles_px, cells)
    if cells.points == "rows":
        return _grow_samples(samples, shares, motion, middles_px, cells.rows)
    shifts = motion.at(middles_px, shares)
    moved = np.empty((*shifts.shape[:3], 5), np.float32)
    np.add(samples[:, None, :, :4], shifts, out=moved[..., :4])
    moved[..., 4] = samples[:, None, :, 4]
    return moved


def _grow_samples(
    samples: np.ndarray, shares: np.ndarray, motion: JointMotion, middles_px: np.ndarray, rows: int
) -> np.ndarray:
    """Samples of cells of so many rows, and their growth from one pair of rows to the next: (cells, layers, count, 9)."""
    first, last = motion.rows_inside(middles_px[:, 1], rows)
    above, below = (motion.at(np.column_stack([middles_px[:, 0], y]), shares) for y in (first, last))
    apart = np.maximum(last - first, 1e-9)
    share = ((middles_px[:, 1] - first) / apart).astype(np.float32)[:, None, None, None]
    moved = np.empty((*above.shape[:3], 9), np.float32)
    np.add(samples[:, None, :, :4], above + share * (below - above), out=moved[..., :4])
    moved[..., 4] = samples[:, None, :, 4]
    np.multiply(below - above, (2.0 / apart).astype(np.float32)[:, None, None, None], out=moved[..., 5:])
    return moved


def _turn_samples(
    samples: np.ndarray, shares: np.ndarray, motion: JointMotion, middles_px: np.ndarray, cells: Cells
) -> np.ndarray:
    """Samples of cells over which they are bilinear, with growth to the right, down and both: (cells, layers, count, 17)."""
    found = bilinear_shifts(motion, middles_px, cells, shares)
    moved = np.empty((*found.shape[1:4], 17), np.float32)
    turns = motion.turns_at(middles_px[:, 1], shares)
    for first in (0, 2):  # the point of the aperture, and the place in the photosite
        turned = np.einsum(
            "clnij,cnj->clni", turns, np.broadcast_to(samples, (len(turns), *samples.shape[1:]))[..., first : first + 2]
        )
        moved[..., first : first + 2] = turned + found[0, ..., first : first + 2]
    moved[..., 4] = samples[:, None, :, 4]
    for number in (1, 2, 3):
        moved[..., 1 + 4 * number : 5 + 4 * number] = found[number]
    return moved


def bilinear_shifts(motion: JointMotion, middles_px: np.ndarray, cells: Cells, shares: np.ndarray) -> np.ndarray:
    """Shifts of `JointMotion.at` in the middles of cells, and their growth: (4, cells, layers, shares, 4) float32.

    Growth is that per photosite to the right, down, and both. Shifts are those of the photosites in the corners of a cell.
    """
    first, last = motion.rows_inside(middles_px[:, 1], cells.rows - 1.0)
    across_px = max(cells.columns - 1.0, 1.0)
    left, right = (middles_px[:, 0] + side * across_px for side in (-0.5, 0.5))
    above, above_right, below, below_right = (
        motion.at(np.column_stack([x, y]), shares) for y in (first, last) for x in (left, right)
    )
    down_px = np.maximum(last - first, 1.0)
    to_middle, per_row = (part.astype(np.float32)[:, None, None, None] for part in (middles_px[:, 1] - first, 1.0 / down_px))
    down, down_right = per_row * (below - above), per_row * (below_right - above_right)
    on_left, on_right = above + to_middle * down, above_right + to_middle * down_right
    per_column = np.float32(1.0 / across_px)
    return np.stack(
        [
            0.5 * (on_left + on_right),
            per_column * (on_right - on_left),
            0.5 * (down + down_right),
            per_column * (down_right - down),
        ]
    )


def _places(square: np.ndarray, samples_per_axis: int, open_side: float) -> np.ndarray:
    """Places of points in a photosite, from its middle [photosites], as many in each of its samples.

    Light that is read bilinearly at the middles of a photosite's samples is the exact mean of samples that are even squares,
    however far aside a point looks. Beside an open area of another side there are no such places: points spread evenly, with
    the variance that this area has more than a sample.

    square: (points, 2), from 0 to 1, as many in each of samples_per_axis strips of the first.
    """
    if open_side != 1.0:
        return math.sqrt(max(open_side**2 - 1.0 / samples_per_axis**2, 0.0)) * (square - 0.5)
    strip = np.floor(samples_per_axis * square[:, 0])
    each = len(square) // samples_per_axis  # points of a strip, in the order of the other number
    along = np.empty_like(strip)
    along[np.lexsort((square[:, 1], strip))] = np.tile(np.arange(each) * samples_per_axis // each, samples_per_axis)
    return (np.column_stack([strip, along]) + 0.5) / samples_per_axis - 0.5
