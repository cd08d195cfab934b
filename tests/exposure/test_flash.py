"""Flash: guide number, energy and inverse square; its pulse over lines; and it adds to the light that is there."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.color.spectra import luminance_cd_m2
from simulator.errors import PhotositeError
from simulator.exposure.exposed_light import plan_exposure
from simulator.exposure.flash import Flash, add_flash
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import CurtainShutter, RollingShutter
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.arrays import scene_from_rgb, scene_from_spectra
from simulator.scene.charts import ChartScene
from simulator.scene.deep_pixels import DeepPixels
from simulator.scene.scene import Scene

WHITE = np.ones((24, 32), np.float32)
NEAR = Flash(0.001, guide_number_m=4.0)
LENS = ThinLens(50.0, 4.0, 2.0, cos4=False)  # all of the field is as far as its middle to 3e-6


def electrons(
    depth_m: Any = 2.0, lens: Any = LENS, time_s: float = 0.01, luminance: float = 1e-3, **settings: Any
) -> np.ndarray:
    """Mean electrons of a white wall, or of a map of depths."""
    scene = scene_from_rgb(WHITE, luminance_cd_m2=luminance, depth_m=depth_m)
    shot = Shot(scene, lens, Exposure(time_s, **settings), small_camera(32, 24), tolerance=1.0)
    return simulate(shot).mean_electrons


def test_a_guide_number_gives_its_luminous_exposure_at_one_metre():
    """C GN^2 / 100 lx s with C = 250, of which a white surface sends a share of 1 / pi in each direction."""
    grid_nm = np.arange(380.0, 781.0, 5.0)
    luminous = luminance_cd_m2(Flash(0.001, guide_number_m=36.0).white_j_m2_sr_nm(grid_nm), grid_nm)
    assert luminous == pytest.approx(2.5 * 36.0**2 / math.pi)


def test_an_energy_is_spread_over_its_cone():
    """1 J over the whole sphere is 1 / (4 pi) J/sr; a hemisphere has twice as much."""
    grid_nm = np.arange(380.0, 781.0, 5.0)
    sphere, half = (Flash(0.001, energy_j=1.0, beam_deg=angle).white_j_m2_sr_nm(grid_nm) for angle in (360.0, 180.0))
    assert np.trapezoid(sphere, grid_nm) == pytest.approx(1.0 / (4.0 * math.pi) / math.pi)
    np.testing.assert_allclose(half, 2.0 * sphere, rtol=1e-12)


def test_guide_number_over_distance_is_the_f_number():
    """The same exposure at f/4 and 1 m, f/2 and 2 m, with one guide number; the lens is focused far away."""
    lens = replace(LENS, focus_distance_m=math.inf, irradiance="aplanatic")
    near, far = (electrons(d, replace(lens, f_number=4.0 / d), flash=NEAR).mean() for d in (1.0, 2.0))
    assert far == pytest.approx(near, rel=1e-4)


def test_light_falls_with_the_square_of_the_distance_over_the_depth():
    depth_m = np.where(np.arange(32) < 16, 1.0, 2.0)[None, :].repeat(24, axis=0)
    lens = replace(LENS, f_number=400.0)  # sharp but for the pixels at the edge
    lit = electrons(depth_m, lens, flash=Flash(0.001, guide_number_m=400.0)) - electrons(depth_m, lens)
    np.testing.assert_allclose(lit[:, :14] / lit[:, :-15:-1], 4.0, rtol=1e-5)


def test_what_stands_aside_is_farther_away():
    """r^2 = Z^2 (1 + tan^2): a wall 10 mm behind a lens of 50 mm."""
    scene = add_flash(scene_from_rgb(WHITE, luminance_cd_m2=1.0, depth_m=3.0), NEAR, 0.1)
    x, y = (np.arange(32) - 15.5) * 0.1, (np.arange(24) - 11.5) * 0.1
    expected = 1.0 / (9.0 * (1.0 + x[None, :] ** 2 + y[:, None] ** 2))
    np.testing.assert_allclose(scene.planes[..., 1], expected, rtol=1e-6)
    np.testing.assert_array_equal(scene.planes[..., 0], 1.0)


@pytest.mark.parametrize("shutter", [None, CurtainShutter(0.003), CurtainShutter(0.02), RollingShutter(0.02)])
def test_flash_and_the_light_that_is_there_add_up(shutter):
    """Where lines collect alike shares of both, and where they do not."""
    both = electrons(luminance=50.0, shutter=shutter, flash=NEAR)
    ambient, alone = electrons(luminance=50.0, shutter=shutter), electrons(shutter=shutter, flash=NEAR)
    dark = electrons(shutter=shutter)
    np.testing.assert_allclose(both, ambient + alone - dark, rtol=2e-6)
    assert (alone - dark).max() > 0.2 * ambient.max()


def test_behind_a_blur_and_with_scattered_light_they_add_up_too():
    """Two surfaces out of focus, the nearer one lit four times as much, and a veil of each light's own mean."""
    lens = replace(LENS, veiling_glare=0.1)
    depth_m = np.where(np.arange(32) < 16, 1.9, 2.1)[None, :].repeat(24, axis=0)
    shutter = RollingShutter(0.02)
    both = electrons(depth_m, lens, luminance=50.0, shutter=shutter, flash=NEAR)
    ambient = electrons(depth_m, lens, luminance=50.0, shutter=shutter)
    alone = electrons(depth_m, lens, shutter=shutter, flash=NEAR)
    assert (np.abs(both - ambient - alone) <= np.sqrt(both)).all()  # the tolerance of each is one sigma of the noise
    flat = np.abs(both - ambient - alone)[:, [0, -1]]
    assert (flat < 1e-4 * both[:, [0, -1]]).all()
    assert np.ptp(alone.mean(axis=1)) > 0.5 * alone.mean() and np.ptp(ambient) < 1e-3 * ambient.mean()


def test_planes_are_made_once_for_flashes_of_all_powers():
    scene = ChartScene("grey_ramp", 7.0).load()
    for array in scene.arrays():
        array.setflags(write=False)
    one, other = (add_flash(scene, Flash(0.001, guide_number_m=number), 0.1) for number in (1.0, 2.0))
    assert one.planes is other.planes and not one.planes.flags.writeable
    np.testing.assert_allclose(other.spectra_w_m2_sr_nm[1:], 4.0 * one.spectra_w_m2_sr_nm[1:], rtol=1e-12)
    np.testing.assert_array_equal(other.spectra_w_m2_sr_nm[:1], scene.spectra_w_m2_sr_nm)


def test_samples_of_a_deep_picture_are_lit_by_their_own_distances():
    deep = DeepPixels(
        np.array([0, 2, 3]), 2, np.ones((3, 1), np.float32), np.ones(3), np.array([1.0, 2, 3]), np.array([1.0, 4, 3])
    )
    scene = replace(scene_from_rgb(np.ones((1, 2), np.float32), luminance_cd_m2=1.0, depth_m=2.0), deep=deep)
    lit = add_flash(scene, NEAR, 2.0).deep
    assert lit is not None
    np.testing.assert_allclose(lit.planes[:, 1], 1.0 / (2.0 * np.array([1.0, 9.0, 9.0])), rtol=1e-6)


def test_its_spectrum_lights_the_reflectances_of_the_scene():
    """A wall that is red in daylight is as red in the light of a tungsten flash: reflectance is kept, not radiance."""
    red = np.tile(np.array([1.0, 0.1, 0.1], np.float32), (24, 32, 1))
    lit = add_flash(scene_from_rgb(red, luminance_cd_m2=1.0, depth_m=1.0), replace(NEAR, illuminant="A"), 0.0)
    own, flashed = lit.spectra_w_m2_sr_nm[:3], lit.spectra_w_m2_sr_nm[3:]
    light = NEAR.white_j_m2_sr_nm(lit.wavelengths_nm) * 0 + replace(NEAR, illuminant="A").white_j_m2_sr_nm(lit.wavelengths_nm)
    np.testing.assert_allclose(flashed / light, own / own.sum(axis=0), rtol=1e-9)


def test_a_lamp_that_lacks_wavelengths_leaves_reflectances_known_beside_them():
    lit = add_flash(scene_from_rgb(WHITE, luminance_cd_m2=1.0, illuminant="LED-RGB1", depth_m=1.0), NEAR, 0.0)
    np.testing.assert_allclose(lit.spectra_w_m2_sr_nm[1], NEAR.white_j_m2_sr_nm(lit.wavelengths_nm), rtol=1e-9)


def shares(exposure: Exposure, rows: int = 720) -> np.ndarray:
    """Share of the flash that each row gets, of the whole pulse."""
    flash = plan_exposure(exposure, small_camera(8, rows, pixel_pitch_um=24e3 / rows), 4.0, 4.0).components[1]
    return flash.collected() * exposure.time_s


def test_the_band_of_a_flash_under_a_rolling_shutter_is_as_high_as_both_times_together():
    """4 ms under 8 ms over 40 ms and 720 rows: 216 rows, with ramps of the shorter, 72 rows."""
    for time_s, length_s, most in ((0.004, 0.008, 0.5), (0.008, 0.004, 1.0)):
        flash = Flash(length_s, guide_number_m=10.0, delay_s=-0.02)
        band = shares(Exposure(time_s, shutter=RollingShutter(0.04), flash=flash))
        assert np.count_nonzero(band) == pytest.approx(216, abs=1)
        assert np.count_nonzero(band > most * (1 - 1e-9)) == pytest.approx(72, abs=1)
        np.testing.assert_allclose(np.diff(band)[np.flatnonzero(band)[0] : np.flatnonzero(band)[0] + 70], most / 72, rtol=1e-6)
        assert band.sum() == pytest.approx(time_s / (0.04 / 720), rel=1e-9)  # no light is lost


def test_a_flash_is_synchronous_up_to_the_travel_time_of_the_curtains():
    flash = Flash(1e-5, guide_number_m=10.0)
    assert shares(Exposure(0.0041, shutter=CurtainShutter(0.004), flash=flash)).min() == pytest.approx(1.0)
    late = shares(Exposure(0.001, shutter=CurtainShutter(0.004), flash=flash))
    assert np.count_nonzero(late > 0.999) == pytest.approx(180, abs=3)  # the slit is a quarter of the frame
    assert (late[:530] == 0).all()


@pytest.mark.parametrize("decay_s", [0.0, 0.0005])
def test_the_first_curtain_fires_when_all_is_open_and_the_second_ends_before_anything_closes(decay_s):
    first = Flash(0.001, decay_s, guide_number_m=10.0)
    exposure = Exposure(0.1, start_s=5.0, shutter=CurtainShutter(0.004), flash=first)
    exposed = plan_exposure(exposure, small_camera(), 4.0, 4.0)
    begin = exposed.components[1].span_s[0]
    assert begin == pytest.approx(5.0 + exposed.components[0].openings[0].open_s.max())
    again = plan_exposure(replace(exposure, flash=replace(first, sync="second_curtain")), small_camera(), 4.0, 4.0)
    pulse = again.components[1]
    end = 5.0 + pulse.openings[0].closes_s.min()
    left = 1.0 - pulse.collected(np.array([end]))[0, 0] * 0.1
    assert left == pytest.approx(0.1 * decay_s / (0.001 + decay_s), abs=1e-9)  # a tenth of the tail is still to come


def test_a_flash_lights_lines_within_its_pulse_alone():
    """What a moving scene is integrated over: 1/30,000 s of an exposure of 1/200 s, on the lines that are open."""
    flash = Flash(1 / 30_000, guide_number_m=10.0)
    exposure = Exposure(1 / 200, start_s=2.0, shutter=CurtainShutter(0.004), flash=flash)
    ambient, pulse = plan_exposure(exposure, small_camera(), 4.0, 4.0).components
    (lit,), (open_,) = pulse.lit_openings(), ambient.lit_openings()
    np.testing.assert_allclose(lit.closed_s - lit.opens_s, 1 / 30_000, rtol=1e-6)
    np.testing.assert_array_equal(open_.opens_s, ambient.openings[0].opens_s)
    begin, end = pulse.span_s
    assert end - begin == pytest.approx(1 / 30_000) and begin == pytest.approx(2.0 + lit.opens_s[0])
    weights = np.diff(pulse.collected(np.linspace(begin, end, 5)), axis=1) / pulse.most
    np.testing.assert_allclose(weights, 0.25, rtol=1e-6)


def test_a_flash_that_fires_while_no_line_is_open_is_told_and_leaves_the_frame_alone():
    scene = scene_from_rgb(WHITE, luminance_cd_m2=10.0, depth_m=2.0)
    shot = Shot(scene, LENS, Exposure(0.01, flash=replace(NEAR, delay_s=0.02)), small_camera(32, 24))
    (warning,) = plan(shot).warnings()
    assert warning.startswith("exposure.flash: it fires while no line is open")
    bare = replace(shot, exposure=Exposure(0.01))
    np.testing.assert_array_equal(simulate(shot).dn, simulate(bare).dn)


def refused(scene: Scene | ChartScene) -> str:
    with pytest.raises(PhotositeError) as caught:
        plan(Shot(scene, LENS, Exposure(0.01, flash=NEAR), small_camera()))
    return str(caught.value)


def test_a_scene_without_depth_or_reflectance_is_one_message():
    text = "exposure.flash falls with the distance, but everything in this scene is infinitely far; give scene.depth"
    assert refused(scene_from_rgb(WHITE, luminance_cd_m2=1.0)).startswith(text)
    cube = scene_from_spectra(np.ones((4, 4, 3)), [400, 500, 600], depth_m=2.0)
    assert refused(cube).startswith("exposure.flash lights reflectances, but this scene states radiance alone")


def test_reflectances_of_charts_and_cubes_are_lit():
    cube = scene_from_spectra(
        np.full((4, 4, 3), 0.5), [400, 550, 700], quantity="reflectance", luminance_cd_m2=5.0, depth_m=1.0
    )
    chart = ChartScene("flat_field", 7.0, reflectance=0.5, depth_m=1.0).load()
    for scene in (cube, chart):
        lit = add_flash(scene, NEAR, 0.0)
        flashed = (
            lit.planes[0, 0, len(lit.spectra_w_m2_sr_nm) // 2 :] @ lit.spectra_w_m2_sr_nm[len(lit.spectra_w_m2_sr_nm) // 2 :]
        )
        inner = (lit.wavelengths_nm >= 400) & (lit.wavelengths_nm <= 700)
        np.testing.assert_allclose(flashed[inner], 0.5 * NEAR.white_j_m2_sr_nm(lit.wavelengths_nm)[inner], rtol=1e-6)


def test_a_bare_sensor_gathers_the_flash_too():
    frame = electrons(lens=BareSensor(), flash=NEAR)
    assert frame.min() == frame.max() > 100 * electrons(lens=BareSensor()).max()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"guide_number_m": 10.0}, "exposure.flash.length = 0 s: a pulse takes time"),
        ({"guide_number_m": 10.0, "length_s": -1.0}, "exposure.flash.length = -1 s"),
        ({"length_s": 0.001}, "exposure.flash.guide_number = none: give a guide_number, such as 36 m, or an energy"),
        ({"length_s": 0.001, "guide_number_m": 1.0, "energy_j": 1.0}, "exposure.flash.guide_number = 1 m"),
        ({"length_s": 0.001, "guide_number_m": -1.0}, "exposure.flash.guide_number = -1 m"),
        ({"length_s": 0.001, "energy_j": 1.0}, "exposure.flash.beam = none: goes with an energy"),
        ({"length_s": 0.001, "energy_j": 1.0, "beam_deg": 400.0}, "exposure.flash.beam = 400 deg"),
        ({"length_s": 0.001, "guide_number_m": 1.0, "sync": "rear"}, "exposure.flash.sync = rear"),
        ({"length_s": 0.001, "guide_number_m": 1.0, "illuminant": "D66"}, "exposure.flash.illuminant = D66"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        Flash(**settings)
