"""Cameras small enough for a test, and one of each stage that a camera file can switch on."""

from typing import Any

import numpy as np

from simulator.sensor.camera.camera import Camera, IsoSetting, SpectralResponse
from simulator.sensor.camera.cfa import CfaName
from simulator.sensor.stages.color_bias import ColorBias
from simulator.sensor.stages.conversion_gain import ConversionGain
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Stage

STAGE_NUMBERS = {  # of every stage that a camera file can switch on, all with an effect
    "banding": (2.0, 30.0),
    "column_offset": (1.5,),
    "dark_current": (3.0, 2.0),
    "dead_pixels": (0.01,),
    "digital_gain": (1.25, 300.0),
    "dsnu": (2.0,),
    "full_well": (20000.0,),
    "hot_pixels": (0.02, 300.0, 2.0),
    "nonlinearity": ((0.0, 20.0, -10.0, 0.0), 40000.0),
    "photon_shot_noise": (),
    "prnu": (0.02,),
    "random_telegraph_noise": (0.05, 30.0),
    "row_noise": (1.0,),
}


def small_camera(width: int = 64, height: int = 48, cfa: CfaName = "MONO", **settings: Any) -> Camera:
    """A small camera whose colours see separate thirds of the spectrum, with unit quantum efficiency."""
    wavelengths = np.arange(400.0, 701.0, 10.0)
    thirds = np.stack([wavelengths > 600, (wavelengths > 500) & (wavelengths < 600), wavelengths < 500], axis=-1)
    efficiency = np.ones((31, 1)) if cfa == "MONO" else thirds.astype(float)
    defaults = {
        "make": "Photosite",
        "model": "test",
        "width_px": width,
        "height_px": height,
        "pixel_pitch_um": 5.0,
        "cfa": cfa,
        "bit_depth": 16,
        "black_level_dn": 0.0,
        "response": SpectralResponse(wavelengths, efficiency),
        "iso_table": {100: IsoSetting(1.0, 0.0)},
        "stages": {},
    }
    return Camera(**{**defaults, **settings})


def green_camera(width: int = 64, height: int = 48, **settings: Any) -> Camera:
    """A camera without colour filter that sees 550 nm alone."""
    wavelengths = np.arange(400.0, 701.0, 10.0)
    return small_camera(
        width, height, response=SpectralResponse(wavelengths, (wavelengths == 550.0)[:, None] * 1.0), **settings
    )


def every_stage() -> dict[str, Stage]:
    """One of each stage that a camera file can switch on."""
    return {stem: stage(*STAGE_NUMBERS[stem]) for stem, stage in STAGES.items() if stage.in_camera_stages}


def every_effect() -> tuple[Stage, ...]:
    """Those, and what belongs to an ISO: all that the fused kernel can do. Tests that share it share a build, of seconds."""
    return (
        *every_stage().values(),
        ConversionGain(1.5),
        ReadNoiseBeforeGain(4.0, 0.2),
        ReadNoiseAfterGain(2.0, -0.1),
        ColorBias((-1.9, 0.3, 1.2, 4.1)),
    )
