"""What a stage declares of itself is true, and enough for the rest of the chain."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from helpers.camera_builders import every_stage

from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.kernel.kernel_launch import mean_range
from simulator.sensor.kernel.kernel_program import in_order, signal_steps, white_level_dn
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.color_bias import ColorBias
from simulator.sensor.stages.conversion_gain import ConversionGain
from simulator.sensor.stages.digital_gain import DigitalGain
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.irradiance import Irradiance
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.sensor.stages.registry import FUSED
from simulator.sensor.stages.stage import NORMAL_REACH, Moments, Stage

WINDOW = Window(10, 20, 30, 40)
STAGES = every_stage() | {
    stage.stem: stage
    for stage in (
        Irradiance(0.05, 1e-8, 100.0, 80.0),
        Integration(0.01, 25.0),
        ConversionGain(4.0),
        ReadNoiseBeforeGain(3.0),
        AnalogGain(0.7),
        ReadNoiseAfterGain(2.0),
        ColorBias((1.0, -1.0, 2.0, -2.0)),
        Adc(14, 512.0),
    )
}


def test_a_stage_changes_the_mean_if_and_only_if_it_says_so():
    assert set(STAGES) == set(FUSED)
    for stem, stage in STAGES.items():
        changed = [float(stage.moments(Moments(mean, 0.0)).mean) != mean for mean in (0.0, 10.0, 3e4)]
        assert any(changed) == stage.changes_mean, stem


def test_a_gain_is_the_slope_of_the_mean():
    for stem, stage in STAGES.items():
        if stage.is_linear and not stage.acts_on_light:
            slope = stage.moments(Moments(11.0, 0.0)).mean - stage.moments(Moments(10.0, 0.0)).mean
            assert stage.gain == pytest.approx(slope), stem


@pytest.mark.parametrize("stem", ["row_noise", "banding", "column_offset", "dsnu"])
def test_stages_common_to_rows_move_all_photosites_of_a_row(bench, stem):
    codes = bench.sensor(np.zeros((40, 50)), STAGES[stem], gain=100.0, black=20000.0).astype(int)
    assert bool((codes == codes[:, :1]).all()) == STAGES[stem].is_common_to_rows


@dataclass(frozen=True)
class Law(Stage):
    """A stage that overrides nothing but its moments: mean * factor + offset, with noise."""

    stem: ClassVar[str] = "law"
    factor: float = 1.0
    offset: float = 0.0
    sigma: float = 0.0
    fixed_sigma: float = 0.0

    def moments(self, signal: Moments) -> Moments:
        return signal.scaled(self.factor).plus(self.offset, self.sigma**2, self.fixed_sigma**2)


@dataclass(frozen=True)
class Defect(Law):
    """Likewise, of few photosites."""

    is_defect: ClassVar[bool] = True


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (Law(offset=100.0), (102.0, 108.0)),
        (Law(factor=-1.0, offset=20.0), (12.0, 18.0)),
        (Law(offset=100.0, sigma=2.0), (102.0 - 2.0 * NORMAL_REACH, 108.0 + 2.0 * NORMAL_REACH)),
        (Law(offset=100.0, sigma=3.0, fixed_sigma=4.0), (102.0 - 5.0 * NORMAL_REACH, 108.0 + 5.0 * NORMAL_REACH)),
        (Law(fixed_sigma=4.0), (0.0, 8.0 + 4.0 * NORMAL_REACH)),
        (Defect(), (0.0, math.inf)),
    ],
)
def test_the_range_of_the_mean_follows_from_the_moments_at_both_ends(law, expected):
    assert law.mean_range(2.0, 8.0, WINDOW) == pytest.approx(expected)
    low, high = law.mean_range(np.array([[2.0], [0.0]]), np.array([[8.0], [0.0]]), WINDOW)
    assert (low[0, 0], high[0, 0]) == pytest.approx(expected) and low.shape == high.shape == (2, 1)


def test_stages_before_the_counting_are_asked_in_physical_order_and_none_behind():
    stages = (Law(factor=2.0), Law(offset=5.0), PhotonShotNoise(), Law(offset=1e6))
    assert mean_range(stages, 1.0, 3.0, WINDOW) == (7.0, 11.0)


@pytest.mark.parametrize("window", [Window(0, 0, 200, 160), Window(120, 90, 30, 20), Window(10, 100, 50, 60)])
def test_the_range_of_the_irradiance_holds_every_photosite_of_a_window(window):
    lens = Irradiance(0.05, 1e-5, 100.0, 80.0, vignetting=(1.0, 0.9, 0.5), nodes_per_px=0.02)
    x, y = np.meshgrid(window.x + np.arange(window.width) + 0.5, window.y + np.arange(window.height) + 0.5)
    irradiance = 0.05 * lens.relative_illumination(np.hypot(x - 100.0, y - 80.0))
    low, high = lens.mean_range(2.0, 3.0, window)
    assert low <= 2.0 * irradiance.min() and 3.0 * irradiance.max() <= high


@pytest.mark.parametrize("sigma", [0.01, 0.2])
def test_the_range_of_the_response_holds_the_farthest_normal_number(sigma):
    low, high = Prnu(sigma).mean_range(100.0, 1000.0, WINDOW)
    assert low == pytest.approx(100.0 * max(0.0, 1.0 - NORMAL_REACH * sigma)) and low >= 0.0
    assert high == pytest.approx(1000.0 * (1.0 + NORMAL_REACH * sigma))


@pytest.mark.parametrize(
    ("well_e", "factor", "white_dn"),
    [(1e6, 1.0, 4095), (500.0, 1.0, 64 + 1000), (1e6, 0.5, round(64 + 0.5 * (4095 - 64))), (500.0, 3.0, 64 + 3000)],
)
def test_white_is_what_clips_first_seen_behind_all_stages(well_e, factor, white_dn):
    stages = in_order([FullWell(well_e), AnalogGain(2.0), Adc(12, 64.0), DigitalGain(factor, 64.0)])
    assert white_level_dn(signal_steps(stages), 64.0) == white_dn
