"""Programs that a command used are built ahead by the next process that does the same, and only then."""

import json
import os
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pyopencl as cl
import pytest

from simulator.device import Device, programs_ahead
from simulator.device.device import ProgramKey
from simulator.device.programs_ahead import ProgramsAhead, programs_file, read_programs

PASS = "camera_planes", {"CHANNELS": 3, "BANDS": 3, "UNREAD": 1}
KEY = "camera_planes.cl", (("CHANNELS", "3"), ("BANDS", "3"))
KIND = "simulate chart"


class AskedDevice(Device):
    """A device that tells when it was asked what the process had used before, which may be late on a busy machine."""

    def __init__(self, device: cl.Device) -> None:
        super().__init__(device)
        self.asked = Event()

    def used_programs(self) -> list[ProgramKey]:
        found = super().used_programs()
        self.asked.set()
        return found


@pytest.fixture
def new_process(device, tmp_path, monkeypatch):
    """A function that returns a device which nothing was built for, as in a new process, and which a command then finds."""
    monkeypatch.setenv("PHOTOSITE_CACHE", str(tmp_path))
    own = next(one for all_of in cl.get_platforms() for one in all_of.get_devices() if one.name.strip() == device.info.name)

    def start() -> AskedDevice:
        fresh = AskedDevice(own)
        monkeypatch.setattr(programs_ahead, "find_device", lambda name: fresh)
        return fresh

    return start


@pytest.fixture
def builds(monkeypatch):
    """A list that gets each program which is built; its `done` is set then."""
    found, build = Builds(), cl.Program.build
    found.done = Event()

    def counted(program):
        built = build(program)
        found.append(program)
        found.done.set()
        return built

    monkeypatch.setattr(cl.Program, "build", counted)
    return found


class Builds(list):
    """A list with an event."""

    done: Event


def take(device, kind=KIND, **settings):
    """Run a command that uses one program; returns its kernel."""
    with ProgramsAhead(kind, **settings):
        assert device.asked.wait(60.0)
        return device.kernel(*PASS)


def test_the_next_command_of_the_kind_finds_its_programs_built(new_process, builds):
    take(new_process())
    builds.done.clear()
    device = new_process()
    with ProgramsAhead(KIND):
        assert builds.done.wait(60.0)  # while the command does other things
        assert device.kernel(*PASS).name == "camera_planes"
    assert len(builds) == 2


def test_a_command_remembers_what_it_used_for_its_kind_alone(new_process):
    take(device := new_process())
    assert read_programs(programs_file(KIND, device.info.label)) == [KEY]
    assert read_programs(programs_file("simulate edge", device.info.label)) == []


def test_what_a_process_used_before_is_not_remembered(new_process, tmp_path):
    device = new_process()
    device.kernel(*PASS)
    take(device)
    assert not list(tmp_path.iterdir())


def test_a_command_that_fails_leaves_what_was_remembered(new_process):
    take(device := new_process())
    new_process()
    with pytest.raises(KeyboardInterrupt), ProgramsAhead(KIND):
        raise KeyboardInterrupt
    assert read_programs(programs_file(KIND, device.info.label)) == [KEY]


CHANNELS_MISSPELT = b'[["camera_planes.cl", [["CHANNELS", "?"]]]]'


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff", b"{}", b"[1]", b'[["camera_planes.cl"]]', b'[["gone.cl", []]]', CHANNELS_MISSPELT],
)
def test_a_damaged_file_costs_time_alone(new_process, content):
    file = programs_file(KIND, new_process().info.label)
    file.write_bytes(content)
    assert take(new_process()).name == "camera_planes"
    assert json.loads(file.read_bytes()) == [["camera_planes.cl", [["CHANNELS", "3"], ["BANDS", "3"]]]]


def test_a_device_that_cannot_be_opened_is_told_by_who_needs_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PHOTOSITE_CACHE", str(tmp_path))
    with ProgramsAhead(KIND, "no such device"):
        pass
    assert not list(tmp_path.iterdir())


def test_few_files_are_kept(new_process, tmp_path):
    for number in range(3):
        take(device := new_process(), f"simulate {number}", most_files=2)
        os.utime(programs_file(f"simulate {number}", device.info.label), (number, number))
    assert {*tmp_path.iterdir()} == {programs_file(f"simulate {number}", device.info.label) for number in (1, 2)}


def test_threads_that_need_a_program_build_it_once(new_process, builds):
    device = new_process()
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(device.build_program, [KEY] * 8))
    device.kernel(*PASS)
    assert len(builds) == 1


def test_a_program_that_failed_is_built_again(new_process, monkeypatch):
    device = new_process()

    def fail(program):
        raise MemoryError

    with monkeypatch.context() as patch, pytest.raises(MemoryError):
        patch.setattr(cl.Program, "build", fail)
        device.kernel(*PASS)
    assert device.kernel(*PASS).name == "camera_planes"


def test_macros_are_the_same_as_text_and_as_numbers(new_process):
    device = new_process()
    device.kernel("camera_planes", {"CHANNELS": np.int64(3), "BANDS": "3"})
    device.kernel(*PASS)
    assert device.used_programs() == [KEY]
