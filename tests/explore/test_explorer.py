"""Answers to the page follow physics, and a newer request ends the work on an older one."""

import json

import numpy as np
import pytest
from helpers.explore_shots import write_shot

from simulator.errors import PhotositeError
from simulator.explore.explorer import Explorer, Request, SupersededError
from simulator.explore.opened_shot import OpenedShot
from simulator.pipeline.device_rates import cache_path, rates_key


@pytest.fixture(scope="module")
def explorer(tmp_path_factory):
    return Explorer([OpenedShot(str(write_shot(tmp_path_factory.mktemp("shot")))), OpenedShot("color_checker")])


M = 8.0 / (2000.0 - 8.0)  # magnification of 8 mm focused at 2 m


def ask(explorer, want="preview", at=(0.5, 0.5), **settings):
    return explorer.answer(
        Request(want, explorer.names()[0], {key.replace("__", "."): text for key, text in settings.items()}, at)
    )


def mean_electrons(explorer, **settings):
    return ask(explorer, "detail", **settings).data["pixel"]["mean_electrons"]


def test_twice_the_time_is_twice_the_electrons_two_stops_a_quarter_and_iso_leaves_them(explorer):
    base_e = mean_electrons(explorer, lens__f_number="f/8")
    assert mean_electrons(explorer, lens__f_number="f/8", exposure__time="1/50 s") == pytest.approx(2 * base_e, rel=1e-6)
    assert mean_electrons(explorer, lens__f_number="f/8", exposure__iso="400") == pytest.approx(base_e, rel=1e-6)
    white = [ask(explorer, lens__f_number=stop).data["exposure"]["white_electrons"]["G"] for stop in ("f/8", "f/16")]
    assert white[0] / white[1] == pytest.approx((1 + 4 * 16**2 * (1 + M) ** 2) / (1 + 4 * 8**2 * (1 + M) ** 2), rel=1e-6)


def test_numbers_of_a_preview_are_plain_data_for_the_frame_itself(explorer):
    found = ask(explorer, lens__focus_distance="inf m")
    json.dumps(found.data, allow_nan=False)
    assert found.data["lens"]["focus_distance_m"] is None and found.data["lens"]["far_m"] is None
    assert found.data["sensor"]["width_px"] == 960 and found.pixels.shape == (213, 320, 4)
    assert found.data["lens"]["hyperfocal_m"] == pytest.approx(found.data["lens"]["near_m"], rel=1e-2)  # H and H - f


def test_the_detail_has_the_pixels_of_the_frame(explorer):
    detail, frame = (ask(explorer, want, (0.4, 0.6), lens__f_number="f/8") for want in ("detail", "frame"))
    place = detail.data["window"]
    part = np.s_[place["y"] : place["y"] + place["height"], place["x"] : place["x"] + place["width"]]
    inner = np.s_[4:-4, 4:-4]  # demosaicing sees past the border of the part
    assert np.array_equal(detail.pixels[inner], frame.pixels[part][inner])
    assert frame.pixels.shape == (640, 960, 4)


def test_a_newer_request_ends_the_work(explorer):
    request = Request("frame", explorer.names()[0], {}, (0.5, 0.5))
    with pytest.raises(SupersededError):
        explorer.answer(request, lambda: True)


def test_only_shots_that_were_offered_are_opened(explorer):
    with pytest.raises(PhotositeError, match="cannot be opened from the page"):
        explorer.answer(Request("preview", "/etc/passwd", {}))


PATTERNS = (
    "illustrative/x_trans",
    pytest.param("illustrative/quad_bayer", marks=pytest.mark.slow),
    "illustrative/rgbw",
    pytest.param("illustrative/dual_gain", marks=pytest.mark.slow),
    "ideal",
)


@pytest.mark.parametrize("camera", PATTERNS)
def test_a_photosite_of_any_pattern_is_explained_in_its_own_colour(explorer, camera):
    """A flat field: its electrons are those of white in that colour, and all photosites of a colour are alike."""
    settings = {"scene": "flat_field", "camera": camera, "exposure.iso": "400", "exposure.time": "1/1000 s"}
    white = ask(explorer, **settings).data["exposure"]["white_electrons"]
    for at in ((0.5, 0.5), (0.5005, 0.5), (0.501, 0.5005)):
        found = ask(explorer, "detail", at, **settings).data
        pixel = found["pixel"]
        assert pixel["mean_electrons"] == pytest.approx(white[pixel["color"]] * share_of_binned(camera), rel=1e-4)
        photosites = found["window"]["width"] * found["window"]["height"]
        assert sum(map(sum, found["histogram"]["counts"].values())) * share_of_binned(camera) == photosites


def share_of_binned(camera):
    return 4 if camera == "illustrative/quad_bayer" else 1  # it adds the charge of 2 x 2 photosites


def test_a_binned_sensor_is_shown_pixel_by_pixel_and_its_preview_is_no_smaller(tmp_path):
    path = str(write_shot(tmp_path))
    explorer = Explorer([OpenedShot(path, {"camera.binning": {"factor": 2, "mode": "average"}, "camera.height": 400})])
    for share in (0.0, 0.37, 1.0):
        detail = explorer.answer(Request("detail", path, {}, (share, share)))
        assert detail.pixels.shape == (200, 384, 4) and np.isfinite(detail.data["pixel"]["mean_electrons"])
    assert explorer.answer(Request("preview", path, {})).pixels.shape == (133, 320, 4)
    assert explorer.answer(Request("frame", path, {})).pixels.shape == (200, 480, 4)


def test_the_numbers_of_a_metered_shot_are_those_that_the_camera_chose(tmp_path, device, monkeypatch):
    """On a device whose rates are known: to measure them takes longer than the rest."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    cache_path().parent.mkdir()
    cache_path().write_text(json.dumps({rates_key(device): {}}), "utf-8")
    path = str(write_shot(tmp_path))
    exposure = {"mode": "aperture_priority", "iso": 100}
    explorer = Explorer([OpenedShot(path, {"exposure": exposure, "camera.width": 480, "time_budget": "5 s"})])
    preview = explorer.answer(Request("preview", path, {})).data["exposure"]
    assert preview["time_s"] > 0 and preview["exposure_value"] == pytest.approx(np.log2(2.0**2 / preview["time_s"]))
    wider = explorer.answer(Request("preview", path, {"lens.f_number": "f/4"})).data["exposure"]
    assert wider["time_s"] > 1.9 * preview["time_s"]
    assert explorer.answer(Request("detail", path, {})).data["pixel"]["mean_electrons"] > 0


def test_a_moved_control_gets_a_coarser_preview_only_while_it_is_moved(explorer):
    shown = [
        explorer.answer(Request("preview", explorer.names()[0], {"lens.f_number": stop}, is_moving=is_moving))
        for stop, is_moving in (("f/3.2", True), ("f/3.5", True), ("f/3.5", False))
    ]
    assert all(one.pixels.shape[1] in (320, 240, 160, 120) for one in shown)
    assert [one.data["is_coarse"] for one in shown] == [one.pixels.shape[1] < 320 for one in shown]
    assert shown[-1].pixels.shape[1] == 320 and shown[-1].data["exposure"] == shown[-2].data["exposure"]
