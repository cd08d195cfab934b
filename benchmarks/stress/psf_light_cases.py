"""Cases of the kernels that lay out light for point spread functions: frames that are blurred already, and sharp layers."""

from functools import cache

import numpy as np
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene

from simulator.device import Device, open_device
from simulator.exposure.settings import Exposure
from simulator.optics.passes.psf_bands import PsfBand
from simulator.optics.passes.psf_gather import BlurredLight, SharpLight
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera_sections import Window

from .inputs import COLUMNS, FRAME, ROWS, SHAPE, number, picture
from .search import Outcome, StressCase
from .space import Inputs, Picture, Whole

BAND = PsfBand(FRAME, 0, 16, 1)
NEAR_PX, FAR_PX = 2.0, 6.0  # signed blur radii


def run_psf_interleave(device: Device, inputs: Inputs) -> Outcome:
    """A frame in the band that holds it, and nothing beside it."""
    x, y, light = int(number(inputs, "x")), int(number(inputs, "y")), picture(inputs)
    planes = device.zeros(BAND.layout.shape(2), np.float32)
    source = BlurredLight(device, Window(x, y, COLUMNS, ROWS), device.upload(light), [1])
    source.fill(BAND, planes)
    found = BAND.layout.decode(device.download(planes, BAND.layout.shape(2), np.float32)[1])
    exact, down, right = np.zeros(found.shape), y - BAND.y, x - BAND.x
    exact[down : down + ROWS, right : right + COLUMNS] = light
    return Outcome(found, exact)


@cache
def layered_plan() -> Plan:
    """Return the plan of two layers out of focus; nothing but their radii counts."""
    half, ones = np.full(SHAPE, 0.5), np.ones((*SHAPE, 1), np.float32)
    behind = (Layer(ones, float(depth_of(FAR_PX))),)
    scene = band_scene(half, depth_of(NEAR_PX), coverage=half.astype(np.float32), behind=behind)
    return measure(plan(Shot(scene, LENS, Exposure(0.001), small_camera(COLUMNS, ROWS))), open_device())


def run_psf_composite(device: Device, inputs: Inputs) -> Outcome:
    """Light of a near layer over a far one, and the blur radius of what covers more than half."""
    planned = layered_plan()
    assert planned.tiles is not None  # the layers are out of focus
    near, cover, far = (picture(inputs, name) for name in ("near", "coverage", "far"))
    planes = [device.upload(np.stack(pair)) for pair in ((near, cover), (far, np.ones_like(far)))]
    layers, radius = (device.empty(BAND.layout.shape(count), np.float32) for count in (4, 2))
    SharpLight(planned.optics, device, planes, planned.tiles, layers, radius).fill(BAND, layers)
    light, seen_px = (
        BAND.layout.decode(device.download(buffer, BAND.layout.shape(count), np.float32)[0])
        for buffer, count in ((layers, 4), (radius, 2))
    )
    own, exact = (slice(-BAND.y, ROWS - BAND.y), slice(-BAND.x, COLUMNS - BAND.x)), cover.astype(np.float64)
    seen = np.where(1.0 - exact < 0.5, *(np.float32(px) for px in planned.tiles.defocus.radii_px))
    composite = near + (1.0 - exact) * far.astype(np.float64)
    return Outcome(np.stack([light[own], seen_px[own]]), np.stack([composite, seen]))


CASES = (
    StressCase(
        "psf_interleave",
        ("psf_interleave",),
        {"light": Picture(SHAPE), "x": Whole(0, 80), "y": Whole(-16, 8)},
        run_psf_interleave,
        "numbers are copied",
        most_ulps=0.0,
    ),
    StressCase(
        "psf_composite",
        ("psf_composite",),
        {"near": Picture(SHAPE, 1e-30, 1e30), "far": Picture(SHAPE, 1e-30, 1e30), "coverage": Picture(SHAPE, 1e-6, 1.0)},
        run_psf_composite,
        "a difference, a product and a sum, each of which may lie in the next binade",
        most_ulps=3.0,
    ),
)
