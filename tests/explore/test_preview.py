"""A preview shows the frame: the same light in fewer photosites."""

import numpy as np
import pytest
from helpers.explore_shots import write_shot

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


def test_a_small_frame_is_its_own_preview(tmp_path):
    shot = load_shot(write_shot(tmp_path), {"camera.width": 240, "camera.height": 160, "camera.pixel_pitch": "24 um"})
    quick = preview_of(shot, load_scene(shot.scene))
    assert quick.side == 1 and quick.shot.camera is shot.camera and quick.shot.tolerance == shot.tolerance


def test_its_scene_has_one_pixel_for_each_photosite(tmp_path):
    shot = load_shot(write_shot(tmp_path))
    scene = load_scene(shot.scene)
    quick = preview_of(shot, scene).shot
    angle = np.tan(np.radians(0.5 * quick.scene.field_of_view_deg)) * 2 / quick.scene.planes.shape[1]
    pitch = 1e-3 * quick.camera.pixel_pitch_um / quick.lens.image_distance_mm
    assert angle == pytest.approx(pitch, rel=1e-9)
    assert preview_of(shot, scene).shot.scene is quick.scene  # kept for the next move
