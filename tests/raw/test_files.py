import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.raw_frame import random_frame

from simulator.atomic_files import atomic_write
from simulator.errors import PhotositeError
from simulator.raw import image_files
from simulator.raw.dng.writer import write_dng
from simulator.raw.image_files import write_picture

REPOSITORY = Path(__file__).parents[2]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_write_that_succeeds_replaces_the_file_and_leaves_nothing_else(tmp_path):
    target = tmp_path / "new" / "folder" / "a.bin"
    for content in (b"first", b"second"):
        with atomic_write(target) as temporary:
            assert temporary.parent.parent == target.parent and temporary.suffix == ".bin"
            temporary.write_bytes(content)
        assert target.read_bytes() == content
        assert names(target.parent) == ["a.bin"]


@pytest.mark.parametrize("failure", [ValueError, OSError, KeyboardInterrupt])
def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    expected = PhotositeError if failure is OSError else failure
    with pytest.raises(expected), atomic_write(target) as temporary:
        temporary.write_bytes(b"half")
        raise failure("broken")
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


def test_a_folder_that_cannot_be_made_is_one_clear_error(tmp_path):
    (tmp_path / "file").write_text("")
    target = tmp_path / "file" / "sub" / "a.dng"
    with pytest.raises(PhotositeError, match=r"a\.dng.*is a file, not a folder"):
        write_dng(random_frame(), target)


def test_a_folder_without_write_permission_is_one_clear_error(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "replace", refuse)  # root may write anywhere, so the refusal is made here
    with pytest.raises(PhotositeError, match=r"a\.dng.*Permission denied.*may write"):
        write_dng(random_frame(), tmp_path / "a.dng")
    assert names(tmp_path) == []


def test_a_device_or_folder_is_never_replaced(tmp_path):
    for target in ("/dev/null", tmp_path):
        with pytest.raises(PhotositeError, match="not a plain file"), atomic_write(target):
            pass
    assert Path("/dev/null").is_char_device()


def test_a_link_is_kept_and_what_it_points_to_replaced(tmp_path):
    (tmp_path / "real.bin").write_bytes(b"old")
    (tmp_path / "link.bin").symlink_to(tmp_path / "real.bin")
    with atomic_write(tmp_path / "link.bin") as temporary:
        temporary.write_bytes(b"new")
    assert (tmp_path / "link.bin").is_symlink()
    assert (tmp_path / "real.bin").read_bytes() == b"new"


def test_the_file_has_the_permissions_of_any_new_file(tmp_path):
    (tmp_path / "plain").write_bytes(b"")
    with atomic_write(tmp_path / "atomic") as temporary:
        temporary.write_bytes(b"")
    assert (tmp_path / "atomic").stat().st_mode == (tmp_path / "plain").stat().st_mode


WRITERS = {
    "a.dng": "from simulator.raw.dng.writer import write_dng as write",
    "a.exr": "from simulator.raw.truth_exr import write_twin as write",
    "a.png": "from simulator.raw.development import write_image; write = lambda raw, path: write_image(path, raw.dn)",
    "a.jpg": "from simulator.raw.development import write_image; write = lambda raw, path: write_image(path, raw.dn)",
    "a.tif": "from simulator.raw.development import write_image; write = lambda raw, path: write_image(path, raw.dn)",
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_fills_up_is_one_clear_error_and_keeps_the_old_file(tmp_path, name):
    (tmp_path / name).write_bytes(b"old")
    program = f"""
import resource
{WRITERS[name]}
from helpers.raw_frame import random_frame
from simulator.errors import PhotositeError
import OpenImageIO
resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))
try:
    write(random_frame(), {str(tmp_path / name)!r})
except PhotositeError as error:
    print(error)
"""
    environment = os.environ | {"PYTHONPATH": f"{REPOSITORY}:{REPOSITORY / 'tests'}"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"{tmp_path / name}: cannot be written: File too large; ")
    assert done.stdout.count("\n") == 1
    assert (tmp_path / name).read_bytes() == b"old"
    assert names(tmp_path) == [name]


def test_a_failure_inside_the_picture_library_is_told(tmp_path, monkeypatch):
    # The temporary name is taken by a folder, which the library can only find out itself.
    monkeypatch.setattr(image_files, "reserve", lambda path, size: Path(path).mkdir())
    with pytest.raises(PhotositeError, match=r"a\.exr: cannot be written: .*the file"):
        write_picture(tmp_path / "a.exr", np.zeros((4, 4, 3), np.float32))
    assert not (tmp_path / "a.exr").exists()
