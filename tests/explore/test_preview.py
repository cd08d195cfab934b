"""A preview shows the frame: the same light in fewer photosites."""

import numpy as np
import pytest
from helpers.explore_shots import write_moving, write_shot

from simulator.config import load_shot
from simulator.explore.preview import WIDTH_PX, preview_of
from simulator.pipeline.scene_loading import load_scene
from simulator.pipeline.simulate import simulate


@pytest.mark.parametrize("f_number", ["f/2", "f/16"])
def test_a_preview_has_the_light_of_the_frame(tmp_path, f_number):
    """In means over blocks of 48 photosites of the frame, 16 of the preview."""
    shot = load_shot(write_shot(tmp_path), {"lens.f_number": f_number})
    quick = preview_of(shot, load_scene(shot.scene))
    assert quick.side == 3 and quick.shot.camera.width_px == 320 <= WIDTH_PX
    whole = simulate(shot).mean_electrons.astype(float)[:624].reshape(13, 48, 20, 48)
    small = simulate(quick.shot).mean_electrons.astype(float)[:208].reshape(13, 16, 20, 16)
    for colors in (np.s_[:, 0::2, :, 1::2], np.s_[:, 1::2, :, 0::2]):
        large_e, small_e = whole[colors].mean(axis=(1, 3)), small[colors].mean(axis=(1, 3)) / quick.side**2
        assert np.abs(small_e / large_e - 1).mean() < 0.03
        assert small_e.mean() == pytest.approx(large_e.mean(), rel=3e-3)


def block_means(frame, side):
    return frame.astype(float).reshape(frame.shape[0] // side, side, frame.shape[1] // side, side).mean(axis=(1, 3))


def test_a_layer_moves_in_a_preview_as_it_does_in_the_frame(tmp_path):
    shot = load_shot(write_moving(tmp_path))
    quick = preview_of(shot, load_scene(shot.scene))
    assert quick.side == 2
    large_e, small_e = block_means(simulate(shot).mean_electrons, 4), block_means(simulate(quick.shot).mean_electrons, 2)
    ratio = small_e / quick.side**2 / large_e
    assert np.abs(ratio - 1).mean() < 0.005 and np.abs(ratio - 1).max() < 0.1


@pytest.mark.parametrize("focal_length", ["8 mm", "35 mm"])
def test_what_no_blur_circle_reaches_is_left_out_and_the_picture_stays(tmp_path, focal_length):
    """A long lens sees a part of the scene; a coarser preview has the light of a finer one."""
    shot = load_shot(write_shot(tmp_path), {"lens.focal_length": focal_length, "lens.f_number": "f/8"})
    scene = load_scene(shot.scene)
    fine, coarse = (preview_of(shot, scene, width_px) for width_px in (WIDTH_PX, 180))
    assert coarse.side == 6 and fine.shot.scene.planes.shape[1] <= max(scene.planes.shape[1], 2 * WIDTH_PX)
    large_e = block_means(simulate(shot).mean_electrons[:624, :960], 48)
    for quick in (fine, coarse):
        part = 48 // quick.side
        found_e = simulate(quick.shot).mean_electrons[: 13 * part, : 20 * part]
        assert np.abs(block_means(found_e, part) / quick.side**2 / large_e - 1).mean() < 0.03


def test_a_small_frame_is_its_own_preview(tmp_path):
    shot = load_shot(write_shot(tmp_path), {"camera.width": 240, "camera.height": 160, "camera.pixel_pitch": "24 um"})
    quick = preview_of(shot, load_scene(shot.scene))
    assert quick.side == 1 and quick.shot.camera is shot.camera and quick.shot.tolerance == shot.tolerance


@pytest.mark.parametrize(("width", "height", "side"), [(960, 120, 5), (960, 40, 1), (960, 640, 8)])
def test_the_preview_of_a_strip_is_high_enough_to_be_developed(tmp_path, width, height, side):
    shot = load_shot(write_shot(tmp_path), {"camera.width": width, "camera.height": height})
    assert preview_of(shot, load_scene(shot.scene), 120).side == side


def test_its_scene_has_one_pixel_for_each_photosite(tmp_path):
    shot = load_shot(write_shot(tmp_path))
    scene = load_scene(shot.scene)
    quick = preview_of(shot, scene).shot
    angle = np.tan(np.radians(0.5 * quick.scene.field_of_view_deg)) * 2 / quick.scene.planes.shape[1]
    pitch = 1e-3 * quick.camera.pixel_pitch_um / quick.lens.image_distance_mm
    assert angle == pytest.approx(pitch, rel=1e-9)
    assert preview_of(shot, scene).shot.scene is quick.scene  # kept for the next move
