"""Independent truth: mean electrons of shots that are simple enough for closed forms, or sums ray by ray, in float64 NumPy.

Every photosite's light is the mean over its open area, the pupil and the exposure time of what a straight line meets, layer by
layer. One set of Sobol' points serves all photosites; sets that are scrambled independently tell the standard error. Where one
surface lies upright before the photosites, the mean over the open area is exact, and the points are places in the pupil and
in time alone. Distortion and the path of the camera are those of the plan, in float64: the kernels' geometry is held against
them.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from helpers.area_truth import photosite_means
from scipy.ndimage import map_coordinates
from scipy.stats import qmc

from audit.seen_places import SeenPlaces, radius_px
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan
from simulator.pipeline.scene_loading import load_scene
from simulator.pipeline.shot import Shot

SETS, POINTS = 8, 8192
LAMP_TIMES, MOST_LAMPS = 4.0, 32  # of the brightest light without them; pixels
LAMP_CHORDS, CHORDS_PER_PX = 2048, 400  # least number of chords of the aperture of lamps; and for its radius


@dataclass(frozen=True)
class Truth:
    """Mean electrons (height, width) float64 and their standard error."""

    electrons: np.ndarray
    error: np.ndarray


def is_simple(shot: Shot, planned: Plan) -> bool:
    """Whether this module knows all of the shot: surfaces at one distance each, an ideal lens, and a scene of even squares.

    Of fewer pixels than photosites it knows one surface at rest, and a wall behind a distortion, of as many pixels as well.
    The lens is a pinhole or has a round aperture or blades, and may distort. A low-pass filter makes four spots. Camera and
    layers may move; lines of a rolling shutter are rows.
    """
    optics, lens = planned.optics, shot.lens
    scene = load_scene(shot.scene)
    if not isinstance(lens, ThinLens | Pinhole) or scene.deep is not None:
        return False
    is_wall = not scene.behind and scene.coverage is None
    is_known = _has_one_image(shot, planned) or (is_wall and optics.projection.warp is not None)
    if not optics.projection.is_fine and not (optics.projection.is_bilinear and is_known):
        return False
    plain_lens = not (lens.has_diffraction or lens.pupil.stops or lens.veiling_glare) and lens.psf is None
    plain_lens &= lens.falloff is None and (lens.distortion is None or set(lens.distortion.lateral) == {1.0})
    flat = all(np.ndim(layer.depth_m) == 0 and layer.depth_m is not None for layer in scene.layers)
    motion, exposure = shot.motion, shot.exposure
    moves = motion is None or (motion.vectors is None and (optics.motion is None or optics.motion.path.lines.axis != "columns"))
    return plain_lens and flat and moves and exposure.flash is None and exposure.flicker is None


def exact_means(shot: Shot, planned: Plan) -> Truth | None:
    """Mean electrons of one surface at rest, by the areas of chords of the aperture.

    Its pixels are whole in each photosite, or there are fewer than photosites. None where a shot that `is_simple` is neither.
    """
    if not _has_one_image(shot, planned):
        return None
    optics, camera, pupil = planned.optics, shot.camera, shot.lens.pupil
    scene, projection, window = load_scene(shot.scene), optics.projection, optics.window
    corners = None if pupil.is_round else pupil.corners()
    assert isinstance(scene.depth_m, float | int)
    radius = radius_px(shot.lens, camera.pixel_pitch_um, float(scene.depth_m))
    light = np.moveaxis(scene.planes.astype(np.float64) @ optics.weights.astype(np.float64), -1, 0)
    if projection.is_bilinear:
        inside = _coarse_means(light, shot, planned, radius, corners)[:, window.y :, window.x :]
    else:
        scale = round(projection.scale)
        is_whole = abs(projection.scale - scale) < 1e-9 and projection.offset_x == projection.offset_y == 0.0
        if camera.low_pass_um > 0.0 or not is_whole:
            return None
        margin = math.ceil(abs(radius) * pupil.corner_radius) + 1
        wide = np.pad(light, ((0, 0), *2 * [2 * [margin * scale]]), "edge")
        shape = wide.shape[1] // scale, wide.shape[2] // scale
        pairs = zip(wide, map(lamp_limit, light), strict=True)  # beyond the border a lamp goes on in a row of them
        means = [means_with_lamps(one, shape, radius, camera.fill_factor, limit, corners) for one, limit in pairs]
        inside = np.stack(means)[:, margin + window.y :, margin + window.x :]
    inside = inside[:, : window.height, : window.width]
    found = np.take_along_axis(inside, channels_of(planned)[None], axis=0)[0] * _electrons_per_radiance(shot, planned)
    return Truth(found, np.zeros_like(found))


def _has_one_image(shot: Shot, planned: Plan) -> bool:
    """Whether one surface at rest has the same circle, or polygon, everywhere."""
    pupil, scene = shot.lens.pupil, load_scene(shot.scene)
    is_known = pupil.is_round or pupil.blade_curvature == 0.0
    return is_known and not scene.behind and shot.motion is None and planned.optics.projection.warp is None


def _coarse_means(light: np.ndarray, shot: Shot, planned: Plan, radius: float, corners: np.ndarray | None) -> np.ndarray:
    """Mean radiance of photosites of the whole sensor, (channels, rows, columns), of light between few pixels.

    light: (channels, height, width) radiance of the pixels. Each of the four spots of a low-pass filter sees it by itself.
    """
    camera, projection = shot.camera, planned.optics.projection
    half_px = 0.5 * camera.low_pass_um / camera.pixel_pitch_um
    widest = abs(radius) * (1.0 if corners is None else float(np.hypot(*corners.T).max()))
    beyond = math.ceil((widest + half_px) * projection.scale) + 2
    wide = np.pad(light, ((0, 0), *2 * [2 * [beyond]]), "edge")
    shape, chords = (camera.height_px, camera.width_px), max(LAMP_CHORDS, math.ceil(CHORDS_PER_PX * abs(radius)))
    images = []
    for spot in itertools.product(*2 * [sorted({-half_px, half_px})]):
        first = (
            beyond + offset + away * projection.scale
            for offset, away in zip((projection.offset_y, projection.offset_x), spot, strict=True)
        )
        grid = (projection.scale, *first)
        images.append(photosite_means(wide, shape, radius, camera.fill_factor, chords, corners, grid=grid, is_tent=True))
    return np.asarray(np.mean(images, axis=0))


def lamp_limit(light: np.ndarray) -> float:
    """Light above which pixels of a scene (rows, columns) are lamps."""
    return LAMP_TIMES * float(np.partition(light, -MOST_LAMPS - 1, axis=None)[-MOST_LAMPS - 1])


def means_with_lamps(
    light: np.ndarray,
    shape: tuple[int, int],
    radius: float,
    fill_factor: float,
    limit: float,
    corners: np.ndarray | None = None,
) -> np.ndarray:
    """`photosite_means`, of pixels above a limit from more chords: the rims of their spots show steps between these."""
    is_lamp = light > limit
    means = photosite_means(np.where(is_lamp, 0.0, light), shape, radius, fill_factor, corners=corners)
    widest = 1.0 if corners is None else float(np.hypot(*corners.T).max())
    scale, reach = light.shape[0] // shape[0], math.ceil(abs(radius) * widest) + 1
    chords = max(LAMP_CHORDS, math.ceil(CHORDS_PER_PX * abs(radius)))
    side, spots = 2 * reach + 1, dict[tuple[int, int], np.ndarray]()
    around = np.pad(means, reach)
    for row, column in np.argwhere(is_lamp).tolist():
        place = row % scale, column % scale
        if place not in spots:
            pixel = np.zeros((side * scale, side * scale))
            pixel[reach * scale + place[0], reach * scale + place[1]] = 1.0
            spots[place] = photosite_means(pixel, (side, side), radius, fill_factor, chords, corners)
        top, left = row // scale, column // scale
        around[top : top + side, left : left + side] += light[row, column] * spots[place]
    return around[reach:-reach, reach:-reach]


def channels_of(planned: Plan) -> np.ndarray:
    """Colour plane of each photosite of the window (height, width)."""
    window, block = planned.optics.window, np.array(planned.optics.cfa.block(planned.optics.window.x, planned.optics.window.y))
    y, x = np.mgrid[: window.height, : window.width]
    return block[y % 2, x % 2]


def sum_rays(shot: Shot, planned: Plan, sets: int = SETS, points: int = POINTS) -> Truth:
    """Mean electrons of a shot that `is_simple`."""
    found = np.stack([_one_set(shot, planned, seed, points) for seed in range(sets)])
    return Truth(found.mean(axis=0), found.std(axis=0, ddof=1) / math.sqrt(sets))


def _one_set(shot: Shot, planned: Plan, seed: int, points: int) -> np.ndarray:
    seen, channels = SeenPlaces.of(shot, planned), channels_of(planned)
    layers = [_Surface.of(layer.planes, layer.coverage, planned) for layer in load_scene(shot.scene).layers]
    is_exact = seen.is_upright and len(layers) == 1
    side = math.sqrt(shot.camera.fill_factor)
    area = _AreaMeans(layers[0].light, side * planned.optics.projection.scale) if is_exact else None
    spot_px = 0.5 * shot.camera.low_pass_um / shot.camera.pixel_pitch_um  # from the middle of the four to each, on either axis
    # Draws that are left out would spoil the evenness of the others.
    draws = qmc.Sobol(7, seed=1000 + seed).random(points)
    pupil = np.stack(shot.lens.pupil.map_unit_square(draws[:, 2], draws[:, 3]), axis=-1)
    total = np.zeros(channels.shape)
    for draw, ray in zip(draws, pupil, strict=True):
        across, down = side * (draw[:2] - 0.5) if area is None else (0.0, 0.0)
        right_px = across + math.copysign(spot_px, draw[5] - 0.5)
        down_px = down + math.copysign(spot_px, draw[6] - 0.5)
        light, through = np.zeros(channels.shape), np.ones(channels.shape)
        for number, layer in enumerate(layers):
            at_x, at_y = seen.places(number, right_px, down_px, ray, float(draw[4]))
            if area is not None:
                light = area.means(at_x, at_y, channels)
                break
            if planned.optics.projection.is_bilinear:  # a wall
                light = layer.between(at_x, at_y, channels)
                break
            row, column = layer.pixels(at_x, at_y)
            light += through * layer.light[row, column, channels]
            if layer.coverage is None:
                break
            through = through * (1.0 - layer.coverage[row, column])
        total += light
    return total / points * _electrons_per_radiance(shot, planned)


@dataclass(frozen=True)
class _Surface:
    """Electron radiance (height, width, channels) and coverage (height, width) of a layer, float64; None: everywhere."""

    light: np.ndarray
    coverage: np.ndarray | None

    @classmethod
    def of(cls, planes: np.ndarray, coverage: np.ndarray | None, planned: Plan) -> "_Surface":
        light = planes.astype(np.float64) @ planned.optics.weights.astype(np.float64)
        return cls(light, None if coverage is None else coverage.astype(np.float64))

    def pixels(self, at_x: np.ndarray, at_y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row and column of the squares at places of the scene."""
        height, width, _ = self.light.shape
        return np.clip(np.floor(at_y).astype(int), 0, height - 1), np.clip(np.floor(at_x).astype(int), 0, width - 1)

    def between(self, at_x: np.ndarray, at_y: np.ndarray, channels: np.ndarray) -> np.ndarray:
        """Light of its channel at places of the scene, linear between the middles of pixels."""
        places, planes = [at_y - 0.5, at_x - 0.5], np.moveaxis(self.light, -1, 0)
        found = np.stack([map_coordinates(plane, places, order=1, mode="nearest") for plane in planes])
        return np.asarray(np.take_along_axis(found, channels[None], axis=0)[0])


class _AreaMeans:
    """Exact means of even squares over upright squares of one size at any place, by sums from the corner of the scene."""

    def __init__(self, light: np.ndarray, side: float) -> None:
        self.side, self.size = side, light.shape[:2]
        self.sums = np.pad(light.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0), (0, 0)))

    def means(self, at_x: np.ndarray, at_y: np.ndarray, channels: np.ndarray) -> np.ndarray:
        """Mean around each place, of its channel; beyond its border the scene goes on with the pixels there."""
        half = 0.5 * self.side
        corners = (
            (1.0, at_x + half, at_y + half),
            (-1.0, at_x - half, at_y + half),
            (-1.0, at_x + half, at_y - half),
            (1.0, at_x - half, at_y - half),
        )
        return np.sum([sign * self._sum(x, y, channels) for sign, x, y in corners], axis=0) / self.side**2

    def _sum(self, x: np.ndarray, y: np.ndarray, channels: np.ndarray) -> np.ndarray:
        """Sum from the scene's corner to places: bilinear between those to the corners of pixels, and linear beyond them."""
        height, width = self.size
        column, row = np.clip(np.floor(x), 0, width - 1).astype(int), np.clip(np.floor(y), 0, height - 1).astype(int)
        right, down = x - column, y - row
        upper = (1.0 - right) * self.sums[row, column, channels] + right * self.sums[row, column + 1, channels]
        lower = (1.0 - right) * self.sums[row + 1, column, channels] + right * self.sums[row + 1, column + 1, channels]
        return (1.0 - down) * upper + down * lower


def _electrons_per_radiance(shot: Shot, planned: Plan) -> np.ndarray:
    """Electrons per electron radiance of each photosite: that on the axis times cos^4 of the field angle."""
    lens, camera, window = shot.lens, shot.camera, planned.optics.window
    on_axis = lens.irradiance_per_radiance_sr() * shot.exposure.time_s * camera.pixel_pitch_um**2 * camera.fill_factor
    y, x = np.mgrid[: window.height, : window.width] + 0.5
    dx, dy = x + window.x - 0.5 * camera.width_px, y + window.y - 0.5 * camera.height_px
    tangent2 = (1e-3 * camera.pixel_pitch_um / lens.image_distance_mm) ** 2 * (dx**2 + dy**2)
    return on_axis * (1.0 + tangent2) ** (-2.0 if lens.cos4 else 0.0)
