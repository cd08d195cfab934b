"""Depth maps: distances along the ray become distances along the axis, holes are refused or filled as asked."""

import math
from dataclasses import replace

import numpy as np
import OpenEXR
import pytest
from helpers.picture_files import write

from simulator.errors import PhotositeError
from simulator.scene.depth import DepthChannel, DepthImage
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.scene.spectral_cube import SpectralCubeScene


def saved(tmp_path, depth):
    """A grey picture and a depth map of its size."""
    np.save(tmp_path / "grey.npy", np.ones(np.shape(depth), np.float32))
    np.save(tmp_path / "depth.npy", np.asarray(depth))
    return tmp_path / "grey.npy", tmp_path / "depth.npy"


def load(tmp_path, depth, fov=None, **source):
    picture, file = saved(tmp_path, depth)
    return ImageScene(picture, 100.0, depth_m=DepthImage(file, **source), field_of_view_deg=fov).load()


@pytest.mark.parametrize("fov", [20.0, 65.0, 120.0])
def test_a_wall_measured_along_the_ray_is_flat_along_the_axis(tmp_path, fov):
    """Rays to a wall at 3 m by Pythagoras in float64, on a grid of odd width and even height."""
    height, width, wall_m = 40, 61, 3.0
    half_width_m = wall_m * math.tan(math.radians(fov / 2))
    pixel_m = 2 * half_width_m / width
    x = (np.arange(width) - 30) * pixel_m  # the middle pixel looks along the axis
    y = (np.arange(height) - 19.5) * pixel_m
    ray_m = np.sqrt(x**2 + y[:, None] ** 2 + wall_m**2)
    scene = load(tmp_path, 1000 * ray_m, fov, unit="mm", along="ray")
    np.testing.assert_allclose(scene.depth_m, wall_m, rtol=3e-7)
    assert np.ptp(load(tmp_path, ray_m, fov).depth_m) > 0.03


def test_a_sphere_around_the_camera_is_farther_along_the_axis_in_the_middle(tmp_path):
    scene = load(tmp_path, np.full((5, 7), 2.0), 90.0, along="ray")
    assert scene.depth_m[2, 3] == pytest.approx(2.0)
    assert scene.depth_m[2, 0] == pytest.approx(2.0 * math.cos(math.atan(6 / 7)), rel=1e-6)


@pytest.mark.parametrize("source", [DepthChannel(along="ray"), DepthImage("z.exr", along="ray")])
def test_rays_without_a_field_of_view_are_refused_before_any_file_is_read(source):
    with pytest.raises(PhotositeError, match="scene.depth.along = ray: needs the angles.*scene.field_of_view"):
        ImageScene("nothing.exr", 100.0, depth_m=source)


def test_depth_of_another_data_window_is_refused_and_the_notes_of_its_file_are_passed_on(tmp_path):
    picture = write(tmp_path / "p.exr", np.ones((6, 8, 3), np.float32), window=(0, 0, 32, 24))
    for name, window in (("beside", (20, 15, 32, 24)), ("same", (0, 0, 32, 24))):
        write(tmp_path / f"{name}.exr", np.full((6, 8, 1), 2.0, np.float32), ["Z"], window)
    told = "its pixels begin at x = 20, y = 15 of .* 32x24, but those of the scene at x = 0, y = 0"
    with pytest.raises(PhotositeError, match=f"scene.depth.image = .*beside.exr: {told}"):
        ImageScene(picture, 100.0, depth_m=DepthImage(tmp_path / "beside.exr")).load()
    scene = ImageScene(picture, 100.0, depth_m=DepthImage(tmp_path / "same.exr")).load()
    assert "same.exr: the data window (8x6) is read, not the display window" in scene.notes


@pytest.mark.parametrize(
    ("window", "fix"),
    [
        ((0, 0, 32, 24), "display window's size$"),
        ((12, 9, 32, 24), "or make the data window its display window .* and give the angle of that$"),
        ((-2, -1, 4, 4), "or make the data window its display window .* and give the angle of that$"),
    ],
)
def test_angles_of_a_picture_that_is_not_its_display_window_are_refused(tmp_path, window, fix):
    """They are those of the whole picture, and count from its middle."""
    file = write(tmp_path / "p.exr", np.ones((6, 8, 3), np.float32), ["450nm", "550nm", "650nm"], window)
    grey = write(tmp_path / "g.exr", np.ones((6, 8, 1), np.float32), ["Y"], window)
    for scene in (
        ImageScene(grey, 100.0, field_of_view_deg=40.0),
        LayeredScene((PictureLayer(grey, 2.0),), 100.0, field_of_view_deg=40.0),
        SpectralCubeScene(file, field_of_view_deg=40.0),
    ):
        with pytest.raises(PhotositeError, match=f"scene.field_of_view = 40 deg: .* 8x6 pixels from x = {window[0]}, .*{fix}"):
            scene.load()
        assert replace(scene, field_of_view_deg=None).load().field_of_view_deg is None


HOLES = np.array([[1.0, 2.0, np.nan, 4.0], [0.0, 6.0, 7.0, -1.0], [np.inf, 10.0, 11.0, 12.0]])


def test_holes_are_refused_with_count_place_and_what_to_write(tmp_path):
    with pytest.raises(PhotositeError, match="in 3 of 12 pixels, the first at x = 2, y = 0.*holes: infinity or holes: nearest"):
        load(tmp_path, HOLES)


def test_holes_become_infinity_or_the_nearest_depth_and_a_note(tmp_path):
    good = HOLES > 0
    far = load(tmp_path, HOLES, holes="infinity")
    assert np.isinf(far.depth_m[~good]).all() and np.array_equal(far.depth_m[good], HOLES[good].astype(np.float32))
    near = load(tmp_path, HOLES, holes="nearest")
    assert near.depth_m[0, 2] in (2.0, 4.0, 7.0) and near.depth_m[1, 3] in (4.0, 7.0, 12.0)
    assert near.depth_m[1, 0] in (1.0, 6.0, np.inf) and np.array_equal(near.depth_m[good], far.depth_m[good])
    for scene in (far, near):
        assert any("3 of 12 pixels" in note for note in scene.notes)


def test_the_nearest_depth_is_nearest_by_euclid(tmp_path):
    """Every filled pixel against a search through all pixels in float64."""
    rng = np.random.default_rng(3)
    depth = rng.random((24, 31)) + 1.0
    depth[rng.random(depth.shape) < 0.7] = 0.0
    filled = load(tmp_path, depth, holes="nearest").depth_m
    rows, columns = np.nonzero(depth)
    for y, x in zip(*np.nonzero(depth == 0), strict=True):
        squared = (rows - y) ** 2 + (columns - x) ** 2
        nearest = depth[rows, columns][squared == squared.min()].astype(np.float32)
        assert filled[y, x] in nearest


def test_a_map_of_holes_alone_has_no_nearest_depth(tmp_path):
    with pytest.raises(PhotositeError, match="all of it is NaN, 0 or less"):
        load(tmp_path, np.zeros((3, 3)), holes="nearest")


@pytest.mark.parametrize("other", ["half", "float", "none"])
@pytest.mark.parametrize("parts", [1, 2])
def test_depth_in_whole_numbers_is_read_beside_floats(tmp_path, other, parts):
    """EXR channels have types of their own; codes of 32 bits stay what they are, up to the 24 bits of a float32."""
    codes = np.array([[0x1000001, 2500], [1, 2**32 - 1]], np.uint32)
    floats = {} if other == "none" else dict.fromkeys("RGB", np.full((2, 2), 0.5, {"half": np.float16}.get(other, np.float32)))
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    channels = [floats | {"Z": codes}] if parts == 1 or not floats else [floats, {"Z": codes}]
    with OpenEXR.File([OpenEXR.Part(dict(header), held, f"part{n}") for n, held in enumerate(channels)]) as file:
        file.write(str(tmp_path / "a.exr"))
    np.save(tmp_path / "grey.npy", np.ones((2, 2), np.float32))
    channel = "Z" if len(channels) == 1 else "part1.Z"
    scene = ImageScene(tmp_path / "grey.npy", 100.0, depth_m=DepthImage(tmp_path / "a.exr", channel=channel, unit="mm")).load()
    np.testing.assert_allclose(scene.depth_m, codes / 1000.0, rtol=2e-7)
    if other != "none":
        source = DepthChannel(channel, unit="mm")
        scene = ImageScene(tmp_path / "a.exr", 100.0, depth_m=source).load()
        np.testing.assert_allclose(scene.depth_m, codes / 1000.0, rtol=2e-7)
        assert (scene.planes == 0.5).all()
