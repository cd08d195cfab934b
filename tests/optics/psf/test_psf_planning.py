"""Whether the point spread function of a shot is left out: nowhere on the sensor does it change more than is told."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, lens
from helpers.scene_builders import band_scene

from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

RNG = np.random.default_rng(4)
SHOT_NOISE = {"photon_shot_noise": PhotonShotNoise()}


def error_sigma(shot: Shot) -> float:
    """Largest difference of a frame from that of tolerance 0 [standard deviations of its shot noise]."""
    found, exact = (simulate(one).mean_electrons.astype(np.float64) for one in (shot, dataclasses.replace(shot, tolerance=0.0)))
    return float((np.abs(found - exact) / np.sqrt(exact)).max())


def random_shot(through: ThinLens, least: float, **camera: float) -> Shot:
    """Shot of random squares of the light `least` and 1 per photosite, some thousands of electrons."""
    planes = np.where(RNG.random((24, 36)) < 0.5, least, 1.0)
    return Shot(
        band_scene(planes, math.inf, interpolation="nearest"),
        through,
        EXPOSURE,
        green_camera(36, 24, stages=SHOT_NOISE, **camera),
    )


@pytest.mark.parametrize("field", [0.5, 1.0])
def test_a_table_that_is_sharp_in_the_middle_counts_by_its_other_fields(tmp_path, field):
    fields = [0.0, 0.5, 1.0]
    kernels = np.zeros((1, 3, 1, 9, 9))
    kernels[..., 4, 4] = 1.0
    kernels[0, fields.index(field)] = 1.0 / 81.0
    np.savez(tmp_path / "lens.npz", kernels=kernels, fields=fields)
    shot = random_shot(lens(psf=tmp_path / "lens.npz"), 0.2)
    assert plan(shot).optics.psf is not None
    assert error_sigma(shot) < shot.tolerance


@pytest.mark.parametrize("name", ["coma", "lateral colour"])
def test_what_grows_towards_the_corners_is_not_left_out_by_the_middle(name):
    chosen = {
        "coma": Aberrations(coma_um=8.0),
        "lateral colour": Aberrations(chromatic=(ChromaticShift(500.0, 0.0, 40.0),)),
    }
    shot = random_shot(lens(1.4, aberrations=chosen[name]), 0.985, pixel_pitch_um=8.4)
    assert error_sigma(shot) < shot.tolerance
