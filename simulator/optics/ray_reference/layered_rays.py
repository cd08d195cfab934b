"""The reference blur: rays through a thin lens, low-discrepancy points on photosite and pupil, layers front to back.

Light = mean over photosite and pupil of sum_k C_k(x_k) prod_{j<k} (1 - A_j(x_j)), x_k = x + s_k(x_k) u, with the signed blur
radius s = a f_px (1/z_focus - 1/z) [photosites], linear in the inverse distance. Nothing but the means is approximated.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.device import Device
from simulator.errors import require
from simulator.optics.defocus.aperture_samples import disk_of_square
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.pupil.pupil import Pupil
from simulator.sensor.camera.camera import Window

POSITION_ERROR_PX = 1e-3  # of a ray on a tilted surface: far below a photosite
MOST_ITERATIONS = 64
ROUND = Pupil()
PATTERNS = 32  # neighbours rarely share one; a pattern of 1024 points takes 16 KiB


@dataclass(frozen=True)
class Surfaces:
    """Layers on the device, nearest first, on a grid around the frame.

    colour: buffer (layers, channels, rows, columns) float32, radiance * coverage. coverage: (layers, rows, columns) float32.
    radius_px: (layers, rows, columns) float32, signed blur radius [photosites].
    rows, columns: (frame + 2 margin_px) * oversampling. iterations: fixed-point steps that reach a tilted surface.
    """

    colour: object
    coverage: object
    radius_px: object
    layers: int
    channels: int
    rows: int
    columns: int
    oversampling: int
    margin_px: int
    iterations: int


def upload_surfaces(
    device: Device, colour, coverage, radius_px, margin_px: int, oversampling: int = 1, iterations: int | None = None
) -> Surfaces:
    """Surfaces of arrays shaped as in `Surfaces`.

    iterations: fixed-point steps; default: what `needed_iterations` says. A surface reaches over what hides it, and its radius
    goes on smoothly where its coverage is 0.
    Raises PhotositeError for a coverage outside 0 to 1, a radius or colour that is no number, a surface too steep.
    """
    colour, coverage, radius_px = (np.asarray(array, dtype=np.float32) for array in (colour, coverage, radius_px))
    shapes = f"colour {colour.shape}, coverage {coverage.shape}, radius {radius_px.shape}"
    one_size = colour.ndim == 4 and colour[:, 0].shape == coverage.shape == radius_px.shape
    require(one_size, "surfaces", shapes, "give (layers, channels, rows, columns) and twice (layers, rows, columns)")
    require(np.isfinite(colour).all(), "surface colour", "NaN or infinite", "give a number for every sample")
    require(
        np.isfinite(radius_px).all(), "surface radius", "NaN or infinite", "give a distance for every sample, inf for the sky"
    )
    inside = coverage.min() >= 0 and coverage.max() <= 1
    require(inside, "surface coverage", f"{coverage.min():g} to {coverage.max():g}", "coverage runs from 0 to 1")
    layers, channels, rows, columns = colour.shape
    if iterations is None:
        iterations = needed_iterations(radius_px, oversampling)
    buffers = (device.upload(array) for array in (colour, coverage, radius_px))
    return Surfaces(*buffers, layers, channels, rows, columns, oversampling, margin_px, iterations)


def needed_iterations(radius_px: np.ndarray, oversampling: int = 1) -> int:
    """Fixed-point steps after which every ray is within 0.001 photosites of the surface.

    x' = x + s(x') u with |u| <= 1 contracts by the slope g = |grad s| per step (Banach), so n steps leave at
    most |s| g^n / (1 - g). A flat layer needs none.
    Raises PhotositeError for g >= 0.9: a ray could meet such a surface several times.
    """
    steepest = 0.0
    for axis in (1, 2):
        if radius_px.shape[axis] > 1:
            steepest = math.hypot(steepest, oversampling * float(np.abs(np.diff(radius_px, axis=axis)).max()))
    if steepest == 0.0:
        return 0
    require(
        steepest < 0.9,
        "surface radius",
        f"changes by {steepest:.2g} photosites per photosite",
        "give the two sides of an edge as two layers, each of which goes on behind the other",
    )
    largest = max(float(np.abs(radius_px).max()), POSITION_ERROR_PX)
    steps = math.log(POSITION_ERROR_PX * (1.0 - steepest) / largest) / math.log(steepest)
    return min(max(1, math.ceil(steps)), MOST_ITERATIONS)


def lens_points(samples: int, patterns: int = PATTERNS, seed: int = 1, pupil: Pupil = ROUND) -> np.ndarray:
    """Points (patterns, samples, 4) float32: y, x in a photosite, 0 to 1; y, x on the pupil [pupil radii].

    Each pattern is a Sobol' sequence in four dimensions with its own scrambling (Matousek 1998, as in SciPy); powers of two are
    best. The pupil is sampled through maps of the unit square that keep areas.
    """
    from scipy.stats import qmc  # slow to import

    power = math.ceil(math.log2(samples))
    square = np.stack([qmc.Sobol(4, seed=seed + 1000 * i).random_base2(power)[:samples] for i in range(patterns)])
    if pupil.corner_radius == 1.0:  # round
        y, x = disk_of_square(square[..., 2], square[..., 3])
    else:
        x, y = pupil.of_square(square[..., 2], square[..., 3])
    return np.stack([square[..., 0], square[..., 1], y, x], axis=-1).astype(np.float32)


def sample_lens(
    device: Device,
    surfaces: Surfaces,
    points: np.ndarray,
    frame: Window,
    cfa=None,
    cells: bool = True,
    eyes: CatsEyes | None = None,
):
    """Device buffer float32, the frame's light: (1, height, width), each photosite's own colour; or (channels, height, width).

    points: of `lens_points`. cfa: planes ((p00, p01), (p10, p11)) of the frame's upper left corner; None: all channels.
    cells: colour and coverage are means of their samples; False: values at their centres, read bilinearly.
    eyes: stops that hide parts of the pupil by place on the sensor; each ray is tested, and where none passes it is dark.
    The error falls nearly as 1/samples where light is smooth, as their power -0.7 at edges and small lights.
    """
    check_grid((surfaces.rows, surfaces.columns), frame, surfaces.margin_px, surfaces.oversampling)
    defines = ray_defines(surfaces.oversampling, cfa, eyes) | {"CELLS": int(cells)}
    planes = 1 if cfa is not None else surfaces.channels
    light = device.empty((planes, frame.height, frame.width), np.float32)
    device.run(
        device.kernel("lens_sampling", defines),
        (frame.width, frame.height, planes),
        None,
        colour=surfaces.colour,
        coverage=surfaces.coverage,
        radius=surfaces.radius_px,
        light=light,
        layers=surfaces.layers,
        channels=surfaces.channels,
        iterations=surfaces.iterations,
        grid={"rows": surfaces.rows, "columns": surfaces.columns, "margin": surfaces.margin_px},
        **ray_arguments(device, points, frame, eyes),
    )
    return light


def check_grid(shape: tuple[int, int], frame: Window, margin_px: int, oversampling: int) -> None:
    """Raise PhotositeError when the samples do not reach over the frame and its margin."""
    wanted = tuple((size + 2 * margin_px) * oversampling for size in (frame.height, frame.width))
    enough = shape[0] >= wanted[0] and shape[1] >= wanted[1]
    require(enough, "surfaces", f"{shape} samples", f"give {wanted}: the frame and its margin, {oversampling} per photosite")


def ray_defines(oversampling: int, cfa, eyes: CatsEyes | None) -> dict[str, int]:
    """Macros of a kernel that follows rays; cfa: planes of the frame's upper left corner, or None."""
    block = cfa or ((0, 0), (0, 0))
    places = {f"CFA_{y}{x}": block[y][x] for y in (0, 1) for x in (0, 1)}
    return places | {"OVERSAMPLING": oversampling, "MOSAIC": int(cfa is not None), "STOPS": len(_stops(eyes))}


def ray_arguments(device: Device, points: np.ndarray, frame: Window, eyes: CatsEyes | None) -> dict[str, object]:
    """Arguments of such a kernel that say which rays it follows: buffers, and `struct rays` of kernels/lens_rays.h."""
    tangent, width, height = (eyes.tangent_per_px, eyes.width_px, eyes.height_px) if eyes else (0.0, 0, 0)
    rays = {
        "patterns": points.shape[0],
        "samples": points.shape[1],
        "origin_x": frame.x,
        "origin_y": frame.y,
        "centre_x": 0.5 * width,
        "centre_y": 0.5 * height,
        "tangent_per_px": tangent,
    }
    stops = device.upload(np.array(_stops(eyes) or [(0.0, 0.0)], dtype=np.float32))
    return {"points": device.upload(np.asarray(points, dtype=np.float32)), "stops": stops, "rays": rays}


def _stops(eyes: CatsEyes | None) -> list[tuple[float, float]]:
    """Radius and shift of each stop, in pupil radii."""
    return [(stop.radius, stop.shift) for stop in eyes.pupil.stops] if eyes else []
