"""Layers that move behind a lens, and their picture by dense sums over aperture and time in float64."""

import dataclasses
from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.stats import qmc

from helpers.lens_frame import LENS, case_plan, depth_of, with_accuracy
from helpers.lens_truths import Case
from simulator.device import open_device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.optics.defocus.joint_motion import plan_joint_motion
from simulator.optics.geometry.image_motion import ImageMotion, LayerPath, Surface, plan_geometry
from simulator.optics.geometry.instants import TimedPath
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure
from simulator.sensor.camera.camera_sections import Window

MARGIN = 32  # of the cases, around the photosites of their truth


def light_texture(rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Light from 0.05 to 0.95 that varies over few photosites."""
    smooth = gaussian_filter(rng.random((rows, columns)), 1.0)
    return 0.05 + 0.9 * (smooth - smooth.min()) / np.ptp(smooth)


def bars_before_a_wall(near_px: float, far_px: float, rows: int = 96, columns: int = 128) -> Case:
    """Bright bars and a disk before a textured wall, each at one distance."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:rows, :columns]
    near = (((x - 0.5 * columns) ** 2 + (y - 0.5 * rows) ** 2 < 100.0) | ((x // 9) % 4 == 0)) * 1.0
    light = np.stack([light_texture(rng, rows, columns) * near, light_texture(rng, rows, columns)])
    radius = np.stack([np.full(near.shape, near_px), np.full(near.shape, far_px)])
    truth = np.zeros((rows - 2 * MARGIN, columns - 2 * MARGIN))
    return Case("bars", light, np.stack([near, np.ones_like(near)]), radius, truth, MARGIN, 1, False)


def moving_plan(
    case: Case,
    camera: SteadyMotion | None = None,
    ways_px: tuple[tuple[float, float] | LayerMotion | None, ...] = (),
    lines: LineTimes | None = None,
    start_s: float = 0.0,
    tolerance: float = 0.1,
) -> Plan:
    """Plan of a case whose camera and layers move while lines are open (one second at once, if left out).

    ways_px: of each layer in a second, to the right and down, or its motion; None: it rests.
    """
    resting = case_plan(case, tolerance=tolerance)
    planned = with_accuracy(resting, type(resting.optics.accuracy), tolerance=tolerance)  # not what layers at rest need
    defocus, sensor = planned.optics.defocus, planned.sensor
    assert defocus is not None  # all cases are out of focus somewhere
    paths = [_path(way) for way in ways_px or (None,) * len(case.radius_px)]
    depths = [np.ravel(depth_of(radius)) for radius in case.radius_px]
    surfaces = tuple(Surface(float(depth.min()), float(depth.max()), own) for depth, own in zip(depths, paths, strict=True))
    motion = ImageMotion(plan_geometry(LENS, sensor.camera, planned.optics.projection), surfaces, camera)
    path = TimedPath(motion, lines or open_at_once(1.0), start_s)
    joint = plan_joint_motion(path, LENS, sensor.camera.pixel_pitch_um, defocus.radii_px)
    return dataclasses.replace(
        planned, optics=dataclasses.replace(planned.optics, defocus=dataclasses.replace(defocus, motion=joint))
    )


def _path(way_px: tuple[float, float] | LayerMotion | None) -> LayerPath | None:
    if way_px is None:
        return None
    motion = way_px if isinstance(way_px, LayerMotion) else LayerMotion((Speed(way_px[0], "px/s"), Speed(way_px[1], "px/s")))
    return lambda times_s: motion.moves(times_s, (1, 1))


def image_distance_px(pixel_pitch_um: float = 5.0) -> float:
    """Lens to sensor [photosites]."""
    return 1e3 * LENS.image_distance_mm / pixel_pitch_um


def dense_turned_picture(
    case: Case, angles_rad: Callable[[np.ndarray], np.ndarray], line_s: float = 0.0, samples: int = 1 << 11
) -> np.ndarray:
    """Picture of flat layers that turn about the middle of the scene, of the shape of the case's truth, as `dense_picture`.

    angles_rad: (layers, times), counter-clockwise, at times [s]. Rows are open for a second, each by line_s after that above.
    """
    points = qmc.Sobol(3, seed=78).random(samples)
    radius, angle = np.sqrt(points[:, 0]), 2.0 * np.pi * points[:, 1]
    (rows, columns), margin = case.colour.shape[1:], case.margin
    y, x = np.mgrid[margin : rows - margin, margin : columns - margin] + 0.5
    middle_x, middle_y, blur_px = 0.5 * columns, 0.5 * rows, case.radius_px[:, 0, 0]
    total = np.zeros(x.shape)
    for u_x, u_y, share in zip(radius * np.cos(angle), radius * np.sin(angle), points[:, 2], strict=True):
        turned = angles_rad(line_s * (y[:, 0] - 0.5) + share)[..., None]
        cosine, sine = np.cos(turned), np.sin(turned)
        light, through = np.zeros(x.shape), np.ones(x.shape)
        for layer, blur in enumerate(blur_px):
            right, down = x - middle_x + blur * u_x, y - middle_y + blur * u_y
            at = [
                middle_y + sine[layer] * right + cosine[layer] * down - 0.5,
                middle_x + cosine[layer] * right - sine[layer] * down - 0.5,
            ]
            read = [map_coordinates(plane[layer], at, order=1, mode="nearest") for plane in (case.colour, case.coverage)]
            light += through * read[0]
            through = through * (1.0 - read[1])
        total += light
    return total / samples


def dense_picture(case: Case, shifts_px: Callable[[float], np.ndarray], samples: int = 1 << 13) -> np.ndarray:
    """Picture of flat layers, of the shape of the case's truth, by bilinear reads along rays through `samples` points.

    shifts_px: (layers, 2), x and y, of the place seen at rest at this share of the time. Points of aperture and time
    are Sobol' points of another scrambling than those of the pipeline.
    """
    points = qmc.Sobol(3, seed=77).random(samples)
    radius, angle = np.sqrt(points[:, 0]), 2.0 * np.pi * points[:, 1]
    aperture = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    colour, coverage = case.colour.astype(np.float64), case.coverage.astype(np.float64)
    blur_px = case.radius_px[:, 0, 0]
    height, width = (side - 2 * case.margin for side in colour.shape[1:])
    total = np.zeros((height, width))
    for u, share in zip(aperture, points[:, 2], strict=True):
        moved = blur_px[:, None] * u + shifts_px(float(share))
        light, through = np.zeros((height, width)), np.ones((height, width))
        for layer, (x, y) in enumerate(moved):
            light += through * _read(colour[layer], case.margin + x, case.margin + y, height, width)
            through = through * (1.0 - _read(coverage[layer], case.margin + x, case.margin + y, height, width))
        total += light
    return total / samples


def _read(plane: np.ndarray, x: float, y: float, height: int, width: int) -> np.ndarray:
    """Bilinear read of a window that begins at (x, y)."""
    column, row = int(np.floor(x)), int(np.floor(y))
    right, down = x - column, y - row
    part = plane[row : row + height + 1, column : column + width + 1]
    across = (1.0 - right) * part[:, :-1] + right * part[:, 1:]
    return (1.0 - down) * across[:-1] + down * across[1:]


def moving_picture(case: Case, planned: Plan) -> np.ndarray:
    """Radiance of the photosites of the case's truth by a plan of it, of which no other is computed."""
    height, width = case.truth.shape
    inside = dataclasses.replace(planned.optics, window=Window(case.margin, case.margin, width, height))
    if "layer_edges" in vars(planned.optics):  # those of a plan without them
        vars(inside)["layer_edges"] = planned.optics.layer_edges
    device = open_device()
    mosaic = expose(measure(dataclasses.replace(planned, optics=inside, strips=()), device), device)
    return device.download(mosaic, (height, width), np.float32) / planned.optics.weights.sum()
