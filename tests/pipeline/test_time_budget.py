"""A time budget chooses the most accurate tolerance that fits, and the shot that is kept repeats without it."""

import dataclasses
import json
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS
from helpers.scene_builders import band_scene

from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.pipeline.device_rates import DeviceRates, cache_path, rates_key, rates_of, read_rates, rounded
from simulator.pipeline.planned_pass import Pass
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.pipeline.time_budget import TOLERANCES, choose_tolerance

RATES = DeviceRates({"defocus": 2.0, "sensor": 0.5, "truth": 1.0})


def blurred_shot() -> Shot:
    rng = np.random.default_rng(3)
    depth_m = np.where(np.arange(96) % 32 < 16, 1.7, 2.6) * np.ones((64, 1))
    scene = band_scene(rng.random((64, 96)), depth_m.astype(np.float32))
    return Shot(scene, LENS, Exposure(0.01), small_camera(96, 64))


def cost_ms(shot: Shot, tolerance: float) -> float:
    planned = measure(plan(dataclasses.replace(shot, tolerance=tolerance)), open_device())
    return RATES.cost_ms(planned.passes)


def test_cost_is_the_sum_of_the_passes_at_their_own_rates():
    passes = [
        Pass("defocus", True, "", cost_ms=10.0),
        Pass("sensor", True, "", cost_ms=4.0),
        Pass("motion", True, "", cost_ms=3.0),
    ]
    assert RATES.cost_ms(passes) == pytest.approx(10.0 * 2.0 + 4.0 * 0.5 + 3.0 * 1.0)  # the median, where a pass has none
    assert DeviceRates().cost_ms(passes) == pytest.approx(17.0)


def test_the_most_accurate_tolerance_that_fits_is_chosen():
    shot, device = blurred_shot(), open_device()
    costs = [cost_ms(shot, tolerance) for tolerance in TOLERANCES]
    assert costs[0] > costs[-1]  # else there is nothing to choose
    budget_s = 1e-3 * (costs[0] + costs[-1]) / 2.0
    fit = choose_tolerance(shot, budget_s, RATES, device)
    place = TOLERANCES.index(fit.tolerance)
    assert fit.is_kept and fit.predicted_s == pytest.approx(1e-3 * costs[place]) and fit.warnings() == []
    assert place > 0 and costs[place - 1] > 1e3 * budget_s
    assert choose_tolerance(shot, 1e9, RATES, device).tolerance == TOLERANCES[0]


def test_a_budget_that_cannot_be_kept_is_told():
    fit = choose_tolerance(blurred_shot(), 1e-9, RATES, open_device())
    assert fit.tolerance == TOLERANCES[-1] and not fit.is_kept
    (warning,) = fit.warnings()
    assert warning.startswith("time_budget = 1e-09 s is not kept") and "camera.window" in warning


@pytest.fixture
def kept_rates(tmp_path, monkeypatch):
    """A cache that holds rates of the device."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = cache_path()
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps({rates_key(open_device()): RATES.factors}), encoding="utf-8")
    return path


def test_rates_are_read_from_the_cache(kept_rates):
    assert rates_of(open_device()) == RATES
    for damaged in ("", "[1]", '{"x": 3}', '{"x": {"defocus": "fast"}}'):
        kept_rates.write_text(damaged, encoding="utf-8")
        assert read_rates(kept_rates) == {}
    assert rounded(2.1) == pytest.approx(2.0) and rounded(0.2) == pytest.approx(2.0**-2.25)


def test_a_frame_in_time_is_that_of_its_tolerance(kept_rates):
    """The same bits, and the JSON repeats it without the budget."""
    shot = dataclasses.replace(blurred_shot(), time_budget_s=60.0)
    raw = simulate(shot)
    told = raw.resolved["time_budget"]
    assert told["tolerance"] == TOLERANCES[0] == raw.resolved["error_budget"]["tolerance_sigma"] and told["budget_s"] == 60.0
    again = simulate(dataclasses.replace(shot, tolerance=told["tolerance"], time_budget_s=None))
    assert np.array_equal(raw.dn, again.dn)


def test_rates_of_this_device_are_measured(tmp_path, monkeypatch):
    """Of small frames; they are kept, and are the same at the next call."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    rates = rates_of(open_device(), side_px=512)
    assert {"defocus", "point spread function"} <= set(rates.factors)
    assert all(0.0 < factor < math.inf for factor in rates.factors.values())
    assert rates_of(open_device()) == rates and read_rates(cache_path())


@pytest.mark.parametrize("time_s", [0.0, -1.0, math.inf, math.nan])
def test_a_budget_that_is_no_time_is_refused(time_s):
    with pytest.raises(PhotositeError, match="time_budget"):
        dataclasses.replace(blurred_shot(), time_budget_s=time_s)


def test_a_plan_without_a_device_refuses_a_time_budget():
    with pytest.raises(PhotositeError, match="plan_in_time"):
        plan(dataclasses.replace(blurred_shot(), time_budget_s=2.0))
