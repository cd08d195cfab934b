"""A metered shot: the meter sees what a sharp frame shows, and the file says what the camera chose."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import FixedScene, band_scene

import simulator
from simulator.command_line.exposure_numbers import exposure_facts
from simulator.errors import PhotositeError
from simulator.exposure.dials import AutoIso, Dials
from simulator.exposure.metering import LevelBound, Metering
from simulator.exposure.settings import Exposure
from simulator.exposure.stops import f_number_of, time_of
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.nd_filter import NeutralDensity
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.pipeline.metered_shot import cell_light, meter_shot
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.dng.exif import exif_directory
from simulator.raw.dng.tag_reader import read_tag
from simulator.raw.dng.tags import Tag
from simulator.raw.raw_reader import read_raw_file
from simulator.raw.save import save
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.camera_sections import Window

WHITE_E = 65535.0  # of `small_camera` at ISO 100
FREE = Dials("free", shortest_s=1e-9, longest_s=1e4)
LENS = ThinLens(50.0, 4.0, irradiance="aplanatic")
TABLE = {iso: IsoSetting(iso / 100, 0.0) for iso in (100, 200, 400, 800, 1600)}


def texture(height: int, width: int) -> np.ndarray:
    return np.random.default_rng(7).lognormal(0.0, 0.5, (height, width))


def metered(scene, camera=None, lens=LENS, **settings) -> Shot:
    exposure = {"mode": "aperture_priority", "dials": FREE, **settings}
    return Shot(scene, lens, Exposure(**exposure), camera or small_camera(64, 48, iso_table=TABLE), tolerance=10.0)


@pytest.mark.parametrize(
    ("height", "width", "settings"),
    [(96, 128, {}), (48, 64, {}), (97, 131, {}), (3, 4, {}), (1, 1, {}), (5, 40, {}), (7, 9, {"interpolation": "nearest"})],
)
def test_the_mean_of_the_frame_gets_the_level(height, width, settings):
    """Truth: the mean electrons of the frame itself. Finer, as fine, and coarser than the photosites, and cut off."""
    shot = metered(band_scene(texture(height, width), math.inf, **settings), metering=Metering("mean"))
    electrons = simulate(shot).mean_electrons
    assert electrons.max() < WHITE_E
    # At its nearest pixel, a photosite on an edge has the light of one side.
    assert electrons.mean() / WHITE_E == pytest.approx(10 / 78, rel=1e-3 if settings else 2e-4)


def test_compensation_is_in_stops_and_a_spot_meters_where_it_lies():
    light = np.ones((48, 64))
    light[:24] = 10.0
    for y, level in ((0.25, 10.0), (0.75, 1.0)):
        spot = Metering("spot", x=0.5, y=y, size=0.2, level=0.01)
        electrons = simulate(metered(band_scene(light, math.inf), metering=spot, compensation=1.5)).mean_electrons
        expected = 0.01 * 2**1.5 * WHITE_E
        assert electrons[round(48 * y), 32] == pytest.approx(expected, rel=2e-3)  # the lens is dimmer off its axis
        assert electrons[24 - 6, 32] / electrons[24 + 6, 32] == pytest.approx(10.0, rel=1e-3), level


def test_a_colour_camera_meters_green_and_protects_the_colour_that_clips_first():
    planes = np.ones((48, 64, 3)) * (0.5, 1.0, 5.0)  # blue, green, red
    camera = small_camera(64, 48, "RGGB")
    even = simulate(metered(band_scene(planes, math.inf), camera, metering=Metering("mean"))).mean_electrons
    assert even[::2, 1::2].mean() / WHITE_E == pytest.approx(10 / 78, rel=1e-3)
    safe = simulate(metered(band_scene(planes, math.inf), camera, metering=Metering("highlights", level=0.5))).mean_electrons
    assert even[::2, ::2].mean() > 0.6 * WHITE_E
    bright = np.sort(safe[::2, ::2].ravel())[-round(0.02 * 24 * 32) :]
    assert bright.mean() / WHITE_E == pytest.approx(0.8, rel=1e-3)


def test_layers_are_metered_as_they_are_seen():
    near = np.zeros((48, 64, 1), np.float32)
    near[:, :32] = 4.0
    coverage = (near[..., 0] > 0).astype(np.float32)
    scene = band_scene(np.ones((48, 64)), math.inf).scene
    layered = replace(scene, planes=near, depth_m=2.0, coverage=coverage, behind=(Layer(scene.planes, math.inf),))
    flat = band_scene(np.where(coverage > 0, 4.0, 1.0), math.inf)
    stacked, seen = (plan(metered(one, metering=Metering("mean"))).metered for one in (FixedScene(layered), flat))
    assert stacked.exposure == seen.exposure


def test_a_window_and_more_bright_lamps_do_not_change_what_is_metered():
    scene = band_scene(texture(96, 128), math.inf)
    whole = metered(scene)
    part = metered(scene, small_camera(64, 48, iso_table=TABLE, window=Window(4, 6, 20, 10)))
    assert meter_shot(part).exposure == meter_shot(whole).exposure
    lamp = texture(96, 128)
    lamp[10, 20] = 1e12
    stops = math.log2(meter_shot(metered(band_scene(lamp, math.inf))).exposure.time_s / meter_shot(whole).exposure.time_s)
    assert -0.02 < stops < 0.0


def test_equal_exposures_give_equal_electrons_with_true_stops():
    """f/1.4 at 1/500 s to f/32 at 1 s, in whole stops."""
    scene = band_scene(np.full((4, 4), 1e-3), math.inf)
    means = []
    for stop in range(10):
        lens = replace(LENS, f_number=f_number_of(3 + 3 * stop))
        means.append(simulate(Shot(scene, lens, Exposure(time_of(3 * stop - 27)), small_camera(16, 12))).mean_electrons.mean())
    assert means == pytest.approx([means[0]] * 10, rel=5e-3) and means == pytest.approx([means[0]] * 10, rel=1e-5)


def test_each_mode_reaches_the_exposure_by_its_own_means():
    scene = band_scene(texture(24, 32), math.inf)
    base = meter_shot(metered(scene)).exposure.time_s  # at f/4 and ISO 100
    wanted = {"metering": None, "dials": replace(FREE, narrowest=200.0)}
    faster = meter_shot(metered(scene, lens=replace(LENS, f_number=2.0), mode="shutter_priority", time_s=base, **wanted))
    assert faster.lens.f_number == pytest.approx(4.0) and faster.exposure == Exposure(base)
    manual = meter_shot(metered(scene, mode="manual", time_s=base / 8, auto_iso=AutoIso()))
    assert manual.exposure == Exposure(base / 8, 800) and manual.deviation_stops == pytest.approx(0.0, abs=1e-9)
    report = meter_shot(metered(scene, mode="manual", time_s=4 * base, metering=Metering()))
    assert report.exposure == Exposure(4 * base) and report.deviation_stops == pytest.approx(2.0)
    grey = meter_shot(metered(scene, lens=replace(LENS, nd_filter=NeutralDensity(density=0.9))))
    assert grey.exposure.time_s == pytest.approx(base * 10**0.9)
    for mode in ("programme", "auto"):
        found = meter_shot(metered(scene, lens=replace(LENS, f_number=2.0), mode=mode, **wanted))
        product = found.exposure.time_s * found.exposure.iso / 100 * (4 / found.lens.f_number) ** 2
        assert product == pytest.approx(base, rel=6e-3)  # a whole ISO


def test_the_chosen_aperture_is_metered_with_its_own_fall_off():
    """A rim darkens the corners of an open lens, and less of them as it stops down."""
    rims = Vignetting(front=RoundStop(30.0, 26.0))
    lens = ThinLens(50.0, 2.0, irradiance="aplanatic", vignetting=rims)
    scene, camera = band_scene(np.ones((4, 4)), math.inf), small_camera(64, 48, pixel_pitch_um=400.0)
    shot = metered(scene, camera, lens, mode="shutter_priority", time_s=1e-7, metering=Metering("mean"), compensation=-3.0)
    assert meter_shot(shot).lens.f_number > 2.5
    assert simulate(shot).mean_electrons.mean() / WHITE_E == pytest.approx(10 / 78 / 8, rel=2e-3)


def test_a_t_stop_goes_with_the_f_number_that_is_chosen():
    scene = band_scene(np.ones((4, 4)), math.inf)
    lens = replace(LENS, f_number=2.0, t_stop=2.3)
    found = meter_shot(metered(scene, lens=lens, mode="shutter_priority", time_s=1e-2))
    assert found.lens.f_number > 3.0 and found.lens.t_number / found.lens.f_number == pytest.approx(2.3 / 2.0)


def test_the_wavefront_of_the_open_lens_stays_when_it_stops_down():
    scene = band_scene(np.ones((4, 4)), math.inf)
    lens = replace(LENS, f_number=2.0, aberrations=Aberrations(spherical_um=0.3))
    found = meter_shot(metered(scene, lens=lens, mode="shutter_priority", time_s=1e-2))
    assert found.lens.f_number > 3.0 and found.lens.aberrations == Aberrations(spherical_um=0.3, at_f_number=2.0)


def test_without_an_aperture_the_time_is_chosen_and_the_other_modes_say_so():
    scene = band_scene(np.ones((4, 4)), math.inf)
    for lens in (BareSensor(), Pinhole(0.3, 50.0)):
        electrons = simulate(metered(scene, lens=lens, metering=Metering("mean"))).mean_electrons
        assert electrons.mean() / WHITE_E == pytest.approx(10 / 78, rel=1e-3)
        with pytest.raises(PhotositeError, match="exposure.mode = programme: .* has none to choose; write mode: aperture_pri"):
            meter_shot(metered(scene, lens=lens, mode="programme"))


def test_darkness_and_isos_that_are_not_there_are_one_message():
    with pytest.raises(PhotositeError, match="the frame is black, there is nothing to meter"):
        meter_shot(metered(band_scene(np.zeros((4, 4)))))
    scene = band_scene(np.ones((4, 4)))
    with pytest.raises(PhotositeError, match="exposure.auto_iso.highest = 12800: the .* was not measured there"):
        meter_shot(metered(scene, mode="auto", auto_iso=AutoIso(highest=12800)))
    with pytest.raises(PhotositeError, match="exposure.auto_iso.highest = 100: is below exposure.iso = 400"):
        meter_shot(metered(scene, iso=400, auto_iso=AutoIso(highest=100)))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"mode": "aperture_priority", "time_s": 0.1}, "exposure.time = 0.1 s: mode aperture_priority chooses the time"),
        (
            {"mode": "shutter_priority"},
            "exposure.time: .* mode shutter_priority needs a time; write for example `time: 1/125 s`",
        ),
        ({"time_s": 0.1, "compensation": 1.0}, "exposure.compensation = 1: nothing is metered in mode manual"),
        ({"time_s": 0.1, "dials": Dials()}, "exposure.dials = given: nothing is metered"),
        ({"mode": "auto", "compensation": math.nan}, "exposure.compensation = nan"),
    ],
)
def test_settings_that_the_mode_does_not_use_are_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        Exposure(**settings)


def test_extremes_of_light_end_at_the_limits():
    for light, limit in ((1e-9, "longest time"), (1e3, "shortest time")):
        found = meter_shot(metered(band_scene(np.full((4, 4), light)), dials=None))
        assert found.limits == (limit,) and abs(found.deviation_stops) > 1
    point = np.zeros((100, 100))
    point[50, 50] = 1.0
    found = meter_shot(metered(band_scene(point), metering=Metering("mean"), dials=None))
    assert found.exposure.time_s == 32.0 and found.describe()["deviation_stops"] is None


def test_cells_keep_the_mean_of_a_large_sensor():
    """Of 1.2 million photosites; truth: the mean of the scene's own pixels."""
    camera = small_camera(1201, 1003, pixel_pitch_um=1.0)
    planes = texture(1003, 1201)
    light = cell_light(band_scene(planes).scene, replace(LENS, cos4=False), camera)
    one = cell_light(band_scene(np.ones((1, 1))).scene, replace(LENS, cos4=False), camera)
    assert light.shape[0] * light.shape[1] < 2**17 + 400
    assert light.mean() / one.mean() == pytest.approx(planes.mean(), rel=1e-6)


def test_the_files_say_what_the_camera_chose_and_are_taken_again_from_it(tmp_path):
    shot = simulator.load_shot(
        "grey_ramp",
        {
            "camera.window": {"x": 2000, "y": 1400, "width": 32, "height": 24},
            "lens.f_number": "f/1.4",
            "scene.depth": "infinity",
            "lens.focus_distance": "infinity",
            "exposure": {"mode": "shutter_priority", "time": "1/500 s", "auto_iso": {"highest": 3200}, "compensation": -1},
        },
    )
    raw = simulator.simulate(shot)
    save(raw, tmp_path)
    sidecar = json.loads((tmp_path / "grey_ramp.json").read_text())
    told, taken = sidecar["metered"], sidecar["shot"]
    assert (told["mode"], told["compensation"], told["time_s"]) == ("shutter_priority", -1, 0.002)
    assert told["iso"] == taken["exposure"]["iso"] == raw.iso > 100
    assert told["limits"] == [] and abs(told["deviation_stops"]) < 0.5
    assert taken["exposure"]["mode"] == "manual" and taken["exposure"]["time"] == "0.002 s"
    file = read_raw_file(tmp_path / "grey_ramp.dng")
    assert (file.iso, file.exposure_time_s) == (raw.iso, pytest.approx(1 / 500))
    packet = read_tag(tmp_path / "grey_ramp.dng", Tag.XMP).decode()
    assert json.loads(re.search(r"photosite:Metered='(.*?)'", packet)[1]) == told
    exif = exif_directory(raw)
    assert [exif[tag].payload for tag in (Tag.EXPOSURE_PROGRAM, Tag.METERING_MODE)] == [b"\4\0", b"\2\0"]
    assert np.frombuffer(exif[Tag.EXPOSURE_BIAS_VALUE].payload, "<i4").tolist() == [-1_000_000, 1_000_000]
    again = simulator.simulate(simulator.load_shot(tmp_path / "grey_ramp.json"))
    assert np.array_equal(again.dn, raw.dn)


def test_explain_shows_settings_marks_values_and_speeds():
    shot = simulator.load_shot("color_checker", {"exposure": {"mode": "aperture_priority"}, "lens.f_number": "f/5.6"})
    planned = plan(shot)
    found = {fact.quantity: fact for fact in exposure_facts(planned.settle(shot), planned)}
    assert found["mode"].value == "aperture_priority"
    assert (found["f-number"].value, found["f-number"].formula) == ("f/5.6", "+0.029 stops from f/5.657, marked f/5.6")
    assert found["time"].formula.startswith("+0.000 stops from ")
    time_s = planned.metered.exposure.time_s
    assert float(found["EV"].value) == pytest.approx(math.log2(5.6**2 / time_s), abs=0.01)
    assert found["saturation-based speed"].formula == "78 lx s / H_sat (ISO 12232)"
    widths = [max(map(len, column)) for column in zip(*((f.quantity, f.value, f.formula) for f in found.values()), strict=True)]
    assert sum(widths) + 10 <= 100


def test_bounds_are_read_from_a_shot_file():
    section = {"pattern": "mean", "bounds": [{"bound": "most", "from_quantile": 0.9, "to_quantile": 1.0, "level": 0.5}]}
    shot = simulator.load_shot("grey_ramp", {"exposure": {"mode": "programme", "metering": section}})
    assert shot.exposure.metering == Metering("mean", bounds=(LevelBound("most", 0.9, 1.0, 0.5),))
    assert shot.exposure.mode == "programme" and not Exposure(0.1).is_metered
