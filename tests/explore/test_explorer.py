"""Answers to the page follow physics, and a newer request ends the work on an older one."""

import json

import numpy as np
import pytest
from helpers.explore_shots import write_shot

from simulator.errors import PhotositeError
from simulator.explore.explorer import Explorer, Request, SupersededError
from simulator.explore.opened_shot import OpenedShot


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
    white = [ask(explorer, lens__f_number=stop).data["exposure"]["white_electrons"][1] for stop in ("f/8", "f/16")]
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
