"""What small circles leave where they are left out, or met by rays, against sums over fine parts in float64."""

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.signal import fftconvolve

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.predicted_error import ignored_error, ray_terms
from simulator.optics.defocus.scene_contrast import SceneContrast
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

GAPS_PX = {(0.75, 0.0): 0.125, (0.5, 0.0): 0.25, (0.75, 0.5): 0.125, (1.0, 0.25): 0.125}  # by open side and spots' distance


@pytest.mark.parametrize("is_linear", [True, False])
def test_small_circles_count_by_bends_where_photosites_do_not_read_single_pixels(is_linear):
    """Random pixels, linear between their middles, or even squares over whose borders circles go: in float64."""
    parts, side, radius_px = 24, 40, 0.17
    light = np.random.default_rng(7).random((side, side))
    places = (np.arange(-8, side * parts + 8) + 0.5) / parts - 0.5
    y, x = np.meshgrid(places, places, indexing="ij")
    pixels = map_coordinates(light, (y, x) if is_linear else (np.rint(y), np.rint(x)), order=1, mode="nearest")
    spread = fftconvolve(pixels, disk_weights(parts * radius_px), mode="same")
    if is_linear:
        pixels, spread = (
            one[8 + parts // 2 - 1 : -8 : parts, 8 + parts // 2 - 1 : -8 : parts]
            + one[8 + parts // 2 : -8 : parts, 8 + parts // 2 : -8 : parts]
            for one in (0.5 * pixels, 0.5 * spread)
        )
    else:
        pixels, spread = (one[8:-8, 8:-8].reshape(side, parts, side, parts).mean(axis=(1, 3)) for one in (pixels, spread))
    bends = max(float(np.quantile(np.abs(np.diff(light, 2, axis=axis)), 0.999)) for axis in (0, 1))
    left = float(np.quantile(np.abs(spread - pixels)[2:-2, 2:-2], 0.999))
    accuracy = Accuracy(electrons=1000.0)
    (term,) = ignored_error(accuracy, radius_px, SceneContrast(curvature=bends))
    assert 0.4 * term.sigma < accuracy.in_sigma(left) <= term.sigma
    assert ignored_error(accuracy, radius_px, SceneContrast(curvature=bends), reads_pixels=True)[0].sigma == 0.0


@pytest.mark.parametrize("open_side", [1.0, 0.7, 0.5])
def test_light_that_bends_in_the_open_part_of_a_photosite_counts_there(open_side):
    """Random columns two photosites wide, linear between their middles, in float64: a small open side holds all of a bend."""
    parts, side, radius_px = 20, 200, 0.23
    light = np.random.default_rng(8).random(side // 2)
    places = (np.arange(side * parts) + 0.5) / (2 * parts) - 0.25  # middles of columns in those of photosites
    pixels = np.interp(places, np.arange(side // 2), light)
    lost = pixels - np.convolve(pixels, disk_weights(parts * radius_px).sum(axis=0), mode="same")
    first = round(0.5 * (1.0 - open_side) * parts)
    left = np.abs(lost.reshape(side, parts)[2:-2, first : parts - first].mean(axis=1)).max()
    accuracy = Accuracy(electrons=1000.0)
    contrast = SceneContrast(curvature=0.5 * float(np.abs(np.diff(light, 2)).max()))
    (term,) = ignored_error(accuracy, radius_px, contrast, scale=0.5, open_side=open_side)
    assert 0.9 * term.sigma < accuracy.in_sigma(left) <= term.sigma


@pytest.mark.parametrize(("open_side", "apart_px"), [(0.75, 0.0), (0.5, 0.0), (0.75, 0.5), (1.0, 0.25)])
@pytest.mark.parametrize("radius_px", [0.12, 0.17, 0.35])
def test_circles_that_end_before_the_borders_of_open_areas_leave_nothing(open_side, apart_px, radius_px):
    """Random even squares, one per photosite, around whose open parts circles pass the border, in float64."""
    parts, side, inner = 48, 24, slice(2, -2)
    light = np.random.default_rng(9).random((side, side))
    pixels = np.kron(light, np.ones((parts, parts)))
    spots = [round(0.5 * way * apart_px * parts) for way in (-1, 1)]

    def opened(values: np.ndarray) -> np.ndarray:
        """Mean of the four spots in the open area."""
        values = np.mean([np.roll(values, (down, right), axis=(0, 1)) for down in spots for right in spots], axis=0)
        shut = round(0.5 * (1.0 - open_side) * parts)
        part = slice(shut, parts - shut)
        return values.reshape(side, parts, side, parts)[inner, part, inner, part].mean(axis=(1, 3))

    blurred = fftconvolve(pixels, disk_weights(parts * radius_px), mode="same")
    left = float(np.quantile(np.abs(opened(blurred) - opened(pixels)), 0.999))
    bends = max(float(np.quantile(np.abs(np.diff(light, 2, axis=axis)), 0.999)) for axis in (0, 1))
    accuracy, gap_px = Accuracy(electrons=1000.0), GAPS_PX[open_side, apart_px]
    (term,) = ignored_error(accuracy, radius_px, SceneContrast(curvature=bends), open_side=open_side, gap_px=gap_px)
    assert 0.1 * term.sigma - 1e-9 <= accuracy.in_sigma(left) <= term.sigma + 1e-9
    assert (term.sigma == 0.0) == (radius_px <= gap_px)


@pytest.mark.parametrize("radius_px", [0.03, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("scale", [0.5, 1.0])
def test_samples_that_rays_meet_leave_what_is_told_of_light_that_bends_in_them(scale, radius_px):
    """Random squares, linear between their middles: 8 x 8 even samples of a photosite in place of the light."""
    parts, samples, side = 64, 8, 32
    light = (np.random.default_rng(1).random((side + 3, side + 3)) > 0.5).astype(float)
    places = scale * (np.arange(side * parts) + 0.5) / parts + 0.5
    pixels = map_coordinates(light, np.meshgrid(places, places, indexing="ij"), order=1)
    wide = parts // samples
    even = np.kron(pixels.reshape(side * samples, wide, -1, wide).mean(axis=(1, 3)), np.ones((wide, wide)))
    spread = fftconvolve(even - pixels, disk_weights(parts * radius_px), mode="same")
    left = np.quantile(np.abs(spread.reshape(side, parts, side, parts).mean(axis=(1, 3))[2:-2, 2:-2]), 0.999)
    bends = scale * max(float(np.quantile(np.abs(np.diff(light, 2, axis=axis)), 0.999)) for axis in (0, 1))
    planned = plan(Shot(band_scene(light, depth_of(radius_px)), LENS, Exposure(1e-3), small_camera(side, side), tolerance=0.0))
    (term,) = ray_terms(planned.optics.defocus, SceneContrast(curvature=bends), is_smooth=True)
    assert 0.4 * term.sigma < planned.optics.accuracy.in_sigma(float(left)) <= term.sigma
