"""Rays to the samples of deep pictures, against closed forms and against rays that are followed one by one in float64."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_error import z_scores
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import FixedScene, band_scene
from scipy.stats import qmc

from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.lens.distortion import Distortion
from simulator.optics.ray_reference.deep_rays import DeepPicture
from simulator.optics.ray_reference.layered_rays import ray_samples
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.compositing import deep_pixels_of, flatten_layers
from simulator.scene.deep import DeepDepth, DeepScene
from simulator.scene.deep_pixels import DeepPixels, surface_slopes
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Window

ROWS, COLUMNS = 40, 60  # scene pixels, one per photosite
Sample = tuple[float, float, float, float]  # colour times alpha, alpha, radius at the near and at the far end [px]


def deep_scene(pixels: list[list[Sample]]) -> Scene:
    """Grey deep picture of ROWS x COLUMNS pixels; its layer is the nearest sample and takes no part."""
    samples = np.array([sample for pixel in pixels for sample in pixel])
    near_m, far_m = (1.0 / np.maximum(1.0 / np.atleast_1d(depth_of(radii)), 1e-9) for radii in samples[:, 2:].T)
    far_m = np.where(samples[:, 3] > samples[:, 2], far_m, near_m)
    starts = np.cumsum([0, *(len(pixel) for pixel in pixels)])
    planes, alpha = samples[:, :1].astype(np.float32), samples[:, 1].astype(np.float32)
    deep = DeepPixels(starts, COLUMNS, planes, alpha, near_m, far_m)
    front = np.array([pixel[0][0] if pixel else 0.0 for pixel in pixels]).reshape(ROWS, COLUMNS)
    return dataclasses.replace(band_scene(front, float(near_m.max())).load(), deep=deep)


def planned_frame(scene: Scene, electrons: float = 2000.0) -> Plan:
    camera = small_camera(COLUMNS, ROWS)
    first = plan(Shot(FixedScene(scene), LENS, Exposure(1e-3), camera, tolerance=0.0))
    per_radiance = first.optics.accuracy.electrons_per_radiance * first.optics.weights.sum()
    time_s = 1e-3 * electrons / per_radiance
    return plan(Shot(FixedScene(scene), LENS, Exposure(time_s), camera, tolerance=0.0))


def rays_light(planned: Plan, window: Window) -> np.ndarray:
    """Radiance of a window of the frame."""
    device = open_device()
    planned = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=window))
    mosaic = expose(measure(planned, device), device)
    return device.download(mosaic, (window.height, window.width), np.float32) / planned.optics.weights.sum()


def below(t: np.ndarray) -> np.ndarray:
    """Share of the pupil left of t."""
    t = np.clip(t, -1.0, 1.0)
    return 0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / math.pi


def test_a_half_plane_with_alpha_before_a_wall_is_the_closed_form():
    """Light of the wall times 1 - alpha A, A the share of the pupil that the half-plane fills; mean over the photosite."""
    near, far, alpha, edge = -6.0, 5.0, 0.6, 30
    pixels = [
        ([(0.2 * alpha, alpha, near, near)] if column < edge else []) + [(1.0, 1.0, far, far)]
        for _ in range(ROWS)
        for column in range(COLUMNS)
    ]
    window = Window(18, 18, 24, 4)
    covered = alpha * below((edge - (np.arange(18, 42)[:, None] + (np.arange(64) + 0.5) / 64)) / abs(near)).mean(axis=1)
    truth = np.tile(0.2 * covered + 1.0 - covered, (4, 1))
    found = rays_light(planned_frame(deep_scene(pixels)), window)
    assert np.abs(z_scores(found, truth, 2000.0)).max() < 0.15


@pytest.mark.parametrize("slope", [(0.0, 0.05), (0.12, -0.2), (0.35, 0.0)])
def test_a_tilted_plane_of_cards_has_no_cracks(slope):
    """Grey before black: light that passes between cards would be missing. A third of a photosite per photosite is a cliff."""
    y, x = np.mgrid[:ROWS, :COLUMNS] - np.array([20.0, 30.0])[:, None, None]
    radius = 2.0 + slope[0] * y + slope[1] * x
    pixels = [[(0.7, 1.0, s, s)] for s in radius.ravel().tolist()]
    found = rays_light(planned_frame(deep_scene(pixels)), Window(24, 16, 12, 8))
    assert np.abs(found / 0.7 - 1.0).max() < 2e-4


def test_a_tilted_texture_is_met_where_the_plane_is():
    """x' = x + u s(x) / (1 - slope u) for a plane; cards of columns of one colour, quadrature over the pupil in float64."""
    slope, rng = 0.15, np.random.default_rng(4)
    stripes = rng.uniform(0.2, 1.0, COLUMNS)
    radius = 2.5 + slope * (np.arange(COLUMNS) + 0.5 - 30.0)
    pixels = [[(stripes[c], 1.0, radius[c], radius[c])] for _ in range(ROWS) for c in range(COLUMNS)]
    window = Window(24, 18, 12, 2)
    points = qmc.Sobol(3, seed=2).random_base2(18)
    u_x = np.sqrt(points[:, 0]) * np.cos(2.0 * np.pi * points[:, 1])
    truth = []
    for column in range(24, 36):
        x = column + points[:, 2]
        met = x + u_x * (2.5 + slope * (x - 30.0)) / (1.0 - slope * u_x)
        truth.append(stripes[np.floor(met).astype(int)].mean())
    found = rays_light(planned_frame(deep_scene(pixels)), window)
    assert np.abs(z_scores(found, np.tile(truth, (2, 1)), 2000.0)).max() < 0.15


def test_fog_lets_through_what_its_thickness_does():
    """Fog of one extent everywhere: a ray crosses all of its depths wherever it goes, so even light stays even."""
    pixels = [[(0.3, 0.5, -4.0, 3.0), (0.8, 1.0, 6.0, 6.0)]] * (ROWS * COLUMNS)
    found = rays_light(planned_frame(deep_scene(pixels)), Window(24, 16, 8, 4))
    assert np.abs(found / (0.3 + 0.5 * 0.8) - 1.0).max() < 1e-4


@pytest.mark.parametrize("alpha", [1e-9, 1.4e-45])
def test_fog_of_a_tiny_alpha_keeps_its_light(alpha):
    """Found by `make stress`: 1 - e^-x lost all light where x is below an ulp of 1, and of denormals it is rounded."""
    pixels = [[(0.3, alpha, -0.3, 0.2), (0.1, 1.0, 4.0, 4.0)]] * (ROWS * COLUMNS)
    found = rays_light(planned_frame(deep_scene(pixels)), Window(24, 16, 8, 4))
    assert np.abs(found / 0.4 - 1.0).max() < 1e-5


def test_layers_too_steep_to_be_met_once_are_met_as_cards():
    """The nearer of two layers has a step in depth inside it: rays may meet both of its parts, or neither."""
    step = np.where(np.arange(COLUMNS) < 30, -5.0, 4.0) * np.ones((ROWS, 1))
    layers = [
        Layer(np.full((ROWS, COLUMNS, 1), 0.2, np.float32), depth_of(step), np.full((ROWS, COLUMNS), 0.5, np.float32)),
        Layer(np.full((ROWS, COLUMNS, 1), 0.8, np.float32), depth_of(6.0)),
    ]
    scene = band_scene(layers[0].planes, layers[0].depth_m).load()
    scene = dataclasses.replace(scene, coverage=layers[0].coverage, behind=(layers[1],))
    found = rays_light(planned_frame(scene), Window(18, 18, 24, 4))
    far = np.r_[0:4, 20:24]  # beyond the reach of the step
    assert np.abs(found[:, far] / (0.2 + 0.5 * 0.8) - 1.0).max() < 1e-5
    # Rays u with x - 5 u < 30 meet the near part, those with x + 4 u >= 30 the far one: u above one bound, or above another.
    x = np.arange(18, 42)[:, None] + (np.arange(64) + 0.5) / 64
    near, last = 1.0 - below((x - 30) / 5.0), 1.0 - below((30 - x) / 4.0)
    both = np.minimum(near, last)
    none = 1.0 - np.maximum(near, last)
    truth = none * 0.8 + (1.0 - both - none) * (0.2 + 0.5 * 0.8) + both * (0.2 + 0.5 * 0.2 + 0.25 * 0.8)
    assert np.abs(z_scores(found, np.tile(truth.mean(axis=1), (4, 1)), 2000.0)).max() < 0.15


def test_layers_that_pass_through_one_another_lie_in_the_written_order():
    """The first layer stands before the second on the left and behind it on the right: rays meet it first on both sides.

    Between the two they meet none of its parts, and see the second, or both. Of both the nearer one lies above.
    """
    step = np.where(np.arange(COLUMNS) < 30, -5.0, 6.0) * np.ones((ROWS, 1))
    half = np.full((ROWS, COLUMNS), 0.5, np.float32)
    first = Layer(np.full((ROWS, COLUMNS, 1), 0.2, np.float32), depth_of(step), half)
    second = Layer(np.full((ROWS, COLUMNS, 1), 0.8, np.float32), depth_of(2.0))
    scene = band_scene(first.planes, first.depth_m).load().with_layers((first, second))
    found = rays_light(planned_frame(scene), Window(18, 18, 24, 4))
    x = np.arange(18, 42)[:, None] + (np.arange(64) + 0.5) / 64
    near, far = 1.0 - below((x - 30) / 5.0), 1.0 - below((30 - x) / 6.0)  # shares of the pupil that meet each part
    once, twice = 0.2 + 0.5 * 0.8, 0.2 + 0.5 * 0.2 + 0.25 * 0.8
    both, none = np.minimum(near, far), 1.0 - np.maximum(near, far)
    truth = none * 0.8 + (1.0 - both - none) * once + both * twice
    assert np.abs(z_scores(found, np.tile(truth.mean(axis=1), (4, 1)), 2000.0)).max() < 0.15


def test_a_layer_too_steep_to_be_met_once_keeps_light_with_alpha_0():
    """A glow of 0.5 with a step in depth before a wall of 0.5: their sum, beyond the reach of the step."""
    step = np.where(np.arange(COLUMNS) < 30, -5.0, 4.0) * np.ones((ROWS, 1))
    light = np.full((ROWS, COLUMNS, 1), 0.5, np.float32)
    glow = Layer(light, depth_of(step), np.zeros((ROWS, COLUMNS), np.float32))
    scene = band_scene(light).load().with_layers((glow, Layer(light, depth_of(6.0))))
    found = rays_light(planned_frame(scene), Window(18, 18, 24, 4))
    assert np.abs(found[:, np.r_[0:4, 20:24]] - 1.0).max() < 1e-5


def test_a_crop_has_the_bits_of_the_frame():
    rng = np.random.default_rng(8)
    drawn = rng.uniform(0.1, 3.0, (ROWS * COLUMNS, 2)).tolist()
    pixels = [[(0.4 * c, 0.5, s, s), (c, 1.0, s + 4.0, s + 4.0)] for c, s in drawn]
    planned = planned_frame(deep_scene(pixels), 50.0)
    whole, part = rays_light(planned, Window(20, 10, 16, 12)), rays_light(planned, Window(23, 14, 7, 5))
    np.testing.assert_array_equal(part, whole[4:9, 3:10])


def test_samples_of_one_surface_are_linked_and_those_of_others_are_not():
    """Two parallel tilted sheets two photosites apart, a lone sample, and a volume between them."""
    width = 5
    rows = [[0.1 * column, 2.0 + 0.1 * column] for column in range(width)]
    radius = np.array([*rows[0], *rows[1], *rows[2], 9.0, *rows[3], *rows[4]])
    starts = np.array([0, 2, 4, 7, 9, 11])
    near = np.ones(len(radius))
    far = near + (radius == 9.0)
    slopes = surface_slopes(DeepPixels(starts, width, np.ones((11, 1)), np.ones(11), near, far), radius, 0.3)
    assert np.allclose(slopes[0][radius < 9.0], 0.1) and slopes[0][radius == 9.0] == 0.0 and not slopes[1].any()


def test_surfaces_of_layers_are_linked_within_each():
    """Two planes that cross: the nearest radius beside a sample of one may be the other's."""
    y, x = np.mgrid[:6, :8]
    radii = np.stack([2.0 + 0.2 * x + 0.1 * y, 3.0 - 0.2 * x + 0.1 * y])
    layers = tuple(Layer(np.ones((6, 8, 1), np.float32), depth_of(radius)) for radius in radii)
    slopes = surface_slopes(deep_pixels_of(layers), radii.ravel(), 0.3).reshape(2, 2, 6, 8)
    np.testing.assert_allclose(slopes[0], np.array([0.2, -0.2])[:, None, None] * np.ones((6, 8)), atol=1e-12)
    np.testing.assert_allclose(slopes[1], 0.1, atol=1e-12)


DEEP_PICTURES = Path(__file__).parents[4] / "shared" / "data" / "openexr-images"


class OneByOne:
    """Rays through a deep picture in float64 NumPy: pixel by pixel along the ray, sample by sample, cards in their planes."""

    def __init__(self, planned: Plan) -> None:
        self.optics, self.deep = planned.optics, planned.optics.scene.deep
        self.near, self.far = planned.optics.deep_blur.near_px, planned.optics.deep_blur.far_px
        self.slopes = surface_slopes(self.deep, self.near, 0.6 / self.optics.projection.scale)
        self.colour = self.deep.planes.astype(float) @ self.optics.weights

    def light(self, x: int, y: int, channel: int, rays: np.ndarray) -> float:
        return float(np.mean([self.ray(x + ray[0], y + ray[1], ray[2], ray[3], channel) for ray in rays.astype(float)]))

    def ray(self, x: float, y: float, u: float, v: float, channel: int) -> float:
        geometry = self.optics.projection
        px, py = geometry.offset_x + geometry.scale * x, geometry.offset_y + geometry.scale * y
        dx, dy = geometry.scale * u, geometry.scale * v
        low, high = self.near.min() - 2.0, self.far.max() + 2.0
        cuts = [low, high]
        for start, step in ((px, dx), (py, dy)):
            ends = np.sort([start + low * step, start + high * step])
            cuts += [(line - start) / step for line in range(math.ceil(ends[0]), math.floor(ends[1]) + 1)]
        cuts, light, through = sorted(cuts), 0.0, 1.0
        for a, b in zip(cuts[:-1], cuts[1:], strict=True):
            column, row = math.floor(px + 0.5 * (a + b) * dx), math.floor(py + 0.5 * (a + b) * dy)
            row_in, column_in = np.clip(row, 0, geometry.scene_height - 1), np.clip(column, 0, geometry.scene_width - 1)
            pixel = row_in * geometry.scene_width + column_in
            for k in range(self.deep.starts[pixel], self.deep.starts[pixel + 1]):
                assert self.near[k] == self.far[k], "volumes are tested by closed forms"
                gx, gy = self.slopes[:, k]
                met = (self.near[k] + gx * (px - column - 0.5) + gy * (py - row - 0.5)) / (1.0 - gx * dx - gy * dy)
                if a <= met < b:
                    light += through * self.colour[k, channel]
                    through *= 1.0 - float(self.deep.alpha[k])
        return light


@pytest.mark.parametrize("name", [*(pytest.param(name, marks=pytest.mark.slow) for name in ("Balls", "Leaves")), "Trunks"])
def test_openexrs_deep_pictures_are_those_of_rays_followed_one_by_one(name):
    path = DEEP_PICTURES / f"{name}.exr"
    if not path.is_file():
        pytest.skip(f"{path} is not there: OpenEXR's pictures are no part of the repository")
    median = float(np.median(DeepScene(path, 1000.0, negative="clip").load().deep.near_m))
    scene = DeepScene(path, 1000.0, negative="clip", depth=DeepDepth(scale=2.0 / median)).load()
    height, width = scene.planes.shape[:2]
    largest_px = float(np.abs(LENS.blur_radius_um(scene.deep.near_m)).max()) / 5.0
    lens = dataclasses.replace(LENS, f_number=LENS.f_number * largest_px / 12.0)
    shot = Shot(FixedScene(scene), lens, Exposure(1e-2), small_camera(width, height, "RGGB"), tolerance=0.0)
    planned = plan(shot)
    seen = np.abs(np.diff(flatten_layers(scene).planes.sum(axis=2)))[20:-20, 20:-20]
    top, left = np.unravel_index(seen.argmax(), seen.shape)  # where a pinhole sees the hardest edge
    window, points = Window(int(left) + 18, int(top) + 18, 6, 4), ray_samples(256, patterns=1)
    optics, block = planned.optics, planned.optics.cfa.block(window.x, window.y)
    picture = DeepPicture(open_device(), optics.scene.deep, optics.deep_blur, optics.weights, optics.projection)
    found = picture.sample(points, window, block, np.arange(24)).reshape(4, 6)
    tracer, truth = OneByOne(planned), np.zeros((4, 6))
    for (y, x), _ in np.ndenumerate(truth):
        truth[y, x] = tracer.light(window.x + x, window.y + y, block[y % 2][x % 2], points[0])
    error = np.abs(found - truth) / np.max(truth)
    # Single precision moves one of 256 rays across a pixel's border now and then.
    assert np.median(error) < 1e-4 and error.max() < 2e-3
    assert np.unique(truth).size == 24


def test_distortion_moves_samples_as_it_moves_layers():
    """One texture at one distance, four pixels per photosite, as layer and as samples; without distortion it lies elsewhere."""
    texture = np.kron(np.random.default_rng(3).uniform(0.2, 1.0, (4, 6)), np.ones((40, 40)))
    scene = band_scene(texture, 0.6).load()
    samples = dataclasses.replace(scene, deep=deep_pixels_of(scene.layers))
    barrel, device = dataclasses.replace(LENS, distortion=Distortion(k1=-0.2)), open_device()
    frames = []
    for one, lens in ((scene, barrel), (samples, barrel), (samples, LENS)):
        shot = Shot(FixedScene(one), lens, Exposure(1e-8), small_camera(60, 40, pixel_pitch_um=300.0), tolerance=0.0)
        planned = plan(shot)
        planned = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=Window(4, 3, 20, 12)))
        mosaic = expose(measure(planned, device), device)
        frames.append(device.download(mosaic, (12, 20), np.float32) / planned.optics.weights.sum())
    layer, deep, straight = frames
    assert np.std(deep - layer) < 0.25 * np.std(straight - layer)
