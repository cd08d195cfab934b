"""Scenes whose picture behind a thin lens is known, with that picture in float64.

Photosite (r, c) covers [r, r+1) x [c, c+1); an image point is blurred to a disk of radius |s|, s > 0 behind the focus. The
picture is the mean over photosite and lens point u (uniform in the unit disk) of the layers, front to back, read at x + s u.
Nothing here is read from pixels: the truths come from closed forms, or from quadrature of the scene's own formula.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from scipy.special import j1

ROWS, COLUMNS = 24, 48
Surface = tuple[np.ndarray | float, np.ndarray | float, np.ndarray | float]  # radiance * coverage, coverage, radius [px]


@dataclass(frozen=True)
class Case:
    """One scene and its picture.

    colour: (layers, rows, columns) radiance * coverage, nearest layer first;
    rows = (rows of the truth + 2 margin) * oversampling.
    coverage: (layers, rows, columns) 0 to 1. radius_px: (layers, rows, columns) signed blur radius [photosites].
    truth: (rows, columns) mean radiance of each photosite. margin: photosites around the truth.
    oversampling: samples per photosite and axis. means: samples are means over their cell, not values at its centre.
    """

    name: str
    colour: np.ndarray
    coverage: np.ndarray
    radius_px: np.ndarray
    truth: np.ndarray
    margin: int
    oversampling: int
    means: bool


def makers(oversampling: int = 1, squares: bool = False) -> list[partial[Case]]:
    """Functions that make every scene, its surfaces sampled this many times per photosite and axis; truths take time.

    squares: samples are even squares, and those of a wave have the height whose squares hold the wave.
    """
    return [
        *(
            partial(sinusoid, radius, period, oversampling, squares)
            for radius in (0.7, 3.3, -7.6, 15.5)
            for period in (24.0, 9.0)
        ),
        *(partial(point, radius, oversampling) for radius in (0.7, 2.4, 7.6)),
        *(partial(square_light, radius, oversampling) for radius in (2.4, 7.6)),
        partial(penumbra, -11.0, 0.0, oversampling),
        partial(penumbra, -3.4, 0.3, oversampling),
        partial(uniform_layers, -5.0, 6.0, oversampling),
        partial(stripes, -5.1, 6.0, 12.0, oversampling),
        partial(stripes, 4.0, 9.0, 10.0, oversampling),
        partial(slanted_plane, (0.05, 0.11), oversampling),
    ]


@cache
def cases(oversampling: int = 1, squares: bool = False) -> tuple[Case, ...]:
    """The scenes of `makers`, made once: tests share them and change none."""
    return tuple(make() for make in makers(oversampling, squares))


def sinusoid(radius: float, period_px: float, oversampling: int = 1, squares: bool = False) -> Case:
    """An oblique wave at one distance: its amplitude times 2 J1(2 pi q R)/(2 pi q R), times the photosite's sinc in x and y.

    squares: as of `makers`; even squares show a wave lower by their own sinc in x and y.
    """
    qy, qx = np.array([0.6, 0.8]) / period_px
    angle = 2.0 * math.pi * abs(radius) / period_px
    amplitude = 0.45 * 2.0 * float(j1(angle)) / angle * np.sinc(qx) * np.sinc(qy)

    def wave(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.cos(2.0 * math.pi * (qy * y + qx * x) + 0.7)

    margin = math.ceil(abs(radius)) + 2
    y, x = _centres(margin, oversampling)
    truth = 0.5 + amplitude * wave(*_centres(0, 1))
    height = 0.45 / float(np.sinc(qx / oversampling) * np.sinc(qy / oversampling)) if squares else 0.45
    return _case(
        f"sinusoid_{radius:g}_{period_px:g}", [(0.5 + height * wave(y, x), 1.0, radius)], truth, margin, oversampling, False
    )


def point(radius: float, oversampling: int = 1, light: float = 200.0) -> Case:
    """A point at the centre of a sample; in focus it gives a photosite this radiance: its disk's area on each photosite."""
    colour, margin, (row, column) = _one_bright_cell(radius, oversampling, light)
    return _case(
        f"point_{radius:g}", [(colour, 1.0, radius)], 0.5 + light * _spread(row, column, radius), margin, oversampling, True
    )


def square_light(radius: float, oversampling: int = 1, light: float = 200.0) -> Case:
    """The same light from a square as large as a sample: the mean of its points' disks."""
    colour, margin, (row, column) = _one_bright_cell(radius, oversampling, light)
    nodes, weights = _gauss(24, -0.5 / oversampling, 0.5 / oversampling)
    disks = sum(
        weight_y * weight_x * _spread(row + dy, column + dx, radius)
        for dy, weight_y in zip(nodes, weights, strict=True)
        for dx, weight_x in zip(nodes, weights, strict=True)
    )
    truth = 0.5 + light * oversampling**2 * disks
    return _case(f"square_light_{radius:g}", [(colour, 1.0, radius)], truth, margin, oversampling, True)


def penumbra(radius: float, slope: float, oversampling: int = 1, front: float = 0.2) -> Case:
    """A near half-plane before a wave in focus: T = F A + B (1 - A), A = 1/2 + (t sqrt(1 - t^2) + asin t)/pi, t = distance / R.

    slope: tangent of the edge against the columns; 0 puts it between two photosites.
    """
    normal = np.array([slope, 1.0]) / math.hypot(slope, 1.0)
    offset = normal @ (ROWS / 2, COLUMNS / 2)

    def back(x: np.ndarray) -> np.ndarray:
        return 0.8 + 0.2 * np.sin(2.0 * math.pi * x / 24.0)

    def picture(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        t = np.clip((offset - normal[0] * y - normal[1] * x) / abs(radius), -1.0, 1.0)
        covered = 0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / math.pi
        return front * covered + back(x) * (1.0 - covered)

    margin = math.ceil(abs(radius)) + 2
    y, x = _centres(margin, oversampling)
    near = _half_plane_means(offset - normal[0] * y - normal[1] * x, np.abs(normal) / oversampling)
    sinc = np.sinc(1.0 / (24.0 * oversampling))  # the wave's mean over a sample
    layers = [(front * near, near, radius), (0.8 + sinc * (back(x) - 0.8) + 0.0 * y, 1.0, 0.0)]
    return _case(f"penumbra_{radius:g}_{slope:g}", layers, _photosite_mean(picture), margin, oversampling, True)


def uniform_layers(near: float, far: float, oversampling: int = 1) -> Case:
    """A near half-plane before a wall, both uniform and out of focus: nothing to covary, the penumbra alone."""
    return _edge_and_wall(f"uniform_layers_{near:g}_{far:g}", near, far, lambda x: 1.0 + 0.0 * x, 1.0, oversampling)


def stripes(near: float, far: float, period_px: float, oversampling: int = 1) -> Case:
    """A near half-plane before stripes, both out of focus: over the lens, edge and stripes covary."""

    def back(x: np.ndarray) -> np.ndarray:
        return 0.6 + 0.35 * np.cos(2.0 * math.pi * x / period_px + 0.4)

    name = f"stripes_{near:g}_{far:g}_{period_px:g}"
    return _edge_and_wall(name, near, far, back, np.sinc(1.0 / (period_px * oversampling)), oversampling)


def slanted_plane(slope: tuple[float, float], oversampling: int = 1) -> Case:
    """A plane through the focus: s is affine in the image, so x' = x + s(x') u is x + u s(x) / (1 - slope u)."""
    gy, gx = slope

    def radius(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        return 0.5 + gy * (y - ROWS / 2) + gx * (x - COLUMNS / 2)

    def texture(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        return 0.5 + 0.2 * np.cos(2.0 * math.pi * (0.06 * x + 0.02 * y)) + 0.2 * np.sin(2.0 * math.pi * (0.03 * x - 0.07 * y))

    def picture(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        total, s = 0.0, radius(y, x)
        for uy, ux, weight in _lens_nodes(12, 40):
            reach = s / (1.0 - gy * uy - gx * ux)
            total = total + weight * texture(y + reach * uy, x + reach * ux)
        return total

    corners = np.abs(radius(*np.meshgrid([0.0, ROWS], [0.0, COLUMNS])))
    margin = math.ceil(corners.max() / (1.0 - math.hypot(gy, gx))) + 2
    y, x = _centres(margin, oversampling)
    layers = [(texture(y, x), 1.0, radius(y, x))]
    return _case(f"slanted_plane_{gy:g}_{gx:g}", layers, _photosite_mean(picture, 4), margin, oversampling, False)


def _edge_and_wall(
    name: str,
    near: float,
    far: float,
    back: Callable[[np.ndarray], np.ndarray],
    sample_contrast: float,
    oversampling: int,
    front: float = 0.2,
) -> Case:
    """Quadrature over the lens, split where the edge x = COLUMNS/2 of the near half-plane is crossed.

    sample_contrast: contrast of the wall's mean over a sample against the wall itself.
    """
    edge = COLUMNS / 2

    def picture(_: np.ndarray, x: np.ndarray) -> np.ndarray:
        crossing = np.clip((edge - x) / near, -1.0, 1.0)  # near * u < edge - x is covered
        inner, outer = _strip(crossing, -1.0, lambda u: back(x + far * u)), _strip(1.0, crossing, lambda u: back(x + far * u))
        covered = _strip(crossing, -1.0, np.ones_like) if near > 0 else _strip(1.0, crossing, np.ones_like)
        return front * covered + (outer if near > 0 else inner)

    margin = math.ceil(max(abs(near), abs(far))) + 2
    y, x = _centres(margin, oversampling)
    covered = (x + 0.0 * y < edge).astype(np.float64)
    mean = 0.6 if sample_contrast < 1.0 else 1.0
    layers = [(front * covered, covered, near), (mean + sample_contrast * (back(x) - mean) + 0.0 * y, 1.0, far)]
    return _case(name, layers, _photosite_mean(picture, 1, 16), margin, oversampling, True)


def _strip(high: np.ndarray | float, low: np.ndarray | float, value: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Integral of value(u) 2/pi sqrt(1 - u^2) du between two numbers of [-1, 1], with u = sin(angle): smooth to its ends."""
    high, low = np.arcsin(high), np.arcsin(low)
    nodes, weights = _gauss(48, 0.0, 1.0)
    angles = [low + (high - low) * node for node in nodes]
    parts = [w * np.cos(a) ** 2 * value(np.sin(a)) for w, a in zip(weights, angles, strict=True)]
    return 2.0 / math.pi * (high - low) * sum(parts)


def _case(name: str, layers: list[Surface], truth: np.ndarray, margin: int, oversampling: int, means: bool) -> Case:
    """Put a case together of surfaces and the picture that they give."""
    shape = ((ROWS + 2 * margin) * oversampling, (COLUMNS + 2 * margin) * oversampling)
    colour, coverage, radius = (
        np.stack([np.broadcast_to(layer[i], shape) for layer in layers]).astype(float) for i in range(3)
    )
    return Case(name, colour, coverage, radius, np.broadcast_to(truth, (ROWS, COLUMNS)), margin, oversampling, means)


def _centres(margin: int, oversampling: int) -> tuple[np.ndarray, np.ndarray]:
    """Centres y (rows, 1) and x (1, columns) of the samples [photosites] from the truth's upper left corner."""
    y = (np.arange((ROWS + 2 * margin) * oversampling) + 0.5) / oversampling - margin
    x = (np.arange((COLUMNS + 2 * margin) * oversampling) + 0.5) / oversampling - margin
    return y[:, None], x[None, :]


def _gauss(count: int, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss-Legendre quadrature from low to high."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (low + high) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * weights


def _lens_nodes(rings: int, spokes: int) -> Iterator[tuple[float, float, float]]:
    """Points and weights (y, x, weight) of a quadrature over the unit disk, of mean 1: Gauss in r^2, equal angles."""
    for area, weight in zip(*_gauss(rings, 0.0, 1.0), strict=True):
        for spoke in range(spokes):
            angle = 2.0 * math.pi * (spoke + 0.5) / spokes
            yield math.sqrt(area) * math.sin(angle), math.sqrt(area) * math.cos(angle), weight / spokes


def _photosite_mean(picture: Callable[[np.ndarray, np.ndarray], np.ndarray], rows: int = 12, columns: int = 12) -> np.ndarray:
    """Mean of picture(y, x) over each photosite by Gauss-Legendre quadrature."""
    y, x = _centres(0, 1)
    (dy, wy), (dx, wx) = _gauss(rows, -0.5, 0.5), _gauss(columns, -0.5, 0.5)
    return sum(wy[i] * wx[j] * picture(y + dy[i], x + dx[j]) for i in range(rows) for j in range(columns))


def _half_plane_means(distance: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Share of square cells inside a half-plane; distance: of a centre, > 0 inside; widths: of the cell along the normal."""
    high, low = 0.5 * max(widths), 0.5 * min(widths)
    if low == 0.0:
        return np.clip(0.5 + 0.5 * distance / high, 0.0, 1.0)
    corners = ((1, high + low), (-1, high - low), (-1, low - high), (1, -high - low))
    return sum(sign * 0.5 * np.maximum(distance + shift, 0.0) ** 2 for sign, shift in corners) / (4.0 * high * low)


def _one_bright_cell(radius: float, oversampling: int, light: float) -> tuple[np.ndarray, int, tuple[float, float]]:
    """Samples of a grey wall with one bright sample, and the position of that sample's centre."""
    margin = math.ceil(abs(radius)) + 2
    y, x = _centres(margin, oversampling)
    row, column = (
        (margin + ROWS // 2) * oversampling + oversampling // 3,
        (margin + COLUMNS // 2) * oversampling + oversampling // 2,
    )
    colour = np.full((y.size, x.size), 0.5)
    colour[row, column] += light * oversampling**2
    return colour, margin, (y[row, 0], x[0, column])


def _spread(row: float, column: float, radius: float) -> np.ndarray:
    """Share of a disk's area on each photosite, by inclusion and exclusion of the photosites' corners."""
    y, x = np.arange(ROWS + 1) - row, np.arange(COLUMNS + 1) - column
    corner = _disk_quadrant(x[None, :] / abs(radius), y[:, None] / abs(radius))
    return np.diff(np.diff(corner, axis=0), axis=1) / math.pi


def _disk_quadrant(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Area of the unit disk left of x and above y."""
    x, y = np.clip(x, -1.0, 1.0), np.clip(y, -1.0, 1.0)
    chord = np.sqrt(1.0 - y**2)
    middle = np.clip(x, -chord, chord)
    area = y * (middle + chord) + _half_disk(middle) - _half_disk(-chord)
    outside = _half_disk(np.minimum(x, -chord)) + _half_disk(np.maximum(x, chord)) - _half_disk(chord)
    return area + np.where(y > 0.0, 2.0 * outside, 0.0)


def _half_disk(t: np.ndarray) -> np.ndarray:
    """Integral of sqrt(1 - t^2) from -1."""
    return 0.5 * (t * np.sqrt(np.maximum(1.0 - t**2, 0.0)) + np.arcsin(t)) + 0.25 * math.pi
