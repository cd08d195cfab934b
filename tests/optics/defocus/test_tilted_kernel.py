"""The aperture's image on a tilted surface: against lines through the pupil, closed forms and rays."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import blurred_case
from helpers.lens_truths import Case, slanted_plane
from helpers.scene_builders import band_scene
from scipy.stats import qmc

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_kernel import make_taps, photosite_weights
from simulator.optics.defocus.photosite_area import WHOLE, PhotositeArea
from simulator.optics.defocus.tilted_kernel import tilted_weights
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window


def image_of(pupil: Pupil, radius: float, slope: tuple[float, float], samples_per_axis: int) -> np.ndarray:
    """Weights of one image."""
    return tilted_weights(pupil, np.array([radius]), np.array([slope]), samples_per_axis)[0]


def met_by_lines(pupil: Pupil, radius: float, slope: tuple[float, float], half: int) -> np.ndarray:
    """Share of lines through the pupil that meet each cell of a plane, s(w) = radius + slope . w, w = s(w) u."""
    place = np.linspace(-1.6, 1.6, 1601)
    u = np.stack(np.meshgrid(place, place), axis=-1).reshape(-1, 2)
    u = u[pupil.contains(u)]
    met = radius * u / (1.0 - u @ slope)[:, None]
    cells = np.rint(met).astype(int) + half
    counted = np.zeros((2 * half + 1, 2 * half + 1))
    np.add.at(counted, (cells[:, 1], cells[:, 0]), 1.0 / len(u))
    return counted


@pytest.mark.parametrize("pupil", [Pupil(), Pupil(3, rotation_deg=20.0)])
@pytest.mark.parametrize(("radius", "slope"), [(2.4, (0.12, 0.05)), (-6.3, (0.05, -0.15)), (11.0, (-0.02, 0.2))])
def test_weights_are_the_share_of_the_lines_that_meet_a_point(pupil, radius, slope):
    """Cell by cell where steps are one row, with the sum and the centre of each column where they are longer."""
    found = image_of(pupil, radius, slope, 1)
    half = found.shape[0] // 2
    expected = met_by_lines(pupil, radius, slope, half)
    assert found.sum() == pytest.approx(1.0, abs=1e-12)
    rows = np.arange(-half, half + 1)[:, None]
    assert np.abs(found - expected).max() < 0.1 * found.max()
    assert np.abs(found.sum(axis=0) - expected.sum(axis=0)).max() < 2e-3
    assert (found * rows).sum() == pytest.approx((expected * rows).sum(), abs=5e-3)
    assert (found * rows.T).sum() == pytest.approx((expected * rows.T).sum(), abs=5e-3)


@pytest.mark.parametrize(("radius", "samples_per_axis"), [(9.5, 1), (7.0, 2), (30.0, 1)])
def test_mirrored_slopes_have_mirrored_weights(radius, samples_per_axis):
    """Of a round pupil; a radius of the other sign turns the image by half a turn. A triangle has its own directions."""
    first = image_of(Pupil(), radius, (0.06, 0.09), samples_per_axis)
    assert np.array_equal(image_of(Pupil(), radius, (-0.06, 0.09), samples_per_axis), first[:, ::-1])
    assert np.array_equal(image_of(Pupil(), radius, (0.06, -0.09), samples_per_axis), first[::-1])
    assert np.array_equal(image_of(Pupil(), -radius, (0.06, 0.09), samples_per_axis), first[::-1, ::-1])
    blades = Pupil(3, rotation_deg=20.0)
    one, other = (image_of(blades, radius, (slope, 0.09), samples_per_axis) for slope in (0.06, -0.06))
    assert np.abs(other - one[:, ::-1]).max() > 0.1 * one.max()


@pytest.mark.parametrize(("radius", "samples_per_axis"), [(0.7, 2), (3.3, 1), (-7.6, 2)])
def test_without_a_slope_it_is_the_image_of_the_aperture(radius, samples_per_axis):
    flat, tilted = (
        photosite_weights(Pupil(), radius, samples_per_axis),
        image_of(Pupil(), radius, (0.0, 0.0), samples_per_axis),
    )
    spare = (tilted.shape[0] - flat.shape[0]) // 2
    assert np.abs(np.pad(flat, spare) - tilted).max() < 4e-3 * flat.max()


def test_images_that_are_made_together_have_the_bits_of_each_alone():
    """Images of one size and of others, whole photosites and parts of samples."""
    rng = np.random.default_rng(4)
    radii, slopes = rng.normal(0.0, 6.0, 24), rng.normal(0.0, 0.05, (24, 2))
    radii[:4] = 0.0, 0.01, -0.3, 0.5
    for pupil in (Pupil(), Pupil(5, rotation_deg=20.0)):
        for area, samples_per_axis in ((WHOLE, 1), (PhotositeArea(open_side=0.7), 2), (PhotositeArea(True, 2), 2)):
            together = tilted_weights(pupil, radii, slopes, samples_per_axis, area)
            for radius, slope, found in zip(radii, slopes, together, strict=True):
                (alone,) = tilted_weights(pupil, np.array([radius]), slope[None], samples_per_axis, area)
                assert np.array_equal(found, alone)


@pytest.mark.parametrize(
    ("radius", "slope"), [(0.0, (0.05, 0.03)), (0.376, (0.003, 0.013)), (0.376, (0.15, 0.1)), (0.9, (0.05, 0.03))]
)
@pytest.mark.parametrize("samples_per_axis", [2, 4])
def test_even_squares_have_the_share_of_lines_from_all_of_the_photosite(radius, slope, samples_per_axis):
    """Random greys, to a thousandth of their range, by 2^18 lines, each with the radius at its place."""
    draws, size = qmc.Sobol(4, seed=1).random(2**18), 8 * samples_per_axis
    place = draws[:, :2] - 0.5
    pupil = np.stack(Pupil().map_unit_square(draws[:, 2], draws[:, 3]), axis=-1)
    met = place + (radius + place @ slope)[:, None] * pupil / (1.0 - pupil @ slope)[:, None]
    cells = np.floor((met + 4.0) * samples_per_axis).astype(int)
    expected = np.bincount(cells[:, 1] * size + cells[:, 0], minlength=size**2) / len(draws)
    (found,) = tilted_weights(
        Pupil(), np.array([radius]), np.array([slope]), samples_per_axis, PhotositeArea(True, samples_per_axis)
    )
    greys = np.random.default_rng(0).random((1000, size, size))
    missed = greys * (np.pad(found, (size - len(found)) // 2) - expected.reshape(size, size))
    assert np.abs(missed.sum(axis=(1, 2))).max() < 1e-3


def test_a_large_image_needs_few_taps():
    """Weights change from row to row; as steps they take a number of taps that grows with the radius, not with its square."""
    taps = [len(make_taps([image_of(Pupil(), radius, (0.1, 0.1), 1)])[0].weights) for radius in (10.0, 20.0, 40.0)]
    assert taps[1] < 2.2 * taps[0] and taps[2] < 2.2 * taps[1]


@pytest.mark.parametrize(
    "slope", [(0.0, 0.02), *(pytest.param(one, marks=pytest.mark.slow) for one in ((-0.1, 0.05), (0.1, 0.173)))]
)
def test_a_tilted_plane_is_met(slope):
    """Its closed form to a tenth of the noise of 2000 e-, where a photosite's own radius alone leaves up to 0.7.

    `test_closed_forms_are_met` has another slope.
    """
    case = slanted_plane(slope, 4)
    assert statistics(z_scores(blurred_case(case), case.truth, 2000.0)).p99_9 < 0.1


@pytest.mark.slow
def test_a_curved_surface_follows_its_rays(bench):
    """The slope changes from tile to tile and inside them; 8192 rays per photosite."""
    rows, columns, margin, samples_per_axis = 64, 144, 12, 2
    y, x = ((np.arange(size * samples_per_axis) + 0.5) / samples_per_axis for size in (rows, columns))
    y, x = y[:, None], x[None, :]
    radius = 6.0 - 0.0011 * ((x - 20.0) ** 2 + (y - 60.0) ** 2) ** 0.5 * 40.0
    wave = np.cos(2.0 * math.pi * (0.06 * x + 0.02 * y)) + np.sin(2.0 * math.pi * (0.03 * x - 0.07 * y))
    light = 0.5 + 0.2 * wave
    inner = (rows - 2 * margin, columns - 2 * margin)
    case = Case("bowl", light[None], np.ones((1, *light.shape)), radius[None], np.zeros(inner), margin, samples_per_axis, False)
    surfaces = upload_surfaces(bench.device, light[None, None], case.coverage, case.radius_px, margin, samples_per_axis)
    rays = sample_lens(bench.device, surfaces, ray_samples(8192), Window(0, 0, inner[1], inner[0]), cells=False)
    expected = bench.device.download(rays, inner, np.float32)
    found = statistics(z_scores(blurred_case(case), expected, 2000.0))
    flat = dataclasses.replace(case, radius_px=np.full_like(case.radius_px, 3.0))
    assert found.p99 < 0.15, found
    assert statistics(z_scores(blurred_case(flat), expected, 2000.0)).p99 > 1.0


def test_a_crop_of_a_tilted_surface_has_the_bits_of_the_whole():
    """Slopes belong to tiles of the sensor, also where a tile reaches over the sensor's edge."""
    rng = np.random.default_rng(9)
    depth = 1.0 / (0.5 - 0.0004 * np.mgrid[:180, :300][1] + 0.0003 * np.mgrid[:180, :300][0])
    scene = band_scene(rng.random((180, 300, 3)), depth.astype(np.float32))
    camera, lens = small_camera(300, 180, "GRBG"), ThinLens(50.0, 2.0, 2.0)
    whole = simulate(Shot(scene, lens, Exposure(0.01), camera))
    for x, y, width, height in ((0, 0, 120, 60), (131, 37, 90, 101), (170, 80, 130, 100)):
        window = dataclasses.replace(camera, window=Window(x, y, width, height))
        crop = simulate(Shot(scene, lens, Exposure(0.01), window))
        assert np.array_equal(crop.mean_electrons, whole.mean_electrons[y : y + height, x : x + width])
