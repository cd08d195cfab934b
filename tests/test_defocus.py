"""Defocus by layers: exact for one depth, flat for flat light, and the same bits for any crop."""

import dataclasses
import math

import numpy as np
import pyopencl
import pytest
from conftest import band_scene, test_camera
from scipy.integrate import quad
from scipy.signal import convolve2d

from simulator.defocus import SHARP_PX, disk_chords, plan_layers
from simulator.device import Device
from simulator.exposure import Exposure
from simulator.lens import ThinLens
from simulator.pipeline import simulate
from simulator.sensor.camera import Window
from simulator.shot import Shot

EXPOSURE = Exposure(0.01)


def lens_with_blur(radius_px: float, pitch_um=5.0, behind=True) -> tuple[ThinLens, float]:
    """A lens and a depth whose blur circle has this radius [px]."""
    lens = ThinLens(50.0, 2.0, focus_distance_m=2.0, cos4=False)
    per_diopter = float(lens.blur_radius_um(math.inf)) * 2.0 / pitch_um  # radius per difference of 1/m
    return lens, 1.0 / (0.5 - (radius_px if behind else -radius_px) / per_diopter)


def electrons(planes, depth_m, lens, camera) -> np.ndarray:
    return simulate(Shot(band_scene(planes, depth_m), lens, EXPOSURE, camera)).mean_electrons.astype(np.float64)


def disk_by_chords(radius: float) -> np.ndarray:
    """The disk as kernel weights, from its exact area in each row, in float64 (by quadrature)."""
    half = int(math.ceil(radius)) + 1
    weights = np.zeros((2 * half + 1, 2 * half + 1))
    for row in range(-half, half + 1):
        low, high = max(row - 0.5, -radius), min(row + 0.5, radius)
        reach = quad(lambda t: math.sqrt(radius**2 - t**2), low, high)[0] if low < high else 0.0
        distance = np.abs(np.arange(-half, half + 1))
        weights[row + half] = np.clip(reach - (distance - 0.5), 0.0, 1.0)
        weights[row + half, half] = min(2 * reach, 1.0)
    return weights / weights.sum()


@pytest.mark.parametrize("radius", [0.7, 1.5, 3.3, 7.6, 15.5, 31.3])
def test_area_of_the_disk_is_exact_in_every_row(radius):
    chords, area = disk_chords(radius)
    assert area == pytest.approx(math.pi * radius**2, rel=1e-12)
    lengths = 2.0 * chords.sum(axis=1) + 1.0
    rows = np.arange(len(chords)) - len(chords) // 2
    for row, length in zip(rows, lengths, strict=True):
        t = row - 0.5 + (np.arange(200000) + 0.5) / 200000
        assert len(chords) % 2 == 1 and length == pytest.approx(
            2 * np.sqrt(np.clip(radius**2 - t**2, 0, None)).mean(), abs=1e-5
        )


@pytest.mark.parametrize("behind", [True, False])
@pytest.mark.parametrize("radius", [0.8, 2.0, 5.5, 12.3])
def test_one_depth_is_a_disk_convolution(radius, behind):
    """A fronto-parallel texture, with and without bright points, against convolution in float64."""
    rng = np.random.default_rng(7)
    texture = rng.gamma(4.0, 1.0, (90, 150)) + 1.0
    points = 500.0 * (rng.random((90, 150)) > 0.998)
    lens, depth = lens_with_blur(radius, behind=behind)
    camera = test_camera(150, 90)
    for planes in (texture, texture + points):
        sharp = electrons(planes, 2.0, lens, camera)
        expected = convolve2d(np.pad(sharp, 20, mode="edge"), disk_by_chords(radius), mode="same")[20:-20, 20:-20]
        error = np.abs(electrons(planes, depth, lens, camera) - expected)
        assert error.max() < 5e-6 * sharp.max()  # float32 of the largest running sum, 0.01 of the shot noise here
        assert np.median(error / expected) < 1e-6


def test_depth_steps_keep_a_flat_field_flat():
    """R21: light that is the same everywhere stays the same under any depth map, focus and aperture."""
    rng = np.random.default_rng(8)
    depth = np.where(rng.random((96, 160)) > 0.9, 1.0, np.linspace(1.2, 8.0, 160)[None, :]).astype(np.float32)
    for f_number, focus in ((1.4, 2.0), (4.0, 1.0), (2.0, math.inf)):
        lens = ThinLens(50.0, f_number, focus, cos4=False)
        for cfa, bands in (("MONO", 1), ("RGGB", 3)):
            found = electrons(np.full((96, 160, bands), 0.7), depth, lens, test_camera(480, 288, cfa))
            for y, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
                colour = found[y::2, x::2]
                assert np.max(np.abs(colour / colour.mean() - 1.0)) < 1e-6, (f_number, focus, cfa)


def test_a_point_keeps_its_light():
    planes = np.zeros((81, 81))
    planes[40, 40] = 1000.0
    lens, depth = lens_with_blur(9.0)
    camera = test_camera(81, 81)
    assert electrons(planes, depth, lens, camera).sum() == pytest.approx(electrons(planes, 2.0, lens, camera).sum(), rel=1e-5)


def test_a_crop_has_the_bits_of_the_whole_frame():
    rng = np.random.default_rng(9)
    scene = band_scene(rng.random((60, 100, 3)), rng.uniform(1.0, 4.0, (60, 100)).astype(np.float32))
    lens, camera = ThinLens(50.0, 2.0, 2.0), test_camera(300, 180, "GRBG")
    whole = simulate(Shot(scene, lens, EXPOSURE, camera))
    for x, y, width, height in ((0, 0, 120, 60), (131, 37, 90, 101), (170, 80, 130, 100)):
        crop = simulate(Shot(scene, lens, EXPOSURE, dataclasses.replace(camera, window=Window(x, y, width, height))))
        assert np.array_equal(crop.mean_electrons, whole.mean_electrons[y : y + height, x : x + width])


def test_sharp_depths_plan_no_blur():
    lens, depth = lens_with_blur(SHARP_PX * 0.99)
    assert plan_layers(lens, 5.0, depth) is None
    assert plan_layers(lens, 5.0, lens_with_blur(SHARP_PX * 1.01)[1]).radii_px == pytest.approx((SHARP_PX * 1.01,))


def test_layers_run_from_near_to_far_in_steps_of_the_radius():
    lens = ThinLens(50.0, 2.0, 2.0)
    depth = np.array([[0.8, 1.0, 2.0, 4.0, math.inf]], dtype=np.float32)
    layers = plan_layers(lens, 5.0, depth)
    signed = lens.blur_radius_um(depth) / 5.0
    assert np.all(np.diff(layers.scene_layers.astype(int)) > 0)
    assert (
        np.max(np.abs(np.array(layers.radii_px)[layers.scene_layers] - np.abs(signed))) <= 2.0
    )  # half of a 4-pixel step: 231 pixels in at most 64 layers


def test_an_occluder_in_focus_keeps_its_edge():
    """A dark near half-plane in focus before a bright wall: no light of the wall may come onto it (the slab-and-add fault)."""
    depth = np.where(np.arange(160) < 80, 2.0, 8.0)[None, :].repeat(96, 0).astype(np.float32)
    planes = np.where(np.arange(160) < 80, 0.0, 1.0)[None, :].repeat(96, 0)
    lens = ThinLens(50.0, 2.0, 2.0, cos4=False)
    found = electrons(planes, depth, lens, test_camera(160, 96))
    assert found[:, :80].max() == 0.0
    assert found[:, 81:].min() > 0.999 * found.max()


def test_memory_that_no_pass_wrote_is_not_read(monkeypatch):
    """Every new buffer of floats is filled with NaN; none may reach the frame."""

    def poisoned(device, shape, dtype):
        buffer = empty(device, shape, dtype)
        if np.dtype(dtype) == np.float32:
            fill = np.full(buffer.size // 4, np.nan, np.float32)
            pyopencl.enqueue_copy(device._queue, buffer, fill)
        return buffer

    empty = Device.empty
    monkeypatch.setattr(Device, "empty", poisoned)
    rng = np.random.default_rng(0)
    for cfa, size, window in (("GRBG", (90, 40), None), ("RGGB", (90, 40), Window(31, 17, 50, 20)), ("MONO", (700, 300), None)):
        camera = test_camera(*size, cfa, window=window)
        scene = band_scene(rng.random((20, 30, camera.channels)), rng.uniform(1.5, 3.0, (20, 30)).astype(np.float32))
        raw = simulate(Shot(scene, ThinLens(50.0, 2.0, 2.0), EXPOSURE, camera))
        assert np.isfinite(raw.mean_electrons).all() and np.isfinite(raw.noise_free_dn).all()


def covered_by_left(edge: int, radius: float) -> np.ndarray:
    """Share of a disk of this radius left of a column, mean over each photosite: 1/2 + (t sqrt(1 - t^2) + asin t) / pi."""
    t = np.clip(-(np.arange(160)[:, None] + (np.arange(100) + 0.5) / 100 - edge) / radius, -1.0, 1.0)
    return (0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / math.pi).mean(axis=1)


def half_planes(near_px: float, far_px: float, near: float, far: float) -> np.ndarray:
    """A row of light, left half near, right half far, each uniform and of this blur radius [px]; 1 is plane weight 1."""
    lens, near_depth = lens_with_blur(near_px, behind=False)
    far_depth = lens_with_blur(far_px)[1] if far_px else 2.0
    left = np.arange(160) < 80
    depths = np.where(left, near_depth, far_depth)[None, :].repeat(96, 0).astype(np.float32)
    planes = np.where(left, near, far)[None, :].repeat(96, 0)
    camera = test_camera(160, 96)
    return electrons(planes, depths, lens, camera)[48] / electrons(np.ones((96, 160)), 2.0, lens, camera)[48]


def test_the_penumbra_of_a_defocused_edge_follows_its_closed_form():
    """Near half-plane out of focus before a background in focus: T = F A + B (1 - A), on the side where nothing is hidden."""
    found, covered = half_planes(12.0, 0.0, 0.2, 1.0), covered_by_left(80, 12.0)
    assert np.max(np.abs(found - (0.2 * covered + (1.0 - covered)))[80:]) < 2e-3
    assert np.allclose(found[:60], 0.2, rtol=1e-6)


def test_where_no_surface_is_known_the_known_ones_stand_in():
    """Both half-planes out of focus, the far one unknown behind the near: T = (A F + (1 - A) b B) / (A + (1 - A) b)."""
    found = half_planes(12.0, 8.0, 0.2, 1.0)
    covered, behind = covered_by_left(80, 12.0), 1.0 - covered_by_left(80, 8.0)
    seen = covered + (1.0 - covered) * behind
    assert np.max(np.abs(found - (0.2 * covered + (1.0 - covered) * behind) / seen)) < 4e-3
