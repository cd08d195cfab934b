"""`photosite explore` says where its page is, ends with Ctrl-C, and tells in one line what keeps it from starting."""

import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("tornado", reason="the extra `explore` is not installed")

from simulator.command_line.explore import explore_shot  # noqa: E402  # needs tornado
from simulator.errors import PhotositeError  # noqa: E402


def test_ctrl_c_ends_it_without_a_traceback():
    command = [sys.executable, "-m", "simulator", "explore", "flat_field", "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    assert any(line.startswith("http://127.0.0.1:") for line in process.stdout)
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=60)
    assert process.returncode == 0 and "ended" in rest and "Traceback" not in rest


def test_a_port_that_is_taken_is_told():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(PhotositeError, match=f"port = {port}: .*; give another --port, or 0 for a free one"):
            explore_shot(Path("flat_field"), [], port, browse=False, device=None)


def test_a_device_that_is_not_there_and_a_picture_that_is_missing_are_told_before_the_page_opens():
    with pytest.raises(PhotositeError, match="no OpenCL device matches 'none such'"):
        explore_shot(Path("flat_field"), [], 0, browse=False, device="none such")
    with pytest.raises(PhotositeError, match=r"scene\.image = none\.exr: no such file; name one with --set scene\.image=FILE"):
        explore_shot(Path("motorcycle_wide_open"), ["scene.image=none.exr"], 0, browse=False, device=None)
