"""Motion vectors of renderers become velocities to the right and down, or one message."""

import numpy as np
import pytest
from helpers.picture_files import put, write

from simulator.errors import PhotositeError
from simulator.exposure.vector_maps import BlenderVectors, VectorMap
from simulator.scene.pixel_file import DataWindow

SIZE = 4, 6
RANDOM = np.random.default_rng(3).normal(size=(*SIZE, 4)).astype(np.float32)
BLENDER = tuple(f"ViewLayer.Vector.{axis}" for axis in "XYZW")


def test_vectors_per_frame_over_the_frame_time_are_velocities(tmp_path):
    file = put(tmp_path / "flow.npy", RANDOM[..., :2])
    field = VectorMap(file, "px/frame").load(SIZE, frame_time_s=0.5)
    np.testing.assert_array_equal(field.velocity, 2 * RANDOM[..., :2])
    assert not field.is_in_metres
    np.testing.assert_array_equal(field.px_per_s(np.inf, 100.0), field.velocity)


def test_named_channels_are_turned_down_and_to_the_place_after(tmp_path):
    file = put(tmp_path / "flow.exr", RANDOM, ("a.x", "a.y", "b.x", "b.y"))
    field = VectorMap(file, "px/s", x="b.x", y="b.y", y_axis="up", scale=-1.0).load(SIZE)
    np.testing.assert_array_equal(field.velocity, RANDOM[..., 2:] * np.array([-1, 1], np.float32))


def test_the_vector_pass_of_cycles_is_turned_forward_and_down(tmp_path):
    """A point that steps 3 px right and 2 px up a frame: before - here = (-3, -2), here - after = (-3, -2), y up."""
    file = put(tmp_path / "render.exr", np.full((*SIZE, 4), (-3, -2, -3, -2), np.float32), BLENDER)
    field = BlenderVectors(file, "ViewLayer.Vector").load(SIZE, frame_time_s=0.25)
    np.testing.assert_allclose(field.velocity, np.broadcast_to([12.0, -8.0], (*SIZE, 2)))


def test_metres_per_second_need_the_distance(tmp_path):
    field = VectorMap(put(tmp_path / "flow.npy", RANDOM[..., :2]), "m/s").load(SIZE)
    assert field.is_in_metres
    depth_m = np.linspace(1, 5, 24).reshape(SIZE).astype(np.float32)
    depth_m[0, 0] = np.inf
    found = field.px_per_s(depth_m, 700.0)
    np.testing.assert_allclose(found, RANDOM[..., :2] * (700.0 / depth_m)[..., None], rtol=1e-6)
    assert not found[0, 0].any()
    np.testing.assert_allclose(field.px_per_s(2.0, 700.0), 350 * RANDOM[..., :2], rtol=1e-6)


def test_vectors_of_another_size_are_refused(tmp_path):
    file = put(tmp_path / "flow.npy", RANDOM[..., :2])
    with pytest.raises(PhotositeError, match="motion.vectors.image = .*flow.npy: is 6x4 pixels, but the scene is 9x8; export"):
        VectorMap(file, "px/s").load((8, 9))


def test_vectors_of_another_data_window_are_refused_and_their_notes_are_passed_on(tmp_path):
    file = write(tmp_path / "flow.exr", RANDOM[..., :2], ("u", "v"), (20, 10, 64, 48))
    scene = DataWindow(0, 0, 64, 48)
    told = "its pixels begin at x = 20, y = 10 of .* 64x48, but those of the scene at x = 0, y = 0"
    with pytest.raises(PhotositeError, match=f"motion.vectors.image = .*flow.exr: {told}"):
        VectorMap(file, "px/s").load(SIZE, window=scene)
    found = VectorMap(file, "px/s").load(SIZE, window=DataWindow(20, 10, 64, 48))
    assert found.notes == ("flow.exr: the data window (6x4) is read, not the display window",)


@pytest.mark.parametrize(("value", "name"), [(np.nan, "NaN"), (np.inf, "Inf")])
def test_vectors_that_are_not_finite_are_counted(tmp_path, value, name):
    vectors = RANDOM[..., :2].copy()
    vectors[2, 5, 1] = value
    file = put(tmp_path / "flow.npy", vectors)
    with pytest.raises(PhotositeError, match=f"motion.vectors.image = .*flow.npy: {name} in 1 of 24 pixels, .* x = 5, y = 2"):
        VectorMap(file, "px/s").load(SIZE)


def test_channels_that_are_missing_or_many_are_named(tmp_path):
    file = put(tmp_path / "render.exr", RANDOM, BLENDER)
    with pytest.raises(PhotositeError, match="has channels ViewLayer.Vector.X, .*; name the two of them as x: and y:"):
        VectorMap(file, "px/s").load(SIZE)
    with pytest.raises(PhotositeError, match="motion.vectors.vector_pass = Other.X: no such channel in .* ViewLayer.Vector.X"):
        BlenderVectors(file, "Other").load(SIZE)
    with pytest.raises(PhotositeError, match="motion.vectors.x = u: name both channels"):
        VectorMap(file, "px/s", x="u")
    with pytest.raises(PhotositeError, match="motion.vectors.image = .*none.exr: no such file"):
        VectorMap(tmp_path / "none.exr", "px/s").load(SIZE)
