"""Planning of the lens blur: the radius of each surface's blur circle, and which tile of the frame needs which method.

A tile is as cheap as what it sees allows: copied where it is sharp, one mean over the aperture's image where a single surface
fills its surroundings, and points of the aperture where surfaces hide each other.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Self

import numpy as np

from simulator.errors import require
from simulator.optics.defocus.error_laws import Accuracy
from simulator.optics.defocus.field_pupil import CatsEyes, plan_cats_eyes
from simulator.optics.defocus.patch_reach import far_reaching
from simulator.optics.lens.lens import Lens
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.scene import Scene

LARGEST_PX = 1024  # of a blur circle; larger ones hardly show a picture, and take minutes
TILE_COLUMNS, TILE_ROWS = 128, 16
BLOCK_COLUMNS, BLOCK_ROWS = 32, 8  # where points of the aperture are needed is decided block by block
PATCH_COLUMNS, PATCH_ROWS = 8, 8  # what reaches a tile or a block is found out patch by patch
PATCHWISE_PX = 66.0  # reach up to which every pair of patches is looked at
STEEPEST_PX = 0.2  # change of the radius from photosite to photosite up to which a surface counts as one
CLASSES = 64  # of radii, one bit each in a 64-bit mask
_USUAL = Accuracy()
CLASS_UNIT_PX = 4.0  # up to about this radius all classes are equally wide


class Method(IntEnum):
    """How a tile is computed."""

    COPY = 0  # sharp
    MEAN = 1  # one surface: mean over the aperture's image
    COMPOSITE = 2  # smooth surfaces laid over one another, each with its mean; exact while only one is out of focus
    CORRECTED = 3  # the same, and what the surfaces have to do with each other, from points of the aperture
    OCCLUSION = 4  # points of the aperture alone: surfaces that hide parts of themselves


@dataclass(frozen=True)
class Defocus:
    """Blur of a scene's layers, nearest first.

    radii_px: signed radius of each layer's blur circle on the scene's grid [photosites], > 0 behind the plane in focus: a float
        or (height, width) float32.
    opaque: whether a layer covers everything, so that no line through the aperture ends in the dark.
    scale: scene pixels per photosite.
    pupil: shape of the aperture. eyes: how rims cut it by place on the sensor; None: nowhere.
    accuracy: how exact the blur has to be.
    guessed: whether what lies behind edges is not in the scene, so that nobody can tell what is right there.
    """

    radii_px: tuple[float | np.ndarray, ...]
    opaque: bool
    scale: float
    pupil: Pupil = Pupil()
    accuracy: Accuracy = Accuracy()
    guessed: bool = False
    eyes: CatsEyes | None = None

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
        """Largest blur circle's radius."""
        return max(abs(self.least_px), abs(self.greatest_px))

    def of_scene(self) -> Self:
        """Return the blur of the scene's own surfaces, without a background that is only assumed."""
        return replace(self, radii_px=self.radii_px[:1]) if self.guessed else self

    @property
    def maps(self) -> int:
        """Layers whose radius differs from place to place."""
        return sum(np.ndim(radius) > 0 for radius in self.radii_px)

    @property
    def reach_px(self) -> int:
        """Photosites that a blur needs on either side."""
        class_px = (self.largest_px + CLASS_UNIT_PX) / self.classes_per_unit
        return math.ceil(self.pupil.corner_radius * (self.largest_px + 2.0 * class_px)) + 2

    @cached_property
    def classes_per_unit(self) -> float:
        """Classes of radii per unit of asinh(radius / CLASS_UNIT_PX).

        Twelve make them a third of a photosite wide in focus, a twelfth of large radii; half of that where four photosites or
        more show one scene pixel. A loose tolerance makes them wider.
        """
        span = math.asinh(self.greatest_px / CLASS_UNIT_PX) - math.asinh(self.least_px / CLASS_UNIT_PX)
        finest = 12.0 * min(max(2.0 * self.scale, 0.5), 1.0) / self.accuracy.coarser
        return min(finest, (CLASSES - 3) / span) if span else finest

    @cached_property
    def first_class(self) -> float:
        """Border of the classes below the least radius: two before it, since slabs of a class begin one before."""
        return math.floor(self.classes_per_unit * math.asinh(self.least_px / CLASS_UNIT_PX)) - 1.0

    def class_border_px(self, number: int) -> float:
        """Signed radius at which a class begins."""
        return CLASS_UNIT_PX * math.sinh((self.first_class + number) / self.classes_per_unit)


def plan_defocus(
    lens: Lens,
    pixel_pitch_um: float,
    scene: Scene,
    scale: float,
    accuracy: Accuracy = _USUAL,
    sensor_px: tuple[int, int] = (0, 0),
) -> Defocus | None:
    """Blur of a scene with so many pixels per photosite, or None when no blur circle is as large as `Accuracy.sharp_px`.

    sensor_px: (width, height) of the whole sensor, whose middle lies on the axis; (0, 0): all of it is seen from the axis.
    Raises PhotositeError for blur circles above LARGEST_PX.
    """
    radii = tuple(_radius_px(lens, pixel_pitch_um, layer.depth_m) for layer in scene.layers)
    opaque, pupil = any(layer.coverage is None for layer in scene.layers), replace(lens.pupil, stops=())
    planned = Defocus(radii, opaque, scale, pupil, accuracy, guessed=not scene.behind)
    if planned.largest_px <= accuracy.sharp_px:
        return None
    return replace(planned, eyes=plan_cats_eyes(lens, pixel_pitch_um, sensor_px, planned.largest_px))


def _radius_px(lens: Lens, pixel_pitch_um: float, depth_m: float | np.ndarray) -> float | np.ndarray:
    signed = lens.blur_radius_um(depth_m) / pixel_pitch_um
    _check_size(signed, depth_m, lens)
    if np.ndim(signed) == 0 or signed.min() == signed.max():
        return float(np.min(signed))
    return signed.astype(np.float32)


def _check_size(signed_px: np.ndarray, depth_m: float | np.ndarray, lens: Lens) -> None:
    worst = np.argmax(np.abs(signed_px))
    radius_px, depth = abs(float(np.ravel(signed_px)[worst])), float(np.ravel(depth_m)[worst])
    over = 1.005 * radius_px / LARGEST_PX  # what is advised has three digits, and is enough
    key, value, fix = lens.smaller_aperture(over)
    told = f"blurs what stands at {depth:.3g} m to a radius of {radius_px:.4g} photosites, at most {LARGEST_PX} are computed"
    require(radius_px <= LARGEST_PX, key, value, f"{told}; give {fix}, or correct its depth")


@dataclass(frozen=True)
class RadiusStatistics:
    """What patches of a frame hold of one layer, (patch rows, patch columns) each; or tiles, or what reaches them.

    least_px, greatest_px: signed radius. steepest_px: greatest step of it between neighbours. slope_x, slope_y: mean step to
        the right and down; `seen_from` leaves a tile its own.
    classes: which classes of radii occur, one bit each. covered: greatest coverage. filled: least coverage.
    """

    least_px: np.ndarray
    greatest_px: np.ndarray
    steepest_px: np.ndarray
    slope_x: np.ndarray
    slope_y: np.ndarray
    classes: np.ndarray
    covered: np.ndarray
    filled: np.ndarray

    def of_tiles(self) -> "RadiusStatistics":
        """Put the patches of each tile together."""
        return self._joined(TILE_ROWS // PATCH_ROWS, TILE_COLUMNS // PATCH_COLUMNS)

    def of_blocks(self) -> "RadiusStatistics":
        """Put the patches of each block together."""
        return self._joined(BLOCK_ROWS // PATCH_ROWS, BLOCK_COLUMNS // PATCH_COLUMNS)

    def _joined(self, rows: int, columns: int) -> "RadiusStatistics":
        joins = _JOIN | dict.fromkeys(_SLOPES, _mean_of_two)
        return RadiusStatistics(**{name: _halved(plane, joins[name], rows, columns) for name, plane in vars(self).items()})


def _mean_of_two(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return 0.5 * (a + b)


def _halved(plane: np.ndarray, join: Callable, rows: int, columns: int) -> np.ndarray:
    """Neighbours joined two by two until so many, powers of two, are one."""
    if _even(plane):
        return plane[::rows, ::columns]
    while columns > 1:
        plane, columns = join(plane[:, ::2], plane[:, 1::2]), columns // 2
    while rows > 1:
        plane, rows = join(plane[::2], plane[1::2]), rows // 2
    return plane


def _even(plane: np.ndarray) -> bool:
    return bool(plane.min() == plane.max())


_JOIN = {
    "least_px": np.minimum,
    "greatest_px": np.maximum,
    "steepest_px": np.maximum,
    "classes": np.bitwise_or,
    "covered": np.maximum,
    "filled": np.minimum,
}
_SLOPES = ("slope_x", "slope_y")


def seen_from(
    radius_statistics: RadiusStatistics, corner_radius: float = 1.0, largest_px: float = math.inf
) -> RadiusStatistics:
    """Return, for each patch, what can reach it: patches whose blur circles touch its own, and all that its own touch.

    corner_radius: of the pupil, how far a spot reaches beyond its blur circle. largest_px: radius of the largest blur circle of
        the scene, so that a part of the frame finds what the whole finds.
    """
    reach = np.maximum(np.abs(radius_statistics.least_px), np.abs(radius_statistics.greatest_px)) * corner_radius + 2.0
    largest = np.where(reach <= PATCHWISE_PX, reach, 0.0)
    rows, columns = (math.ceil(float(largest.max()) / size) for size in (PATCH_ROWS, PATCH_COLUMNS))
    joined = {name: getattr(radius_statistics, name) for name in _JOIN if not _even(getattr(radius_statistics, name))}
    found = {name: plane.copy() for name, plane in joined.items()}
    if not found:
        return radius_statistics
    padding = ((rows, rows), (columns, columns))
    padded = {name: np.pad(plane, padding, mode="edge") for name, plane in found.items()}
    padded_largest = np.pad(largest, padding, mode="edge")
    height, width = largest.shape
    for down in range(-rows, rows + 1):
        for right in range(-columns, columns + 1):
            gap = math.hypot(max(abs(down) - 1, 0) * PATCH_ROWS, max(abs(right) - 1, 0) * PATCH_COLUMNS)
            window = slice(rows + down, rows + down + height), slice(columns + right, columns + right + width)
            near = np.maximum(padded_largest[window], largest) > gap
            for name, plane in found.items():
                _JOIN[name](plane, padded[name][window], out=plane, where=near)
    far = np.where(largest > 0, 0.0, reach)
    far_reaching(joined, _JOIN, found, far, largest_px * corner_radius + 2.0, (PATCH_ROWS, PATCH_COLUMNS))
    return replace(radius_statistics, **found)
