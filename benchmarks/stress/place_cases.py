"""Cases of the kernels by which photosites see the scene, sharp and at rest: means over their areas, and where these lie."""

import math
from dataclasses import replace

import numpy as np
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from scipy.ndimage import maximum_filter

from simulator.device import Device
from simulator.optics.geometry.footprint import Footprint
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project, project_planes
from simulator.optics.lens.distortion import MOST_STEPS, Distortion, plan_warp
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

from .inputs import number, picture
from .search import Outcome, StressCase, promised_sigma
from .space import Choice, Inputs, Picture, Real

ELECTRONS = Real(5.0, 5e4, log=True, switches=(1000.0,))
KEPT = "the tolerance of the shot is 0.1 sigma, which 99.9 % of the photosites keep; this is the worst of all"
PROMISED = (
    "99.9 % of the photosites keep the tolerance of the shot, 0.1 sigma, or what its error budget states where that is more"
)
SCENE_SHAPE = {1.0: (30, 40), 2.0: (60, 80), 2.7: (81, 108), 4.0: (120, 160)}  # pixels of 30 x 40 photosites


def area_outcome(
    inputs: Inputs, scale: float, radius_px: float, margin: int, shape: tuple[int, int] = (30, 40), chords: int = 512
) -> Outcome:
    """Electrons of photosites whose scene has `scale` pixels per photosite, behind blur circles of this radius.

    chords: of the truth's circles, whose spots of lamps they leave off by 1e-3 at 512 and 1e-4 at 2048.
    """
    height, width = (round(scale * side) for side in shape)
    pixels = picture(inputs)[:height, :width].astype(np.float64)
    electrons = number(inputs, "electrons")
    found, planned = frame_radiance(fine_shot(pixels, shape, radius_px, electrons))
    truth = photosite_means(pixels.astype(np.float32).astype(np.float64), shape, radius_px, chords=chords)
    inner = (slice(margin, -margin), slice(margin, -margin)) if margin else (slice(None), slice(None))
    promised = promised_sigma(planned)
    return Outcome(electrons * found[inner].astype(np.float64), electrons * truth[inner], promised_sigma=promised)


def run_projection(device: Device, inputs: Inputs) -> Outcome:
    frame = area_outcome(inputs, number(inputs, "scale"), 0.0, 0)
    least = number(inputs, "electrons") * float(np.finfo(np.float32).tiny)  # of light that float32 holds with all places
    return replace(frame, scale=np.maximum(maximum_filter(frame.exact, 3), least))


def run_projection_places(device: Device, inputs: Inputs) -> Outcome:
    """Photosites far to the right on a large sensor: a place in the scene is one number of float32."""
    scale, first = float(np.float32(number(inputs, "scale"))), int(number(inputs, "column"))
    count = math.ceil((first + 36) * scale) + 66
    line = np.zeros(count, np.float32)
    light = picture(inputs)[0]
    begin = int(first * scale)
    line[begin : begin + len(light)] = light
    projection = Projection(scale, 0.0, 0.0, count, 4, max(1, math.ceil(scale - 1e-6)), False)
    planes = device.upload(np.broadcast_to(line, (1, 4, count)))
    mosaic = project(device, projection, Cfa.uniform(0), Window(first, 0, 32, 3), planes)
    x = scale * (first + np.arange(33.0))
    if projection.is_fine:
        exact = (
            np.diff(np.interp(x, np.arange(count + 1.0), np.concatenate([[0.0], np.cumsum(line.astype(np.float64))]))) / scale
        )
    else:
        exact = np.interp(x[:-1] + 0.5 * scale - 0.5, np.arange(count), line.astype(np.float64))
    size = np.full((3, 32), float(light.max()) * (first + 36) * scale)
    return Outcome(device.download(mosaic, (3, 32), np.float32), np.broadcast_to(exact, (3, 32)), size)


def bilinear_means(line: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Means between edges [px] of light that is bilinear between the middles of a line's pixels, float64."""
    values = line.astype(np.float64)
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    pixel = np.floor(edges - 0.5).astype(int)
    past = edges - 0.5 - pixel
    return np.diff(sums[pixel] + past * values[pixel] + 0.5 * past**2 * (values[pixel + 1] - values[pixel])) / np.diff(edges)


def run_projection_samples(device: Device, inputs: Inputs) -> Outcome:
    """Samples of photosites in a scene of fewer pixels: read across, then down, where there are two or more to a pixel."""
    scale, over, first = float(np.float32(number(inputs, "scale"))), int(number(inputs, "over")), int(number(inputs, "column"))
    light = picture(inputs)[0]
    line = np.zeros(math.ceil((first + 40) * scale) + len(light) + 8, np.float32)
    begin = 4 + int(first * scale)
    line[begin : begin + len(light)] = light
    projection = Projection(scale, 4.3, 0.0, len(line), 4, 1, False, is_bilinear=True)
    planes, layout = device.upload(np.broadcast_to(line, (1, 4, len(line)))), InterleavedColumns(over, 2 * over, 16)
    sampled = device.empty(layout.shape(1), np.float32)
    project_planes(device, projection, planes, 1, sampled, 0, layout, (first, 0))
    found = layout.decode(device.download(sampled, layout.shape(1), np.float32)[0])
    exact = bilinear_means(line, 4.3 + scale * (first + np.arange(found.shape[1] + 1.0) / over))
    size = np.full(found.shape, float(light.max()) * (first + 40) * scale)
    return Outcome(found, np.broadcast_to(exact, found.shape), size)


def run_pixel_samples(device: Device, inputs: Inputs) -> Outcome:
    """Samples of photosites in a scene of as many pixels, beyond whose ends its last ones continue."""
    light, left, top = picture(inputs), int(number(inputs, "left")), int(number(inputs, "top"))
    (height, width), layout = light.shape, InterleavedColumns(1, 8, 64)
    projection = Projection(1.0, 0.0, 0.0, width, height, 1, False)
    sampled = device.empty(layout.shape(1), np.float32)
    project_planes(device, projection, device.upload(light[None]), 1, sampled, 0, layout, (left, top))
    rows, columns = (np.clip(at + np.arange(size), 0, end - 1) for at, size, end in ((top, 8, height), (left, 128, width)))
    return Outcome(layout.decode(device.download(sampled, layout.shape(1), np.float32)[0]), light[rows[:, None], columns])


def square_means(line: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Means between edges [px] of a line's pixels as even squares, float64."""
    sums = np.concatenate([[0.0], np.cumsum(line.astype(np.float64))])
    return np.diff(np.interp(edges, np.arange(len(sums)), sums)) / np.diff(edges)


def run_footprint(device: Device, inputs: Inputs) -> Outcome:
    """Samples that average a scene over a filter's spots and squares beside them: light between its pixels, or even squares."""
    scale, spots_px, first = (float(np.float32(number(inputs, name))) for name in ("scale", "spots_px", "column"))
    light, first, over = picture(inputs)[0], int(first), int(number(inputs, "over"))
    line = np.zeros(math.ceil((first + 40) * scale) + len(light) + 8, np.float32)
    begin = 4 + int(first * scale)
    line[begin : begin + len(light)] = light
    footprint, is_tent = Footprint(0.75, spots_px, 0.28, number(inputs, "share")), scale < 1.0
    projection = Projection(scale, 4.3, 0.0, len(line), 4, 1, False, is_bilinear=is_tent, footprints=(footprint,))
    planes, layout = device.upload(np.broadcast_to(line, (1, 4, len(line)))), InterleavedColumns(over, 2, 16)
    sampled = device.empty(layout.shape(1), np.float32)
    project_planes(device, projection, planes, 1, sampled, 0, layout, (first, 0))
    mosaic = project(device, projection, Cfa.uniform(0), Window(first, 0, 32, 2), planes)
    every = layout.decode(device.download(sampled, layout.shape(1), np.float32)[0])
    found = np.concatenate([every, device.download(mosaic, (2, 32), np.float32)], axis=1)
    middles = np.concatenate([first + (np.arange(32.0 * over) + 0.5) / over, first + np.arange(32.0) + 0.5])
    exact, padded, means = np.zeros(len(middles)), np.pad(line, 8, "edge"), bilinear_means if is_tent else square_means
    for place, share in footprint.places:
        exact += share * np.array([means(padded, 12.3 + scale * (one + place + 0.375 * EDGES))[0] for one in middles])
    return Outcome(found, np.broadcast_to(exact, found.shape), np.full(found.shape, float(light.max())))


EDGES = np.array([-1.0, 1.0])
PLACES_SENSOR = 12000, 8000  # photosites


def run_displaced_places(device: Device, inputs: Inputs) -> Outcome:
    """Photosites far from the axis of a lens that distorts and a camera that has turned, each the light at its middle."""
    (width, height), first, light = PLACES_SENSOR, int(number(inputs, "column")), picture(inputs)[0]
    x, y = first + np.arange(32) + 0.5, np.full(32, 0.5 * height + 0.5)
    warp = plan_warp(Distortion(k1=number(inputs, "k1"), unit="half_diagonal"), width, width, height, 1)
    if warp is not None:
        x, y = replace(warp, steps=MOST_STEPS).undistorted(x, y)
    turn, shrink = number(inputs, "turn"), 1e-3 * number(inputs, "turn") / width
    pose = (0.5 * width, 0.5 * height, number(inputs, "pan_px"), turn, 0.0, 0.0, 0.0, 0.0, shrink, 0.0)
    from_axis = x - pose[0]
    x = x + (pose[2] + turn * from_axis - shrink * from_axis**2) / (1.0 + shrink * from_axis)
    line = np.zeros(128, np.float32)
    line[8 : 8 + len(light)] = light
    offset_px = 16.3 - math.floor(x.min())
    planes = device.upload(np.broadcast_to(line, (1, 4, len(line))))
    projection = Projection(1.0, offset_px, -0.5 * height, len(line), 4, 1, False, warp, pose=pose)
    mosaic = project(device, projection, Cfa.uniform(0), Window(first, height // 2, 32, 1), planes)
    exact = np.interp(offset_px + x - 0.5, np.arange(len(line)), line.astype(np.float64))
    return Outcome(device.download(mosaic, (32,), np.float32), exact)


CASES = (
    StressCase(
        "projection",
        ("upright_projection",),
        {"light": Picture(SCENE_SHAPE[4.0], 1e-9, 1e5), "scale": Choice((2.0, 2.7, 4.0)), "electrons": ELECTRONS},
        run_projection,
        "a place of up to 160 scene pixels is rounded to 2^-17, and so is the scale: 256 ulps of the brightest neighbour",
        most_ulps=256.0,
    ),
    StressCase(
        "projection_places",
        ("upright_projection",),
        {
            "light": Picture((1, 64), 1e-3, 2e4),
            "scale": Real(0.3, 3.0, switches=(0.5, 1.0, 2.0)),
            "column": Choice((0, 1000, 6000, 23000)),
        },
        run_projection_places,
        "a place in the scene is a rounded product: 1 ulp of the place, times the contrast, at either end",
        most_ulps=3.0,
    ),
    StressCase(
        "projection_samples",
        ("projection_planes", "projection_across", "projection_down"),
        {
            "light": Picture((1, 64), 1e-3, 2e4),
            "scale": Real(0.2, 0.95, switches=(0.5,)),
            "over": Choice((1, 2, 4)),
            "column": Choice((0, 1000, 6000, 23000)),
        },
        run_projection_samples,
        "as of projection_places",
        most_ulps=3.0,
    ),
    StressCase(
        "pixel_samples",
        ("pixel_planes",),
        {"light": Picture((6, 150), 1e-37, 3e38), "left": Choice((-200, -3, 0, 7, 40, 200)), "top": Choice((-9, 0, 3, 9))},
        run_pixel_samples,
        "samples are pixels, bit by bit",
        most_ulps=0.0,
    ),
    StressCase(
        "footprint",
        ("footprint_across", "footprint_planes", "footprint_mosaic"),
        {
            "light": Picture((1, 64), 1e-3, 2e4),
            "scale": Real(0.2, 3.0, switches=(0.5, 1.0)),
            "over": Choice((1, 3)),
            "spots_px": Real(0.0, 2.0, switches=(0.5, 1.0)),
            "share": Real(0.0, 0.4),
            "column": Choice((0, 1000, 6000, 23000)),
        },
        run_footprint,
        "up to 14 shares, each rounded, of differences and their sums, along either axis: 12 ulps of the brightest pixel",
        most_ulps=12.0,
    ),
    StressCase(
        "displaced_places",
        ("projection_mosaic",),
        {
            "light": Picture((1, 64), 1e-3, 2e4),
            "column": Choice((0, 1000, 6000, 11000)),
            "k1": Choice((-0.02, 0.0, 0.01)),
            "pan_px": Real(-60.0, 60.0, switches=(0.0,)),
            "turn": Real(-1e-3, 1e-3, switches=(0.0,)),
        },
        run_displaced_places,
        "a displacement of up to 120 photosites is off by 2e-7 of it, times the contrast",
        most_sigma=0.5,
    ),
)
