"""A scene narrower than the field of view: what stands where, by the tangents of the angles."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator import load_shot, simulate
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene

WIDTH, HEIGHT, PITCH_UM = 96, 64, 100.0  # 9.6 mm x 6.4 mm
LENS = ThinLens(10.0, 8.0, cos4=False)  # a photosite is 0.01 of a tangent wide


def picture(columns: int, rows: int, outside: str, **more) -> Scene:
    """Pixels of one photosite each; the left half is 1, the right half 3; the top half twice that."""
    planes = np.ones((rows, columns, 1), np.float32)
    planes[:, columns // 2 :] = 3.0
    planes[: rows // 2] *= 2.0
    angle_deg = math.degrees(2 * math.atan(0.5 * columns * 0.01))
    spectrum = np.full((1, 31), 1e-3)
    grid = np.arange(400.0, 701.0, 10.0)
    settings = {"field_of_view_deg": angle_deg, "interpolation": "nearest", "outside": outside} | more
    return Scene(planes, spectrum, grid, np.ones(31), **settings)


def light(scene: Scene, lens=LENS, **more) -> np.ndarray:
    """Mean electrons over those of a pixel of 1."""
    camera = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
    shot = Shot(scene, lens, Exposure(0.01), camera, **more)
    inside = simulate(replace(shot, scene=picture(WIDTH, HEIGHT, "refuse"), lens=LENS)).mean_electrons[-1, 0]
    return simulate(shot).mean_electrons / inside


def expected(columns: int, rows: int, outside: str) -> np.ndarray:
    """The same by the place of each photosite, counted from the middle of the picture."""
    x = np.arange(WIDTH) - WIDTH // 2 + columns // 2
    y = np.arange(HEIGHT) - HEIGHT // 2 + rows // 2
    if outside == "repeat":
        x, y = x % columns, y % rows
    inside = np.outer((y >= 0) & (y < rows), (x >= 0) & (x < columns))
    value = np.outer(np.where(y < rows // 2, 2.0, 1.0), np.where(x < columns // 2, 1.0, 3.0))
    return value * inside if outside == "black" else value


@pytest.mark.parametrize("outside", ["black", "extend", "repeat"])
@pytest.mark.parametrize(("columns", "rows"), [(40, 80), (100, 20), (28, 12)])
def test_light_outside_is_what_was_asked_for(outside, columns, rows):
    found = light(picture(columns, rows, outside))
    np.testing.assert_allclose(found, expected(columns, rows, outside), rtol=2e-5, atol=1e-7)


@pytest.mark.parametrize("outside", ["black", "extend", "repeat"])
def test_a_scene_that_is_wide_enough_is_left_alone(outside):
    scene = picture(WIDTH, HEIGHT, outside)
    assert (light(scene) == light(replace(scene, outside="refuse"))).all()


def test_a_window_of_the_frame_is_that_part_of_it():
    camera = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
    shot = Shot(picture(30, 30, "repeat"), LENS, Exposure(0.01), camera)
    window = replace(camera, window=type(camera.frame)(8, 4, 40, 20))
    part = simulate(replace(shot, camera=window)).mean_electrons
    assert (part == simulate(shot).mean_electrons[4:24, 8:48]).all()


def test_blur_carries_light_over_the_edge_of_a_black_surrounding_and_none_is_lost():
    """A straight edge out of focus: as much light lies outside it as is missing inside, none beyond the radius of the blur."""
    lens = ThinLens(10.0, 1.0, cos4=False)
    scene = picture(48, 4 * HEIGHT, "black", depth_m=0.3)
    flat = replace(scene, planes=np.ones_like(scene.planes))
    radius_px = abs(float(lens.blur_radius_um(0.3))) / PITCH_UM
    assert 1 < radius_px < 8
    found = simulate(Shot(flat, lens, Exposure(0.01), small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM))).mean_electrons
    row = found[HEIGHT // 2].astype(np.float64)
    row /= row[WIDTH // 2]
    edge = WIDTH / 2 + 24
    assert (row[: int(WIDTH - edge - radius_px - 1)] == 0).all() and (row[int(edge + radius_px + 2) :] == 0).all()
    assert row.sum() == pytest.approx(48, rel=1e-4) and 0.1 < row[int(edge)] < 0.5
    np.testing.assert_allclose(row, row[::-1], atol=1e-4)


def test_surfaces_of_layers_continue_with_their_depth_and_coverage():
    near = np.zeros((20, 30, 1), np.float32)
    coverage = np.zeros((20, 30), np.float32)
    near[:, :15], coverage[:, :15] = 5.0, 1.0  # the left half is covered by a light surface
    back = picture(30, 20, "extend")
    scene = replace(back, planes=near, coverage=coverage, depth_m=1.0, behind=(Layer(back.planes, 4.0),))
    found = light(scene)
    np.testing.assert_allclose(found[:, : WIDTH // 2], 5.0, rtol=2e-5)
    np.testing.assert_allclose(found[:, WIDTH // 2 :], expected(30, 20, "extend")[:, WIDTH // 2 :], rtol=2e-5)


def test_distortion_sees_the_surroundings_too():
    barrel = replace(LENS, distortion=Distortion(k1=-0.2))
    found = light(picture(WIDTH, HEIGHT, "black"), barrel)
    assert found[0, 0] == 0 and found[-1, -1] == 0 and found[HEIGHT // 2, WIDTH // 2] == pytest.approx(3.0, rel=1e-4)


def test_without_a_lens_it_is_dark_beyond_the_edges_as_ever():
    scenes = [picture(30, 20, outside) for outside in ("refuse", "repeat")]
    assert (light(scenes[0], BareSensor()) == light(scenes[1], BareSensor())).all()


def test_a_narrow_scene_that_says_nothing_is_refused_with_the_fix():
    with pytest.raises(
        PhotositeError,
        match=r"past the edge of the scene.* mm, leave field_of_view out, or say what is outside, such as scene.outside: black",
    ):
        light(picture(30, 20, "refuse"))


def test_a_shot_file_says_it_of_a_chart(tmp_path):
    settings = {"scene.field_of_view": "10 deg", "camera.window": {"x": 0, "y": 0, "width": 64, "height": 48}}
    raw = simulate(load_shot("color_checker", settings | {"scene.outside": "black"}))
    assert (raw.mean_electrons == 0).all()  # the corner of the frame lies outside
    assert any("past the edge of the scene: outside it is no light" in note for note in raw.resolved["notes"])
    extended = simulate(load_shot("color_checker", settings | {"scene.outside": "extend"})).mean_electrons
    assert (extended > 0).all()
    with pytest.raises(PhotositeError, match="scene.outside"):
        load_shot("color_checker", settings | {"scene.outside": "grey"})


def test_what_moves_in_a_scene_that_had_to_be_filled_is_refused():
    settings = {
        "scene.field_of_view": "10 deg",
        "scene.outside": "extend",
        "motion.layers": {0: {"velocity": ["10 px/s", "0 px/s"]}},
    }
    with pytest.raises(PhotositeError, match="scene.outside = extend: things that move are told in the pixels of the scene"):
        simulate(load_shot("color_checker", settings))


def test_surroundings_beyond_any_memory_are_refused():
    wide = ThinLens(0.01, 8.0, cos4=False)
    with pytest.raises(PhotositeError, match=r"scene.outside = extend: the camera sees .* pixels of it; use a longer lens"):
        light(picture(30, 20, "extend"), wide)
