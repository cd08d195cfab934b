"""What moves in a shot fits together and fits the scene."""

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.camera_table import MeasuredClip
from simulator.exposure.hand_tremor import HandTremor
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.vector_maps import VectorMap

PER_FRAME = LayerMotion((Speed(1.0, "px/frame"), Speed(0.0, "px/frame")))
VECTORS = VectorMap("flow.exr", "px/frame")


def test_a_camera_on_a_tripod_does_not_move():
    poses = Motion().camera_poses(np.arange(3.0))
    assert poses.rotation_rad.shape == (3, 3) and not poses.rotation_rad.any() and not poses.location_m.any()


def test_the_fastest_motion_is_that_of_any_part(tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("time_s,rotation_deg\n" + "".join(f"{0.01 * line},{line % 2}\n" for line in range(9)))
    spinning, by_table = LayerMotion(spin_deg_per_s=-3600.0), LayerMotion(path=path)
    assert Motion().fastest_hz == Motion(layers={0: PER_FRAME}, frame_time_s=0.1).fastest_hz == 0.0
    assert Motion(camera=HandTremor(1.0), layers={1: spinning}).fastest_hz == 12.0
    assert Motion(camera=SteadyMotion(roll_deg_per_s=720.0), layers={1: spinning}).fastest_hz == 10.0
    assert Motion(layers={0: spinning, 2: by_table}).fastest_hz == pytest.approx(25.0)
    assert Motion(camera=MeasuredClip("the_closeup")).fastest_hz == pytest.approx(6.0, rel=0.02)


def test_layers_that_are_not_named_stand_still():
    motion = Motion(layers={1: PER_FRAME}, frame_time_s=0.1)
    assert motion.layer_moves(0, np.zeros(2), (4, 4)) is None
    moves = motion.layer_moves(1, np.array([0.0, 1.0]), (4, 4))
    np.testing.assert_allclose(moves.matrices[1, 0, 2], 10.0)
    assert motion.vector_field((4, 4)) is None


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"layers": {3: PER_FRAME}}, "motion.layers.3.velocity = per frame: needs the time of a frame; add motion.frame_time"),
        ({"vectors": VECTORS}, "motion.vectors.unit = per frame: needs the time of a frame"),
        ({"frame_time_s": 0.0}, "motion.frame_time = 0.0 s: give a time above 0 s"),
        ({"layers": {-1: LayerMotion()}}, "motion.layers = -1: name layers by their number"),
        ({"layers": {0: LayerMotion()}, "vectors": VECTORS, "frame_time_s": 1.0}, "motion.vectors = flow.exr: a scene of one"),
    ],
)
def test_settings_that_do_not_fit_together_are_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        Motion(**settings)


def test_motion_of_layers_that_the_scene_lacks_is_refused():
    motion = Motion(layers={0: LayerMotion(), 2: LayerMotion()})
    motion.check_layers([1.0, 2.0, 3.0])
    with pytest.raises(PhotositeError, match="motion.layers.2 = 2: the scene has 2 layers, numbered from 0"):
        motion.check_layers([1.0, 2.0])
    with pytest.raises(PhotositeError, match="motion.vectors = flow.exr: vectors are of one picture, but the scene has 2"):
        Motion(vectors=VECTORS, frame_time_s=1.0).check_layers([1.0, 2.0])
    Motion(vectors=VECTORS, frame_time_s=1.0).check_layers([1.0])


def test_a_velocity_in_metres_needs_a_distance():
    metres = Motion(layers={0: LayerMotion((Speed(0.3, "m/s"), Speed(0.0, "m/s")))})
    metres.check_layers([3.0])
    with pytest.raises(PhotositeError, match="motion.layers.0.velocity = m/s: is in metres, but the layer is infinite"):
        metres.check_layers([np.inf])
    for unit, value in (("px/s", 1.0), ("m/s", 0.0)):
        Motion(layers={0: LayerMotion((Speed(value, unit), Speed(0.0, unit)))}).check_layers([np.inf])


def test_a_path_in_metres_needs_a_distance(tmp_path):
    for column, refused in (("x_m", True), ("y_m", True), ("y_px", False), ("rotation_deg", False)):
        (tmp_path / f"{column}.csv").write_text(f"time_s,{column}\n0,0\n1,0.5\n")
        motion = Motion(layers={0: LayerMotion(path=tmp_path / f"{column}.csv")})
        motion.check_layers([3.0])
        if refused:
            rule = (
                f"motion.layers.0.path = .*{column}.csv: is in metres, but the layer is infinitely far; .* columns x_px, y_px"
            )
            with pytest.raises(PhotositeError, match=rule):
                motion.check_layers([np.inf])
        else:
            motion.check_layers([np.inf])
    (tmp_path / "still.csv").write_text("time_s,x_m,y_m\n0,0,0\n1,0,0\n")
    Motion(layers={0: LayerMotion(path=tmp_path / "still.csv")}).check_layers([np.inf])


def test_a_path_that_ends_before_the_exposure_does_is_refused(tmp_path):
    (tmp_path / "way.csv").write_text("time_s,x_px\n0,0\n1,10\n")
    motion = Motion(MeasuredClip("the_closeup"), {0: LayerMotion(path=tmp_path / "way.csv")})
    motion.check_span(0.0, 1.0)
    with pytest.raises(PhotositeError, match="motion.layers.0.path = .*way.csv: the path holds from 0 s to 1 s"):
        motion.check_span(0.2, 1.01)
    with pytest.raises(PhotositeError, match="motion.camera.clip = the_closeup: the path holds from"):
        motion.check_span(0.0, 3600.0)
