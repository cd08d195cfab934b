"""The last scene is kept while it is the same, and no frame depends on what was simulated before it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.linked_files import put_cube
from helpers.picture_files import put

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.pipeline.planner import plan
from simulator.pipeline.scene_loading import load_scene
from simulator.scene.image import ImageScene
from simulator.scene.scene import Layer, Scene
from simulator.scene.spectral_cube import SpectralCubeScene


@pytest.fixture
def picture(tmp_path):
    return put(tmp_path / "picture.exr", np.random.default_rng(1).random((6, 8, 3), dtype=np.float32))


def test_a_picture_is_read_once_while_its_file_is_the_same(picture):
    source = ImageScene(picture, 100.0)
    scene = load_scene(source)
    assert load_scene(ImageScene(picture, 100.0)) is scene
    put(picture, np.full((7, 8, 3), 0.5, np.float32))
    again = load_scene(source)
    assert again.planes.shape[0] == 7 and load_scene(replace(source, luminance_cd_m2=50.0)) is not again


@pytest.mark.parametrize("named", ["cube.hdr", "cube.img"])
def test_a_cube_is_read_again_when_its_other_file_has_changed(tmp_path, named):
    put_cube(tmp_path, 0.01)
    source = SpectralCubeScene(tmp_path / named)
    scene = load_scene(source)
    assert load_scene(source) is scene
    header = tmp_path / "cube.hdr"
    if named == "cube.img":
        header.write_text(header.read_text() + "data gain values = {3, 3, 3, 3, 3}\n")
    else:
        put_cube(tmp_path, 0.03)
    np.testing.assert_allclose(load_scene(source).planes, 3 * scene.planes, rtol=1e-6)


def test_a_scene_that_is_kept_cannot_be_written_to(picture):
    scene = load_scene(ImageScene(picture, 100.0))
    with pytest.raises(ValueError, match="read-only"):
        scene.planes[0, 0, 0] = 1.0


def test_a_file_that_has_gone_is_an_error_also_of_a_scene_that_is_kept(picture):
    load_scene(ImageScene(picture, 100.0))
    picture.unlink()
    with pytest.raises(PhotositeError, match=r"picture\.exr.*no such file"):
        load_scene(ImageScene(picture, 100.0))


def test_a_scene_that_is_given_as_it_is_leaves_the_one_that_is_kept(picture):
    scene = load_scene(ImageScene(picture, 100.0))
    assert load_scene(replace(scene, field_of_view_deg=10.0)) is not scene
    assert load_scene(ImageScene(picture, 100.0)) is scene


class Drifting:
    """A user's own source, which gives another scene each time."""

    def __init__(self) -> None:
        self.calls = 0

    def load(self) -> Scene:
        self.calls += 1
        return Scene(np.full((4, 6, 1), self.calls, np.float32), np.ones((1, 2)), np.array([400.0, 700.0]), np.ones(2))


def test_a_users_own_source_is_asked_each_time_and_its_scene_stays_writable():
    source = Drifting()
    first, second = load_scene(source), load_scene(source)
    assert (first.planes == 1).all() and (second.planes == 2).all() and first.planes.flags.writeable


SETTINGS = [
    {"lens.f_number": "f/2"},
    {"lens.f_number": "f/8"},
    {"lens.focus_distance": "3 m"},
    {"exposure.time": "1/100 s"},
    {"exposure.iso": 1600},
    {"tolerance": 1.0},
    {"camera.fill_factor": 0.5},
    {"lens.veiling_glare": 0.02},
    {"scene.depth": "2 m"},
]
FEW_PX = {"camera.width": 424, "camera.height": 284, "camera.pixel_pitch": "84 um"}
SMALL = FEW_PX | {"scene.depth": "1 m", "lens.f_number": "f/2", "lens.focus_distance": "2 m"}


def decisions(shot):
    """All of a plan that numbers or texts tell."""
    planned = plan(shot)
    optics = planned.optics
    told = optics.projection, optics.window, optics.accuracy, optics.contrast, optics.psf_skipped, optics.ignored_px
    glare = None if optics.veiling_glare is None else optics.veiling_glare.irradiance.tolist()
    return repr(told), glare, optics.weights.tolist(), planned.steps, planned.passes


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda setting: "".join(setting))
def test_a_plan_is_that_of_its_own_settings_whatever_was_planned_before(setting):
    """The plan of the optics is kept with the scene; each setting it depends on makes another one."""
    other = load_shot("color_checker", SMALL | setting)
    fresh = decisions(replace(other, scene=Unkept(other.scene)))
    plan(load_shot("color_checker", SMALL))
    plan(load_shot("color_checker", SMALL | {"camera.window": {"x": 8, "y": 6, "width": 64, "height": 48}}))
    assert decisions(other) == fresh == decisions(other)


class Unkept:
    """A source whose scenes are not kept, since nothing tells whether they stay the same."""

    def __init__(self, source) -> None:
        self.source = source

    def load(self) -> Scene:
        return self.source.load()


def test_a_window_has_the_plan_of_the_frame_in_all_but_the_window():
    window = {"x": 120, "y": 90, "width": 64, "height": 48}
    whole, crop = plan(load_shot("color_checker", SMALL)), plan(load_shot("color_checker", SMALL | {"camera.window": window}))
    assert crop.optics.scene is whole.optics.scene and crop.optics.defocus is whole.optics.defocus
    fresh = load_shot("color_checker", SMALL | {"camera.window": window})
    assert repr(plan(replace(fresh, scene=Unkept(fresh.scene))).optics.window) == repr(crop.optics.window)


@pytest.mark.parametrize("writable", [True, False])
def test_light_of_a_scene_from_python_has_some_coverage(writable):
    """What is made is kept with a scene that cannot be written to; a scene whose light is covered is itself."""
    light, coverage = np.array([[[0.5], [0.0], [0.5], [0.5]]], np.float32), np.array([[0.0, 0.0, 0.25, 1.0]], np.float32)
    base = Scene(light, np.ones((1, 2)), np.array([400.0, 700.0]), np.ones(2), 1.0, coverage=coverage)
    scene = base.with_layers([Layer(light, 1.0, coverage), Layer(light, 2.0)])
    for array in scene.arrays():
        array.setflags(write=writable)
    found = load_scene(scene)
    assert found.coverage.tolist() == np.float32([[1e-6, 0.0, 0.25, 1.0]]).tolist() and found.behind[0].coverage is None
    assert scene.coverage[0, 0] == 0.0 and found.planes is scene.planes
    assert (load_scene(scene) is found) is not writable and load_scene(found) is found
    dark = replace(scene, planes=light * (coverage > 0)[..., None])
    assert load_scene(dark) is dark
