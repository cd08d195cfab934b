"""OpenCL in workers, however they were started: it works, or says at once why not. It never waits forever."""

import json
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from simulator.device import devices, open_device
from simulator.errors import PhotositeError

SCRIPT = Path(__file__).parent.parent / "helpers" / "capture_in_workers.py"


@pytest.mark.parametrize(("method", "before"), [("fork", False), ("spawn", True), ("forkserver", True)])
def test_workers_give_the_codes_of_one_process(method, before):
    paths = os.pathsep.join([str(SCRIPT.parents[2]), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, str(SCRIPT), method, str(before)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, env=os.environ | {"PYTHONPATH": paths})
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["workers"] == found["expected"] and len(set(found["expected"])) == 4


def messages(device, buffer, answers) -> None:
    """What a process forked too late is told, by what it tries."""
    tries = {
        "open": open_device,
        "list": devices,
        "upload": lambda: device.upload(np.zeros(4)),
        "download": lambda: device.download(buffer, (4,), np.float32),
        "share": lambda: device.share(np.zeros(4)),
        "finish": device.finish,
        "build": lambda: device.build("kernel void one() {}", "one", {}),
    }
    told = {}
    for name, attempt in tries.items():
        try:
            attempt()
        except PhotositeError as error:
            told[name] = str(error)
        else:
            told[name] = "nothing"
    answers.put(told)


def test_a_process_forked_after_opencl_was_used_is_told_so(device):
    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    worker = context.Process(target=messages, args=(device, device.upload(np.zeros(4, np.float32)), answers), daemon=True)
    worker.start()
    told = answers.get(timeout=30)
    worker.join(timeout=30)
    assert worker.exitcode == 0
    for name, message in told.items():
        assert "forked" in message and "spawn" in message, name
    device.finish()  # goes on here


def test_a_device_is_opened_once():
    assert open_device() is open_device()
