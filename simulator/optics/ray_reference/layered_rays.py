"""The reference blur of layers: rays through a thin lens from low-discrepancy points on photosite and pupil, front to back.

Light = mean over photosite and pupil of sum_k C_k(x_k) prod_{j<k} (1 - A_j(x_j)), x_k = x + s_k(x_k) u, with the signed blur
radius s = a f_px (1/z_focus - 1/z) [photosites], linear in the inverse distance. Only the means are approximated, by sums.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from simulator.device import Buffer, Device
from simulator.errors import require
from simulator.optics.defocus.aperture_samples import bilinear_shifts, disk_of_square
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.defocus.joint_motion import Cells, JointMotion
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.small_lights import pupil_spans
from simulator.sensor.camera.camera import Window

POSITION_ERROR_PX = 1e-3  # of the intersection of a ray with a tilted surface
MOST_ITERATIONS = 64
INSTANTS = 8192  # at which the path of moving images is known: steps of 0.003 photosites on a path of 20
ROUND = Pupil()
PATTERNS = 32  # of rays, so that neighbouring photosites rarely share one; a pattern of 1024 rays takes 16 KiB

LightsLost = Callable[[np.ndarray, np.ndarray], np.ndarray]
CfaBlock = tuple[tuple[int, ...], ...]  # colour planes of the upper left 2 x 2 photosites


@dataclass(frozen=True)
class Surfaces:
    """Layers on the device, nearest first, on a grid around the frame.

    colour: buffer (layers, channels, rows, columns) float32, radiance * coverage. coverage: (layers, rows, columns) float32.
    radius_px: (layers, rows, columns) float32, signed blur radius [photosites].
    rows, columns: (frame + 2 margin_px) * oversampling. iterations: fixed-point steps to intersect a tilted surface.
    """

    colour: Buffer
    coverage: Buffer
    radius_px: Buffer
    layers: int
    channels: int
    rows: int
    columns: int
    oversampling: int
    margin_px: int
    iterations: int


def upload_surfaces(
    device: Device,
    colour: ArrayLike,
    coverage: ArrayLike,
    radius_px: ArrayLike,
    margin_px: int,
    oversampling: int = 1,
    iterations: int | None = None,
    farthest: float = 1.0,
) -> Surfaces:
    """Upload arrays shaped as in `Surfaces`.

    iterations: fixed-point steps; None: of `needed_iterations`. farthest: from the pupil's middle, of any ray's point and shift
    [pupil radii]. A surface continues behind what occludes it, and its radius
    is smooth where its coverage is 0.
    Raises PhotositeError for a coverage outside 0 to 1, NaN or infinity in a radius or colour, and a surface too steep.
    """
    light, covered, radius = (np.asarray(array, dtype=np.float32) for array in (colour, coverage, radius_px))
    shapes = f"colour {light.shape}, coverage {covered.shape}, radius {radius.shape}"
    one_size = light.ndim == 4 and light[:, 0].shape == covered.shape == radius.shape
    require(one_size, "surfaces", shapes, "give (layers, channels, rows, columns) and twice (layers, rows, columns)")
    require(bool(np.isfinite(light).all()), "surface colour", "NaN or infinite", "give a number for every sample")
    require(
        bool(np.isfinite(radius).all()),
        "surface radius",
        "NaN or infinite",
        "give a distance for every sample, inf for the sky",
    )
    inside = bool(covered.min() >= 0 and covered.max() <= 1)
    require(inside, "surface coverage", f"{covered.min():g} to {covered.max():g}", "coverage runs from 0 to 1")
    layers, channels, rows, columns = light.shape
    if iterations is None:
        iterations = needed_iterations(radius, oversampling, farthest)
    return Surfaces(
        device.upload(light),
        device.upload(covered),
        device.upload(radius),
        layers,
        channels,
        rows,
        columns,
        oversampling,
        margin_px,
        iterations,
    )


def needed_iterations(radius_px: np.ndarray, oversampling: int = 1, farthest: float = 1.0) -> int:
    """Fixed-point steps after which every ray is within 0.001 photosites of the surface.

    x' = x + s(x') u with |u| <= `farthest` contracts by g = |grad s| |u| per step (Banach), so n steps leave at
    most |s| g^n / (1 - g). A flat layer needs none.
    Raises PhotositeError for g >= 0.9: a ray could meet such a surface several times.
    """
    steepest = 0.0
    for axis in (1, 2):
        if radius_px.shape[axis] > 1:
            slope = oversampling * float(np.abs(np.diff(radius_px, axis=axis)).max())
            steepest = math.hypot(steepest, farthest * slope)
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


def ray_samples(
    samples: int, patterns: int = PATTERNS, seed: int = 1, pupil: Pupil | None = ROUND, *, timed: bool = False
) -> np.ndarray:
    """Patterns of rays (patterns, samples, 4) float32: x, y in a photosite, 0 to 1; x, y on the pupil [pupil radii].

    pupil: None: the last two numbers are x, y in the unit square. timed: a fifth number is the share of the light, 0 to 1, that
    has come at the ray's instant.

    Each pattern is a Sobol' sequence in as many dimensions with its own scrambling (Matousek 1998, as in SciPy), which is most
    uniform for powers of two. The pupil is sampled through area-preserving maps of the unit square.
    """
    from scipy.stats import qmc  # slow to import

    power = math.ceil(math.log2(samples))
    # SciPy's annotations lack `seed`; `rng` may give other numbers.
    sobol = (qmc.Sobol(4 + timed, seed=seed + 1000 * i) for i in range(patterns))  # pyright: ignore[reportCallIssue]
    square = np.stack([sequence.random_base2(power)[:samples] for sequence in sobol])
    if pupil is None:
        y, x = square[..., 2], square[..., 3]
    elif pupil.corner_radius == 1.0:  # round
        y, x = disk_of_square(square[..., 2], square[..., 3])
    else:
        x, y = pupil.map_unit_square(square[..., 2], square[..., 3])
    time = [square[..., 4]] if timed else []
    return np.stack([square[..., 1], square[..., 0], x, y, *time], axis=-1).astype(np.float32)


def move_rays(points: np.ndarray, motion: JointMotion, middle_px: tuple[float, float], cells: Cells) -> np.ndarray:
    """Rays of a cell whose images move, (patterns, samples, 4 + 16 layers) float32, with the shifts of each layer.

    points: of `ray_samples`, timed. middle_px: x and y of the cell from the sensor's corner [photosites]. cells: its size.
    """
    middle, shares = np.array([middle_px]), (np.arange(INSTANTS) + 0.5) / INSTANTS
    shifts = np.moveaxis(bilinear_shifts(motion, middle, cells, shares)[:, 0], 0, 2)  # (layers, instants, 4, 4)
    turns = motion.turns_at(middle[:, 1], shares)[0] - np.eye(2, dtype=np.float32)
    instants = np.minimum((points[..., 4] * INSTANTS).astype(np.intp), INSTANTS - 1)
    moved = np.moveaxis(shifts, 0, 1)[instants]  # (patterns, samples, layers, 4, 4)
    own = np.moveaxis(turns, 0, 1)[instants]
    moved[..., 0, :2] += np.einsum("...lij,...j->...li", own, points[..., 2:4])
    moved[..., 0, 2:] += np.einsum("...lij,...j->...li", own, points[..., :2] - np.float32(0.5))
    return np.concatenate([points[..., :4], moved.reshape(*points.shape[:2], -1)], axis=-1)


def sample_lens(
    device: Device,
    surfaces: Surfaces,
    points: np.ndarray,
    frame: Window,
    cfa: CfaBlock | None = None,
    cells: bool = True,
    eyes: CatsEyes | None = None,
    places: np.ndarray | None = None,
    middle_px: tuple[float, float] = (0.0, 0.0),
) -> Buffer:
    """Device buffer float32, the light of a frame, (1, height, width), in each photosite's own colour, or (channels, ...).

    places: photosites to compute, row * width + column, (n,); the buffer is then (1, n). None: all.
    points: of `ray_samples` or `move_rays`. middle_px: of `move_rays`.
    cfa: planes ((p00, p01), (p10, p11)) of the frame's upper left corner; None: all channels.
    cells: colour and coverage are means over their samples; False: values at their centres, interpolated bilinearly.
    eyes: stops that clip the pupil by field; each ray is tested, and a photosite that no ray reaches is dark.
    The error falls nearly as 1/samples where light is smooth, as samples^-0.7 at edges and small highlights.
    """
    check_grid((surfaces.rows, surfaces.columns), frame, surfaces.margin_px, surfaces.oversampling)
    defines = ray_defines(surfaces.oversampling, cfa, eyes, points.shape[-1]) | {"CELLS": int(cells)}
    planes, computed = 1 if cfa is not None else surfaces.channels, all_places(frame) if places is None else places
    light = device.empty((planes, len(computed)), np.float32)
    device.run(
        device.kernel("lens_sampling", defines),
        (len(computed), planes),
        None,
        places=device.upload(computed.astype(np.uint32)),
        colour=surfaces.colour,
        coverage=surfaces.coverage,
        radius=surfaces.radius_px,
        light=light,
        layers=surfaces.layers,
        channels=surfaces.channels,
        iterations=surfaces.iterations,
        grid={"rows": surfaces.rows, "columns": surfaces.columns, "margin": surfaces.margin_px},
        **ray_arguments(device, points, frame, eyes, middle_px),
    )
    return light


@dataclass(frozen=True)
class LayeredRays:
    """Rays of a frame through layers, and rays of their small lights.

    The fields are arguments of `sample_lens`; margin_px, oversampling: as in `Surfaces`.
    """

    surfaces: Surfaces
    device: Device
    margin_px: int
    frame: Window
    oversampling: int
    cfa: CfaBlock
    eyes: CatsEyes | None

    def sample(self, points: np.ndarray, places: np.ndarray, middle_px: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
        """Mean light of some photosites, (n,) float32. points: of `ray_samples` or `move_rays`. middle_px: of `move_rays`."""
        scene = self.device, self.surfaces, points, self.frame, self.cfa
        light = sample_lens(*scene, eyes=self.eyes, places=places, middle_px=middle_px)
        return self.device.download(light, places.shape, np.float32)

    def lights_lost(self, lights: np.ndarray, pupil: Pupil) -> LightsLost | None:
        """Return the function that samples what is lost of small lights, (n,) float32; None: nothing can be.

        lights: (lights, 6) as in kernels/lens_lights.h. The function takes points of `ray_samples` without a pupil, and pairs.
        """
        if self.eyes is None and not lights[:, 2].any():
            return None
        surfaces = self.surfaces
        arrays = {"coverage": surfaces.coverage, "radius": surfaces.radius_px, "iterations": surfaces.iterations}
        grid = {"rows": surfaces.rows, "columns": surfaces.columns, "margin": surfaces.margin_px}
        defines = ray_defines(self.oversampling, None, self.eyes) | {"CELLS": 1}
        return lights_sampler(self, "lens_sampling_lights", lights, pupil, defines, {**arrays, "grid": grid})


class FrameRays(Protocol):
    """What `lights_sampler` reads of rays of a frame."""

    @property
    def device(self) -> Device:
        """Device of the buffers."""
        ...

    @property
    def frame(self) -> Window:
        """Photosites from which rays start."""
        ...

    @property
    def eyes(self) -> CatsEyes | None:
        """Stops."""
        ...


def lights_sampler(
    rays: FrameRays, name: str, lights: np.ndarray, pupil: Pupil, defines: dict[str, object], arguments: dict[str, object]
) -> LightsLost:
    """Return the function of `LayeredRays.lights_lost` by a kernel of this name; arguments: those that its scene needs."""
    device, (spans, macros) = rays.device, pupil_spans(pupil)
    kernel = device.kernel(name, defines | macros, file=f"{name.removesuffix('_lights')}.cl")
    shared = {"lights": device.upload(lights), "spans": device.upload(spans), **arguments}

    def lost(points: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        found = device.empty((len(pairs),), np.float32)
        of_rays = ray_arguments(device, points, rays.frame, rays.eyes)
        device.run(kernel, (len(pairs),), None, pairs=device.upload(pairs.astype(np.uint32)), lost=found, **shared, **of_rays)
        return device.download(found, (len(pairs),), np.float32)

    return lost


def all_places(frame: Window) -> np.ndarray:
    """Places of all photosites of a frame: row * width + column."""
    return np.arange(frame.height * frame.width)


def check_grid(shape: tuple[int, int], frame: Window, margin_px: int, oversampling: int) -> None:
    """Raise PhotositeError when the samples do not cover the frame and its margin."""
    wanted = tuple((size + 2 * margin_px) * oversampling for size in (frame.height, frame.width))
    enough = shape[0] >= wanted[0] and shape[1] >= wanted[1]
    require(enough, "surfaces", f"{shape} samples", f"give {wanted}: the frame and its margin, {oversampling} per photosite")


def ray_defines(
    oversampling: int, cfa: CfaBlock | None, eyes: CatsEyes | None, numbers: int = 4, finer: int = 1
) -> dict[str, object]:
    """Macros of a kernel that traces rays; cfa: planes of the frame's upper left corner, or None.

    numbers: of a ray (`move_rays`). finer: divides the steps along a ray, half a sample for a ray through the pupil's rim.
    """
    block = cfa or ((0, 0), (0, 0))
    places: dict[str, object] = {f"CFA_{y}{x}": block[y][x] for y in (0, 1) for x in (0, 1)}
    sampling = {"OVERSAMPLING": oversampling, "POINT": numbers, "T_STEP": f"{0.5 / (oversampling * finer)!r}f"}
    return places | sampling | {"MOSAIC": int(cfa is not None), "STOPS": len(_stops(eyes))}


def ray_arguments(
    device: Device,
    points: np.ndarray,
    frame: Window,
    eyes: CatsEyes | None,
    middle_px: tuple[float, float] = (0.0, 0.0),
) -> dict[str, object]:
    """Arguments of a kernel that traces rays: buffers of rays and stops, and `struct rays` of kernels/lens_rays.h.

    middle_px: of `move_rays`.
    """
    tangent, width, height = (eyes.tangent_per_px, eyes.width_px, eyes.height_px) if eyes else (0.0, 0, 0)
    rays = {
        "patterns": points.shape[0],
        "samples": points.shape[1],
        "width": frame.width,
        "origin_x": frame.x,
        "origin_y": frame.y,
        "centre_x": 0.5 * width,
        "centre_y": 0.5 * height,
        "tangent_per_px": tangent,
        "cell_x": middle_px[0],
        "cell_y": middle_px[1],
    }
    stops = device.upload(np.array(_stops(eyes) or [(0.0, 0.0)], dtype=np.float32))
    return {"points": device.upload(np.asarray(points, dtype=np.float32)), "stops": stops, "rays": rays}


def _stops(eyes: CatsEyes | None) -> list[tuple[float, float]]:
    """Radius and shift of each stop [pupil radii]."""
    return [(stop.radius, stop.shift) for stop in eyes.pupil.stops] if eyes else []
