"""Diffraction, filter and aperture in the frame: against closed forms in float64, through the whole pipeline."""

import dataclasses
import math
import re

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.green_frames import EXPOSURE, FINE, GREEN_UM, PITCH_UM, electrons, lens, point_frame
from helpers.kernels_alone import electrons_by_kernels
from helpers.scene_builders import band_scene
from helpers.wave_optics import pupil_transfer
from scipy.special import j1

from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.psf_planning import plan_psf
from simulator.optics.pupil.pupil import Aperture
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window


def wave_frame(qx, qy, camera, through) -> np.ndarray:
    """Contrast of a wave of qx, qy cycles per photosite in the frame, over what it has in the scene."""
    y, x = ((np.arange(side * FINE) + 0.5) / FINE for side in (camera.height_px, camera.width_px))
    phase = 2.0 * math.pi * (qy * y[:, None] + qx * x[None, :])
    means = np.sinc(qx / FINE) * np.sinc(qy / FINE)  # over the scene's own pixels
    found = electrons(1.0 + 0.8 * means * np.cos(phase), camera, through, tolerance=0.02)
    y, x = np.arange(camera.height_px)[:, None] + 0.5, np.arange(camera.width_px)[None, :] + 0.5
    inner = slice(12, -12), slice(12, -12)  # beyond the scene its edge goes on
    phase = 2.0 * math.pi * (qy * y + qx * x)[inner]
    design = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)]).reshape(3, -1).T
    mean, cosine, sine = np.linalg.lstsq(design, found[inner].ravel(), rcond=None)[0]
    assert abs(sine) < 2e-3 * mean
    return cosine / mean / 0.8


WAVES = ((0.05, 0.0), (0.21, 0.13), (0.0, 0.61), (0.4, 0.7))


@pytest.mark.parametrize("f_number", [2.8, pytest.param(22.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("qx", "qy"), WAVES)
def test_a_wave_keeps_the_contrast_of_pupil_and_photosite(f_number, qx, qy):
    """To 0.007: a hundredth of the light comes from farther away than the frame is wide, where there is no wave."""
    found = wave_frame(qx, qy, green_camera(), lens(f_number, diffraction=True))
    expected = pupil_transfer(math.hypot(qx, qy) / PITCH_UM, f_number) * np.sinc(qx) * np.sinc(qy)
    assert found == pytest.approx(expected, abs=0.007)


@pytest.mark.parametrize(("fill_factor", "low_pass_um"), [(1.0, 2.2), (0.5, 3.0), (0.7, 3.0), (1.0, 5.0)])
@pytest.mark.parametrize(("qx", "qy"), WAVES)
def test_aperture_and_filter_have_their_transfer(fill_factor, low_pass_um, qx, qy):
    """The scene's pixels are even squares: waves of their grid beside that of q look the same to photosites."""
    camera = green_camera(fill_factor=fill_factor, low_pass_um=low_pass_um)
    side, apart = math.sqrt(fill_factor), low_pass_um / PITCH_UM
    images = np.arange(-400, 401)
    waves = [q + FINE * images for q in (qx, qy)]
    passed = [np.sinc(side * wave) * np.cos(math.pi * apart * wave) * np.sinc(wave / FINE) for wave in waves]
    expected = np.prod([np.sinc(q / FINE) * (1 - 2 * (images % 2)) @ one for q, one in zip((qx, qy), passed, strict=True)])
    assert wave_frame(qx, qy, camera, lens()) == pytest.approx(expected, abs=5e-4)


def airy_shares(side_px: int, f_number: float, fine: int = 45) -> np.ndarray:
    """Share of a point's light on each of side x side photosites around it: (2 J1(x) / x)^2 by the midpoint rule."""
    place = (np.arange(side_px * fine) + 0.5) / fine - 0.5 * side_px
    radius_um = PITCH_UM * np.hypot(place[:, None], place[None, :])
    x = np.maximum(math.pi * radius_um / (GREEN_UM * f_number), 1e-9)
    density = (2.0 * j1(x) / x) ** 2 * math.pi / (4.0 * (GREEN_UM * f_number) ** 2)
    return density.reshape(side_px, fine, side_px, fine).mean(axis=(1, 3)) * PITCH_UM**2


@pytest.mark.parametrize(("f_number", "tolerance"), [(8.0, 0.022), (22.0, 0.0095)])
def test_a_point_is_an_airy_disk_on_photosites(f_number, tolerance):
    """But for the width of the light. What falls beyond the frame, a square, is 0.18 lambda N over half its side."""
    camera = green_camera(121, 121)
    found, whole = (point_frame(camera, lens(f_number, diffraction=wave)) for wave in (True, False))
    beyond = 8.0 * math.sin(0.25 * math.pi) / math.pi**3 * GREEN_UM * f_number / (60.5 * PITCH_UM)
    assert found.sum() == pytest.approx((1.0 - beyond) * whole.sum(), rel=1.5e-3)
    shares, expected = found[55:66, 55:66] / whole.sum(), airy_shares(11, f_number)
    assert np.abs(shares - expected).max() < tolerance * expected.max()


DIM = 0.7
LENSES = {
    "sharp": (lens(4.0, diffraction=True), math.inf, {}),
    "field": (lens(8.0, aberrations=Aberrations(coma_um=0.5, zernike_um={11: 0.05})), math.inf, {}),
    "filter": (lens(), math.inf, {"low_pass_um": 3.0, "fill_factor": 0.6}),
    "distances": (ThinLens(50.0, 8.0, 2.0, cos4=False, diffraction=True), "slope", {}),
    "edges": (ThinLens(50.0, 8.0, 2.0, cos4=False, diffraction=True, aperture=Aperture(5)), "steps", {}),
    "blur first": (ThinLens(50.0, 2.0, 2.0, cos4=False), "slope", {"low_pass_um": 3.0}),
    "blur first, cat's eyes": (
        ThinLens(50.0, 2.0, 2.0, cos4=False, diffraction=True, vignetting=Vignetting(front=RoundStop(30.0, 24.7))),
        "slope",
        {"low_pass_um": 3.0},
    ),
    "hole": (Pinhole(0.1, 20.0, cos4=False, diffraction=True), 2.0, {}),
}
RNG = np.random.default_rng(9)
DEPTHS = {
    "slope": np.linspace(1.9, 2.15, 100, dtype=np.float32)[None, :].repeat(60, 0),
    "steps": RNG.choice([1.88, 2.0, 2.15], (6, 10)).repeat(10, 0).repeat(10, 1).astype(np.float32),
}


SLOW = "field", "edges", "blur first, cat's eyes"  # others have their methods
NAMES = [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in LENSES]


@pytest.mark.parametrize("name", NAMES)
def test_a_crop_has_the_bits_of_the_whole_frame(name):
    through, depth, settings = LENSES[name]
    cfa, bands = ("MONO", 1) if name not in ("sharp", "filter", "edges", "hole") else ("GRBG", 3)
    scene, camera = band_scene(RNG.random((60, 100, bands)), DEPTHS.get(depth, depth)), small_camera(150, 90, cfa, **settings)
    whole = simulate(Shot(scene, through, EXPOSURE, camera))
    for x, y, width, height in ((0, 0, 60, 31), (71, 37, 30, 51)):
        crop = simulate(Shot(scene, through, EXPOSURE, dataclasses.replace(camera, window=Window(x, y, width, height))))
        assert np.array_equal(crop.mean_electrons, whole.mean_electrons[y : y + height, x : x + width])


@pytest.mark.parametrize("name", [name for name in NAMES if name.values != ("blur first, cat's eyes",)])
def test_a_flat_field_stays_flat(name):
    """To 1e-6. A light in the far corner keeps the plan from skipping all of it, and is out of reach of the window."""
    through, depth, settings = LENSES[name]
    cfa, bands = ("MONO", 1) if name in ("field", "blur first", "distances") else ("RGGB", 3)
    planes = np.full((60, 100, bands), DIM)
    planes[-1, -1] = 2.0 * DIM
    camera = small_camera(1200, 720, cfa, window=Window(8, 6, 150, 130), **settings)
    planned = Shot(band_scene(planes, DEPTHS.get(depth, depth)), through, EXPOSURE, camera)
    optics = plan(planned).optics
    assert optics.psf is not None or optics.projection.footprints
    found = electrons_by_kernels(planned)  # their wings reach it
    for y, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        colour = found[y::2, x::2]
        assert np.max(np.abs(colour / colour.mean() - 1.0)) < 1e-6


def test_light_is_spread_beyond_the_frame_and_from_beyond_it():
    """A window that ends beside a point gets its light, one with the point loses what falls outside."""
    camera, through = green_camera(121, 121), lens(22.0, diffraction=True)
    whole = point_frame(camera, through)
    for window in (Window(61, 0, 60, 121), Window(0, 0, 61, 121)):
        crop = point_frame(dataclasses.replace(camera, window=window), through)
        assert np.array_equal(crop, whole[:, window.x : window.x + window.width]) and crop.sum() > 0.1 * whole.sum()


def test_what_is_skipped_agrees_with_what_would_have_been_done():
    """Kernels that are skipped because they move the scene's contrast by less than half the tolerance."""
    planes = 1.0 + 1e-6 * RNG.random((48, 64))
    shot = Shot(band_scene(planes, math.inf), lens(11.0, diffraction=True), Exposure(0.05), green_camera(low_pass_um=3.0))
    planned = plan(shot)
    assert planned.optics.psf is None
    told = re.fullmatch(r"changes nothing by more than (\S+) sigma", planned.optics.psf_skipped.reason)
    psf = plan_psf(shot.lens, planned.sensor.camera, planned.optics.scene, None, planned.optics.projection.scale)
    found, skipped = (
        open_device().download(expose(measure(one, open_device()), open_device()), (48, 64), np.float32).astype(np.float64)
        for one in (dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, psf=psf)), planned)
    )
    electrons_each = planned.sensor.stage("exposure").time_s * planned.sensor.stage("exposure").collecting_area_um2
    electrons_each *= planned.sensor.stage("irradiance").effective_solid_angle_sr
    z = electrons_each * (found - skipped) / np.sqrt(planned.sensor.moments(electrons_each * skipped.mean()).variance)
    assert 0.0 < np.abs(z).max() < float(told[1]) < 0.5 * shot.tolerance


@pytest.mark.parametrize("name", ["f/8", "filter", "small aperture", "out of focus"])
def test_a_light_in_the_dark_has_no_dark_ring_and_keeps_its_light(name):
    """A scene pixel as large as a photosite, 10,000 times its surroundings, which stay as bright as they are to 5 %.

    What they lose is the ringing of a light four times as bright; that of all of it would leave black holes.
    """
    through, settings, depth = lens(8.0, diffraction=name == "f/8"), {}, math.inf
    if name == "filter":
        settings = {"low_pass_um": 2.5}
    if name == "small aperture":
        settings = {"fill_factor": 0.5}
    if name == "out of focus":
        through, depth = ThinLens(50.0, 5.6, 2.0, cos4=False, diffraction=True), 2.3
    planes = np.full((101, 101), 1.0)
    planes[50, 50] = 1e4
    scene = band_scene(planes, depth, interpolation="nearest")
    found = electrons_by_kernels(Shot(scene, through, EXPOSURE, green_camera(101, 101, **settings)))
    assert found.min() > 0.95 * found[0, 0]
    assert (found - found[0, 0]).sum() == pytest.approx(9999.0 * found[0, 0], rel=1e-3)
