"""A window of a frame has the frame's bits, and asks the device for no more than it sees."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.picture_files import put

from simulator.config import load_shot
from simulator.device import Device
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera_sections import Window

WIDTH, HEIGHT = 1200, 704  # of the frame
WINDOW = {"x": 700, "y": 400, "width": 256, "height": 128}
ODD = {"x": 1023, "y": 637, "width": 131, "height": 5}  # begins and ends beside borders of tiles and bands
SHARE = WINDOW["width"] * WINDOW["height"] / (WIDTH * HEIGHT)
FRAME = {"camera.window": {"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT}}
RIMS = {"front": {"distance": "30 mm", "diameter": "44 mm"}, "rear": {"distance": "20 mm", "diameter": "26 mm"}}
FINE = {"camera.low_pass": "20 um", "tolerance": 0.002}  # kernels are too large to be gathered
# The scene covers the whole sensor, of which the frame is a part.
SHOTS = {
    "sharp, coarse scene": {"scene.depth": "2.5 m", "lens.focus_distance": "2.5 m"},
    "sharp behind a distortion": {"scene.depth": "2.5 m", "lens.distortion": {"k1": -0.1}},
    "blurred depth": {"lens.f_number": "f/2.8"},
    "blurred depth, wide": {"lens.f_number": "f/1.4", "scene.hidden": "extend"},
    "blurred and distorted": {"lens.f_number": "f/4", "lens.distortion": {"k1": 0.05}},
    "glare": {"scene.depth": "2.5 m", "lens.veiling_glare": 0.05},
    "rims": {"lens.f_number": "f/2", "lens.vignetting": RIMS},
    "highlights": {"lens.f_number": "f/2.8", "scene.image": "lamps.exr"},
    "diffraction": {"lens.f_number": "f/11", "lens.diffraction": True},
    "diffraction, by transforms": FINE | {"lens.f_number": "f/22", "lens.diffraction": True},
    "diffraction of a sharp scene": {"scene.depth": "2.5 m", "lens.diffraction": True},
}
SLOW = "diffraction", "diffraction, by transforms", "rims", "blurred depth, wide", "blurred and distorted"

MARGIN_ITEMS = 2**13  # work-items of pixels of the scene around a window


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    """A picture with depth, 2120 x 1416 pixels, half as many as the sensor has photosites along each side.

    Beside it lies the same with lamps.
    """
    random = np.random.default_rng(7)
    pixels = random.random((1416, 2120, 4), dtype=np.float32)
    y, x = np.mgrid[:1416, :2120]
    pixels[..., 3] = np.where((x // 150 + y // 110) % 3 == 0, 2.2, 2.5 + 0.5 * x / 2120)
    path = put(tmp_path_factory.mktemp("scene") / "picture.exr", pixels, ("R", "G", "B", "Z"))
    pixels[5::61, 3::47, :3] = 500.0
    put(path.with_name("lamps.exr"), pixels, ("R", "G", "B", "Z"))
    return path


def shot(picture, settings, window):
    scene = {"scene.image": picture.name, "scene.field_of_view": None, "scene.depth": {"channel": "Z", "unit": "m"}} | settings
    scene["scene.image"] = str(picture.with_name(scene["scene.image"]))
    return load_shot("motorcycle_stopped_down", scene | window)


class Asked:
    """Work that a device is asked for: work-items, and bytes that are copied to it."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.items = self.bytes = 0
        run, upload, write = Device.run, Device.upload, Device.write

        def counted_run(device, kernel, global_size, local_size, **arguments):
            self.items += int(np.prod(global_size))
            run(device, kernel, global_size, local_size, **arguments)

        def counted_upload(device, array):
            self.bytes += array.nbytes
            return upload(device, array)

        def counted_write(device, buffer, array, offset):
            self.bytes += array.nbytes
            write(device, buffer, array, offset)

        patch.setattr(Device, "run", counted_run)
        patch.setattr(Device, "upload", counted_upload)
        patch.setattr(Device, "write", counted_write)


def spoil_memory(patch: pytest.MonkeyPatch) -> None:
    """Let all memory of a device that nothing was written to hold NaN."""
    empty = Device.empty

    def spoilt(device, shape, dtype):
        buffer = empty(device, shape, dtype)
        device.fill(buffer, np.uint8(255), 0)
        return buffer

    patch.setattr(Device, "empty", spoilt)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in SHOTS])
def test_a_window_reads_nothing_that_was_not_computed_for_it(picture, name, monkeypatch):
    whole = simulate(shot(picture, SHOTS[name], FRAME))
    spoil_memory(monkeypatch)
    for window in (WINDOW, ODD):
        part = simulate(shot(picture, SHOTS[name], {"camera.window": window}))
        rows, columns = (
            slice(window[first], window[first] + window[length]) for first, length in (("y", "height"), ("x", "width"))
        )
        for array in ("dn", "mean_electrons", "noise_free_dn"):
            assert np.array_equal(getattr(part, array), getattr(whole, array)[rows, columns]), array


@pytest.mark.parametrize("name", ["sharp, coarse scene", "glare"])
def test_a_window_of_a_sharp_frame_costs_its_share(picture, name):
    asked = []
    for window in (FRAME, {"camera.window": WINDOW}):
        with pytest.MonkeyPatch.context() as patch:
            counted = Asked(patch)
            simulate(shot(picture, SHOTS[name], window))
        asked.append(counted)
    whole, part = asked
    assert part.items <= 1.5 * SHARE * whole.items + MARGIN_ITEMS and part.bytes <= 2**14


def test_a_window_of_a_blurred_frame_costs_its_share_and_the_margin_of_the_blur(picture):
    """Tiles have 128 x 16 photosites, with a margin of 32 columns and of 16 rows around each of the two bands that it meets."""
    asked = []
    settings = SHOTS["blurred depth"]
    for window in (FRAME, {"camera.window": WINDOW}):
        with pytest.MonkeyPatch.context() as patch:
            counted = Asked(patch)
            simulate(shot(picture, settings, window))
        asked.append(counted)
    whole, part = asked
    tiled = (WINDOW["width"] + 128 + 2 * 32) * (WINDOW["height"] + 2 * 2 * 16) / (WIDTH * HEIGHT)
    # A work-item of the projection has 16 samples, those of passes over whole tiles have 1 or 64.
    assert part.items <= 1.05 * tiled * whole.items and part.bytes <= 0.5 * whole.bytes + 2**20


def test_a_second_window_neither_reads_the_scene_nor_plans_its_optics(picture, monkeypatch):
    """Its accuracy follows the whole scene, in a time that does not depend on the window. Its text waits until it is read."""
    settings = SHOTS["blurred depth, wide"]
    whole = shot(picture, settings, FRAME)
    simulate(whole)
    read = []
    monkeypatch.setattr("simulator.scene.image.read_pixels", lambda *arguments: read.append(arguments))
    monkeypatch.setattr("simulator.optics.blur_planning.scene_contrast", lambda *arguments: read.append(arguments))
    monkeypatch.setattr("simulator.optics.passes.tile_plan.highlight_threshold", lambda *arguments: read.append(arguments))
    monkeypatch.setattr("simulator.sensor.sensor_plan.SensorPlan.noise_floor", lambda *arguments: read.append(arguments))
    part = replace(whole, camera=replace(whole.camera, window=Window(**WINDOW)))
    with monkeypatch.context() as patch:
        patch.setattr("simulator.config.shot_file.LoadedShot.describe", lambda *arguments: read.append(arguments))
        raw = simulate(part)
    assert not read
    assert raw.resolved["shot"]["camera"]["window"] == WINDOW
