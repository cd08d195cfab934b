"""The memory of large buffers lives as long as a command uses it, and no longer."""

import resource
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from simulator.device.huge_pages import HAS_HUGE_PAGES, LARGE_BYTES, HugePages

SIDE = 2048  # float32 pixels: four times LARGE_BYTES
WEIGHTS = np.full((1, 1), 2.0, np.float32)


def doubled(device, values, times):
    """Enqueue kernels that double values so many times, each into a fresh buffer, and drop every buffer before the last."""
    kernel, light = device.kernel("camera_planes", {"BANDS": 1, "CHANNELS": 1}), device.upload(values)
    for _ in range(times):
        planes = device.empty((1, values.size), np.float32)
        settings = {"width": SIDE, "pixels": values.size, "first_column": 0, "first_row": 0, "eights": 1}
        device.run(kernel, (SIDE, SIDE, 1), None, scene=light, weights=device.upload(WEIGHTS), planes=planes, **settings)
        light = planes
    return device.download(light, values.shape, np.float32)


def test_a_buffer_may_go_while_commands_still_use_it(device):
    values = np.random.default_rng(1).random((SIDE, SIDE), np.float32)
    assert 4 * values.size >= LARGE_BYTES
    np.testing.assert_array_equal(doubled(device, values, 12), values * np.float32(2.0**12))


def test_threads_that_share_a_device_keep_apart(device):
    found = {}

    def work(seed):
        values = np.random.default_rng(seed).random((SIDE, SIDE), np.float32)
        found[seed] = np.array_equal(doubled(device, values, 4), values * np.float32(16.0))

    threads = [Thread(target=work, args=(seed,)) for seed in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {0: True, 1: True, 2: True}


def resident_bytes() -> int:
    """Memory of this process that is in use."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize()


@pytest.mark.skipif(not HAS_HUGE_PAGES, reason="the system has no huge pages to ask for")
def test_memory_is_given_back_when_the_queue_has_come_past_it():
    passed = [False]
    pages, size = HugePages(lambda: lambda: passed[0], most_free_bytes=0), 64 * LARGE_BYTES
    before = resident_bytes()
    array = pages.take(size)
    array[:] = 1
    assert resident_bytes() > before + 0.9 * size
    del array
    pages.take(1)
    assert resident_bytes() > before + 0.9 * size  # a command may use it
    passed[0] = True
    pages.take(1)
    assert resident_bytes() < before + 0.1 * size


@pytest.mark.skipif(not HAS_HUGE_PAGES, reason="the system has no huge pages to ask for")
def test_memory_is_used_again_only_when_no_view_and_no_command_uses_it():
    passed, size = [True], 2 * LARGE_BYTES
    pages = HugePages(lambda: lambda: passed[0], most_free_bytes=size)
    array = pages.take(size)
    place, view = array.ctypes.data, array.view(np.uint16)[:100].reshape(10, 10)[2:]
    array[:] = 7
    del array
    other = pages.take(size)
    other[:] = 1
    assert (view == 0x0707).all()
    passed[0] = False
    del view
    third = pages.take(size)
    assert third.ctypes.data != place  # a command may use it
    passed[0] = True
    assert pages.take(size - 1000).ctypes.data == place


@pytest.mark.skipif(not HAS_HUGE_PAGES, reason="the system has no huge pages to ask for")
def test_new_memory_takes_the_place_of_what_was_kept():
    pages, size = HugePages(lambda: lambda: True), 16 * LARGE_BYTES
    pages.take(size)[:] = 1
    before = resident_bytes()
    array = pages.take(2 * size)
    array[:] = 1
    assert resident_bytes() < before + 1.2 * size


@pytest.mark.skipif(not HAS_HUGE_PAGES, reason="the system has no huge pages to ask for")
def test_a_small_array_does_not_hold_the_memory_of_a_large_one():
    """Codes of half the size of the light before them: a strip would hold more than is stated."""
    pages, size = HugePages(lambda: lambda: True, most_free_bytes=64 * LARGE_BYTES), 32 * LARGE_BYTES
    before = resident_bytes()
    light = pages.take(size)
    light[:] = 1
    del light
    codes = pages.take(size // 2)
    codes[:] = 1
    assert resident_bytes() < before + 0.7 * size
