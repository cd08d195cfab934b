"""Planning of the lens blur: the radius of each surface's blur circle, and the statistics of radii by which tiles get a method.

Each tile gets the cheapest method that is exact enough: it is copied where it is sharp, averaged over the aperture's image
where a single surface surrounds it, and sampled through points of the aperture where surfaces occlude each other.
"""

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np

from simulator.errors import require
from simulator.optics.defocus.accuracy import MEASURED, WIDE_PX, Accuracy, lamp_px
from simulator.optics.defocus.aperture_rectangles import rectangle_count
from simulator.optics.defocus.field_pupil import MOST_MOVED, CatsEyes, plan_cats_eyes
from simulator.optics.defocus.lamp_laws import gathered_lamp_error
from simulator.optics.defocus.patch_reach import merge_far_patches
from simulator.optics.defocus.photosite_area import WHOLE, PhotositeArea
from simulator.optics.lens.lens import Lens
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.memo import Memo
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera_sections import Window

if TYPE_CHECKING:
    from simulator.optics.defocus.joint_motion import JointMotion

LARGEST_PX = 1024  # largest blur radius; beyond it an image is hardly recognisable and takes minutes
TILE_COLUMNS: int = 128
TILE_ROWS: int = 16
BLOCK_COLUMNS, BLOCK_ROWS = 32, 8  # unit in which aperture sampling is chosen
PATCH_COLUMNS, PATCH_ROWS = 8, 8  # unit of the radius statistics
PATCHWISE_PX = 66.0  # largest reach for which pairs of patches are compared one by one
STEEPEST_PX = 0.2  # largest change of the radius between photosites of one continuous surface
NODES_PER_PX = 2  # tabulated radii per photosite of radius; the mean is interpolated between them by a cubic
FINE_NODES_PER_PX = 8  # the same near the focus, and where wave optics corrects the blur
FINE_NODES_PX, FINE_SQUARES_PX = 3.0, 2.0  # largest radius that counts as near, of samples that are values, and even squares
MOST_GATHERED = 4700.0  # most scene pixels, once for each rectangle of the aperture, that a photosite gathers one by one
MOST_FINER = 4  # times as many rectangles where lamps are gathered; a power of two
CLASSES = 64  # classes of radii, one bit each of a 64-bit mask
_USUAL = Accuracy()
ZONE_SHARE = 0.75  # of the allowed error, for zones that share a pupil
MOST_APART_PX = 0.4  # largest way of a ray between slabs of radius near the focus at MEASURED, where images move [photosites]
LEAST_APART_PX = 0.1  # slabs are not nearer to each other at any tolerance
T = TypeVar("T")
CLASS_UNIT_PX = 4.0  # up to about this radius all classes are equally wide


class Method(IntEnum):
    """How a tile is computed."""

    COPY = 0  # sharp
    MEAN = 1  # one surface: mean over the aperture's image
    COMPOSITE = 2  # means of smooth surfaces, composited; exact while only one surface is out of focus
    CORRECTED = 3  # the same plus the surfaces' covariance over the aperture, from aperture samples
    OCCLUSION = 4  # aperture samples alone: surfaces that occlude parts of themselves
    WIDE = 5  # the same where all blur circles are wide: from the blur on photosites twice as wide


@dataclass(frozen=True)
class Defocus:
    """Blur of a scene's layers, nearest first.

    radii_px: signed radius of each layer's blur circle on the scene's grid [photosites], > 0 behind the plane in focus: a float
        or (height, width) float32.
    opaque: whether a layer covers the whole scene, so that every ray through the aperture meets a surface.
    scale: scene pixels per photosite.
    pupil: shape of the aperture. eyes: how rims clip it by position on the sensor (cat's eye vignetting); None: nowhere.
    accuracy: error that the blur may have.
    guessed: whether the background behind edges is assumed, because the scene does not contain it.
    area: how a photosite gathers the samples around it.
    wider: width of the photosites of this blur, in photosites of the camera; a power of two.
    corrected_px: largest blur radius that is corrected to wave optics, by kernels of single blur radii; 0: none is.
    motion: of the layers' images while the shutter is open, which is computed together with the blur; None: they rest.
    """

    radii_px: tuple[float | np.ndarray, ...]
    opaque: bool
    scale: float
    pupil: Pupil = Pupil()
    accuracy: Accuracy = Accuracy()
    guessed: bool = False
    eyes: CatsEyes | None = None
    area: PhotositeArea = WHOLE
    wider: int = 1
    corrected_px: float = 0.0
    motion: "JointMotion | None" = None
    _memo: Memo = field(default_factory=Memo, init=False, repr=False, compare=False)

    def remember(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return `make()`, which depends on the blur and the key alone, and keep it with the blur."""
        return self._memo.get(key, make)

    @cached_property
    def least_px(self) -> float:
        """Least signed radius."""
        return min(float(np.min(radius)) for radius in self.radii_px)

    @cached_property
    def greatest_px(self) -> float:
        """Greatest signed radius."""
        return max(float(np.max(radius)) for radius in self.radii_px)

    @property
    def largest_px(self) -> float:
        """Radius of the largest blur circle."""
        return max(abs(self.least_px), abs(self.greatest_px))

    @property
    def copied_px(self) -> float:
        """Largest blur radius of a tile that may be copied [photosites]; -1: none, since a copy is the mean over all of it."""
        return self.accuracy.sharp_px if self.area.open_side == 1.0 else -1.0

    def samples_per_axis(self, least_px: np.ndarray, largest_px: np.ndarray) -> np.ndarray:
        """`Accuracy.samples_per_axis`."""
        return self.accuracy.samples_per_axis(least_px, largest_px, self.scale)

    def gathers_scene(self, least_px: np.ndarray, largest_px: np.ndarray) -> np.ndarray:
        """Whether tiles of one surface with blur circles between these radii are gathered from the scene's pixels.

        They are where no grid of samples is exact enough in a scene finer than the photosites, and few pixels are reached.
        """
        if not self.area.fine or self.eyes is not None:
            return np.zeros(largest_px.shape, bool)
        reached = self.scale * (self.area.open_side + 2.0 * self.pupil.corner_radius * largest_px) + 2.0
        is_few = rectangle_count(largest_px) * reached**2 <= MOST_GATHERED
        return is_few & ~self.accuracy.samples_suffice(least_px, self.scale)

    def gathered_rectangles(self, radius_px: np.ndarray) -> np.ndarray:
        """Rectangles of the aperture by which tiles with blur circles up to these radii are gathered from the scene's pixels.

        As many more as lamps need, up to MOST_FINER times.
        """
        count = rectangle_count(radius_px)
        for _ in range(MOST_FINER.bit_length() - 1):
            missed = gathered_lamp_error(radius_px, count, self.scale, self.accuracy) > self.accuracy.allowed
            count = np.where(missed, 2 * count, count)
        return count

    @property
    def nodes_per_px(self) -> int:
        """Tabulated radii per photosite of radius.

        Light bends with the radius where blur circles cross the borders of samples: the area beyond grows as the 1.5th power of
        the way. A correction to wave optics is interpolated between radii as the blur is, so that the radii of both must lie
        close together.
        """
        near_px = FINE_SQUARES_PX if self.accuracy.detail else FINE_NODES_PX
        near_focus = not self.least_px > near_px and not self.greatest_px < -near_px
        bends = self.area.whole_pixels or self.corrected_px or not self.accuracy.detail
        return FINE_NODES_PER_PX if bends and near_focus else NODES_PER_PX

    def is_coarse(self, least_px: np.ndarray, greatest_px: np.ndarray) -> np.ndarray:
        """Whether NODES_PER_PX tabulated radii are enough for signed radii of these ranges, although others need more.

        Those beyond FINE_NODES_PX and the last correction to wave optics are.
        """
        fine_px = self.corrected_px if self.accuracy.detail else max(self.corrected_px, FINE_NODES_PX)
        beyond = (least_px > fine_px) | (greatest_px < -fine_px)
        return beyond & (not self.area.whole_pixels and self.nodes_per_px != NODES_PER_PX)

    def with_moved_pixels(self) -> Self:
        """Return the blur of a scene whose pixels do not stay on the borders of samples."""
        accuracy, area = replace(self.accuracy, whole_pixels=0), replace(self.area, whole_pixels=0)
        return self._kept_as(accuracy=accuracy, area=area)

    def with_skew(self, skew: tuple[float, float]) -> Self:
        """Return the blur with spots of this skew (`Pupil.skew`)."""
        return self._kept_as(pupil=replace(self.pupil, skew=skew))

    def with_zones(self, allowed: float) -> Self:
        """Return the blur whose zones may leave this error where rims clip the pupil, as a share of the brightest light."""
        return self if self.eyes is None else self._kept_as(eyes=self.eyes.allowing(allowed, self.largest_px))

    def _kept_as(self, **changes: Hashable) -> Self:
        """Return the blur with other settings: itself where they are its own, else one that is kept with what is remembered."""
        if all(getattr(self, name) == value for name, value in changes.items()):
            return self
        return self.remember(("changed", *changes.items()), lambda: replace(self, **changes))  # type: ignore[arg-type]

    def on_wider_photosites(self) -> Self:
        """Return the blur as photosites see it that are twice as wide, which take means over all of their area."""
        return self._on_wider_photosites

    @cached_property
    def _on_wider_photosites(self) -> Self:
        radii = tuple(0.5 * radius for radius in self.radii_px)
        eyes = None if self.eyes is None else self.eyes.on_wider_photosites(0.5 * self.largest_px)
        accuracy = replace(self.accuracy, detail=0.0, whole_pixels=0)  # nothing inside a pixel is seen at these radii
        motion = None if self.motion is None else self.motion.on_wider_photosites()
        wider = replace(
            self,
            radii_px=radii,
            scale=2.0 * self.scale,
            accuracy=accuracy,
            area=WHOLE,
            wider=2 * self.wider,
            corrected_px=0.5 * self.corrected_px,
        )
        return replace(wider, eyes=eyes, motion=motion)

    @cached_property
    def ranges_px(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest blur radius of each layer, without its sign."""
        sizes = [np.abs(radius) for radius in self.radii_px]
        return tuple((float(np.min(size)), float(np.max(size))) for size in sizes)

    def of_scene(self) -> Self:
        """Return the blur of the scene's own surfaces, without a background that is only assumed."""
        return self._of_scene if self.guessed else self

    @cached_property
    def _of_scene(self) -> Self:
        return replace(self, radii_px=self.radii_px[:1])

    def aside_px(self, layer: int) -> tuple[int, int]:
        """Whole photosites x, y by which a layer is read aside of where it rests (`JointMotion.rest_px`)."""
        if self.motion is None:
            return 0, 0
        x, y = self.motion.rest_px[layer].tolist()
        return x, y

    def seen_aside(self, window: Window) -> list[Window]:
        """Windows of the sensor at which layers at rest are read for a window (`aside_px`)."""
        places = {self.aside_px(layer) for layer in range(len(self.radii_px))}
        return [replace(window, x=window.x + right, y=window.y + down) for right, down in sorted(places)]

    @property
    def has_covariance(self) -> bool:
        """Whether several layers are out of focus, so that the mean of their product is not the product of their means."""
        return sum(most > self.accuracy.sharp_px for _, most in self.ranges_px) > 1

    @property
    def maps(self) -> int:
        """Number of layers whose radius varies over the scene."""
        return sum(np.ndim(radius) > 0 for radius in self.radii_px)

    @property
    def reach_px(self) -> int:
        """Margin that the blur needs on each side [photosites]."""
        slab_px = (self.largest_px + CLASS_UNIT_PX) / (self.classes_per_unit * self.slab_parts)
        farthest_px = self.largest_px + 2.0 * slab_px
        moved_px = 0.0 if self.motion is None else self.motion.reach_px(farthest_px)
        return math.ceil(self.pupil.corner_radius * farthest_px + moved_px) + 2

    @property
    def wide_px(self) -> float:
        """Smallest blur radius from which light is computed on photosites twice as wide [photosites].

        At the end of a penumbra of radius R light grows as the 1.5th power of the distance over R, which no polynomial follows.
        A block of wider photosites has one pupil, so there are none where rims clip it differently across the block. The rim of
        a lamp's spot is a step, which they miss: they are taken where it is too faint to be seen.
        """
        if self.eyes is not None and self.eyes.movement(2 * BLOCK_COLUMNS) > MOST_MOVED:
            return math.inf
        looser = max(self.accuracy.looser, 1.0) if self.guessed else self.accuracy.looser
        return max(WIDE_PX * looser ** (-2.0 / 3.0), lamp_px(self.accuracy.peak, looser * MEASURED, self.scale))

    @cached_property
    def classes_per_unit(self) -> float:
        """Classes of radii per unit of asinh(radius / CLASS_UNIT_PX).

        With twelve, a class is a third of a photosite wide in focus and a twelfth of the radius for large radii. There are
        twice as many where all radii are large, and fewer for a loose tolerance, but of lamps, which what is in their own slab
        does not hide.
        """
        span = math.asinh(self.greatest_px / CLASS_UNIT_PX) - math.asinh(self.least_px / CLASS_UNIT_PX)
        finest = (12.0 if self.wider == 1 else 24.0) / (1.0 if self.accuracy.has_lamps else self.accuracy.coarser)
        return min(finest, (CLASSES - 3) / span) if span else finest

    @cached_property
    def first_class(self) -> float:
        """Class number before the least radius: two before its class, because the slabs of a class begin one class earlier."""
        return math.floor(self.classes_per_unit * math.asinh(self.least_px / CLASS_UNIT_PX)) - 1.0

    @cached_property
    def slab_parts(self) -> int:
        """Slabs of each class of radii: one where images rest, else as many as `apart_px` needs."""
        if self.motion is None:
            return 1
        most_px = min(max(MOST_APART_PX * math.sqrt(self.accuracy.looser), LEAST_APART_PX), 1.0)  # errors grow with its square
        way_px = CLASS_UNIT_PX / self.classes_per_unit * (1.0 + self.motion.largest_aperture)
        return max(math.ceil(way_px / most_px - 1e-9), 1)

    @property
    def apart_px(self) -> float:
        """Way of a ray from a slab of radius near the focus to the next one, where images move [photosites].

        A ray that meets a surface in a slab reads it up to half of this way aside, evenly to either side.
        """
        assert self.motion is not None  # else slabs are read where rays meet them
        return CLASS_UNIT_PX / (self.classes_per_unit * self.slab_parts) * (1.0 + self.motion.largest_aperture)

    @cached_property
    def slab_borders_px(self) -> np.ndarray:
        """Signed radii at which the slabs of all classes begin, and two more."""
        numbers = self.first_class + np.arange(CLASSES * self.slab_parts + 2) / self.slab_parts
        return CLASS_UNIT_PX * np.sinh(numbers / self.classes_per_unit)


def plan_defocus(
    lens: Lens,
    pixel_pitch_um: float,
    scene: Scene,
    scale: float,
    accuracy: Accuracy = _USUAL,
    sensor_px: tuple[int, int] = (0, 0),
    area: PhotositeArea = WHOLE,
    *,
    keeps_sharp: bool = False,
) -> Defocus | None:
    """Blur of a scene with so many pixels per photosite, or None when no blur circle is as large as `Accuracy.sharp_px`.

    area: how a photosite gathers the samples around it.
    keeps_sharp: whether a blur is returned that is smaller, too.
    sensor_px: (width, height) of the whole sensor, whose middle lies on the axis; (0, 0): all of it is seen from the axis.
    Raises PhotositeError for blur circles above LARGEST_PX.
    """
    radii = tuple(_radius_px(lens, pixel_pitch_um, layer.depth_m) for layer in scene.layers)
    opaque, pupil = any(layer.coverage is None for layer in scene.layers), replace(lens.pupil, stops=())
    planned = Defocus(radii, opaque, scale, pupil, accuracy, guessed=not scene.behind, area=area)
    if planned.largest_px <= accuracy.sharp_px and not keeps_sharp:
        return None
    allowed = ZONE_SHARE * accuracy.allowed if accuracy.tolerance else None
    return replace(planned, eyes=plan_cats_eyes(lens, pixel_pitch_um, sensor_px, planned.largest_px, allowed))


def radius_range_px(lens: Lens, pixel_pitch_um: float, scene: Scene) -> tuple[float, float]:
    """Least and greatest signed radius of a scene's blur circles [photosites]."""
    radii = [_radius_px(lens, pixel_pitch_um, layer.depth_m) for layer in scene.layers]
    return min(float(np.min(radius)) for radius in radii), max(float(np.max(radius)) for radius in radii)


def _radius_px(lens: Lens, pixel_pitch_um: float, depth_m: float | np.ndarray) -> float | np.ndarray:
    """Signed blur radius of a layer [photosites]: a float where it is the same everywhere, else a float32 map."""
    signed = lens.blur_radius_um(depth_m) / pixel_pitch_um
    _check_size(signed, depth_m, lens)
    if np.ndim(signed) == 0 or signed.min() == signed.max():
        return float(np.min(signed))
    return np.asarray(signed).astype(np.float32)


def _check_size(signed_px: float | np.ndarray, depth_m: float | np.ndarray, lens: Lens) -> None:
    worst = np.argmax(np.abs(signed_px))
    radius_px, depth = abs(float(np.ravel(signed_px)[worst])), float(np.ravel(depth_m)[worst])
    excess = 1.005 * radius_px / LARGEST_PX  # 0.5 % more, so that the advised value suffices when rounded to three digits
    key, value, fix = lens.smaller_aperture(excess)
    rule = f"blurs what stands at {depth:.3g} m to a radius of {radius_px:.4g} photosites, at most {LARGEST_PX} are computed"
    require(radius_px <= LARGEST_PX, key, value, f"{rule}; give {fix}, or correct its depth")


@dataclass(frozen=True)
class RadiusStatistics:
    """Statistics of a layer's blur radius and coverage in each patch, tile or block: arrays of (rows, columns).

    least_px, greatest_px: range of the signed radius [photosites]. steepest_px: greatest absolute difference between
        neighbouring photosites. slope_x, slope_y: mean change to the right and down [photosites per photosite];
        `merge_within_reach` does not change them.
    classes: classes of radii that occur, one bit each. covered: greatest coverage. filled: least coverage.
    """

    least_px: np.ndarray
    greatest_px: np.ndarray
    steepest_px: np.ndarray
    slope_x: np.ndarray
    slope_y: np.ndarray
    classes: np.ndarray
    covered: np.ndarray
    filled: np.ndarray

    def inside(self, rows: int, columns: int) -> "RadiusStatistics":
        """Leave out so many rows and columns of patches on each side."""
        kept = slice(rows, len(self.least_px) - rows), slice(columns, self.least_px.shape[1] - columns)
        return RadiusStatistics(**{name: plane[kept] for name, plane in vars(self).items()})

    def of_tiles(self) -> "RadiusStatistics":
        """Merge the patches of each tile."""
        return self._merge(TILE_ROWS // PATCH_ROWS, TILE_COLUMNS // PATCH_COLUMNS)

    def of_blocks(self) -> "RadiusStatistics":
        """Merge the patches of each block."""
        return self._merge(BLOCK_ROWS // PATCH_ROWS, BLOCK_COLUMNS // PATCH_COLUMNS)

    def _merge(self, rows: int, columns: int) -> "RadiusStatistics":
        joins: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]
        joins = {**_JOIN, **dict.fromkeys(_SLOPES, _mean_of_two)}
        return RadiusStatistics(
            **{name: _merge_neighbours(plane, joins[name], rows, columns) for name, plane in vars(self).items()}
        )


def _mean_of_two(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return 0.5 * (a + b)


def _merge_neighbours(
    plane: np.ndarray, join: Callable[[np.ndarray, np.ndarray], np.ndarray], rows: int, columns: int
) -> np.ndarray:
    """Merge groups of rows x columns neighbours, both powers of two, pairwise."""
    if _is_constant(plane):
        return plane[::rows, ::columns]
    while columns > 1:
        plane, columns = join(plane[:, ::2], plane[:, 1::2]), columns // 2
    while rows > 1:
        plane, rows = join(plane[::2], plane[1::2]), rows // 2
    return plane


def _is_constant(plane: np.ndarray) -> bool:
    return bool(plane.min() == plane.max())


_JOIN: Mapping[str, np.ufunc] = {  # how the statistics of two patches merge
    "least_px": np.minimum,
    "greatest_px": np.maximum,
    "steepest_px": np.maximum,
    "classes": np.bitwise_or,
    "covered": np.maximum,
    "filled": np.minimum,
}
_SLOPES = ("slope_x", "slope_y")


def merge_within_reach(
    radius_statistics: RadiusStatistics, corner_radius: float = 1.0, largest_px: float = math.inf, beside_px: float = 0.0
) -> RadiusStatistics:
    """Merge into each patch the statistics of all patches that its blur circles reach or whose blur circles reach it.

    corner_radius: largest radius of the pupil's shape in blur radii. largest_px: largest blur radius of the scene, so that a
        crop of the frame gets the same statistics as the whole frame. beside_px: way beside the blur circles to which light
        reaches, too.
    """
    reach = np.maximum(np.abs(radius_statistics.least_px), np.abs(radius_statistics.greatest_px)) * corner_radius
    reach = reach + (2.0 + beside_px)
    largest = np.where(reach <= PATCHWISE_PX, reach, 0.0)
    rows, columns = (math.ceil(float(largest.max()) / size) for size in (PATCH_ROWS, PATCH_COLUMNS))
    varying = {name: getattr(radius_statistics, name) for name in _JOIN if not _is_constant(getattr(radius_statistics, name))}
    merged = {name: plane.copy() for name, plane in varying.items()}
    if not merged:
        return radius_statistics
    padding = ((rows, rows), (columns, columns))
    padded = {name: np.pad(plane, padding, mode="edge") for name, plane in merged.items()}
    padded_largest = np.pad(largest, padding, mode="edge")
    height, width = largest.shape
    for down in range(-rows, rows + 1):
        for right in range(-columns, columns + 1):
            gap = math.hypot(max(abs(down) - 1, 0) * PATCH_ROWS, max(abs(right) - 1, 0) * PATCH_COLUMNS)
            window = slice(rows + down, rows + down + height), slice(columns + right, columns + right + width)
            near = np.maximum(padded_largest[window], largest) > gap
            for name, plane in merged.items():
                _JOIN[name](plane, padded[name][window], out=plane, where=near)
    far = np.where(largest > 0, 0.0, reach)
    merge_far_patches(varying, _JOIN, merged, far, largest_px * corner_radius + 2.0 + beside_px, (PATCH_ROWS, PATCH_COLUMNS))
    return replace(radius_statistics, **merged)
