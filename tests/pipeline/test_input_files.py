"""All files that a shot is read from are told with their hashes: also those that a file leads to."""

import hashlib
import os

import numpy as np
import pytest
from helpers.linked_files import FILES, put_cube, put_shot

from simulator.config import load_shot
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.input_files import fingerprints, named_files, sha256_of
from simulator.pipeline.simulate import simulate
from simulator.scene.image import ImageScene
from simulator.scene.spectral_cube import SpectralCubeScene


def relative(named, folder):
    return [(".".join(keys), os.path.relpath(path, folder)) for keys, path in named]


@pytest.mark.parametrize("named", ["cube.hdr", "cube.img"])
def test_header_and_data_of_a_cube_and_the_files_of_a_list_are_told_behind_the_file_that_the_shot_names(tmp_path, named):
    other = ({"cube.hdr", "cube.img"} - {named}).pop()
    shot = load_shot(put_shot(tmp_path, named))
    expected = [("scene.spectral_cube", named), ("scene.spectral_cube", other)]
    expected += [("lens.psf", name) for name in FILES[2:]]
    found = fingerprints(shot.scene, shot.lens, shot.motion)
    assert [(one["key"], os.path.relpath(one["path"], tmp_path)) for one in found] == expected
    contents = [hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() for _, name in expected]
    assert [one["sha256"] for one in found] == contents
    assert simulate(shot).resolved["inputs"] == found


def test_the_header_that_is_read_counts_where_there_are_two(tmp_path):
    put_cube(tmp_path)
    (tmp_path / "cube.img.hdr").write_bytes((tmp_path / "cube.hdr").read_bytes())
    cube = SpectralCubeScene(tmp_path / "cube.img")
    assert relative(named_files(cube, ()), tmp_path) == [("spectral_cube", "cube.img"), ("spectral_cube", "cube.img.hdr")]


def test_a_file_that_leads_nowhere_stands_alone(tmp_path):
    """Other kinds of the same suffix, and files that are not there or damaged, which their readers refuse."""
    (tmp_path / "light.hdr").write_bytes(b"#?RADIANCE\n")
    (tmp_path / "light.img").touch()
    for name in ("light.hdr", "none.hdr", "none.mat", "a.npy"):
        assert relative(named_files(SpectralCubeScene(tmp_path / name), ()), tmp_path) == [("spectral_cube", name)]
    assert relative(named_files(ImageScene(tmp_path / "light.hdr", 100.0), ()), tmp_path) == [("image", "light.hdr")]
    np.save(tmp_path / "k.npy", np.ones((3, 3)) / 9)
    (tmp_path / "other.csv").write_text("time_s,x_px\n0,1\n")
    (tmp_path / "damaged.csv").write_bytes(b"\xff\xfef")
    for name in ("k.npy", "other.csv", "damaged.csv", "none.csv"):
        assert relative(named_files(ThinLens(50.0, 4.0, 2.0, psf=tmp_path / name), ()), tmp_path) == [("psf", name)]


def test_a_listed_file_that_is_not_there_is_told_too(tmp_path):
    (tmp_path / "psf.csv").write_text("file,blur_radius_px\nnone.npy,0\n\n,1\n")
    lens = ThinLens(50.0, 4.0, 2.0, psf=tmp_path / "psf.csv")
    assert relative(named_files(lens, ()), tmp_path) == [("psf", "psf.csv"), ("psf", "none.npy")]
    with pytest.raises(OSError, match=r"none\.npy"):
        fingerprints(None, lens)


def test_the_hash_of_a_file_that_was_replaced_is_that_of_the_new_one(tmp_path):
    """A copy that keeps its time, as `cp -p` makes it, may be older than the file it replaces."""
    path, old = tmp_path / "a.bin", tmp_path / "old.bin"
    path.write_bytes(b"new")
    first = sha256_of(path)
    old.write_bytes(b"old")
    stat = path.stat()
    os.utime(old, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    old.replace(path)
    assert (first, sha256_of(path)) == tuple(hashlib.sha256(content).hexdigest() for content in (b"new", b"old"))
