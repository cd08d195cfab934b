"""Edges of layers that shift apart within photosites, against exact sums of even squares in float64."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.layer_truth import exact_layers
from helpers.moving_frame import moving_light, plan_moving, rolling, without_edges
from helpers.scene_builders import band_scene

from simulator.device import open_device
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_samples import moving_samples, sample_count
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.swept_mosaic import swept_planes
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

LENS, TIME_S = ThinLens(50.0, 8.0, focus_distance_m=2000.0, cos4=False, transmittance=0.015), 0.01  # some 2000 e-
WIDTH, HEIGHT = 140, 18  # two spans of a row
WAYS = (4.3, 1.1), (-2.2, 3.7), (0.7, -2.1), None


def noise_shot(scale: float, ways_px, cfa="MONO", holes=None, lens=LENS, **camera) -> Shot:
    """Layers of noise, all but the last with holes, that move by ways in the exposure [px of the scene]; None: at rest.

    holes: coverage (layers, height, width); None: squares of 0 or 1 at random.
    """
    height, width, count = round(HEIGHT * scale), round(WIDTH * scale), len(ways_px)
    rng = np.random.default_rng(3)
    light = rng.random((count, height, width)).astype(np.float32)
    if holes is None:
        small = np.round(rng.random((count - 1, height // 5 + 1, width // 5 + 1)))
        holes = np.kron(small, np.ones((5, 5)))[:, :height, :width]
    holes, bands = holes.astype(np.float32), np.ones(1) if cfa == "MONO" else np.array([1.0, 0.7, 0.4])
    planes = [(light[n] * (holes[n] if n + 1 < count else 1.0))[..., None] * bands for n in range(count)]
    covers = [*holes, None]
    behind = tuple(Layer(planes[n].astype(np.float32), 2000.0 + 0.1 * n, covers[n]) for n in range(1, count))
    scene = band_scene(planes[0], 2000.0, coverage=covers[0], behind=behind)
    moves = {n: LayerMotion(tuple(Speed(way / TIME_S, "px/s") for way in own)) for n, own in enumerate(ways_px) if own}
    own = small_camera(WIDTH, HEIGHT, cfa=cfa, pixel_pitch_um=40.0, **camera)
    return Shot(scene, lens, Exposure(TIME_S), own, motion=Motion(layers=moves), tolerance=0.1)


def exact(shot: Shot, planned: Plan, ways_px, instants, opens_s=None) -> np.ndarray:
    scene, projection = shot.scene.load(), planned.optics.projection
    layers = [(one.planes[..., 0].astype(float), one.coverage) for one in scene.layers]
    opens = np.zeros(HEIGHT) if opens_s is None else opens_s / TIME_S
    side = projection.open_side if projection.is_fine else 1.0
    return exact_layers(layers, projection, ways_px, opens, WIDTH, instants, side)


def sigmas(planned: Plan, found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    accuracy = planned.optics.accuracy
    per_light = accuracy.electrons_per_radiance * float(planned.optics.weights.max())
    return per_light * np.abs(found - truth) / np.sqrt(per_light * truth + accuracy.read_noise_e**2)


SCALED = [(1.0, 3), (1.3, 2), (1.5, 4), (2.0, 3), (4.0, 2)]  # each scale and each number of layers


@pytest.mark.parametrize(
    ("scale", "layers"), [*SCALED[:2], *(pytest.param(*one, marks=pytest.mark.slow) for one in SCALED[2:4]), SCALED[4]]
)
def test_edges_within_photosites_are_composited_exactly_at_each_instant(scale, layers):
    ways_px = (*WAYS[: layers - 1], WAYS[layers - 1] if layers < 4 else None)
    shot = noise_shot(scale, ways_px)
    planned = plan_moving(shot)
    optics = planned.optics
    assert optics.motion.method == "swept" and optics.mixes_edges()
    truth = exact(shot, planned, ways_px, optics.motion.path.borders(optics.cell_instants))
    assert np.abs(moving_light(planned) - truth).max() < 5e-6
    assert sigmas(planned, moving_light(without_edges(planned)), truth).max() > 1.0


@pytest.mark.parametrize("share", [0.05, 0.2, 1.0])
@pytest.mark.parametrize("scale", [1.0, 1.5, 2.6])
def test_the_tolerance_is_kept_at_hard_edges_over_fine_detail(scale, share):
    ways_px = tuple((share * x, share * y) for x, y in WAYS[:2])
    shot = noise_shot(scale, ways_px)
    planned = plan_moving(shot)
    truth = exact(shot, planned, ways_px, 2 * planned.optics.motion.count)
    found = float(np.quantile(sigmas(planned, moving_light(planned), truth), 0.999))
    assert found < planned.error_budget.predicted_sigma < 1.001 * shot.tolerance and not planned.error_budget.warnings()


def test_lines_that_open_one_after_the_other_and_a_fill_factor():
    ways_px, lines = WAYS[:2], rolling(HEIGHT, TIME_S, 3e-4)
    shot = noise_shot(1.5, ways_px, fill_factor=0.5)
    planned = plan_moving(shot, lines)
    motion = planned.optics.motion
    truth = exact(shot, planned, ways_px, motion.path.borders(planned.optics.cell_instants), lines.opens_s)
    assert planned.optics.projection.open_side < 0.8 and np.abs(moving_light(planned) - truth).max() < 5e-6


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
@pytest.mark.parametrize("scale", [pytest.param(1.0, marks=pytest.mark.slow), 1.5])
def test_a_crop_has_the_bits_of_the_frame_and_a_colour_those_of_its_plane(scale, row_s):
    holes = np.zeros((1, round(HEIGHT * scale), round(WIDTH * scale)))
    holes[:, 9:14, 20:33] = 1.0  # means are composited elsewhere
    lines = rolling(HEIGHT, TIME_S, row_s)
    planned = plan_moving(noise_shot(scale, ((2.1, 1.1), (-1.2, 1.7)), "RGGB", holes), lines)
    assert planned.optics.mixes_edges() and planned.optics.mixed_share() < 1.0 or scale > 1.0
    found, window = moving_light(planned), Window(17, 5, 90, 10)
    part = replace(planned, optics=replace(planned.optics, window=window))
    assert np.array_equal(moving_light(part), found[5:15, 17:107])
    alone = moving_light(replace(planned, optics=planned.optics.in_one_color(2)))
    assert np.array_equal(found[1::2, 1::2], alone[1::2, 1::2])


def test_a_single_edge_in_a_small_part_of_the_frame_is_composited_exactly_where_it_passes():
    holes = np.zeros((1, HEIGHT, WIDTH))
    holes[0, :9, :40] = 1.0
    ways_px = (0.6, 0.3), (-0.4, 0.8)
    shot = noise_shot(1.0, ways_px, holes=holes)
    planned = plan_moving(shot)
    assert planned.optics.sweeps_shifted_layers() and 0.0 < planned.optics.mixed_share() < 1.0
    truth = exact(shot, planned, ways_px, planned.optics.motion.path.borders(planned.optics.cell_instants))
    assert np.abs(moving_light(planned) - truth).max() < 5e-5  # elsewhere there are fewer instants
    assert np.abs(moving_light(without_edges(planned)) - truth).max() > 0.02


def test_even_coverage_and_even_light_behind_need_no_cells():
    veil = plan_moving(noise_shot(1.0, WAYS[:2], holes=np.full((1, HEIGHT, WIDTH), 0.4)))
    assert veil.optics.composites_cells() and not veil.optics.mixes_edges()
    shot = noise_shot(1.0, WAYS[:2])
    near = shot.scene.load()
    (far,) = near.behind
    wall = replace(near, behind=(replace(far, planes=np.full_like(far.planes, 0.5)),))
    planned = plan_moving(replace(shot, scene=type(shot.scene)(wall)))
    assert planned.optics.composites_cells() and not planned.optics.mixes_edges()


@pytest.mark.parametrize("over", [1, 2])
def test_samples_of_all_colours_are_composited_exactly(over):
    """As before a blur that is the same at each instant; a sample smaller than a pixel sees one."""
    ways_px = (3.1, 1.3), (-1.2, 2.7)
    shot = noise_shot(1.5, ways_px, "RGGB")
    optics = plan_moving(shot).optics
    device, scene = open_device(), shot.scene.load()
    planes = []
    for layer in scene.layers:
        covered = np.ones(layer.planes.shape[:2], np.float32) if layer.coverage is None else layer.coverage
        planes.append(device.upload(np.concatenate([np.moveaxis(layer.planes, -1, 0), covered[None]]).astype(np.float32)))
    window = Window(4, 2, 100, 12)
    found = swept_planes(optics, device, planes, window, over)
    light = device.download(found, (3, over * window.height, over * window.width), np.float32)
    own = replace(optics.projection, scale=1.5 / over)
    layers = [(one.planes[..., 1].astype(float), one.coverage) for one in scene.layers]
    borders, size = optics.motion.path.borders(optics.cell_instants), over * np.array([HEIGHT, WIDTH])
    truth = exact_layers(layers, own, ways_px, np.zeros(size[0]), size[1], borders, side=max(1.0, over / 1.5))
    there = truth[over * 2 : over * 14, over * 4 : over * 104]
    assert optics.mixes_edges(over) and np.abs(light[1] - there).max() < 5e-6


@pytest.mark.parametrize("row_s", [0.0, pytest.param(3e-4, marks=pytest.mark.slow)], ids=["global", "rolling"])
def test_layers_out_of_focus_are_composited_exactly_at_points_of_aperture_and_time(row_s):
    """The same points in float64, each of which displaces a layer."""
    ways_px, shot = WAYS[:2], noise_shot(1.0, WAYS[:2])
    near = shot.scene.load()
    (far,) = near.behind
    scene = type(shot.scene)(replace(near, depth_m=1.85, behind=(replace(far, depth_m=2.1),)))
    lens = ThinLens(50.0, 1.4, 2.0, cos4=False, transmittance=4.7e-4)
    planned = plan_moving(replace(shot, scene=scene, lens=lens), rolling(HEIGHT, TIME_S, row_s))
    optics, blur = planned.optics, planned.optics.moving_blur
    assert optics.samples_shifted_layers and optics.layer_edges.are_seen
    points = moving_samples(blur.pupil, int(sample_count(np.array([blur.largest_px]), blur)[0]), 1).astype(np.float64)
    layers = [(one.planes[..., 0].astype(float), one.coverage) for one in near.layers]
    truth, opens = np.zeros((HEIGHT, WIDTH)), row_s / TIME_S * np.arange(HEIGHT)
    for right, below, share in points[:, [0, 1, 5]]:
        aside = np.outer(blur.radii_px, [right, below])
        times = opens + share - 0.5
        truth += exact_layers(layers, optics.projection, ways_px, times, WIDTH, 1, aside=aside) / len(points)
    assert np.abs(moving_light(planned) - truth).max() < 5e-6
    assert sigmas(planned, moving_light(without_edges(planned)), truth).max() > 0.5


def test_what_edges_cost_is_predicted():
    ways_px = (7.0, 0.0), (-7.0, 0.0)
    shots = noise_shot(1.0, ways_px, holes=np.full((1, HEIGHT, WIDTH), 0.4)), noise_shot(1.0, ways_px)
    costs = [next(one for one in plan(shot).passes if one.name == "motion") for shot in shots]
    assert costs[1].cost_ms > costs[0].cost_ms and "% of the picture" in costs[1].method


@pytest.mark.parametrize(("scale", "share"), [(1.0, 0.1), (1.0, 1.0), (1.0, 2.5), (1.5, 1.0), (1.5, 2.5), (2.6, 2.5)])
def test_what_means_over_photosites_lack_is_measured(scale, share):
    ways_px = tuple((share * x, share * y) for x, y in WAYS[:2])
    shot = noise_shot(scale, ways_px)
    planned = plan_moving(shot)
    optics = planned.optics
    assert optics.sweeps_shifted_layers() and optics.mixes_edges()
    truth = exact(shot, planned, ways_px, optics.motion.path.borders(optics.motion.count))
    lacked = np.quantile(sigmas(planned, moving_light(without_edges(planned)), truth), [0.99, 0.999])
    assert shot.tolerance < lacked[0] < optics.lacked_sigma() < 2.0 * lacked[1]


def test_where_means_over_photosites_lack_nothing_they_are_composited():
    """A photosite sees one pixel of a picture at rest, whatever moves before it."""
    still = plan_moving(noise_shot(1.0, (WAYS[0], None)))
    assert still.optics.layer_edges.are_seen and still.optics.lacked_sigma() < 1e-6 and not still.optics.mixes_edges()
    truth = exact(noise_shot(1.0, (WAYS[0], None)), still, (WAYS[0], None), 512)
    assert np.quantile(sigmas(still, moving_light(still), truth), 0.999) < 0.1
    assert not still.error_budget.warnings()


def test_layers_out_of_focus_on_a_long_way_lack_little_which_is_told():
    shot = noise_shot(1.0, ((70.0, 9.0), None))
    near = shot.scene.load()
    (far,) = near.behind
    scene = type(shot.scene)(replace(near, depth_m=1.4, behind=(replace(far, depth_m=3.2),)))
    planned = plan_moving(replace(shot, scene=scene, lens=ThinLens(50.0, 1.4, 2.0, cos4=False, transmittance=4.7e-5)))
    optics = planned.optics
    assert optics.samples_shifted_layers and optics.layer_edges.are_seen and not optics.mixes_points
    exactly = replace(planned, optics=replace(optics, tolerance=0.0))
    assert exactly.optics.mixes_points
    lacked = np.quantile(sigmas(planned, moving_light(planned), moving_light(exactly)), 0.999)
    assert 0.01 < lacked < optics.lacked_sigma() < 3.0 * lacked
