"""The passes of a plan: the same as the executor runs, with sizes, shares and costs that add up."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import every_stage, small_camera
from helpers.scene_builders import band_scene

from simulator.device import Device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.flicker import MainsFlicker
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.pipeline.execution import execute, expose
from simulator.pipeline.passes import BLUR_PROGRAM_BYTES
from simulator.pipeline.planned_pass import Pass
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.optical_black import OpticalBlack

RANDOM = np.random.default_rng(11)
PLANES = RANDOM.uniform(0.1, 1.0, (24, 32, 3))
SLOPE_M = np.linspace(1.9, 2.1, 32)[None, :].repeat(24, axis=0)
EDGE_M = np.where(np.arange(32) < 16, 1.9, 2.1)[None, :].repeat(24, axis=0)
IDEAL = ThinLens(50.0, 2.0, 2.0, cos4=False)
REAL = replace(IDEAL, veiling_glare=0.02, distortion=Distortion(k1=-0.01))
ABERRATED = replace(REAL, f_number=8.0, aberrations=Aberrations(spherical_um=0.1))
PAN = Motion(camera=SteadyMotion(pan_deg_per_s=2.0))
ROLLING = Exposure(0.001, shutter=RollingShutter(0.01), flicker=MainsFlicker(100.0, 0.4))
TRUTH = ("variance", "depth", "blur", "rgb")


def full_camera():
    """Every stage, crosstalk of light and charge, optical black and a low-pass filter."""
    return small_camera(
        cfa="RGGB",
        stages=every_stage(),
        crosstalk=Crosstalk(0.02, 0.01, 0.01, 0.005),
        optical_black=OpticalBlack(left_px=4, top_px=2),
        low_pass_um=4.0,
    )


def shot_of(lens=REAL, depth_m=SLOPE_M, camera=None, truth=TRUTH, **settings) -> Shot:
    exposure = settings.pop("exposure", Exposure(0.01))
    return Shot(band_scene(PLANES, depth_m), lens, exposure, camera or full_camera(), truth=truth, **settings)


SHOTS = {
    "everything": shot_of(),
    "only the blur is asked for": shot_of(truth=("blur",)),
    "rays instead of the blur": shot_of(lens=replace(IDEAL, f_number=8.0), camera=small_camera(16, 12, "RGGB"), tolerance=0.0),
    "kernels stand for the blur": shot_of(lens=ABERRATED, depth_m=EDGE_M),
    "pinhole": shot_of(lens=Pinhole(0.2, 50.0, diffraction=False), depth_m=2.0),
    "sharp": shot_of(lens=IDEAL, depth_m=2.0, camera=small_camera(cfa="RGGB"), truth=()),
    "swept": shot_of(lens=IDEAL, depth_m=2.0, camera=small_camera(cfa="RGGB"), truth=(), motion=PAN),
    "swept, then blurred": shot_of(lens=IDEAL, depth_m=5.0, camera=small_camera(16, 12), truth=(), motion=PAN, tolerance=10.0),
    "blurred at each instant": shot_of(lens=IDEAL, camera=small_camera(16, 12), truth=(), motion=PAN, tolerance=10.0),
    "rolling shutter under a flickering lamp": shot_of(
        lens=IDEAL, depth_m=2.0, camera=small_camera(cfa="RGGB"), truth=(), exposure=ROLLING
    ),
    "two strips": shot_of(lens=IDEAL, depth_m=2.0, camera=small_camera(20, 200, "RGGB"), truth=()),
}
STRIP_PX = 20 * 150  # the shots but the last are smaller


def plan_of(name: str) -> Plan:
    return plan(SHOTS[name], STRIP_PX)


def by_name(planned: Plan) -> dict[str, Pass]:
    return {one.name: one for one in planned.passes}


SLOW = "rays instead of the blur", "blurred at each instant", "kernels stand for the blur"


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in SHOTS])
def test_the_executor_times_the_passes_that_the_plan_keeps(name, device):
    """Two exceptions: `measure` finds out whether methods are chosen by tile, so it is always timed; and the blur that a point
    spread function follows runs inside that pass, so its time is that pass's."""
    shot, stopwatch = SHOTS[name], Stopwatch(running=True)
    raw = execute(plan_of(name), shot, device, lambda what, share: None, stopwatch)
    assert "truth" not in stopwatch.times_ms or "variance" in shot.truth or len(plan_of(name).strips) > 1
    assert raw.mean_electrons.shape == raw.noise_free_dn.shape == raw.dn.shape  # the truth is computed when it is read
    passes = by_name(measure(plan_of(name), device))
    expected = {one.name for one in passes.values() if one.kept} | {"radius statistics"}
    assert set(stopwatch.times_ms) <= set(passes)
    assert set(stopwatch.times_ms) == expected - ({"defocus"} if passes["point spread function"].kept else set())


def test_the_shots_above_keep_every_pass_at_least_once():
    passes = [one for name in SHOTS for one in plan_of(name).passes]
    assert {one.name for one in passes if one.kept} == {one.name for one in passes}


@pytest.mark.parametrize("name", SHOTS)
def test_sums_are_those_of_the_kept_passes_and_skipped_ones_cost_nothing(name, device):
    planned = measure(plan_of(name), device)
    kept = [one for one in planned.passes if one.kept]
    held = itertools.accumulate(one.memory_bytes for one in kept)
    assert planned.memory_bytes() == max(bytes_ + one.scratch_bytes for bytes_, one in zip(held, kept, strict=True)) > 0
    assert planned.cost_ms() == pytest.approx(math.fsum(one.cost_ms for one in kept))
    for one in planned.passes:
        assert one.method
        if one.kept:
            assert one.size > 0 and one.cost_ms > 0.0
        else:
            assert (one.size, one.memory_bytes, one.scratch_bytes, one.cost_ms) == (0, 0, 0, 0.0)


@pytest.mark.parametrize("name", [name for name in SHOTS if SHOTS[name].tolerance])
def test_the_errors_of_passes_are_what_the_methods_leave_by_the_budget(name):
    """Also of what is left out, and of what runs at each instant; without the background that no pass knows."""
    planned = plan_of(name)
    own = [one.error_sigma for one in planned.passes if one.error_sigma is not None]
    budget = planned.error_budget
    each = [budget.sigma_of(effect) for effect in {term.effect for term in budget.terms if term.limit == "method"}]
    assert max(each, default=0.0) <= math.fsum(own) * (1.0 + 1e-9) and math.fsum(own) <= math.fsum(each) * (1.0 + 1e-9)
    assert budget.predicted_sigma <= math.fsum(own) * (1.0 + 1e-9)


def test_the_shots_above_have_errors_of_each_effect_and_of_the_input():
    terms = [term for name in SHOTS for term in plan_of(name).error_budget.terms]
    assert {"lens blur", "point spread function", "motion blur"} <= {term.effect for term in terms}
    assert any(term.limit == "input" and term.effect == "lens blur" for term in terms)


def test_the_buffers_of_a_blur_are_stated(device, monkeypatch):
    """Light, maps of radii and bands with their margins. The scene has few pixels, so that nothing else is large."""
    sizes, empty = [], Device.empty

    def counted(self, shape, dtype):
        sizes.append(math.prod(shape) * np.dtype(dtype).itemsize)
        return empty(self, shape, dtype)

    monkeypatch.setattr(Device, "empty", counted)
    planned = plan(shot_of(lens=IDEAL, depth_m=EDGE_M, camera=small_camera(1400, 600, "RGGB", pixel_pitch_um=6.0), truth=()))
    measured = measure(planned, device)
    expose(measured, device)
    for told in (planned, measured):
        (blur,) = (one for one in told.passes if one.name == "defocus")
        stated = blur.memory_bytes + blur.scratch_bytes - BLUR_PROGRAM_BYTES
        assert 0.8 * sum(sizes) <= stated <= 1.2 * sum(sizes)


def test_where_kernels_stand_for_the_blur_no_method_is_chosen_by_tile(device):
    planned = measure(plan(SHOTS["kernels stand for the blur"]), device)
    passes = by_name(planned)
    assert planned.tiles is None and planned.optics.defocus is not None
    assert passes["point spread function"].kept
    assert not passes["radius statistics"].kept and not passes["defocus"].kept


def test_truth_in_every_colour_costs_the_light_and_the_truth_of_each(device):
    planned = measure(plan(SHOTS["everything"]), device)
    passes = by_name(planned)
    names = list(passes)
    light = [one for one in names[: names.index("sensor")] if one != "radius statistics"]
    each = sum(passes[name].cost_ms for name in [*light, "truth"])
    assert passes["truth: rgb"].cost_ms == pytest.approx(3 * each)
    mono = by_name(plan(Shot(band_scene(PLANES[..., :1], 2.0), IDEAL, Exposure(0.01), small_camera(), truth=("rgb",))))
    assert mono["truth: rgb"].cost_ms == pytest.approx(
        sum(one.cost_ms for name, one in mono.items() if name not in ("sensor", "truth: rgb"))
    )


@pytest.mark.parametrize("name", ["everything", "two surfaces"])
def test_shares_of_the_methods_add_up_to_the_whole_frame(name, device):
    shot = SHOTS["everything"] if name == "everything" else shot_of(lens=IDEAL, depth_m=EDGE_M)
    tiles = measure(plan(shot), device).tiles
    assert tiles is not None
    shares = tiles.shares()
    assert sum(shares.values()) == pytest.approx(1.0) and min(shares.values()) >= 0.0
