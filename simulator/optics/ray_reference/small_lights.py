"""Small bright lights in the reference blur: few rays from a photosite meet them, so rays start from them instead.

A cell with the excess radiance E and the blur radius s adds E times the share of the pupil's image on it, which is exact, less
what nearer surfaces and the lens's stops take away. Only that share of it is sampled, so that a light that nothing hides has no
noise, and nothing is left of one that is hidden.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from simulator.optics.defocus.aperture_kernel import aperture_weights, disk_shares
from simulator.optics.defocus.blade_kernel import blade_weights
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.defocus.highlights import radius_slopes
from simulator.optics.defocus.lamp_images import square_image
from simulator.optics.pupil.pupil import Pupil
from simulator.sensor.camera.camera import Window

SMALLEST_PX = 0.5  # blur radius from which a cell can be a light [photosites]
TINY_PX = 0.05  # blur radius up to which so few rays cross borders of photosites that a set may have none [photosites]
LEAST_OPEN = 1e-6  # share of the pupil below which a photosite counts as dark
SPAN_ROWS = 2048  # rows of the table of the pupil's shape
NODES = 8  # of the quadrature over a cell, per axis
WHOLE = (1.0, 0.0)  # start of rays on photosites that are open all over, without a filter

Start = tuple[float, float]  # where rays begin: side of their square, and distance of the spots that it has [photosites]


@dataclass(frozen=True)
class SmallLights:
    """Cells that are lights, on a grid of samples around a frame.

    rows, columns, layers: (lights,) cell and layer. radii_px: (lights,) signed blur radius [photosites].
    slopes: (2, lights) its change to the right and down [photosites per photosite].
    excess: (channels, lights) radiance that is taken out of the grid.
    """

    rows: np.ndarray
    columns: np.ndarray
    layers: np.ndarray
    radii_px: np.ndarray
    slopes: np.ndarray
    excess: np.ndarray

    def table(self) -> np.ndarray:
        """`lights` of kernels/lens_lights.h, (lights, 6) float32."""
        return np.stack([self.rows, self.columns, self.layers, self.radii_px, *self.slopes], axis=-1).astype(np.float32)


def take_lights(
    colour: np.ndarray,
    coverage: np.ndarray,
    radius_px: np.ndarray,
    limit: np.ndarray,
    mean: np.ndarray,
    oversampling: int,
    *,
    is_round: bool,
) -> SmallLights:
    """Take the radiance of cells above a limit out of the grid, in place, down to a mean.

    colour: (layers, channels, rows, columns) radiance. coverage: (layers, rows, columns). radius_px: of the same shape, signed
    blur radius [photosites]. limit, mean: (channels,). is_round: whether the pupil is, and no stop clips it. A cell whose blur
    circle is small stays, because many rays meet it, unless it is so small that hardly any of them crosses a border of a
    photosite, the pupil is round, and nothing hides the cell: of rays from a point of it to a point of a photosite hardly one
    goes through the pupil, to tell what share is hidden.
    """
    parts, tiny_px = [], TINY_PX if is_round and oversampling > 1 else 0.0
    for layer, (light, radius) in enumerate(zip(colour, radius_px, strict=True)):
        size = np.abs(radius)
        bright = np.logical_or.reduce(light > limit[:, None, None], axis=0)
        tiny = bright & (size > 0.0) & (size <= tiny_px)
        if tiny.any():
            tiny &= ~_reached(layer, coverage, radius_px, oversampling)
        rows, columns = np.nonzero((bright & (size > SMALLEST_PX)) | tiny)
        excess = np.maximum(light[:, rows, columns] - mean[:, None], 0.0).astype(np.float64)
        light[:, rows, columns] -= excess.astype(np.float32)
        slopes = radius_slopes(radius, rows, columns, oversampling)
        parts.append((rows, columns, np.full(len(rows), layer), radius[rows, columns].astype(float), slopes, excess))
    return SmallLights(*(np.concatenate(values, axis=-1) for values in zip(*parts, strict=True)))


def _reached(layer: int, coverage: np.ndarray, radius_px: np.ndarray, oversampling: int) -> np.ndarray:
    """Whether blur circles of nearer surfaces reach cells of a layer in focus, (rows, columns) bool.

    Those are layers before it, and its own nearer parts. Circles of up to twice a size count as the largest of them. Arguments:
    as of `take_lights`.
    """
    from scipy.ndimage import distance_transform_edt  # only lights in focus need it

    reached = np.zeros(radius_px.shape[1:], bool)
    for number in range(layer + 1):
        size = np.abs(radius_px[number])
        is_nearer = coverage[number] > 0.0 if number < layer else radius_px[layer] < -TINY_PX
        octaves = np.ceil(np.log2(np.maximum(size, TINY_PX)))
        for octave in np.unique(octaves[is_nearer]):
            circles = is_nearer & (octaves == octave)
            reached |= distance_transform_edt(~circles) <= size[circles].max() * oversampling + 1.5
    return reached


def has_shares(pupil: Pupil, start: Start) -> bool:
    """Whether `cell_shares` know photosites with such an open area and filter: behind blades they know no filter."""
    return start[1] == 0.0 or pupil.is_round


@cache
def cell_shares(pupil: Pupil, radius_px: float, oversampling: int, start: Start = WHOLE) -> tuple[np.ndarray, int]:
    """Share of the pupil's image on a cell, for each cell around a photosite: (n, n) float64, and the first cell's offset.

    Element [i, j] is that of the cell `offset + i` rows and `offset + j` columns from the photosite's first sample. It is the
    mean over the photosite's area, and at one sample per photosite that at the photosite's centre. A round pupil's area in a
    photosite is exact, its mean over a cell by Gauss-Legendre quadrature; behind blades both are exact.
    start: of `has_shares`.
    """
    side, apart = start
    if start != WHOLE and pupil.is_round:
        return _open_shares(abs(radius_px), oversampling, side, apart)
    if oversampling == 1 and start == WHOLE:
        weights = aperture_weights(pupil, radius_px)
        return weights, -(len(weights) // 2)
    if pupil.is_round:
        return _round_shares(abs(radius_px), oversampling)
    weights = blade_weights(pupil, radius_px * oversampling, oversampling, side * oversampling)
    return weights, -(len(weights) - oversampling) // 2


def _round_shares(radius_px: float, oversampling: int) -> tuple[np.ndarray, int]:
    """`cell_shares` of a round pupil."""
    if radius_px <= TINY_PX:
        reach = math.ceil(radius_px * oversampling) + 1
        cells = np.arange(-reach, reach + oversampling)
        apart = (cells + 0.5) / oversampling - 0.5
        return square_image(radius_px, 1.0 / oversampling, 1.0, apart, apart), int(cells[0])
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    reach = math.ceil(radius_px * oversampling) + 1
    cells = np.arange(-reach, reach + oversampling)
    shares = np.zeros((len(cells), len(cells)))
    for place_y, weight_y in zip(0.5 * nodes + 0.5, 0.5 * weights, strict=True):
        for place_x, weight_x in zip(0.5 * nodes + 0.5, 0.5 * weights, strict=True):
            # Borders of the photosite from a point of each cell, first the left ones, in reverse order of the cells.
            borders = np.arange(-cells[-1], -cells[0] + oversampling + 1)
            y, x = (borders - place_y) / oversampling, (borders - place_x) / oversampling
            shares += (
                weight_y * weight_x * disk_shares(x, y, radius_px, oversampling)[len(cells) - 1 :: -1, len(cells) - 1 :: -1]
            )
    return shares / oversampling**2, int(cells[0])


def _open_shares(radius_px: float, oversampling: int, side_px: float, apart_px: float) -> tuple[np.ndarray, int]:
    """`cell_shares` of a round pupil on open squares, of which a low-pass filter makes two by two."""
    reach = math.ceil((radius_px + 0.5 * apart_px) * oversampling) + 1
    cells = np.arange(-reach, reach + oversampling)
    away = (cells + 0.5) / oversampling - 0.5
    spots = (-0.5 * apart_px, 0.5 * apart_px) if apart_px else (0.0,)
    images = [
        square_image(radius_px, 1.0 / oversampling, side_px, away - down, away - right) for down in spots for right in spots
    ]
    return np.asarray(np.mean(images, axis=0)), int(cells[0])


def light_pairs(
    lights: SmallLights, pupil: Pupil, frame: Window, margin_px: int, oversampling: int, start: Start = WHOLE
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of a photosite and a light that it sees, (pairs, 2) int (place, light), and the share of each, (pairs,) float64.

    A share is that of the pupil's image on the light's cell, times 1 - g u for the slope g of its radius and the place u of the
    pupil through which it is seen. Sorted by place. start: of `cell_shares`.
    """
    pairs, shares = [np.empty((0, 2), int)], [np.empty(0)]
    reach = 0.0 if oversampling == 1 and start == WHOLE else 0.5 * sum(start)
    for number, (row, column, radius) in enumerate(zip(lights.rows, lights.columns, lights.radii_px, strict=True)):
        weights, offset = cell_shares(pupil, float(radius), oversampling, start)
        from_y, from_x = (
            int(at) - (np.arange(size) + margin_px) * oversampling for at, size in ((row, frame.height), (column, frame.width))
        )  # cells from the first sample of each row and column of photosites
        y, x = (np.flatnonzero((away >= offset) & (away < offset + len(weights))) for away in (from_y, from_x))
        share = weights[np.ix_(from_y[y] - offset, from_x[x] - offset)]
        u_y, u_x = (
            _seen_through((away + 0.5) / oversampling - 0.5, float(radius), reach) for away in (from_y[y][:, None], from_x[x])
        )
        share = share * (1.0 - lights.slopes[0, number] * u_x - lights.slopes[1, number] * u_y)
        i, j = np.nonzero(share > 0.0)
        pairs.append(np.stack([y[i] * frame.width + x[j], np.full(len(i), number)], axis=-1))
        shares.append(share[i, j])
    joined, share = np.concatenate(pairs), np.concatenate(shares)
    order = np.argsort(joined[:, 0], kind="stable")
    return joined[order], share[order]


def _seen_through(away_px: np.ndarray, radius_px: float, reach_px: float) -> np.ndarray:
    """Place of the pupil, -1 to 1 along an axis, through which photosites see a light that lies so far from their middle.

    It is the middle of the places that look from anywhere up to reach_px from there: 0 for a circle inside a photosite.
    radius_px: signed, of the light's blur circle.
    """
    ends = [np.clip((away_px + side * reach_px) / radius_px, -1.0, 1.0) for side in (-1.0, 1.0)]
    return np.asarray(0.5 * (ends[0] + ends[1]))


@dataclass
class LightSpots:
    """Light of the small lights on the photosites of a frame.

    pairs, shares: of `light_pairs`. excess: (pairs,) radiance of the light in the photosite's own colour.
    lost: function that samples, for some pairs (n, 2), by a set of rays, the share lost on the way (kernels/lens_lights.h).
    open: (photosites,) share of the pupil that stops leave open.
    """

    photosites: int
    pairs: np.ndarray
    shares: np.ndarray
    excess: np.ndarray
    open: np.ndarray
    lost: Callable[[np.ndarray, np.ndarray], np.ndarray] | None

    def __post_init__(self) -> None:
        self.hidden = np.zeros(len(self.pairs), bool)  # whether anything of the pair has been seen to be hidden

    def unhidden(self) -> np.ndarray:
        """Light without anything that hides it, (photosites,) float64."""
        return np.bincount(self.pairs[:, 0], self.shares * self.excess, self.photosites) / self.open

    def lost_light(self, points: np.ndarray, places: np.ndarray, first: bool) -> np.ndarray:
        """Sample the light that is hidden from some photosites (n,), float64. first: whether these are the first rays."""
        if self.lost is None or not len(self.pairs):
            return np.zeros(len(places))
        wanted = np.zeros(self.photosites, bool)
        wanted[places] = True
        chosen = np.flatnonzero(wanted[self.pairs[:, 0]] & (first | self.hidden))
        if not len(chosen):
            return np.zeros(len(places))
        lost = self.lost(points, self.pairs[chosen]).astype(np.float64)
        self.hidden[chosen[lost > 0.0]] = True
        light = np.bincount(self.pairs[chosen, 0], lost * self.shares[chosen] * self.excess[chosen], self.photosites)
        return (light / self.open)[places]


def pupil_spans(pupil: Pupil) -> tuple[np.ndarray, dict[str, object]]:
    """`spans` of kernels/lens_lights.h, the shape of the pupil without stops, (SPAN_ROWS, 2) float32; and its macros."""
    rows, left, right = pupil.spans()
    reach = float(np.abs(rows).max()) + 1e-3
    y = reach * ((2.0 * np.arange(SPAN_ROWS) + 1.0) / SPAN_ROWS - 1.0)
    inside = (y >= rows[0]) & (y <= rows[-1])
    low, high = np.interp(y, rows, left), np.interp(y, rows, right)
    spans = np.stack([np.where(inside, low, 1.0), np.where(inside, high, -1.0)], axis=-1).astype(np.float32)
    return spans, {"SPAN_ROWS": SPAN_ROWS, "SPAN_REACH": f"{reach:.9g}f"}


def open_share(eyes: CatsEyes | None, frame: Window, places: np.ndarray) -> np.ndarray:
    """Share of the pupil that stops leave open at each photosite, (photosites,) float64; 1 at those that are not asked for."""
    share = np.ones(frame.height * frame.width)
    if eyes is not None:
        y, x = np.divmod(np.unique(places), frame.width)
        fields = eyes.fields(frame.x + x + 0.5, frame.y + y + 0.5)
        for place in np.flatnonzero(eyes.clips(fields)):
            share[y[place] * frame.width + x[place]] = max(eyes.pupil.area(fields[place]) / math.pi, LEAST_OPEN)
    return share
