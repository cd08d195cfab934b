"""The demonstration scene: depth by the Middlebury formula, holes filled with background."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from data_gen.sources.motorcycle import depth_from_disparity, field_of_view_deg, fill_holes, motorcycle_scene
from simulator.errors import PhotositeError
from simulator.scene.depth import DepthChannel
from simulator.scene.image import ImageScene

REPOSITORY = Path(__file__).parents[3]
skimage_data = pytest.importorskip("skimage.data", reason="scikit-image is not installed")


@pytest.fixture(scope="module")
def motorcycle(tmp_path_factory):
    path = motorcycle_scene(tmp_path_factory.mktemp("scene") / "motorcycle.exr")
    return path, ImageScene(path, luminance_cd_m2=120.0, depth_m=DepthChannel()).load()


def test_depth_follows_the_calibration():
    # 0.193001 m * 994.978 px / (d + 31.086 px): 50 px is 2.36824 m
    assert depth_from_disparity(np.array([50.0, np.inf, np.nan])) == pytest.approx(
        [2.36824, np.nan, np.nan], rel=1e-5, nan_ok=True
    )
    assert field_of_view_deg(741) == pytest.approx(40.8476, abs=1e-4)


def test_a_hole_takes_the_farther_neighbour_of_its_row():
    hole = np.nan
    depth = np.array([[2.0, hole, hole, 5.0], [hole, 3.0, 4.0, hole], [hole, hole, hole, hole], [1.0, hole, hole, 0.5]])
    filled, share = fill_holes(depth)
    assert filled.tolist() == [[2.0, 5.0, 5.0, 5.0], [3.0, 3.0, 4.0, 4.0], [3.0, 3.0, 4.0, 4.0], [1.0, 1.0, 1.0, 0.5]]
    assert share == pytest.approx(10 / 16)


def test_measured_depth_is_untouched_and_holes_lie_within_its_range(motorcycle):
    disparity = skimage_data.stereo_motorcycle()[2]
    depth = motorcycle[1].depth_m
    measured = np.isfinite(disparity)
    assert np.allclose(depth[measured], 0.193001 * 994.978 / (disparity[measured] + 31.086), rtol=1e-6)
    assert depth.min() == depth[measured].min() and depth.max() == depth[measured].max()
    assert 2.1 < depth.min() < depth.max() < 5.1
    assert 1 - measured.mean() == pytest.approx(0.0735, abs=1e-4)


def test_the_disparity_belongs_to_the_left_picture():
    # Looked up at x - d, the right picture shows the same surface: far smaller differences than at x + d.
    left, right, disparity = skimage_data.stereo_motorcycle()
    row, column = np.nonzero(np.isfinite(disparity))
    error = {}
    for sign in (-1, 1):
        other = np.rint(column + sign * disparity[row, column]).astype(int)
        seen = (other >= 0) & (other < left.shape[1])
        error[sign] = np.abs(left[row[seen], column[seen]].astype(float) - right[row[seen], other[seen]]).mean()
    assert error[-1] < 0.3 * error[1]


def test_colour_is_the_left_picture_linearised(motorcycle):
    left = skimage_data.stereo_motorcycle()[0] / 255.0
    truth = np.where(left <= 0.04045, left / 12.92, ((left + 0.055) / 1.055) ** 2.4)
    scene = motorcycle[1]
    assert scene.planes.shape == (500, 741, 3) and np.allclose(scene.planes, truth, atol=1e-6)
    assert not any("sRGB" in note for note in scene.notes)


def test_the_file_records_the_field_of_view(motorcycle):
    import OpenImageIO as oiio

    spec = oiio.ImageInput.open(str(motorcycle[0])).spec()
    assert spec.channelnames == ("R", "G", "B", "Z")
    assert spec.get_float_attribute("field_of_view_deg") == pytest.approx(40.8476, abs=1e-4)
    assert spec.get_float_attribute("filled_share") == pytest.approx(0.0735, abs=1e-4)


def test_without_scikit_image_the_message_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "skimage.data", None)
    with pytest.raises(PhotositeError, match=r"pip install 'photosite\[demo\]'"):
        motorcycle_scene(tmp_path / "motorcycle.exr")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["out.png", "file/out.exr"])
def test_command_fails_in_one_line_and_leaves_nothing(tmp_path, name):
    (tmp_path / "file").write_text("not a folder")
    command = [sys.executable, "-m", "data_gen", "motorcycle", str(tmp_path / name)]
    result = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
    assert result.returncode == 1 and result.stderr.startswith("error: ") and result.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_command_writes_the_scene(tmp_path):
    command = [sys.executable, "-m", "data_gen", "motorcycle", str(tmp_path / "new" / "m.exr")]
    subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True)
    assert (tmp_path / "new" / "m.exr").stat().st_size > 1e6
