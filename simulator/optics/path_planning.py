"""Plans how samples of light between pixels are weighed, and measures what they leave, of one scene pixel per photosite.

Light was swept, or photosites lie between the pixels of a scene at rest, which is a path of one place. Even squares are taken
where they leave little, else weights of the path (`path_weights`) with as few of their own as suffice.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.path_contrast import SceneParts, parts_around
from simulator.optics.defocus.path_weights import Lattice, fit_weights, lattices, pixels_of, skewed_pixels
from simulator.optics.defocus.photosite_area import MOST_REACH, PATH_PX, ReadPath, Way
from simulator.optics.defocus.scene_contrast import steep_radii
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.pupil.pupil import UPRIGHT
from simulator.scene.content_keys import freeze

LONGEST_PX = 64.0  # part of a longer straight path that stands for all of it, whose pieces are alike [photosites]
READS_PER_PX = 16  # places on a straight path, per photosite
FITTED_SHARE = 0.25  # of the allowed error, which weights may leave where more of their own leave less
LEAST_ENDS = 1e-9  # of `SceneContrast.ends` that is measured, which is not 0
SAME_SCALE = 1e-6  # difference from one scene pixel per photosite at which light is read between the middles of pixels
EVERY = 256  # rings that hold all samples of an image
# Rings around the image and within its rim that have weights of their own, by the time that running sums take for them.
RINGS = (0, 0), (0, 1), (1, 1), (1, 2), (2, 2), (2, EVERY)
# Places of the sensor at which paths are looked at that differ from line to line, as shares of its width and height; and where
# they differ from photosite to photosite.
PLACES = (0.06, 0.11), (0.93, 0.31), (0.37, 0.52), (0.68, 0.74), (0.21, 0.97)
TURNED = tuple((0.02 + 0.24 * one + 0.06 * other, 0.02 + 0.24 * other + 0.06 * one) for other in range(4) for one in range(4))


def with_path_weights(planned: OpticsPlan, per_radiance: float) -> OpticsPlan:
    """Return the plan of a surface between pixels with what its samples leave, and weights of its path where these leave less.

    That is a scene of one layer and one pixel per photosite that moves in one light alone, or rests.
    """
    defocus = planned.defocus
    if defocus is None or not _is_measured(planned, defocus):
        return planned
    own = _Left(planned, defocus, per_radiance)
    ends, path, enough = own.ends(None), None, 12.0 * FITTED_SHARE * planned.accuracy.allowed
    for other in own.paths() if ends > enough else ():
        left = own.ends(other)
        if left < ends:
            ends, path = left, other
        if left <= enough:
            break
    if path is not None:
        defocus = replace(defocus, area=replace(defocus.area, path=path))
    ends = max(ends, LEAST_ENDS)
    return replace(planned, defocus=defocus, contrast=replace(planned.contrast, ends=ends, ends_aside=ends))


def _is_measured(planned: OpticsPlan, defocus: Defocus) -> bool:
    projection, psf = planned.projection, planned.psf
    if (psf is not None and psf.by_distance) or planned.accuracy.tolerance == 0.0 or len(defocus.radii_px) > 1:
        return False
    reads = planned.projection.has_pixel_per_photosite and not projection.has_squares and projection.warp is None
    return reads and _is_known(planned) and defocus.copied_px < defocus.largest_px


def _is_known(planned: OpticsPlan) -> bool:
    """Whether the plan knows where photosites read between pixels: at one place, or along one path that tells its weights."""
    motion = planned.motion
    if motion is None:
        return planned.projection.lies_between_pixels
    if planned.has_flash or motion.vectors is not None or motion.method not in ("swept_first", "instants"):
        return False
    return motion.length.longest_px <= LONGEST_PX or (motion.is_shift and motion.path.straight_shift() is not None)


class _Left:
    """What samples of a surface between pixels leave, by their weights."""

    def __init__(self, planned: OpticsPlan, defocus: Defocus, per_radiance: float) -> None:
        self.planned, self.defocus, self.motion = planned, defocus, planned.motion
        self.per_share = per_radiance / planned.accuracy.electrons
        self.ways = _ways(planned.motion, planned.projection)
        blur = None if planned.motion is None else planned.motion.blur
        skew, followed = (UPRIGHT, None) if blur is None else (blur.spot_skew, blur.followed)
        self.skew_px = None if followed is None else (followed.x_px, followed.y_px)
        self.image_of = partial(aperture_weights, replace(defocus.pupil, skew=skew))
        least_px = min(max(defocus.ranges_px[0][0], defocus.copied_px), PATH_PX)
        self.radii_px = steep_radii(least_px, defocus.largest_px)
        if not defocus.maps:
            self.radii_px = [min(max(float(defocus.radii_px[0]), -PATH_PX), PATH_PX)]

    def paths(self) -> Iterator[ReadPath]:
        """Weights of the path that the surface may have, those first that take the least time."""
        defocus, motion, largest_px = self.defocus, self.motion, self.defocus.pupil.corner_radius * self.defocus.largest_px
        is_one = defocus.eyes is None and not defocus.maps and largest_px <= PATH_PX
        if not is_one or (motion is not None and motion.blur is None):
            return
        reach, has_lamps = math.ceil(largest_px - 0.5), self.planned.accuracy.has_lamps
        if reach < MOST_REACH:
            rings = [(beside, EVERY) for beside in range(1, MOST_REACH + 1 - reach)]
        else:  # what rims of lamps leave is known of even squares
            rings = [] if has_lamps else list(RINGS)
        for beside, inside in rings:
            yield ReadPath(self.ways, beside, inside, is_positive=has_lamps)

    def ends(self, path: ReadPath | None) -> float:
        """Return `SceneContrast.ends` of samples with weights of a path; None: of even squares."""
        planned, defocus = self.planned, self.defocus
        light = freeze(planned.weights), self.per_share, planned.accuracy.electrons, planned.accuracy.read_noise_e
        key = "path ends", self.ways, self.image_of.args, self.skew_px, tuple(self.radii_px), defocus.scale, light
        known: dict[ReadPath | None, float] = planned.scene.remember(key, dict)  # of all paths together, as one result
        if path not in known:
            known[path] = self._measure(path)
        return known[path]

    def _measure(self, path: ReadPath | None) -> float:
        left = []
        for radius_px, pairs, own, lit in zip(self.radii_px, self._pairs, self._upright, self._light, strict=True):
            image = self.image_of(radius_px)
            weights = image if path is None else fit_weights(image, pairs, path)
            for (read, _), (_, exact), light, way in zip(pairs, own, lit, self.ways, strict=True):
                found = pixels_of(weights, read)
                if self.skew_px is not None:
                    found = skewed_pixels(weights, way, self.skew_px, len(exact) // 2)
                left.append(self._parts.left(found - exact, light))
        return 12.0 * max(left)

    @cached_property
    def _light(self) -> list[list[np.ndarray]]:
        """Of each radius and way, the light of the scene's parts by exact weights."""
        return [[self._parts.filtered(exact) for _, exact in pairs] for pairs in self._upright]

    @cached_property
    def _pairs(self) -> list[list[Lattice]]:
        """Of each radius, those of each way."""
        return [lattices(self.image_of, radius_px, self.ways) for radius_px in self.radii_px]

    @cached_property
    def _upright(self) -> list[list[Lattice]]:
        """The same of spots as they are, where they are skewed for rows that are swept at times of their own."""
        if self.skew_px is None:
            return self._pairs
        upright, farthest_px = partial(aperture_weights, self.defocus.pupil), max(map(abs, self.skew_px))
        found = [lattices(upright, radius_px, self.ways) for radius_px in self.radii_px]
        more = math.ceil(farthest_px * (max(map(abs, self.radii_px)) + 3.0))
        return [[(read, np.pad(exact, more)) for read, exact in pairs] for pairs in found]

    @cached_property
    def _parts(self) -> SceneParts:
        planned, every = self.planned, [pair for pairs in self._upright for pair in pairs]
        return parts_around(planned.scene, planned.weights, self.per_share, planned.accuracy, every)


def _ways(motion: MotionPlan | None, projection: Projection) -> tuple[Way, ...]:
    """Return `ReadPath.ways` of a motion, or of a place at rest."""
    if motion is None:
        return (((projection.offset_x, projection.offset_y, 1.0),),)
    geometry = motion.path.motion.geometry
    size = np.array([geometry.width_px, geometry.height_px])
    places = PLACES if motion.is_shift else TURNED
    if motion.is_shift and motion.is_common:
        places = places[:1]
    return tuple(_way(motion, projection, np.floor(size * place) + 0.5, size) for place in places)


def _way(motion: MotionPlan, projection: Projection, place_px: np.ndarray, size_px: np.ndarray) -> Way:
    """Way of the photosite at a place x, y of a sensor of this size [photosites], on the scene's grid."""
    line = int(place_px[0 if motion.path.lines.axis == "columns" else 1])
    own, offset = motion.path.of_lines(np.array([line])), np.array([projection.offset_x, projection.offset_y])
    if motion.is_shift and (ends := own.straight_shift()) is not None:
        begin, end = (one[0] + offset for one in ends)
        end = begin + (end - begin) * min(LONGEST_PX / max(float(np.hypot(*(end - begin))), LONGEST_PX), 1.0)
        count = math.ceil(READS_PER_PX * float(np.abs(end - begin).max())) + READS_PER_PX
        places = begin + (np.arange(count)[:, None] + 0.5) / count * (end - begin)
        shares = np.full(count, 1.0 / count)
    else:
        instants = (own.of_shift() if motion.is_shift else own).instants(max(motion.count, motion.lamp_count))
        shares, shifts = instants.weights[0], instants.pose_numbers[0]
        if not motion.is_shift:
            from_axis = np.append(place_px - 0.5 * size_px, 1.0)
            seen = motion.path.motion.homographies(shifts, 0) @ from_axis
            shifts = seen[:, :2] / seen[:, 2:] - from_axis[:2]
        places = shifts + offset
    return tuple((x, y, share) for (x, y), share in zip(places.tolist(), shares.tolist(), strict=True))
