"""Surfaces that occlude each other, out of focus: against closed forms, the reference path and a ray tracer."""

import dataclasses
import uuid
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest
from helpers.area_truth import means_behind_a_near_surface, means_of_upright_layers
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import LENS, blurred_case, case_plan, executed_case
from helpers.lens_truths import Case, penumbra, slanted_plane, stripes, uniform_layers
from scipy.ndimage import maximum_filter

from simulator.device import Device, Kernel
from simulator.device.kernel_source import kernel_source, read_macros
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_samples import aperture_samples as tile_points
from simulator.optics.defocus.defocus import Method, plan_defocus
from simulator.optics.defocus.radius_slabs import make_slab_lists
from simulator.optics.passes.tile_plan import plan_tiles
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure
from simulator.sensor.camera.camera import Window

RENDERS = Path(__file__).parents[4] / "shared" / "data" / "mitsuba"


def hardest(case: Case, bench) -> Method:
    """The most expensive method that a block of the case's frame gets."""
    chosen = plan_tiles(case_plan(case).optics, bench.device).chosen
    return Method(chosen.blocks.methods[chosen.blocks.computed].max())


def test_each_scene_gets_the_cheapest_method_that_is_right(bench):
    both = uniform_layers(-5.0, 6.0)
    near_sharp = dataclasses.replace(both, radius_px=both.radius_px * [[[0.0]], [[1.0]]])
    hidden = dataclasses.replace(near_sharp, coverage=np.ones_like(both.coverage))
    assert hardest(both, bench) == Method.CORRECTED
    assert hardest(near_sharp, bench) == Method.COMPOSITE
    assert hardest(hidden, bench) == Method.COPY  # what the near side covers costs nothing
    assert hardest(slanted_plane((0.02, 0.03)), bench) == Method.MEAN
    cracked = slanted_plane((0.02, 0.03))
    radius = np.where(np.arange(cracked.radius_px.shape[2]) < 20, cracked.radius_px - 9.0, cracked.radius_px)
    assert hardest(dataclasses.replace(cracked, radius_px=radius), bench) == Method.OCCLUSION


def test_what_the_layers_have_to_do_with_each_other_is_added():
    """Edge and stripes covary over the aperture; laid over one another alone they are wrong by several sigma."""
    case = stripes(-5.1, 6.0, 12.0, 2)
    found = statistics(z_scores(blurred_case(case), case.truth, 2000.0))
    assert found.p99_9 < 0.1 and abs(found.mean) < 0.01
    apart = dataclasses.replace(case, radius_px=case.radius_px * [[[1.0]], [[0.0]]])
    assert statistics(z_scores(blurred_case(apart), case.truth, 2000.0)).p99 > 1.0


def test_a_step_in_depth_of_one_picture_is_that_of_two_layers(bench):
    """A picture whose far side is uniform: beside the near side two layers say the same."""
    rng = np.random.default_rng(2)
    rows, columns, edge = 64, 128, 60
    near = np.arange(columns)[None, :] < edge
    texture = 0.3 + 0.2 * np.cumsum(rng.normal(0, 0.05, (rows, columns)), axis=1)
    colour, radius = np.where(near, texture, 0.8), np.where(near, -6.0, 0.0) * np.ones((rows, 1))
    margin = 10
    whole = np.ones_like(colour)
    layers = np.stack([np.where(near, texture, 0.0), 0.8 * whole])
    coverage = np.stack([near * whole, whole])
    truth = np.zeros((rows - 2 * margin, columns - 2 * margin))
    single = Case("single", colour[None], whole[None], radius[None], truth, margin, 1, False)
    double = Case("double", layers, coverage, np.stack([-6.0 * whole, 0.0 * whole]), truth, margin, 1, False)
    found, expected = blurred_case(single), blurred_case(double)
    beyond = slice(edge - margin, None)  # on the near side only what is seen beside it can stand in
    assert hardest(single, bench) == Method.OCCLUSION
    assert statistics(z_scores(found[:, beyond], expected[:, beyond], 2000.0)).p99 < 0.15


def test_light_does_not_depend_on_the_photosites_of_a_work_item(bench):
    """A GPU's work-item has 2 x 2 of them, a CPU's 256: rays are followed as far in both, and a block sees as many points."""
    rng = np.random.default_rng(8)
    plane = slanted_plane((0.02, 0.03))
    steps = rng.choice([-9.0, -4.0, 0.0, 5.0], (1, 12, 12)).repeat(12, axis=1).repeat(16, axis=2)
    rows, columns = plane.radius_px.shape[1:]
    case = dataclasses.replace(plane, radius_px=plane.radius_px + steps[:, :rows, :columns])
    case = dataclasses.replace(case, colour=rng.uniform(0.1, 1.0, case.colour.shape))
    assert hardest(case, bench) == Method.OCCLUSION
    planned = case_plan(case)
    frame = planned.optics.window
    lights = [
        device.download(expose(measure(planned, device), device), (frame.height, frame.width), np.float32)
        for device in (bench.device, bench.like(span=1).device)
    ]
    np.testing.assert_array_equal(*lights)


@pytest.mark.slow
def test_a_broken_floor_follows_the_reference_path(bench):
    """Two tilted surfaces, one before the other, as layers: the reference's rays meet the same surfaces."""
    rng = np.random.default_rng(6)
    rows, columns, margin = 80, 144, 16
    y, x = np.mgrid[:rows, :columns]
    smooth = rng.normal(0, 1, (2, rows, columns))
    for axis in (1, 2):
        smooth = sum(np.roll(smooth, shift, axis) for shift in (-2, -1, 0, 1, 2)) / 5.0
    light = 0.5 + 0.6 * smooth
    near = (x - 70) ** 2 + (y - 40) ** 2 < 20**2
    coverage = np.stack([near * 1.0, np.ones(near.shape)])
    radius = np.stack([-6.0 + 0.01 * (y - 40), 5.0 + 0.02 * (x - 72)])
    case = Case("floor", np.clip(light, 0.05, None) * coverage, coverage, radius, np.zeros((48, 112)), margin, 1, False)
    surfaces = upload_surfaces(bench.device, case.colour[:, None], coverage, radius, margin)
    points = ray_samples(4096)
    points[..., :2] = 0.5  # both read the surfaces at the photosite's centre: they hold one value per photosite
    rays = sample_lens(bench.device, surfaces, points, Window(0, 0, 112, 48), cells=False)
    expected = bench.device.download(rays, (48, 112), np.float32)
    found = statistics(z_scores(blurred_case(case), expected, 2000.0))
    assert hardest(case, bench) == Method.CORRECTED
    assert found.p99 < 0.3 and abs(found.mean) < 0.02


def test_what_is_skipped_would_change_nothing():
    """Blur circles that stay in their photosite: the frame without the lens blur is that with it, to 0.01 sigma."""
    rng = np.random.default_rng(4)
    radius = np.broadcast_to(np.linspace(-0.29, 0.29, 96), (1, 48, 96))
    case = Case("sharp", rng.uniform(0.1, 1.0, (1, 48, 96)), np.ones((1, 48, 96)), radius, np.zeros((40, 88)), 4, 1, False)
    planned = case_plan(case)
    assert planned.optics.defocus is None

    class NothingIsSharp(Accuracy):
        sharp_px = 0.0

    camera, scene, scale = planned.sensor.camera, planned.optics.scene, planned.optics.projection.scale
    blurred = plan_defocus(LENS, camera.pixel_pitch_um, scene, scale, NothingIsSharp())
    found = executed_case(case, dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, defocus=blurred)))
    assert np.abs(z_scores(found, executed_case(case, planned), 20000.0)).max() < 0.01
    assert np.abs(found - executed_case(case, planned)).max() > 0.0  # it was blurred


def test_slabs_of_a_class_follow_one_another_without_a_gap():
    planned = case_plan(slanted_plane((0.02, 0.03))).optics.defocus
    classes, several = np.array([[0b0110, 0b1000, 0b1000]], np.uint64), np.array([[np.nan, np.nan, 1.5]], np.float32)
    lists = make_slab_lists(planned, classes, several)
    own = lists.slabs[lists.first[0] : lists.first[0] + lists.count[0]]
    assert lists.count.tolist() == [3, 2, 1] and np.all(own[:, :2] == [0, 0]) and lists.mapped.tolist() == [True, True, False]
    assert lists.slabs[lists.first[2]].tolist() == [0, -1, 1.5, 1.5, 1.5, -1]  # one radius all around, of no class
    assert np.array_equal(own[1:, 2:4], own[:-1, 3:5]) and np.all(np.diff(own[:, 2:5]) > 0)
    assert own[:, 5].tolist() == [0, 1, 2]


@pytest.mark.parametrize("pupil", [Pupil(), Pupil(5, rotation_deg=12.0)])
def test_points_of_a_tile_fill_pupil_and_photosite(pupil):
    x, y, right, down, phase = tile_points(pupil, 1024, 2).T.astype(float)
    assert pupil.contains(np.stack([x, y], -1)).mean() > 0.995
    assert abs(x.mean()) < 0.01 and abs(y.mean()) < 0.01
    assert np.allclose([right.var(), down.var()], 0.75 / 12, rtol=0.02) and np.allclose(
        [right.mean(), down.mean()], 0, atol=2e-3
    )
    assert np.abs(np.sort(phase) - (np.arange(1024) + 0.5) / 1024).max() < 2e-3
    assert np.all(tile_points(pupil, 1024, 1)[:, 2:4] == 0.0)


@pytest.mark.parametrize(
    ("scene", "radii", "worse"), [("near_occluder", (-11.089522, 0.0), 1.1), ("both_defocused", (-5.118241, 5.971281), 1.25)]
)
def test_a_ray_tracer_gives_the_same_picture(scene, radii, worse):
    """Mitsuba 3's thin lens: no photosite off by a sigma, hardly more deviation than the render's own noise.

    Its layers are known at one sample per photosite only, which already holds the photosite's aperture; docs/lens_accuracy.md.
    """
    path = RENDERS / f"{scene}.npz"
    if not path.is_file():
        pytest.skip(f"{path} is not there: Mitsuba's pictures are no part of the repository")
    render = np.load(path)
    colour, coverage = (np.stack([render[f"layer{k}_{what}"] for k in (1, 0)]).astype(float) for what in ("rgb", "alpha"))
    radius = np.broadcast_to(np.array(radii)[:, None, None], coverage.shape)
    case = Case(scene, colour, np.clip(coverage, 0.0, 1.0), radius, render["thinlens"], 48, 1, True)
    plain = ~maximum_filter((colour > 2.0).any(axis=0), 25)[48:-48, 48:-48]
    own = statistics(z_scores(render["thinlens_b"], render["thinlens_a"], 2000.0) / 2.0, plain)
    found = statistics(z_scores(blurred_case(case), render["thinlens"], 2000.0), plain)
    assert found.above_1 == 0.0 and found.p99 < worse * own.p99 and abs(found.mean) < 0.01


def test_a_slanted_edge_of_squares_is_as_exact_as_an_upright_one():
    """A penumbra of 1.5 photosites: a search found 1.9 sigma, by which the squares of the scene differ from the edge."""
    case = penumbra(-1.5, 1.0, 2)
    inner = slice(case.margin, -case.margin)
    truth = means_behind_a_near_surface(case.colour[0], case.coverage[0], case.colour[1], -1.5, 2)[inner, inner]
    assert np.abs(z_scores(blurred_case(case, 19476.0), truth, 19476.0)).max() < 0.05


def test_stripes_of_squares_are_told_by_the_budget():
    """Circles of 8.6 and 1.1 photosites: a search found 0.8 sigma, by which the squares of the scene differ from a wave."""
    case = stripes(-8.64762, -1.11018, 9.0, 2)
    row, inner = case.oversampling * case.margin, slice(case.margin, -case.margin)
    truth = means_of_upright_layers(case.colour[:, row], case.coverage[0, row], case.radius_px[:, row, 0], 2)[inner]
    planned = case_plan(case, 20000.0)
    z = np.abs(z_scores(executed_case(case, planned), np.broadcast_to(truth, case.truth.shape), 20000.0))
    assert z.max() < 0.2 < np.abs(z_scores(case.truth, np.broadcast_to(truth, case.truth.shape), 20000.0)).max()
    assert z.max() < planned.error_budget.predicted_sigma < 2.0


def test_a_correction_has_points_enough_past_the_end_of_a_penumbra():
    """Few electrons ask for few points: a search found 0.19 sigma where few of 32 see past the edge."""
    case = stripes(-10.36923, -5.86923, 24.0, 2)
    row, inner = case.oversampling * case.margin, slice(case.margin, -case.margin)
    truth = means_of_upright_layers(case.colour[:, row], case.coverage[0, row], case.radius_px[:, row, 0], 2)[inner]
    planned = case_plan(case, 59.527)
    z = np.abs(z_scores(executed_case(case, planned), np.broadcast_to(truth, case.truth.shape), 59.527))
    assert z.max() < planned.error_budget.predicted_sigma < 0.1


@pytest.mark.parametrize(("kernel_name", "lean"), [("layer_covariance", 0.0), ("occlusion", 0.05)])
def test_compilers_find_no_fault_with_what_layers_lack(bench, monkeypatch, kernel_name, lean):
    """What is added to layers that were laid over one another asks of no slab whether it is the first."""
    builds, kernel = [], Device.kernel

    def listening(device: Device, name: str, defines: dict[str, object], **settings: str) -> Kernel:
        builds.extend([defines] * (name == kernel_name))
        return kernel(device, name, defines, **settings)

    monkeypatch.setattr(Device, "kernel", listening)
    layers = uniform_layers(-5.0, 6.0)
    layers.radius_px[1] += lean * np.arange(layers.radius_px.shape[-1])
    blurred_case(layers)
    defines = read_macros(f"{kernel_name}.cl", builds[0])
    assert defines.get("OPAQUE", 0) == 0 and defines.get("COVERAGE", 1) == 1
    late = f"kernel void {kernel_name}(global float *x) {{ const int no = 0 && *x; if (*x > 1.0f && no) *x = 0.0f; }}"
    told = []
    for source in (kernel_source(f"{kernel_name}.cl"), late):
        unbuilt = f"{source}\n// {uuid.uuid4()}"  # in no cache
        program = bench.device.build(unbuilt, kernel_name, defines).function.program
        told.append(program.get_build_info(program.devices[0], cl.program_build_info.LOG).strip())
    assert not told[0] and "constant operand" in told[1]
