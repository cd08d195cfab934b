"""Executes the reference blur, without tolerance: traces rays through the lens for every photosite, in bands of rows."""

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.highlights import BRIGHT, highlight_threshold
from simulator.optics.defocus.joint_motion import JointMotion
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.convergence import FEWEST_RAYS, REPLICATIONS, RaySet, follow_until_converged
from simulator.optics.ray_reference.deep_rays import DeepPicture
from simulator.optics.ray_reference.height_field_rays import HeightField
from simulator.optics.ray_reference.layered_rays import LayeredRays, move_rays, ray_samples, upload_surfaces
from simulator.optics.ray_reference.small_lights import (
    WHOLE,
    LightSpots,
    SmallLights,
    Start,
    has_shares,
    light_pairs,
    open_share,
    take_lights,
)
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Window

BAND_ROWS = 64  # rows that are on the device at once; even, so that each begins with the same colours
FAINT = 1e-6  # of the brightest light, below which no sample is a small light
MOST_LIGHTS = 4096  # scene pixels that count as small lights, the brightest; fewer where one lies on many samples
LEAST_CELL, RAY_CELL_PX = (
    (8, 1),
    0.004,
)  # columns and rows of the smallest cells of moving images, and their largest error [photosites]
CROSSING = 4.0  # rays of a replication that cross a border, at least
RAYS_PER_LIGHT_RAY = 4  # rays of a photosite for each from one of its small lights
PATTERNS, FEWEST_PATTERNS, PATTERN_RAYS = 32, 4, 131072  # patterns of a set of rays: fewer of many rays

Sample = Callable[[RaySet, np.ndarray], np.ndarray]


def reference_mosaic(optics: OpticsPlan, device: Device, planes: list[Buffer], progress: Callable[[float], None]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    planes: as for `defocused_mosaic`. Rays intersect several layers, or one at a single distance, front to back
    (`lens_sampling`); one picture with depth is a surface that continues behind its edges (`lens_height_field`); of a deep
    picture they intersect the samples of each pixel, which no layer has merged (`lens_deep`). Rays are added
    until the estimated standard error of a photosite is `Accuracy.ray_error` of its noise; small bright lights send their own.
    Warns of photosites that do not get there. Raises PhotositeError for layers too steep to be met once.
    """
    light = converged_mosaic(optics.window, optics.accuracy, _rays_of(optics, device, planes), progress, _fewest_rays(optics))
    return device.upload(light)


def _fewest_rays(optics: OpticsPlan) -> int:
    """Rays of a replication of which CROSSING meet the pixel beyond a border of their own, where that may be seen.

    A circle of the radius r brings 2 r / 3 pi over each border of a square. Where none of all rays does, all agree.
    """
    radii_px = [abs(px) for px in _defocus_of(optics).radii_px if not isinstance(px, np.ndarray)]
    crossed = 2.0 / (3.0 * math.pi) * min((px for px in radii_px if px > 0.0), default=1.0)
    if optics.accuracy.in_sigma(crossed * optics.accuracy.detail) < optics.accuracy.ray_error:
        return FEWEST_RAYS
    return max(FEWEST_RAYS, 1 << math.ceil(math.log2(CROSSING / crossed)))


def converged_mosaic(
    frame: Window,
    accuracy: Accuracy,
    rays_of: Callable[[Window], Sample],
    progress: Callable[[float], None],
    fewest: int = FEWEST_RAYS,
) -> np.ndarray:
    """Light of a frame (height, width) float32 by as many rays as it needs, band by band; warns of photosites that need more.

    rays_of: function that gives, for a band of rows, the function that samples its light. fewest: of a replication.
    """
    light = np.empty((frame.height, frame.width), np.float32)
    left, worst = 0, 0.0
    for window in _bands(frame):
        found = follow_until_converged(
            rays_of(window), window.height * window.width, accuracy.allowed_ray_error, fewest, accuracy.rays
        )
        first = window.y - frame.y
        light[first : first + window.height] = found.light.reshape(window.height, window.width)
        left += int((~found.good).sum())
        worst = max(worst, _worst_sigma(accuracy, found.light[~found.good], found.error[~found.good]))
        progress((first + window.height) / frame.height)
    if left:
        warnings.warn(
            f"{left} of {light.size} photosites have an estimated error above {accuracy.ray_error:g} sigma after "
            f"{REPLICATIONS * accuracy.rays} rays each, at most {worst:.2g} sigma",
            stacklevel=3,
        )
    return light


def _rays_of(optics: OpticsPlan, device: Device, planes: list[Buffer]) -> Callable[[Window], Sample]:
    """Function that gives, for a band of rows, the function that samples its light."""
    deep, blur, defocus = optics.scene.deep, optics.deep_blur, _defocus_of(optics)
    if deep is None or blur is None:
        grid = Grid(optics, device, planes)
        on_samples = 4.0 * (grid.over / optics.projection.scale) ** 2 if optics.projection.is_bilinear else 1.0
        most = max(int(MOST_LIGHTS / on_samples), 1)
        has_lights = defocus.motion is None and has_shares(defocus.pupil, _start(optics))
        left = optics.scene if optics.lamps is None else optics.lamps.without(optics.scene, optics.weights)
        limit = light_limit(left, optics.weights, most) if has_lights else None
        return lambda window: BandRays(grid, window, limit).sample
    picture = DeepPicture(device, deep, blur, optics.weights, optics.projection)

    def of_band(window: Window) -> Sample:
        block = optics.cfa.block(window.x, window.y)

        def sample(rays: RaySet, places: np.ndarray) -> np.ndarray:
            points = _points(rays.rays, rays.seed, defocus.pupil, _start(optics))
            return picture.sample(points, window, block, places, defocus.eyes)

        return sample

    return of_band


def _worst_sigma(accuracy: Accuracy, light: np.ndarray, error: np.ndarray) -> float:
    """Greatest standard error, in standard deviations of the noise."""
    return float((error / accuracy.allowed_ray_error(light)).max(initial=0.0)) * accuracy.ray_error


def light_limit(scene: Scene, weights: np.ndarray, most: int = MOST_LIGHTS) -> tuple[np.ndarray, np.ndarray] | None:
    """Electron radiance of each channel above which a sample is a small light, and the radiance that it keeps: (channels,).

    None: the scene has none. weights: as of `highlight_threshold`. most: pixels that count, the brightest.
    """
    limit = highlight_threshold(scene, weights)
    if limit is None:
        return None
    light = np.concatenate([(layer.planes @ weights).reshape(-1, len(limit)) for layer in scene.layers])
    limit = np.maximum(limit, np.float32(FAINT) * light.max(axis=0))  # black but for its lights, a scene has a mean of 0
    ratio = np.divide(light, limit, out=np.zeros_like(light), where=limit > 0.0).max(axis=1)
    most = min(most, len(ratio) - 1)
    factor = max(1.0, float(np.partition(ratio, len(ratio) - 1 - most)[len(ratio) - 1 - most]))
    return limit * np.float32(factor), limit / BRIGHT


def _bands(frame: Window) -> Iterator[Window]:
    """Split a frame into windows of at most BAND_ROWS rows."""
    for first in range(0, frame.height, BAND_ROWS):
        yield Window(frame.x, frame.y + first, frame.width, min(BAND_ROWS, frame.height - first))


def patterns_of(rays: int) -> int:
    """Patterns of a set of so many rays."""
    return max(FEWEST_PATTERNS, min(PATTERNS, PATTERN_RAYS // rays))


@lru_cache(maxsize=8 * REPLICATIONS)
def _points(rays: int, seed: int, pupil: Pupil | None, start: Start, *, timed: bool = False) -> np.ndarray:
    """Rays of a set. pupil: None: the last two numbers are places in the light's cell. start: where they begin."""
    side, apart = start
    points = ray_samples(rays, patterns_of(rays), seed, pupil, timed=timed)
    place = points[..., :2]
    if apart:  # either half of an axis goes to one of the spots, so that both have points as even as one
        second = place >= 0.5
        place = 2.0 * place - second
        points[..., :2] = 0.5 + side * (place - 0.5) + apart * (second - 0.5)
    else:
        points[..., :2] = 0.5 + side * (place - 0.5)
    return points


def _start(optics: OpticsPlan) -> Start:
    return optics.projection.open_side, optics.projection.low_pass_px


class BandRays:
    """Rays of a band of rows.

    limit: of `light_limit`. Samples of a grid with one per photosite are means over photosites, so that the area of the
    photosite counts once: rays start from its centre. Those of images that move start anywhere in it, and so do those that a
    filter or the open area moves: the mean over even squares.
    """

    def __init__(self, grid: "Grid", window: Window, limit: tuple[np.ndarray, np.ndarray] | None) -> None:
        optics, defocus = grid.optics, _defocus_of(grid.optics)
        block = optics.cfa.block(window.x, window.y)
        colour, coverage, radius = grid.band(window)
        start = _start(optics)
        starts_in_middle = grid.over == 1 and defocus.motion is None and start == WHOLE
        self._pupil, self._start = defocus.pupil, (0.0, 0.0) if starts_in_middle else start
        is_round = defocus.pupil.is_round and defocus.eyes is None
        lights = None if limit is None else take_lights(colour, coverage, radius, *limit, grid.over, is_round=is_round)
        args = grid.device, grid.margin_px, window, grid.over, block, defocus.eyes
        self._motion, self._window = defocus.motion, window
        farthest = 1.0 if self._motion is None else 1.0 + self._motion.largest_aperture
        self._rays: HeightField | LayeredRays
        if len(grid.planes) == 1 and np.ndim(defocus.radii_px[0]) > 0:
            self._rays = HeightField(colour[0], radius[0], *args, finer=math.ceil(farthest))
        else:
            surfaces = upload_surfaces(grid.device, colour, coverage, radius, grid.margin_px, grid.over, farthest=farthest)
            self._rays = LayeredRays(surfaces, *args)
        self._spots = None if lights is None or not len(lights.rows) else self._light_spots(lights, window, grid)
        self._unhidden = None if self._spots is None else self._spots.unhidden()

    def _light_spots(self, lights: SmallLights, window: Window, grid: "Grid") -> LightSpots:
        pairs, shares = light_pairs(lights, self._pupil, window, grid.margin_px, grid.over, _start(grid.optics))
        optics, defocus = grid.optics, _defocus_of(grid.optics)
        block = np.array(optics.cfa.block(window.x, window.y))
        y, x = np.divmod(pairs[:, 0], window.width)
        excess = lights.excess[block[y % 2, x % 2], pairs[:, 1]]
        open_ = open_share(defocus.eyes, window, pairs[:, 0])
        lost = self._rays.lights_lost(lights.table(), self._pupil)
        return LightSpots(window.height * window.width, pairs, shares, excess, open_, lost)

    def sample(self, rays: RaySet, places: np.ndarray) -> np.ndarray:
        """Mean light of some photosites (n,), by a set of rays."""
        if self._motion is not None:
            return self._sample_moving(rays, places, self._motion)
        light = self._rays.sample(_points(rays.rays, rays.seed, self._pupil, self._start), places).astype(np.float64)
        if self._spots is None or self._unhidden is None:
            return light
        points = _points(max(rays.rays // RAYS_PER_LIGHT_RAY, 1), rays.seed, None, self._start)
        return light + self._unhidden[places] - self._spots.lost_light(points, places, rays.doubling == 0)

    def _sample_moving(self, rays: RaySet, places: np.ndarray, motion: JointMotion) -> np.ndarray:
        """`sample` where images move: cell by cell, over which shifts are bilinear."""
        points = _points(rays.rays, rays.seed, self._pupil, self._start, timed=True)
        y, x = np.divmod(places, self._window.width)
        cells = motion.turned_cells(*LEAST_CELL, RAY_CELL_PX)
        cell, middles = motion.cells_of(self._window.x + x, self._window.y + y, cells)
        _, first, index = np.unique(cell, axis=1, return_index=True, return_inverse=True)
        light = np.empty(len(places))
        for number, one in enumerate(first):
            own, middle = np.flatnonzero(index.reshape(-1) == number), (float(middles[one, 0]), float(middles[one, 1]))
            light[own] = self._rays.sample(move_rays(points, motion, middle, cells), places[own], middle)
        return light


@dataclass
class Grid:
    """The scene's layers on `over` x `over` samples per photosite, with a margin.

    A scene finer than the photosites has samples that divide its pixels, up to `Accuracy.ray_samples` per photosite and axis;
    where none do, it has the most. So has a scene of fewer pixels than photosites: a sample is the mean of its bilinear light.
    Where each photosite has a pixel of its own, that is the only sample; where pixels lie between photosites, which is so where
    they move, samples are parts of even squares.
    """

    optics: OpticsPlan
    device: Device
    planes: list[Buffer]
    aside_px: int = 0  # from which rays start, beyond a photosite

    def __post_init__(self) -> None:
        defocus, projection = _defocus_of(self.optics), self.optics.projection
        self.margin_px = defocus.reach_px + math.ceil(0.5 * projection.low_pass_px) + self.aside_px
        most = self.optics.accuracy.ray_samples
        divides = 1 if projection.has_own_pixels else projection.whole_pixels(range(2, most + 1)) or most
        self.over = most if projection.is_bilinear else divides
        is_square = not projection.is_bilinear and self.over > 1
        self._projection = replace(projection, nearest=projection.nearest or is_square)
        self.radii = [self.device.upload(px) if isinstance(px, np.ndarray) else px for px in defocus.radii_px]

    def band(self, window: Window) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Colour (layers, channels, rows, columns), coverage and signed radius (layers, rows, columns) of a window."""
        channels, over = self.optics.channels, self.over
        size = [(side + 2 * self.margin_px) * over for side in (window.height, window.width)]
        layout, aside = InterleavedColumns.holding(over, *size), map(_defocus_of(self.optics).aside_px, range(len(self.planes)))
        origins = [(window.x - self.margin_px + right, window.y - self.margin_px + down) for right, down in aside]
        light = np.stack([self._light(planes, layout, at) for planes, at in zip(self.planes, origins, strict=True)])
        radius = np.stack([self._radius(px, layout, at) for px, at in zip(self.radii, origins, strict=True)])
        light, radius = light[..., : size[1]], radius[..., : size[1]]
        # Means of a coverage of 1 may be rounded to more.
        covered = np.minimum(light[:, channels], 1.0) if light.shape[1] > channels else np.ones_like(light[:, 0])
        return light[:, :channels], covered, radius

    def _light(self, planes: Buffer, layout: InterleavedColumns, origin: tuple[int, int]) -> np.ndarray:
        count = self.optics.channels + self.optics.has_coverage
        sampled = self.device.empty(layout.shape(count), np.float32)
        project_planes(self.device, self._projection, planes, count, sampled, 0, layout, origin)
        return layout.decode(self.device.download(sampled, layout.shape(count), np.float32))

    def _radius(self, radius: Buffer | float, layout: InterleavedColumns, origin: tuple[int, int]) -> np.ndarray:
        if isinstance(radius, float | int):
            return np.full((layout.rows, layout.column_sets * layout.set_columns), radius, np.float32)
        found = self.device.empty(layout.shape(1), np.float32)
        project_radius(self.device, self.optics.radius_projection, radius, found, 0, layout, origin)
        return layout.decode(self.device.download(found, layout.shape(1), np.float32))[0]


def _defocus_of(optics: OpticsPlan) -> Defocus:
    """The planned blur, without which this pass does not run."""
    assert optics.defocus is not None
    return optics.defocus
