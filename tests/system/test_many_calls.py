"""Many calls in one process: threads at the same time get the bits of one, and memory does not grow with their number."""

import resource
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import every_stage, small_camera
from helpers.scene_builders import band_scene

from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.raw_image import Raw
from simulator.sensor.frame_stack import expose_frame_stack
from simulator.sensor.kernel.kernel_launch import FrameSetting
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

CAMERA = small_camera(96, 64, "RGGB", stages=every_stage())


def shots() -> list[Shot]:
    """Shots that run the same kernels with other numbers, sharp and blurred."""
    rng = np.random.default_rng(2)
    scenes = [band_scene(rng.uniform(0.1, 1.0, (32, 48, 3)), depth_m) for depth_m in (2.0, 2.1)]
    return [
        Shot(scene, ThinLens(50.0, 4.0, 2.0), Exposure(0.01 * (1 + frame)), CAMERA, Seeds(frame=frame))
        for frame in range(2)
        for scene in scenes
    ]


@pytest.fixture
def threads_that_often_change() -> Iterator[None]:
    """Python changes between threads after each microsecond, not after five milliseconds."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def arrays(raw: Raw) -> list[np.ndarray]:
    return [raw.dn, raw.mean_electrons, raw.noise_free_dn]


def test_threads_that_launch_one_kernel_keep_their_arguments(threads_that_often_change):
    """A kernel has one set of arguments; setting them and enqueuing it is one step for all threads."""
    device, stages = open_device(), tuple(small_camera().sensor_stages(100, 1.0).values())

    def code(level: float) -> float:
        return float(expose_frame_stack(device, np.full((1, 2, 4), level, np.float32), [FrameSetting(stages)]).mean())

    levels = [float(level) for level in range(600)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(code, levels)) == levels


def test_threads_that_simulate_get_the_bits_of_one(threads_that_often_change):
    taken = shots()
    alone = [arrays(simulate(shot)) for shot in taken]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda shot: arrays(simulate(shot)), 2 * taken))
    for index, frames in enumerate(found):
        for one, other in zip(frames, alone[index % len(alone)], strict=True):
            np.testing.assert_array_equal(one, other)


def resident_bytes() -> int:
    """Physical memory of this process [byte] (Linux: proc(5), statm)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize()


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system does not tell a process's memory there")
def test_memory_does_not_grow_over_200_calls():
    """An array of one frame that stayed after each call would take 200 x 96 KiB; the allowance is a tenth of that.

    Every second call holds its light in a cache that has room for few; apertures change, sharp and blurred.
    """
    cache, camera = LightCache(2**19), small_camera(192, 128, stages={"photon_shot_noise": PhotonShotNoise()})
    light = np.random.default_rng(2).uniform(0.1, 1.0, (32, 48))
    scenes = [band_scene(light, depth_m).load() for depth_m in (2.0, 2.0, 2.0, 2.1)]

    def take(frame: int) -> None:
        lens = ThinLens(50.0, 4.0 + 0.001 * (frame % 20), 2.0)
        shot = Shot(scenes[frame % 4], lens, Exposure(0.01), camera, Seeds(frame=frame))
        raw = simulate(shot, cache=cache if frame % 2 else None)
        assert raw.dn.shape == raw.mean_electrons.shape == raw.noise_free_dn.shape

    for frame in range(240):  # after which allocators and caches have what they keep
        take(frame)
    before = resident_bytes()
    for frame in range(200):
        take(frame)
    assert resident_bytes() - before < 20 * 4 * camera.width_px * camera.height_px
