"""Files that a camera or a shot is read from: cameras and their bases, curves, pictures, and what these lead to."""

import pytest
from helpers.linked_files import FILES, put_shot

from simulator.config.source_files import camera_files, shot_files
from simulator.errors import PhotositeError

CURVES = "wavelength_nm,red,green,blue\n400,0,0.1,0.4\n500,0.1,0.5,0.2\n600,0.5,0.2,0\n700,0.2,0,0\n"


def put_camera(folder) -> str:
    """Write a camera on a base of its own, with curves, and return the path of its file."""
    (folder / "base.yaml").write_text("base: sony_a7s2\npixel_pitch: 5 um\n")
    (folder / "curves.csv").write_text(CURVES)
    (folder / "mine.yaml").write_text("base: base.yaml\nbit_depth: 12\nresponse: {file: curves.csv}\n")
    return str(folder / "mine.yaml")


def names_in(folder, files) -> set[str]:
    return {str(file.relative_to(folder)) for file in files if file.is_relative_to(folder)}


def test_a_camera_has_its_file_those_of_its_bases_and_its_curves(tmp_path):
    files = list(camera_files(put_camera(tmp_path), ["camera.width=64"]))
    assert names_in(tmp_path, files) == {"mine.yaml", "base.yaml", "curves.csv"}
    assert "sony_a7s2.yaml" in {file.name for file in files}


def test_a_shot_has_the_files_of_its_camera_and_sections(tmp_path):
    shot = put_shot(tmp_path)
    camera = {"mine.yaml", "base.yaml", "curves.csv"}
    files = shot_files(shot, [f"camera={put_camera(tmp_path)}", "exposure.time=1 s"])
    assert names_in(tmp_path, files) == {shot.name, *FILES, *camera}


def test_a_camera_that_is_not_there_is_an_error():
    with pytest.raises(PhotositeError, match="no_such"):
        list(camera_files("no_such"))
