"""What the page changes is laid over the shot's file; every other key stays, and no folder of the machine is told."""

import pytest
import yaml
from helpers.explore_shots import write_shot

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.explore.opened_shot import OpenedShot


def test_keys_that_the_page_does_not_show_stay(tmp_path):
    path = write_shot(tmp_path)
    opened = OpenedShot(str(path), {"tolerance": 0.3})
    shot = opened.shot({"lens.f_number": "f/4", "exposure.iso": "200"})
    assert shot.lens.f_number == 4.0 and shot.exposure.iso == 200 and shot.tolerance == 0.3
    assert shot.lens.focus_distance_m == 2.0 and shot.camera.pixel_pitch_um == 6.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"scene.image": "/etc/passwd"}, "the page does not change this"),
        ({"lens.f_number": "f/0.1"}, "no lens in air is faster"),
        ({"lens.f_number": "4 mm"}, "f-number"),
        ({"exposure.iso": "1e3"}, "give a whole number"),
        ({"exposure.time": "1" * 100 + " s"}, "up to 64 letters"),
        ({"exposure.time": 3}, "up to 64 letters"),
    ],
)
def test_a_value_that_no_shot_file_may_hold_is_refused(tmp_path, settings, message):
    with pytest.raises(PhotositeError, match=message):
        OpenedShot(str(write_shot(tmp_path))).shot(settings)


def test_the_yaml_beside_the_shot_takes_the_same_shot_and_names_no_folder(tmp_path):
    path = write_shot(tmp_path)
    opened = OpenedShot(str(path))
    settings = {"lens.f_number": "f/8", "motion.camera.pan": "2 deg/s"}
    text = opened.yaml(settings)
    assert str(tmp_path) not in text and yaml.safe_load(text)["scene"]["image"] == "wall.exr"
    copy = tmp_path / "copy.yaml"
    copy.write_text(text, encoding="utf-8")
    shot, again = opened.shot(settings), load_shot(copy)
    assert (again.scene, again.lens, again.exposure, again.motion) == (shot.scene, shot.lens, shot.exposure, shot.motion)


def test_the_command_sets_what_was_moved():
    assert (
        OpenedShot("color_checker").command({"lens.f_number": "f/8"})
        == "photosite simulate color_checker --set 'lens.f_number=f/8'"
    )
    assert "/home" not in OpenedShot("motorcycle_wide_open", {"scene.image": "/home/me/a.exr"}).command({})


def test_a_shot_whose_picture_is_missing_is_told(tmp_path):
    path = write_shot(tmp_path)
    assert OpenedShot(str(path)).is_complete()
    (tmp_path / "wall.exr").unlink()
    assert not OpenedShot(str(path)).is_complete()
    with pytest.raises(PhotositeError, match=r"wall\.exr: no such file"):
        OpenedShot(str(path)).check()
