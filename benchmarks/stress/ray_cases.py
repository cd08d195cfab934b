"""Cases of rays from small bright lights, and of the map of blur radii that rays and means read."""

import numpy as np

from simulator.device import Device
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project_radius
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.height_field_rays import HeightField
from simulator.optics.ray_reference.layered_rays import LayeredRays, LightsLost, ray_samples, upload_surfaces
from simulator.optics.ray_reference.small_lights import SPAN_ROWS, pupil_spans
from simulator.sensor.camera.camera_sections import Window

from .inputs import number, picture
from .search import Outcome, StressCase
from .space import Choice, Inputs, Picture, Real, Whole

FRAME, MARGIN, GRID = Window(101, 57, 20, 12), 6, (24, 32)
RAYS = ray_samples(64, patterns=1, pupil=None)
WEIGHTS = np.append(np.ones(64), 1e-6)  # of the rays of a set, and of the shortest way
CLOSE = 1e-4  # distance from where a decision changes at which float32 may take either side [samples, rows of spans]


def light_rays(row: int, column: int, radius_px: float) -> tuple[np.ndarray, ...]:
    """Rays from a light's cell to each photosite, arrays (photosites, rays), float64.

    The shortest way is the last. Where they start from, y and x [samples on the grid], where they go, y and x [pupil radii],
    whether they pass the round pupil, and whether that is certain.
    """
    y, x = (places.ravel()[:, None] + MARGIN for places in np.mgrid[: FRAME.height, : FRAME.width].astype(np.float64))
    right, down, light_x, light_y = (np.tile(one, (len(y), 1)) for one in RAYS[0].T.astype(np.float64))
    shortest = [np.clip(cell - own + 0.5, 0.0, 1.0) for own, cell in ((x, column), (y, row))]
    ends = [np.clip(start - (cell - own), 0.0, 1.0) for start, own, cell in zip(shortest, (x, y), (column, row), strict=True)]
    right, down, light_x, light_y = (
        np.hstack(pair) for pair in zip((right, down, light_x, light_y), (*shortest, *ends), strict=True)
    )
    radius_px = float(np.float32(radius_px))
    u_y, u_x = ((row - y) + light_y - down) / radius_px, ((column - x) + light_x - right) / radius_px
    spans, macros = pupil_spans(Pupil())
    reach = float(str(macros["SPAN_REACH"]).rstrip("f"))
    place = (u_y + reach) * SPAN_ROWS / (2.0 * reach)
    line = np.clip(np.floor(place).astype(int), 0, SPAN_ROWS - 1)
    low, high = spans[line].astype(np.float64).transpose(2, 0, 1)
    inside = (place >= 0.0) & (place < SPAN_ROWS) & (u_x >= low) & (u_x <= high)
    to_end = np.minimum(np.abs(u_x - low), np.abs(u_x - high))
    close = (np.abs(place - np.rint(place)) < 10.0 * CLOSE) | (to_end < CLOSE)
    return y + down, x + right, u_y, u_x, inside, ~close


def lost_outcome(lost: LightsLost, inside: np.ndarray, hidden: np.ndarray, certain: np.ndarray) -> Outcome:
    """Share of what rays bring that they lose. Those of which float32 may decide either way bring nothing, lose all or none."""
    pairs = np.stack([np.arange(len(hidden)), np.zeros(len(hidden), int)], axis=-1)
    found = lost(RAYS, pairs).astype(np.float64)
    brought, gone = (np.where(certain & inside, own, 0.0) @ WEIGHTS for own in (1.0, hidden))
    unsure = ~certain @ WEIGHTS
    least, most = (np.divide(gone + more, np.maximum(brought + unsure, 1e-30)) for more in (0.0, unsure))
    return Outcome(found, np.clip(found, least, most), 1.0, 1.0)


def run_lens_sampling_lights(device: Device, inputs: Inputs) -> Outcome:
    """A light behind a surface of any coverage: each ray loses what its sample of the surface covers."""
    row, column, radius_px = int(number(inputs, "row")), int(number(inputs, "column")), number(inputs, "radius_px")
    coverage, near_px = picture(inputs, "coverage"), float(np.float32(number(inputs, "near_px")))
    surfaces = upload_surfaces(
        device,
        np.ones((2, 1, *GRID)),
        np.stack([coverage, np.ones(GRID)]),
        np.stack([np.full(GRID, near_px), np.full(GRID, radius_px)]),
        MARGIN,
    )
    rays = LayeredRays(surfaces, device, MARGIN, FRAME, 1, ((0, 0), (0, 0)), None)
    lost = rays.lights_lost(np.array([[row, column, 1, radius_px, 0.0, 0.0]], np.float32), Pupil())
    assert lost is not None  # a surface lies before the light
    y, x, u_y, u_x, inside, certain = light_rays(row, column, radius_px)
    at_y, at_x = y + near_px * u_y, x + near_px * u_x
    rows, columns = (np.clip(np.floor(at).astype(int), 0, size - 1) for at, size in zip((at_y, at_x), GRID, strict=True))
    between = (np.abs(at_y - np.rint(at_y)) > CLOSE) & (np.abs(at_x - np.rint(at_x)) > CLOSE)
    hidden = np.where(inside, coverage.astype(np.float64)[rows, columns], 0.0)
    return lost_outcome(lost, inside, hidden, (certain & between) | (certain & ~inside))


def run_lens_height_field_lights(device: Device, inputs: Inputs) -> Outcome:
    """A light on a flat surface loses nothing, one behind it all of its light."""
    row, column, radius_px = int(number(inputs, "row")), int(number(inputs, "column")), number(inputs, "radius_px")
    before_px = float(inputs["before_px"])
    radius = np.full(GRID, radius_px - before_px, np.float32)
    rays = HeightField(np.ones((1, *GRID), np.float32), radius, device, MARGIN, FRAME, 1, ((0, 0), (0, 0)), None)
    lost = rays.lights_lost(np.array([[row, column, 0, radius_px, 0.0, 0.0]], np.float32), Pupil())
    assert lost is not None  # a picture may hide its lights
    *_, inside, certain = light_rays(row, column, radius_px)
    return lost_outcome(lost, inside, (inside & (before_px > 0.0)).astype(float), certain | (before_px == 0.0))


def run_projection_radius(device: Device, inputs: Inputs) -> Outcome:
    """Bilinear between pixels of one surface, else the nearest pixel's."""
    scale, first = float(np.float32(number(inputs, "scale"))), int(number(inputs, "column"))
    offset = first * scale - 3.2
    signs = np.random.default_rng(int(number(inputs, "signs"))).choice([-1.0, 1.0], GRID)
    pixels = (picture(inputs, "radius") * signs).astype(np.float32)
    projection = Projection(scale, -offset, 0.3, GRID[1], GRID[0], 1, False)
    layout = InterleavedColumns(1, 16, 16)
    found = device.empty(layout.shape(1), np.float32)
    project_radius(device, projection, device.upload(pixels), found, 0, layout, (first, 0))
    decoded = layout.decode(device.download(found, layout.shape(1), np.float32)[0])
    y, x = np.mgrid[: decoded.shape[0], first : first + decoded.shape[1]].astype(np.float64) + 0.5
    v, u = 0.3 + scale * y - 0.5, -offset + scale * x - 0.5
    top, left = np.floor(v).astype(int), np.floor(u).astype(int)
    s, t, own = u - left, v - top, pixels.astype(np.float64)

    def pixels_beside(reach: int) -> np.ndarray:
        beside = range(1 - reach, reach + 1)
        rows, columns = (
            [np.clip(first + step, 0, size - 1) for step in beside] for first, size in zip((top, left), GRID, strict=True)
        )
        return np.stack([own[row, column] for row in rows for column in columns])

    corners = a, b, c, d = pixels_beside(1)
    apart, around = np.ptp(corners, axis=0), np.ptp(pixels_beside(2), axis=0)
    between = (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * c + s * d)
    nearest = np.where(t < 0.5, np.where(s < 0.5, a, b), np.where(s < 0.5, c, d))
    exact = np.where(apart > projection.edge_px, nearest, between)
    unsure = (apart > projection.edge_px) & ((np.abs(s - 0.5) < 0.01) | (np.abs(t - 0.5) < 0.01))  # between two surfaces
    unsure |= np.abs(apart - projection.edge_px) < 1e-6
    on_pixel = (np.abs(s - np.rint(s)) < 1e-4) | (np.abs(t - np.rint(t)) < 1e-4)
    unsure |= on_pixel & (around > projection.edge_px)  # which four pixels are compared is rounded
    size = (np.abs(corners).max(axis=0) + apart) * max(abs(offset), (first + 36) * scale)
    return Outcome(np.where(unsure, exact, decoded), exact, size, 1.0)


CELLS = {"row": Whole(MARGIN, MARGIN + FRAME.height - 1), "column": Whole(MARGIN, MARGIN + FRAME.width - 1)}
RADIUS = Real(0.5, 5.5, switches=(1.0, 2.0))

CASES = (
    StressCase(
        "lens_sampling_lights",
        ("lens_sampling_lights",),
        {**CELLS, "radius_px": RADIUS, "near_px": Real(-5.5, 0.4, switches=(0.0,)), "coverage": Picture(GRID, 1e-30, 1.0)},
        run_lens_sampling_lights,
        "64 numbers up to 1 over their count, relative to 1: 64 roundings of sums, one of each number and of the ratio",
        most_ulps=66.0,
    ),
    StressCase(
        "lens_height_field_lights",
        ("lens_height_field_lights",),
        {**CELLS, "radius_px": RADIUS, "before_px": Choice((0.0, 2.0, 5.0))},
        run_lens_height_field_lights,
        "rays are counted: none is lost, or all are",
        most_ulps=0.0,
    ),
    StressCase(
        "projection_radius",
        ("projection_radius",),
        {
            "radius": Picture(GRID, 1e-9, 2.0),
            "signs": Whole(0, 1000),
            "scale": Real(0.3, 0.9, switches=(0.5,)),
            "column": Choice((0, 1000, 6000)),
        },
        run_projection_radius,
        "a place in the scene is a rounded product, times the difference of neighbours; three interpolations of two roundings",
        most_ulps=10.0,
    ),
)
