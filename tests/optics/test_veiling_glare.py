"""Scattered light lies evenly on the sensor, as much as the image has lost, whatever part of the sensor is read."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

import simulator
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.optics.veiling_glare import VeilingGlare, add_veiling_glare
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window
from simulator.sensor.stages.irradiance import Irradiance

CHART = Path(__file__).parents[2] / "configs" / "shots" / "color_checker.yaml"
GLARE = 0.03
LENS = ThinLens(50.0, 4.0, 2.0, cos4=False)
WIDE = ThinLens(0.3, 4.0, 2.0)  # mm, before 0.32 mm of photosites: cos^4 falls to 0.51 in the corner


def electrons(planes, lens=LENS, glare=GLARE, cfa="MONO", depth_m=2.0, scene=(), **settings) -> np.ndarray:
    """Mean electrons of a frame, float64."""
    planes = np.asarray(planes)
    camera = small_camera(planes.shape[1], planes.shape[0], cfa, **settings)
    taken = band_scene(planes, depth_m, interpolation="nearest", **dict(scene))
    return simulate(Shot(taken, replace(lens, veiling_glare=glare), Exposure(1.0), camera)).mean_electrons.astype(np.float64)


def texture(*shape, seed=5) -> np.ndarray:
    return np.random.default_rng(seed).gamma(1.0, 1.0, shape)


@pytest.mark.parametrize("vignetting", [(), (1.0, 0.7, 0.2)])
def test_the_kernel_adds_the_veil_that_the_fall_off_will_not_dim(device, vignetting):
    stage = Irradiance(0.05, 1e-5, 100.0, 80.0, vignetting, 0.01 * bool(vignetting))
    mosaic, glare = texture(60, 90).astype(np.float32), VeilingGlare(0.25, np.array([0.02, 0.3, 0.001]))
    camera = small_camera(200, 160, "GRBG", window=Window(40, 31, 90, 60))
    buffer = device.upload(mosaic)
    add_veiling_glare(device, buffer, glare, stage, camera.filter.macros(40, 31), camera.frame)
    y, x = np.mgrid[31:91, 40:130]
    open_ = 0.05 * stage.relative_illumination(np.hypot(x + 0.5 - 100.0, y + 0.5 - 80.0))
    channel = np.array([[1, 0], [2, 1]])[y % 2, x % 2]  # GRBG
    expected = 0.75 * mosaic.astype(np.float64) + glare.irradiance[channel] / open_
    assert np.allclose(device.download(buffer, mosaic.shape, np.float32), expected, rtol=3e-6)


def test_a_small_black_patch_in_a_white_field_shows_the_veiling_glare_index():
    """ISO 9358: irradiance in the patch over that of the field; the patch itself gives no light to the mean."""
    planes = np.ones((300, 400))
    planes[148:152, 198:202] = 0.0
    frame, mean = electrons(planes), 1.0 - 16 / 120000
    assert frame[150, 200] / frame[10, 10] == pytest.approx(GLARE * mean / (1.0 - GLARE + GLARE * mean), rel=1e-6)
    assert frame[150, 200] / electrons(planes, glare=0.0)[10, 10] == pytest.approx(GLARE * mean, rel=1e-6)


@pytest.mark.parametrize("glare", [1e-3, 0.03, 0.9])
@pytest.mark.parametrize("cfa", ["MONO", "GRBG"])
def test_a_flat_field_stays_as_it_is(glare, cfa):
    planes = 7.0 * np.ones((48, 64) if cfa == "MONO" else (48, 64, 3))
    assert np.allclose(electrons(planes, glare=glare, cfa=cfa), electrons(planes, glare=0.0, cfa=cfa), rtol=1e-6)


def image_distance_mm(lens) -> float:
    return lens.distance_mm if isinstance(lens, Pinhole) else 1.0 / (1.0 / lens.focal_length_mm - 1e-3 / lens.focus_distance_m)


def cos4(lens, height=48, width=64) -> np.ndarray:
    """Fall-off over a sensor with photosites of 5 um."""
    y, x = np.mgrid[:height, :width] + 0.5
    square = (x - 0.5 * width) ** 2 + (y - 0.5 * height) ** 2
    return 1.0 / (1.0 + square * (5e-3 / image_distance_mm(lens)) ** 2) ** 2 if lens.cos4 else np.ones((height, width))


@pytest.mark.parametrize("cfa", ["MONO", "RGGB", "GBRG"])
@pytest.mark.parametrize("lens", [LENS, WIDE, Pinhole(0.001, 0.3, diffraction=False)])
def test_the_veil_is_the_mean_of_the_irradiance_in_each_colour(cfa, lens):
    """Also behind a lens whose light falls off: what is scattered does not. Float64 from the picture and cos^4."""
    planes = texture(48, 64, 1) if cfa == "MONO" else texture(48, 64, 3) * [3.0, 0.1, 1.0]
    places = {"MONO": [[0, 0], [0, 0]], "RGGB": [[2, 1], [1, 0]], "GBRG": [[1, 0], [2, 1]]}  # bands rise: blue, green, red
    band = np.tile(places[cfa], (24, 32))
    irradiance = planes * cos4(lens)[..., None]
    own = np.take_along_axis(irradiance, band[..., None], axis=2)[..., 0]
    expected = (1.0 - GLARE) * own + GLARE * irradiance.mean(axis=(0, 1))[band]
    ratio = electrons(planes, lens, cfa=cfa) / expected
    # Photosites of so wide a view see the fall-off at their centre, the mean its integral: 1e-5 of it.
    assert np.allclose(ratio, electrons(planes, lens, 0.0, cfa) / own, rtol=2e-5)


@pytest.mark.parametrize("lens", [LENS, WIDE])
def test_no_light_is_made_or_lost(lens):
    planes = texture(300, 400)
    assert electrons(planes, lens).sum() == pytest.approx(electrons(planes, lens, 0.0).sum(), rel=2e-6)


def test_light_that_a_psf_loses_is_not_scattered(tmp_path):
    """A file whose kernel keeps 0.8 of the light, in one photosite."""
    np.savez(tmp_path / "lens.npz", kernels=np.full((1, 1, 1, 1, 1), 0.8), light=0.8)
    planes = texture(48, 64)
    lossy = replace(LENS, psf=tmp_path / "lens.npz")
    assert np.allclose(electrons(planes, lossy), 0.8 * electrons(planes), rtol=1e-6)


def test_a_window_has_the_bits_of_the_whole_sensor():
    planes, window = texture(120, 200, 3), Window(63, 40, 70, 50)
    near = np.zeros((120, 200), np.float32)
    near[30:70, 60:110] = 1.0
    scene = {"coverage": near, "behind": (Layer(texture(120, 200, 3, seed=6).astype(np.float32), 9.0),)}
    planes = planes * near[..., None]
    settings = {"cfa": "RGGB", "depth_m": 1.0, "scene": scene, "pixel_pitch_um": 100.0}
    lens = replace(LENS, cos4=True)  # 0.93 in the corner of 20 mm x 12 mm
    whole, part = (electrons(planes, lens, window=read, **settings) for read in (None, window))
    assert np.array_equal(part, whole[40:90, 63:133])
    assert not np.array_equal(part, electrons(planes, lens, 0.0, window=window, **settings))


def test_layers_scatter_what_a_pinhole_sees_of_them():
    """A grey layer that half covers a white wall, both at the plane in focus, then the near one far out of it."""
    near = np.zeros((48, 64), np.float32)
    near[:, :32] = 0.5
    scene = {"coverage": near, "behind": (Layer(np.ones((48, 64, 1), np.float32), 2.0),)}
    mean = 0.5 * (0.25 * 0.5 + 0.5) + 0.5
    white = electrons(np.ones((48, 64)), glare=0.0)[0, 0]
    sharp = electrons(0.25 * near, scene=scene)
    assert sharp[20, 60] == pytest.approx(white * (1.0 - GLARE + GLARE * mean), rel=1e-6)
    blurred = electrons(0.25 * near, depth_m=1.0, scene=scene)  # radius 65 photosites: larger than the picture
    unveiled = electrons(0.25 * near, depth_m=1.0, glare=0.0, scene=scene)
    assert np.allclose(blurred - (1.0 - GLARE) * unveiled, GLARE * mean * white, rtol=1e-4)


def test_a_scene_larger_than_the_sensor_scatters_only_what_the_sensor_sees():
    """The picture's upper and lower 8 rows of 64 stick out."""
    planes = texture(64, 64)
    camera = small_camera(64, 48)
    taken = band_scene(planes, 2.0, interpolation="nearest")
    frames = [simulate(Shot(taken, replace(LENS, veiling_glare=g), Exposure(1.0), camera)).mean_electrons for g in (0.0, GLARE)]
    veil = GLARE * planes[8:56].mean() * frames[0][0, 0] / planes[8, 0]
    assert np.allclose(frames[1], (1.0 - GLARE) * frames[0].astype(float) + veil, rtol=1e-6)


def test_the_clean_colours_of_the_truth_are_veiled_too():
    planes = texture(48, 64, 3) * [3.0, 0.1, 1.0]
    shot = Shot(
        band_scene(planes, 2.0), replace(LENS, veiling_glare=0.3), Exposure(0.01), small_camera(cfa="RGGB"), truth=("rgb",)
    )
    raw = simulate(shot)
    own = np.tile([[0, 1], [1, 2]], (24, 32))
    seen = np.take_along_axis(raw.truth["rgb"], own[..., None], axis=2)[..., 0]
    assert np.allclose(seen * raw.white_level_dn, raw.noise_free_dn, rtol=1e-5)


def test_rims_that_close_the_pupil_in_the_corner_leave_finite_light():
    lens = ThinLens(50.0, 2.0, 2.0, vignetting=Vignetting(front=RoundStop(200.0, 26.0)))
    frame = electrons(np.ones((96, 128)), lens, pixel_pitch_um=100.0)
    assert np.isfinite(frame).all() and frame[0, 0] == 0.0  # no ray of the image and, so modelled, no veil either
    veil = frame - (1.0 - GLARE) * electrons(np.ones((96, 128)), lens, 0.0, pixel_pitch_um=100.0)
    assert veil[48, 20] == pytest.approx(veil[48, 64], rel=1e-4) and veil[48, 64] > 0


def test_a_shot_file_states_it_and_explain_tells_it():
    shot = simulator.load_shot(CHART, {"lens.veiling_glare": 0.02})
    steps = {step.stage: step for step in plan(shot).steps}
    assert steps["veiling glare"].kept and steps["veiling glare"].why == "2 % of all light lies evenly on the sensor"
    hole = {"lens": {"pinhole": {"diameter": "0.3 mm", "distance": "50 mm", "veiling_glare": 0.01}}}
    assert simulator.load_shot(CHART, hole).lens.veiling_glare == 0.01
    for lens in (LENS, BareSensor()):
        planned = plan(replace(shot, lens=lens))
        skipped = next(step for step in planned.steps if step.stage == "veiling glare")
        assert not skipped.kept and skipped.why and planned.optics.veiling_glare is None


@pytest.mark.parametrize("share", [-0.01, 1.0, math.nan])
def test_a_share_of_all_light_or_none_is_refused(share):
    with pytest.raises(PhotositeError, match="lens.veiling_glare = .*: give the share"):
        replace(LENS, veiling_glare=share)
    with pytest.raises(PhotositeError, match="lens.pinhole.veiling_glare = .*: give the share"):
        Pinhole(0.3, 50.0, veiling_glare=share)


def test_what_blur_does_to_the_mean_is_stated():
    """A bright border that blur moves off the frame: in the noise of the dark middle, against the mean of the blurred frame."""
    planes = np.full((40, 60), 0.01)
    planes[:, :2] = 1.0
    shot = Shot(band_scene(planes, 4.0), replace(LENS, veiling_glare=0.05), Exposure(0.02), small_camera(60, 40))
    with_glare, without = (simulate(replace(shot, lens=lens)).mean_electrons.astype(float) for lens in (shot.lens, LENS))
    planned = plan(shot)
    (term,) = (one for one in planned.error_budget.terms if one.effect == "veiling glare")
    veil_e = float(np.median(with_glare - 0.95 * without))
    off_e = abs(veil_e - 0.05 * float(without.mean()))
    noise_e = math.sqrt(max(float(with_glare.min()) + planned.optics.accuracy.read_noise_e**2, 1.0))
    assert 0.0 < off_e / noise_e <= term.sigma
    sharp = plan(replace(shot, scene=band_scene(planes, 2.0))).error_budget
    assert not [one for one in sharp.terms if one.effect == "veiling glare"]


def test_even_light_has_an_exact_veil():
    """Whatever moves or is magnified, as much comes as goes; a small range leaves a small error."""
    sigmas = []
    for contrast in (0.0, 0.01, 0.1):
        light = 1.0 - contrast * (np.arange(40 * 60).reshape(40, 60) % 7 > 3)
        shot = Shot(band_scene(light, 1.5), replace(LENS, veiling_glare=GLARE), Exposure(1.0), small_camera(60, 40))
        terms = plan(shot).error_budget.terms
        sigmas.append(sum(term.sigma for term in terms if term.effect == "veiling glare"))
    assert sigmas[0] == 0.0 < sigmas[1] < 0.2 * sigmas[2]
