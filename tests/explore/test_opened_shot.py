"""What the page changes is laid over the shot's file; every other key stays, and no folder of the machine is told."""

import shlex

import pytest
import yaml
from helpers.explore_shots import write_moving, write_shot

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
        ({"scene": "/etc/passwd"}, "the page has own, color_checker"),
        ({"camera": "../cameras/ideal"}, "the page has own, canon_550d"),
        ({"camera": "imx385"}, "exposure.iso"),
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


def chosen(**settings):
    return {key.replace("__", "."): text for key, text in settings.items()}


def test_another_camera_keeps_what_the_photographer_set_and_an_iso_that_it_does_not_have_is_told(tmp_path):
    opened = OpenedShot(str(write_shot(tmp_path)), {"camera.width": 480})
    panel = opened.panel(chosen(camera="imx385", lens__f_number="f/5.6", exposure__time="1/50 s"))
    assert panel.settings == chosen(camera="imx385", lens__f_number="f/5.6", exposure__time="1/50 s", exposure__iso="1600")
    assert panel.notes == ("Sony IMX385 has ISO 1600 to 25600: 1600 in place of 100",)
    shot = opened.shot(panel.settings)
    assert shot.camera.model == "IMX385" and shot.camera.width_px == 1920  # nothing of the opened camera is left
    assert shot.lens.f_number == 5.6 and shot.exposure.time_s == 0.02 and shot.lens.focus_distance_m == 2.0
    assert opened.panel(chosen(camera="own", scene="own")).settings == {}


def test_a_control_of_a_changed_view_knows_the_opened_value(tmp_path):
    opened = OpenedShot(str(write_shot(tmp_path)), {"lens.f_number": "f/5.13"})
    by_key = {one.key: one for one in opened.panel(chosen(lens__f_number="f/8", camera="imx385")).controls}
    aperture, iso = by_key["lens.f_number"], by_key["exposure.iso"]
    assert [aperture.choices[place].label for place in (aperture.index, aperture.own)] == ["f/8", "f/5.13"]
    assert iso.own == -1  # the camera cannot have it


@pytest.mark.parametrize("settings", [chosen(scene="dots"), chosen(camera="canon_550d"), chosen(scene="dots", camera="imx385")])
@pytest.mark.parametrize("write", [write_shot, write_moving])
def test_the_yaml_and_the_command_of_a_chosen_scene_and_camera_take_the_same_shot(tmp_path, settings, write):
    opened = OpenedShot(str(write(tmp_path)))
    settings = opened.panel(settings).settings
    shot, copy = opened.shot(settings), tmp_path / "copy.yaml"
    copy.write_text(opened.yaml(settings), encoding="utf-8")
    words = shlex.split(opened.command(settings))
    assert words[:3] == ["photosite", "simulate", str(copy.with_stem("moving" if write is write_moving else "wall").name)]
    for again in (load_shot(copy), load_shot(opened.path, words[4::2])):
        assert again.resolved == shot.resolved


def test_the_view_of_a_sweep_is_one_picture_and_another_scene_stands_still(tmp_path):
    opened = OpenedShot(str(write_moving(tmp_path)))
    assert "--set 'sweep=null'" in opened.command({})
    assert opened.shot({}).motion is not None and opened.shot(chosen(scene="dots")).motion is None
    panned = opened.shot({"scene": "dots", "motion.camera.pan": "2 deg/s"}).motion
    assert panned.camera.pan_deg_per_s == 2.0 and not panned.layers


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
    with pytest.raises(PhotositeError, match=r"scene\.image = wall\.exr: no such file; name one with --set scene\.image=FILE"):
        OpenedShot(str(path)).check()
