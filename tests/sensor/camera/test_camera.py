"""A camera, its seeds and its shot refuse in Python what a file may not say either."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import IsoSetting, SpectralResponse, Window
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.sensor.stages.stage import FromShot, Stage, fields_from_shot

GRID = np.arange(400.0, 701.0, 10.0)

BAD = {
    "camera.read_noise_spread = 2.0: give 0 to 1": dict(read_noise_spread=2.0),
    "camera.read_noise_spread = 0.2: the tails of tukey_lambda hold": dict(
        read_noise_spread=0.2, iso_table={100: IsoSetting(1.0, 3.0, tukey_lambda=0.1)}
    ),
    "camera.width = 0": dict(width=0),
    "camera.height = 65536": dict(height=65536),
    "camera.pixel_pitch = nan um": dict(pixel_pitch_um=math.nan),
    "camera.pixel_pitch = inf um": dict(pixel_pitch_um=math.inf),
    "camera.fill_factor = 1.01": dict(fill_factor=1.01),
    "camera.cfa = RGBG: give one of RGGB": dict(cfa="RGBG"),
    "camera.cfa = RGGB: needs 3 values .* has 1": dict(cfa="RGGB", response=SpectralResponse(GRID, np.ones((31, 1)))),
    "camera.cfa = MONO: needs 1 values .* has 3": dict(response=SpectralResponse(GRID, np.ones((31, 3)))),
    "adc.bit_depth = 17": dict(bit_depth=17),
    "adc.black_level = 65535": dict(black_level_dn=65535.0),
    "camera.iso_table = {}": dict(iso_table={}),
    "camera.iso_table = -100": dict(iso_table={-100: IsoSetting(1.0, 0.0)}),
    "camera.iso_table.200.read_noise = 2 DN: is below": dict(
        iso_table={100: IsoSetting(1.0, 3.0), 200: IsoSetting(2.0, 2.0)}, read_noise_after_gain_dn=2.5
    ),
    "camera.read_noise_after_gain = -1 DN": dict(read_noise_after_gain_dn=-1.0),
    "camera.window = 10 x 10 at .60, 0.: must lie": dict(window=Window(60, 0, 10, 10)),
    "camera.window = 10 x 10 at .0, -1.": dict(window=Window(0, -1, 10, 10)),
    "camera.window = 0 x 10": dict(window=Window(0, 0, 0, 10)),
}


@pytest.mark.parametrize("message", BAD)
def test_a_camera_that_cannot_be_is_refused(message):
    with pytest.raises(PhotositeError, match=message):
        small_camera(**BAD[message])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: IsoSetting(0.0, 1.0), "iso_table.gain = 0"),
        (lambda: IsoSetting(1.0, -1.0), "iso_table.read_noise = -1"),
        (lambda: IsoSetting(1.0, math.nan), "iso_table.read_noise = nan"),
        (lambda: SpectralResponse(GRID, np.ones((30, 3))), "quantum_efficiency = shape .30, 3.: needs 31 lines"),
        (lambda: SpectralResponse(GRID, np.ones((31, 2))), "quantum_efficiency = shape .31, 2."),
        (lambda: SpectralResponse(GRID[::-1], np.ones((31, 3))), "wavelengths = 700 to 400 nm: give ascending"),
        (lambda: SpectralResponse(GRID, np.full((31, 3), -0.1)), "quantum_efficiency = -0.1"),
        (lambda: SpectralResponse(GRID, np.full((31, 3), np.nan)), "quantum_efficiency = nan"),
        (lambda: Seeds(frame=-1), "seeds.frame = -1: give a whole number from 0 to 4294967295"),
        (lambda: Seeds(body=2**32), "seeds.body = 4294967296"),
        (lambda: Seeds(frame=1.5), "seeds.frame = 1.5"),
        (
            lambda: Shot(band_scene(np.ones((4, 4))), ThinLens(50.0, 8.0), Exposure(1.0, 200), small_camera()),
            "exposure.iso = 200",
        ),
    ],
)
def test_its_parts_and_its_shot_are_checked_too(make, message):
    with pytest.raises(PhotositeError, match=message):
        make()


def test_seeds_may_be_any_whole_numbers_of_32_bits():
    assert Seeds(np.uint32(2**32 - 1), 0).body == 4294967295


def test_what_follows_from_the_shot_is_filled_in_for_every_exposure():
    camera = small_camera(stages={"dark_current": DarkCurrent(2.0)})
    assert camera.stages["dark_current"].time_s == 0.0
    assert camera.sensor_stages(100, 0.25)["dark_current"] == DarkCurrent(2.0, 0.25)


def test_a_stage_says_itself_which_fields_follow_from_the_shot():
    @dataclass(frozen=True)
    class Glow(Stage):
        stem: ClassVar[str] = "glow"
        rate: float
        time_s: Annotated[float, FromShot("exposure_time_s")] = 0.0

    assert fields_from_shot(Glow) == {"time_s": "exposure_time_s"}
    assert Glow(3.0).of_shot(exposure_time_s=2.0) == Glow(3.0, 2.0)


def test_the_spread_of_the_read_noise_reaches_the_stage_before_the_gain():
    camera = small_camera(read_noise_spread=0.3, iso_table={100: IsoSetting(2.0, 5.0)}, read_noise_after_gain_dn=3.0)
    stages = camera.sensor_stages(100, 1.0)
    assert stages["read_noise_before_gain"] == ReadNoiseBeforeGain(2.0, 0.3)
    assert stages["read_noise_after_gain"].sigma_dn == 3.0
