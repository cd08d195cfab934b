"""Contrast of the light between photosites: of layers before what is behind them, and in the noise of the dark."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from audit.shot_truth import run, z_scores
from helpers.camera_builders import small_camera
from helpers.lens_frame import case_shot
from helpers.scene_builders import band_scene
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.signal import fftconvolve

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate

SIDE, PARTS = 36, 24  # photosites of a frame, and parts of each along an axis in which its light is summed


def cover_of(kind: str, pixels: int) -> np.ndarray:
    """Random pixels that are open or not, or blobs of several of them."""
    random = (np.random.default_rng(3).random((pixels, pixels)) < 0.5).astype(float)
    smooth = gaussian_filter(random, 2.0)
    return random if kind == "pixels" else (smooth > np.median(smooth)).astype(float)


def light_behind(cover: np.ndarray, scale: float, radius_px: float) -> np.ndarray:
    """Share of an even wall that photosites see past a layer whose circles have this radius, (SIDE, SIDE) float64."""
    places = scale * (np.arange(SIDE * PARTS) + 0.5) / PARTS - 0.5
    fine = map_coordinates(1.0 - cover, np.meshgrid(places, places, indexing="ij"), order=int(scale < 1.0), mode="nearest")
    beside = int(PARTS * (radius_px + 1.0))
    behind = fftconvolve(np.pad(fine, beside, "edge"), disk_weights(PARTS * radius_px), mode="same")
    return behind[beside:-beside, beside:-beside].reshape(SIDE, PARTS, SIDE, PARTS).mean(axis=(1, 3))


@pytest.mark.parametrize("kind", ["pixels", "blobs"])
@pytest.mark.parametrize(
    ("scale", "dark", "near_px", "far_px"),
    [
        (0.5, 0.0, 0.15, 0.0),
        (0.5, 0.0, 0.25, -0.1),
        (0.5, 0.0, 0.45, -0.2),
        (0.5, 0.0, 4.0, -1.0),
        (0.5, 0.02, 0.25, -0.1),
        (2.0, 0.0, 0.25, -0.1),
        (3.0, 0.05, 0.15, 0.0),
        (3.0, 0.02, 0.7, 0.0),
    ],
)
def test_a_dark_layer_before_an_even_wall_leaves_what_is_told(device, kind, scale, dark, near_px, far_px):
    """Neither has any detail but the border of the layer, whose own light says nothing of it."""
    cover = cover_of(kind, round(SIDE * scale))
    light = np.stack([dark * cover, np.ones_like(cover)])
    layers = {"colour": light, "coverage": np.stack([cover, np.ones_like(cover)]), "oversampling": scale}
    shot = case_shot(SimpleNamespace(**layers, radius_px=[np.full_like(cover, near_px), np.full_like(cover, far_px)]), 2e4, 0.3)
    planned = measure(plan(shot), device)
    seen = light_behind(cover, scale, near_px)
    truth = planned.optics.accuracy.electrons * (dark + (1.0 - dark) * seen)
    left = np.quantile(np.abs(z_scores(run(planned, shot, device), truth, planned)), 0.999)
    told = planned.error_budget.predicted_sigma
    assert 0.05 * told < left <= told


@pytest.mark.parametrize("depth_m", [2.02, 2.1])  # circles of 0.3 and 1.5 photosites
@pytest.mark.parametrize("rows", [1, 3])
@pytest.mark.parametrize("is_turned", [False, True])
def test_a_scene_of_few_rows_or_columns_leaves_what_is_told(device, depth_m, rows, is_turned):
    """Half a pixel per photosite, all rows alike, against sums over photosite and circle in float64."""
    line = np.random.default_rng(0).uniform(0.1, 1.0, 9)
    pixels, size = np.repeat(line[None], -(-rows // 2), axis=0), (18, rows)
    pixels, size = (pixels.T, size[::-1]) if is_turned else (pixels, size)
    lens = ThinLens(50.0, 4.0, 2.0, cos4=False)
    shot = Shot(band_scene(pixels, depth_m), lens, Exposure(0.01), small_camera(*size))
    parts = (np.arange(256) + 0.5) / 256
    circle_px = float(lens.blur_radius_um(depth_m)) / shot.camera.pixel_pitch_um * np.cos(2.0 * np.pi * parts)
    circle_px = np.sqrt(parts)[:, None] * circle_px  # rings of even area
    places = np.arange(18)[:, None] + (np.arange(32) + 0.5) / 32
    light = np.interp(0.5 * (places[..., None] + circle_px.ravel()) - 0.5, np.arange(9), line).mean(axis=(1, 2))
    planned = measure(plan(shot), device)
    even = dataclasses.replace(shot, scene=band_scene(np.ones_like(pixels), depth_m))
    electrons = float(simulate(even).mean_electrons.max())
    found = simulate(shot).mean_electrons.astype(np.float64).reshape(size[::-1])
    truth = electrons * (light[:, None] if is_turned else light[None])
    left = np.max(np.abs(found - truth) / np.sqrt(truth))
    told = planned.error_budget.predicted_sigma
    assert 0.1 < left < 1.03 * told < 2.0 * left  # it is told of nearly all photosites, and this is the worst
