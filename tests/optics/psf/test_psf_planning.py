"""What is left out of a point spread function: nowhere does it change more than is told, and light that it loses is lost."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE, PITCH_UM, lens
from helpers.scene_builders import band_scene
from numpy.lib.stride_tricks import sliding_window_view

from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

RNG = np.random.default_rng(4)
LIGHT = 0.8
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


@pytest.mark.parametrize("name", [pytest.param("coma", marks=pytest.mark.slow), "lateral colour"])
def test_what_grows_towards_the_corners_is_not_left_out_by_the_middle(name):
    chosen = {
        "coma": Aberrations(coma_um=8.0),
        "lateral colour": Aberrations(chromatic=(ChromaticShift(500.0, 0.0, 40.0),)),
    }
    shot = random_shot(lens(1.4, aberrations=chosen[name]), 0.985, pixel_pitch_um=8.4)
    assert error_sigma(shot) < shot.tolerance


def save_lossy(path: Path, kernel: np.ndarray) -> Path:
    """A file of one kernel that holds LIGHT of a point's light."""
    np.savez(path, kernels=LIGHT * kernel.reshape(1, 1, 1, *kernel.shape) / kernel.sum(), light=LIGHT)
    return path


@pytest.mark.parametrize("tolerance", [0.1, 0.0])
@pytest.mark.parametrize("amplitude", [0.0, 1e-4, 0.8])
@pytest.mark.parametrize("depth_m", [math.inf, 60.0])
def test_light_that_kernels_lose_is_lost_in_scenes_of_any_contrast(tmp_path, depth_m, amplitude, tolerance):
    """Even ones, whose kernel is left out; all the same to the noise of their light."""
    planes = 1.0 - amplitude * (RNG.random((24, 36)) < 0.5)
    through = lens(4.0, psf=save_lossy(tmp_path / "lens.npz", np.ones((3, 3))))
    shot = Shot(band_scene(planes, depth_m), through, EXPOSURE, green_camera(36, 24), tolerance=tolerance)
    whole = dataclasses.replace(shot, lens=lens(4.0))
    found, lossless = (simulate(one).mean_electrons.astype(np.float64).mean() for one in (shot, whole))
    assert found / lossless == pytest.approx(LIGHT, rel=1e-6 if amplitude == 0.0 else 0.01)


def test_an_even_scene_behind_a_kernel_that_loses_light_needs_no_kernel(tmp_path):
    through = lens(4.0, psf=save_lossy(tmp_path / "lens.npz", np.ones((3, 3))))
    assert plan(Shot(band_scene(np.ones((24, 36)), math.inf), through, EXPOSURE, green_camera(36, 24))).optics.psf is None


def test_a_sharp_kernel_that_loses_light_is_left_out_and_its_light_is_lost(tmp_path):
    shot = random_shot(lens(4.0, psf=save_lossy(tmp_path / "lens.npz", np.ones((1, 1)))), 0.2)
    whole = dataclasses.replace(shot, lens=lens(4.0))
    assert plan(shot).optics.psf is None
    assert np.allclose(simulate(shot).mean_electrons, LIGHT * simulate(whole).mean_electrons, rtol=1e-6)


def test_a_file_of_kernels_may_be_named_by_a_text(tmp_path):
    """The same plan and light as by a path, and another light when the file has changed."""
    path = save_lossy(tmp_path / "lens.npz", np.ones((3, 3)))
    by_path = random_shot(lens(4.0, psf=path), 0.2)
    by_text = dataclasses.replace(by_path, lens=lens(4.0, psf=str(path)))
    assert by_text.lens == by_path.lens and plan(by_text).steps == plan(by_path).steps
    before = simulate(by_text).mean_electrons
    assert np.array_equal(before, simulate(by_path).mean_electrons)
    save_lossy(path, np.ones((5, 5)))
    assert not np.array_equal(simulate(by_text).mean_electrons, before)


@pytest.mark.parametrize("far_m", [100.0, 60.0])
def test_kernels_of_blur_radii_count_where_circles_of_an_ideal_lens_do_not(tmp_path, far_m):
    """A wall a sixth of a photosite out of focus, of which a half may lie farther: kernels of the focus left 10 sigma."""
    kernels = np.zeros((3, 1, 1, 5, 5))
    kernels[1, 0, 0, 2, 2], kernels[::2] = 1.0, 1.0 / 25.0
    np.savez(tmp_path / "lens.npz", kernels=kernels, blur_radii_px=[-1.0, 0.0, 1.0], fields=[0.0])
    through = lens(16.0, psf=tmp_path / "lens.npz")
    planes, depth_m = np.where(RNG.random((24, 48)) < 0.5, 0.2, 1.0), np.full((24, 48), 100.0, np.float32)
    depth_m[:, 24:] = far_m
    shot = Shot(
        band_scene(planes, depth_m, interpolation="nearest"), through, EXPOSURE, green_camera(48, 24, stages=SHOT_NOISE)
    )
    even = dataclasses.replace(shot, scene=band_scene(np.ones((24, 48)), depth_m, interpolation="nearest"))
    found, light_e = (simulate(one).mean_electrons.astype(np.float64) for one in (shot, even))
    around, share = sliding_window_view(np.pad(planes, 2, mode="edge"), (5, 5)).mean(axis=(2, 3)), np.zeros((24, 48))
    for own_m in (100.0, far_m):
        share[depth_m == np.float32(own_m)] = abs(float(through.blur_radius_um(own_m))) / PITCH_UM
    expected = light_e.mean() * ((1.0 - share) * planes + share * around)
    error = (np.abs(found - expected) / np.sqrt(expected))[:, np.abs(np.arange(48) - 23.5) > 3]
    assert share.max() < 0.3 and error.max() < shot.tolerance
