"""Modulation transfer function from a slanted edge: the e-SFR of ISO 12233 on photosites of one colour, not demosaiced."""

import math
import os
from dataclasses import dataclass
from typing import overload

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.measurement.statistics.clipping import require_unclipped
from simulator.raw.raw_reader import plane_places, read_raw_file

BIN_PX = 0.25  # ISO 12233: four bins per pixel
LEAST_STEP = 6.0  # least ratio of the edge's step to the noise beside it
LEAST_ANGLE_DEG = 1.0


@dataclass(frozen=True)
class EdgeTransfer:
    """Modulation transfer function and profile of an edge.

    frequency_per_px: [cycles/px] along the normal of the edge, from 0. transfer: same length, 1 at 0.
    angle_deg: between the edge and the nearer axis of the photosites. step: bright less dark side, in the signal's unit.
    distance_px, edge_spread: the edge's profile, mean signal by distance from the edge, four points per pixel.
    """

    frequency_per_px: np.ndarray
    transfer: np.ndarray
    angle_deg: float
    step: float
    distance_px: np.ndarray
    edge_spread: np.ndarray

    @overload
    def at(self, frequency_per_px: float) -> float: ...

    @overload
    def at(self, frequency_per_px: np.ndarray) -> np.ndarray: ...

    def at(self, frequency_per_px: float | np.ndarray) -> float | np.ndarray:
        """Return the transfer at other frequencies [cycles/px], linear between those measured."""
        return np.interp(frequency_per_px, self.frequency_per_px, self.transfer)

    @property
    def mtf50_per_px(self) -> float:
        """First frequency at which the transfer falls to a half [cycles/px]; nan when it does not."""
        below = np.nonzero(self.transfer < 0.5)[0]
        if len(below) == 0:
            return math.nan
        last = int(below[0])
        x, y = self.frequency_per_px[last - 1 : last + 1], self.transfer[last - 1 : last + 1]
        return float(x[0] + (y[0] - 0.5) / (y[0] - y[1]) * (x[1] - x[0]))


@dataclass(frozen=True, eq=False)
class LocatedEdge:
    """The photosites on both sides of an edge.

    distance_px: (photosites,) along the normal of the edge, growing with x, or with y where the edge lies nearer to the rows.
    along_px: (photosites,) along the edge. signal: (photosites,) of these.
    signed_angle_deg: between the edge and the nearer axis. rows: that the edge crosses [px].
    """

    distance_px: np.ndarray
    along_px: np.ndarray
    signal: np.ndarray
    signed_angle_deg: float
    rows: int

    @property
    def angle_deg(self) -> float:
        """Angle between the edge and the nearer axis of the photosites, >= 0."""
        return abs(self.signed_angle_deg)

    @property
    def reach_px(self) -> float:
        """Distance that photosites on both sides reach [px]."""
        return float(min(-self.distance_px.min(), self.distance_px.max()))


def edge_of_raw_file(
    path: str | os.PathLike[str], plane: str = "G", window_px: tuple[int, int, int, int] | None = None
) -> EdgeTransfer:
    """Measure an edge in a raw file, in one colour: R, G (both greens), B, or MONO where there is no filter.

    window_px: left, top, width and height of a region that contains one edge and nothing else; default: the whole frame.
    Raises PhotositeError for a file that is not a raw file, a colour it does not have, a region without a slanted edge, and one
    in which too many photosites of the colour clip.
    """
    raw = read_raw_file(path)
    label = os.fspath(path)
    places = plane_places(raw.cfa)
    wanted = [place for name, place in places.items() if name == plane or name[0] == plane]
    require(bool(wanted), "colour", plane, f"give one of {'MONO' if raw.cfa == 'MONO' else 'R, G, B'}", file=label)
    step = 1 if raw.cfa == "MONO" else 2
    seen = np.zeros(raw.mosaic.shape, bool)
    signal = raw.mosaic.astype(np.float64)
    for row, column in wanted:
        seen[row::step, column::step] = True
        signal[row::step, column::step] -= raw.black_level_dn[row, column]
    height, width = signal.shape
    left, top, wide, tall = window_px or (0, 0, width, height)
    inside = 0 <= left < left + wide <= width and 0 <= top < top + tall <= height
    require(inside, "window", (left, top, wide, tall), f"must lie inside {width} x {height}", file=label)
    part = slice(top, top + tall), slice(left, left + wide)
    try:
        require_unclipped(raw.mosaic[part][seen[part]], raw.white_level_dn)
        return edge_transfer(signal[part], seen[part])
    except PhotositeError as error:
        raise error.with_file(label) from error


def edge_transfer(signal: np.ndarray, seen: np.ndarray | None = None) -> EdgeTransfer:
    """Measure one straight edge of a linear signal (rows, columns), black level subtracted.

    seen: (rows, columns) mask of the photosites that are measured, those of one colour; default: all.
    ISO 12233: the edge's position in each row is the centroid of the signal's derivative; a line is fitted to the positions;
    the photosites are averaged in bins of their distance from the line (edge spread function); its derivative (line spread
    function) is Fourier-transformed under a Hamming window. The responses of binning and difference are divided out.
    Distances are along the normal of the edge.
    Raises PhotositeError for no edge, an edge along an axis, or a region too small.
    """
    located = locate_edge(signal, seen)
    slope = math.tan(math.radians(located.angle_deg))
    if located.angle_deg < LEAST_ANGLE_DEG or slope * located.rows < 2.0:
        told = f"the edge lies {located.signed_angle_deg:.2f} degrees off the photosites' axis"
        raise PhotositeError(f"{told}; turn it to between 2 and 40 degrees, crossing two columns or more")
    reach = int(0.9 * located.reach_px / BIN_PX)  # the corners of the region contain too few photosites
    spread, offsets_px = _bin_profile(located.distance_px, located.signal, reach)
    return _transform_profile(spread, offsets_px, located.signed_angle_deg)


def locate_edge(signal: np.ndarray, seen: np.ndarray | None = None) -> LocatedEdge:
    """Find one straight edge, at any angle, and the distance of each photosite from it.

    signal, seen: as `edge_transfer` takes them. Raises PhotositeError for no edge and for a region too small.
    """
    signal = np.asarray(signal, np.float64)
    seen = np.ones(signal.shape, bool) if seen is None else seen
    if signal.ndim != 2 or min(signal.shape) < 16:
        raise PhotositeError(f"{signal.shape}: give a part of at least 16 x 16 photosites")
    if _gradient(signal, seen) < _gradient(signal.T, seen.T):
        signal, seen = signal.T, seen.T
    rows, places = _locate_edge(signal, seen)
    slope, start = np.polyfit(rows, places, 1)
    angle = math.atan(slope)
    y, x = np.nonzero(seen)
    across = (x - start - slope * y) * math.cos(angle)
    along = (x - start) * math.sin(angle) + (y - 0.5 * (len(signal) - 1)) * math.cos(angle)
    return LocatedEdge(across, along, signal[seen], math.degrees(angle), len(signal))


def _gradient(signal: np.ndarray, seen: np.ndarray) -> float:
    """Absolute difference of the mean signals of the right and the left half, over the measured photosites."""
    half = signal.shape[1] // 2
    return abs(float(signal[:, half:][seen[:, half:]].mean() - signal[:, :half][seen[:, :half]].mean()))


def _locate_edge(signal: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and the edge's column in each: centroids of the derivative, in two passes with a narrower window."""
    found = []
    for y in np.nonzero(seen.sum(axis=1) >= 8)[0]:
        columns = np.nonzero(seen[y])[0]
        between, slope = 0.5 * (columns[1:] + columns[:-1]), np.diff(signal[y, columns])
        found.append((float(y), between, slope))
    total = sum(float(slope.sum()) for _, _, slope in found)
    width = signal.shape[1]
    line, rows, edge = np.array([0.0, 0.5 * (width - 1)]), np.zeros(0), np.zeros(0)
    for half in (0.5 * width, 0.25 * width):
        centroids = []
        for row, between, slope in found:
            window = np.clip(np.abs(between - np.polyval(line, row)) / half, 0.0, 1.0)
            weights = slope * (0.54 + 0.46 * np.cos(math.pi * window)) * (window < 1.0)
            centroids.append(float(weights @ between / weights.sum()) if weights.sum() * total > 0 else math.nan)
        places = np.array(centroids)
        good = np.isfinite(places) & (places > 0) & (places < width - 1)
        if good.sum() < 0.8 * len(found) or good.sum() < 8:
            raise PhotositeError("no single edge runs through the part; give a part that holds one edge and nothing else")
        rows, edge = np.array([row for row, _, _ in found])[good], places[good]
        line = np.polyfit(rows, edge, 1)
    return rows, edge


def _bin_profile(distance_px: np.ndarray, signal: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the edge spread function, the mean signal in bins from -reach to reach, with empty bins interpolated.

    Returns, too, each photosite's distance from the mean distance of its bin [px].
    """
    if reach < 16:
        raise PhotositeError("the edge comes too near to the part's border; give a part with 5 pixels or more beside it")
    index = np.rint(distance_px / BIN_PX).astype(int) + reach
    inside = (index >= 0) & (index <= 2 * reach)
    index, distance_px = index[inside], distance_px[inside]
    count = np.bincount(index, minlength=2 * reach + 1)
    filled = count > 0
    if filled.mean() < 0.9:
        raise PhotositeError("too few rows for four bins per pixel; give a longer part of the edge, or turn it further")
    count = np.maximum(count, 1)
    means = np.bincount(index, signal[inside], minlength=2 * reach + 1) / count
    places_px = np.bincount(index, distance_px, minlength=2 * reach + 1) / count
    spread = np.interp(BIN_PX * np.arange(-reach, reach + 1), places_px[filled], means[filled])
    return spread, distance_px - places_px[index]


def _transform_profile(spread: np.ndarray, offsets_px: np.ndarray, angle_deg: float) -> EdgeTransfer:
    """Transform the edge spread function, and divide by the responses of the bins and of the difference.

    offsets_px: distances of the photosites from the means of their bins, which give the response of the bins.
    """
    reach = len(spread) // 2
    quarter = max(2, reach // 4)
    dark, bright = spread[:quarter], spread[-quarter:]
    step = float(bright.mean() - dark.mean())
    noise = float(np.hypot(dark.std(), bright.std()))
    if abs(step) <= LEAST_STEP * noise or step == 0.0:
        raise PhotositeError(f"no edge: the sides differ by {abs(step):.3g}, and each varies by {noise:.3g}")
    line = 0.5 * (spread[2:] - spread[:-2])
    window = np.hamming(len(line))
    count = 4 * len(line)  # zero padding: a frequency step small enough for linear interpolation
    frequency = np.fft.rfftfreq(count, BIN_PX)
    spectrum = np.abs(np.fft.rfft(line * window, count))
    kept = frequency <= 1.0
    within = np.array([np.cos(2.0 * math.pi * nu * offsets_px).mean() for nu in frequency[kept]])
    response = within * np.sinc(2.0 * frequency[kept] * BIN_PX)
    transfer = spectrum[kept] / spectrum[0] / response
    distance = BIN_PX * np.arange(-reach, reach + 1)
    return EdgeTransfer(frequency[kept], transfer, abs(angle_deg), abs(step), distance, spread)
