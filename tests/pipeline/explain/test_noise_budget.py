"""A grey patch from luminance to code, and the shares of its noise: by hand, by leaving stages out, and in simulated frames."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.scene_builders import FixedScene
from rich.console import Console

from simulator import load_shot, simulate
from simulator.color.color_tables import CONFIGS
from simulator.color.spectra import luminous_efficiency
from simulator.command_line.patch_numbers import budget_tables, shown_isos
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.explain.grey_patch import grey_patch
from simulator.pipeline.explain.noise_budget import contributions, iso_budgets, noise_budget
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import SpectralResponse
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain

FLAT = CONFIGS / "shots" / "flat_field.yaml"
CHAIN = [
    PhotonShotNoise(),
    DarkCurrent(2.0, 2.0),
    ReadNoiseBeforeGain(3.0),
    AnalogGain(0.5),
    ReadNoiseAfterGain(1.2),
    Adc(14, 64.0),
]


def steps(stages):
    return [stage.signal_step() for stage in stages]


def test_contributions_by_hand():
    signal, parts, fixed = contributions(steps(CHAIN), 100.0)
    assert signal.mean == pytest.approx(0.5 * 104 + 64)
    expected = {
        "photon_shot_noise": 0.25 * 100,
        "dark_current": 0.25 * 4,
        "read_noise_before_gain": 0.25 * 9,
        "read_noise_after_gain": 1.44,
        "adc": 1 / 12,
    }
    assert parts == pytest.approx(expected) and not any(fixed.values())
    assert signal.variance == pytest.approx(sum(expected.values()))


@pytest.mark.parametrize("left_out", [0, 1, 2, 4, 5])
def test_a_contribution_is_the_variance_of_all_less_that_without_it(left_out):
    signal, parts, _ = contributions(steps(CHAIN), 100.0)
    without = [step for index, step in enumerate(steps(CHAIN)) if index != left_out]
    rest = contributions(without, 100.0)[0].variance
    assert parts[CHAIN[left_out].stem] == pytest.approx(signal.variance - rest)


def equal_energy_shot(luminance: float) -> Shot:
    """R6 of the physics tests: 100 cd/m^2 of equal-energy light, 2.8 um, 10 ms, f/4 in focus at infinity: 4458 photons."""
    grid = np.arange(395.0, 706.0, 10.0)
    radiance = luminance / (683.0 * 10.0 * luminous_efficiency(grid[:-1] + 5.0).sum())
    source = FixedScene(Scene(np.ones((4, 4, 1), np.float32), np.full((1, 32), radiance), grid, np.ones(32), math.inf))
    source.luminance_cd_m2 = luminance
    half = SpectralResponse(grid, np.full((32, 1), 0.5))
    camera = small_camera(pixel_pitch_um=2.8, response=half, fill_factor=0.8)
    return Shot(source, ThinLens(4.0, 4.0, cos4=False), Exposure(0.01, 100), camera)


def test_the_chain_of_a_patch_against_published_photons():
    shot = equal_energy_shot(100.0)
    patch = grey_patch(shot, plan(shot).optics.scene, 0.18)
    assert patch.luminance_cd_m2 == pytest.approx(18.0)
    assert patch.illuminance_lx == pytest.approx(18.0 * math.pi / (1 + 4 * 16), rel=1e-9)
    assert patch.exposure_lx_s == pytest.approx(patch.illuminance_lx * 0.01)
    assert patch.photons == pytest.approx(0.18 * 0.8 * 4458, rel=1e-3)
    assert patch.electrons == pytest.approx([0.5 * patch.photons])
    del shot.scene.luminance_cd_m2
    assert grey_patch(shot, plan(shot).optics.scene, 0.18) is None
    with pytest.raises(PhotositeError, match=r"patch = 18: give a reflectance"):
        grey_patch(shot, plan(shot).optics.scene, 18)


def test_fixed_patterns_stand_apart_from_the_noise():
    chain = [Prnu(0.01), PhotonShotNoise(), Dsnu(3.0), AnalogGain(0.5), ColumnOffset(0.7), Adc(14, 64.0)]
    signal, parts, fixed = contributions(steps(chain), 400.0)
    assert parts == pytest.approx({"photon_shot_noise": 0.25 * 400, "adc": 1 / 12})
    assert fixed == pytest.approx({"prnu": 0.25 * 16, "dsnu": 0.25 * 9, "column_offset": 0.49})
    assert signal.fixed_variance == pytest.approx(sum(fixed.values()))


def test_binning_of_charge_counts_read_noise_once():
    shot = load_shot(FLAT, {"camera.binning": {"factor": 2, "mode": "charge"}, "exposure.iso": 1600})
    plain = load_shot(FLAT, {"exposure.iso": 1600})
    budgets = [noise_budget(plan(one).sensor, 100.0, 1600, one.exposure.time_s) for one in (plain, shot)]
    shot_dn2, read_dn2 = (
        [one.shares[stem] * one.sigma_dn**2 for one in budgets] for stem in ("photon_shot_noise", "read_noise_after_gain")
    )
    assert shot_dn2[1] == pytest.approx(4 * shot_dn2[0]) and read_dn2[1] == pytest.approx(read_dn2[0])


def test_a_full_well_that_is_full_has_the_noise_behind_it_only():
    signal, parts, _ = contributions(steps([PhotonShotNoise(), FullWell(500.0), AnalogGain(1.0), Adc(14, 0.0)]), 800.0)
    assert signal.mean == 500.0 and parts["photon_shot_noise"] == 0.0 and parts["adc"] == pytest.approx(1 / 12)


@pytest.mark.parametrize("iso", [100, 1600, 12800])
def test_mean_and_variance_are_those_of_a_simulated_patch(iso):
    overrides = {"scene.reflectance": 0.18, "exposure.iso": iso, "exposure.time": f"{1.6 / iso} s"}
    shot = load_shot(FLAT, overrides)
    planned = plan(shot)
    white = grey_patch(shot, planned.optics.scene, 0.18)
    codes = simulate(shot).dn.astype(np.float64)
    planes = [codes[0::2, 0::2], codes[0::2, 1::2], codes[1::2, 1::2]]
    p_values = {}
    for name, plane, mean_e in zip("RGB", planes, white.electrons, strict=True):
        budget = noise_budget(planned.sensor, float(mean_e), iso, shot.exposure.time_s)
        expected = planned.sensor.moments(float(mean_e)).mean
        p_values[name, "mean"] = mean_p(plane, expected, budget.sigma_dn**2)
        p_values[name, "variance"] = variance_p(plane, budget.sigma_dn**2)
        assert budget.snr == pytest.approx((expected - planned.sensor.moments(0.0).mean) / budget.sigma_dn)
        assert sum(budget.shares.values()) == pytest.approx(1.0)
    accept(p_values)


def test_the_same_brightness_takes_light_away_as_the_iso_grows():
    shot = load_shot(FLAT)
    low, high = iso_budgets(plan(shot).sensor, shot.exposure, 8000.0, [100, 1600], "brightness")
    assert (low.mean_electrons, high.mean_electrons) == (8000.0, 500.0)
    assert high.time_s == pytest.approx(shot.exposure.time_s / 16)
    assert high.signal_dn == pytest.approx(low.signal_dn, rel=1e-6), "this camera's gain is proportional to its ISO"
    assert high.shares["photon_shot_noise"] < low.shares["photon_shot_noise"]


def test_the_same_shutter_keeps_the_electrons_until_they_clip():
    shot = load_shot(FLAT)
    budgets = iso_budgets(plan(shot).sensor, shot.exposure, 8000.0, [100, 800, 6400], "exposure")
    assert [one.mean_electrons for one in budgets] == [8000.0] * 3
    assert [one.is_clipped for one in budgets] == [False, False, True]
    # PMN's numbers of this camera: full scale (16383 - 512) DN / K; at ISO 800 read noise 3.5476 DN, row noise, and rounding.
    dark_dn = math.sqrt(3.5476**2 + shot.camera.iso_table[800].row_noise_dn ** 2 + 1 / 12)
    assert budgets[1].full_scale_e == pytest.approx((16383 - 512) / 0.76504, rel=1e-6)
    assert budgets[1].dynamic_range_stops == pytest.approx(math.log2(15871 / dark_dn), abs=1e-3)


def test_of_many_isos_the_whole_stops_and_the_own_are_shown():
    shown = shown_isos(load_shot(FLAT, {"exposure.iso": 1250}))
    assert {100, 200, 400, 800, 1250, 1600, 3200, 6400, 12800, 25600} <= set(shown) and len(shown) <= 12


def test_a_read_noise_that_was_measured_as_one_is_called_read():
    one = iso_budgets(plan(load_shot(FLAT)).sensor, load_shot(FLAT).exposure, 100.0, [100], "exposure")
    (table,) = budget_tables("t", one, Console(width=400))
    heads = [column.header for column in table.columns]
    assert "read %" in heads and "read, after gain %" not in heads


def test_row_noise_of_averaged_codes_counts_by_their_rows():
    """The mean of 2 x 2 codes keeps half of what a row adds, and a quarter of what each photosite adds."""
    one, mean = (
        plan(load_shot(FLAT, settings)).sensor for settings in ({}, {"camera.binning": {"factor": 2, "mode": "average"}})
    )
    single = contributions(one.moment_steps(), 100.0)[1]
    signal, parts, _ = contributions(mean.moment_steps(), 100.0)
    assert parts["row_noise"] == pytest.approx(single["row_noise"] / 2.0) and single["row_noise"] > 0.0
    assert parts["photon_shot_noise"] == pytest.approx(single["photon_shot_noise"] / 4.0)
    assert sum(parts.values()) == pytest.approx(signal.variance)
