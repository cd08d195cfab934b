"""Modulation transfer of a slanted edge."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.quantity import Curve, Figure, Measured
from simulator.measurement.statistics.clipping import require_unclipped
from simulator.measurement.statistics.slanted_edge import edge_transfer

NYQUIST_PER_PX = 0.5


@dataclass(frozen=True)
class Mtf:
    """Modulation transfer function of an edge, e-SFR of ISO 12233, on the photosites of one colour, not demosaiced.

    Figures: mtf50 [cycles/px], the first frequency at which the transfer falls to a half, nan when it does not;
    mtf50_lw_ph = 2 mtf50 times the frame's height [line widths per picture height]; nyquist, the transfer at 0.5 cycles/px;
    rise_px, from 10 % to 90 % of the step; angle_deg, between edge and nearer axis of the photosites; step_dn of the signal.
    Of a simulated frame mtf50_cy_mm = mtf50 / pitch, too [cycles/mm on the sensor]; binned photosites are one.
    Curves: transfer over cycles/px, and the edge's profile over the distance from it [px, DN].

    area: [top, left, height, width] in photosites, with one edge and nothing else; left out, the whole frame.
    plane: R, G (both greens), Gr, Gb, B or MONO; left out, G, and MONO of a camera without a filter.
    """

    area: Area | None = None
    plane: Plane | None = None

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Measure the edge.

        Raises PhotositeError for an area without a slanted edge, or a colour that the frame has not, and where too many
        photosites clip.
        """
        signal, seen = area_of(frame, self.plane, self.area)
        try:
            found = edge_transfer(signal, seen)
        except PhotositeError as error:
            raise error.with_file(frame.name) from error
        mtf50 = found.mtf50_per_px
        figures = {
            "mtf50": Figure(mtf50, "cycles/px"),
            "mtf50_lw_ph": Figure(2.0 * mtf50 * frame.dn.shape[0], "lw/ph"),
            "nyquist": Figure(found.at(NYQUIST_PER_PX), ""),
            "rise_px": Figure(rise(found.distance_px, found.edge_spread), "px"),
            "angle_deg": Figure(found.angle_deg, "deg"),
            "step_dn": Figure(found.step, "DN"),
        }
        if frame.shot is not None:
            binning = frame.sensor("mtf").readout.binning
            pitch_um = frame.shot.camera.pixel_pitch_um * (1 if binning is None else binning.factor)
            figures["mtf50_cy_mm"] = Figure(1e3 * mtf50 / pitch_um, "cycles/mm")
        curves = {
            "transfer": Curve(found.frequency_per_px, found.transfer, "frequency", "cycles/px", "transfer", ""),
            "edge": Curve(found.distance_px, found.edge_spread, "distance from the edge", "px", "signal", "DN"),
        }
        return Measured(figures, curves)


def area_of(frame: MeasuredFrame, plane: Plane | None, area: Area | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the signal above black (height, width) float64 [DN] of an area, and the mask of the photosites of a colour.

    Raises PhotositeError as `require_unclipped` does of these photosites.
    """
    signal, seen = frame.dn.astype(np.float64), np.zeros(frame.dn.shape, bool)
    step = 1 if frame.cfa == "MONO" else 2
    for row, column in frame.places(plane):
        seen[row::step, column::step] = True
        signal[row::step, column::step] -= frame.black_level_dn[row, column]
    part = frame.cut(area)
    try:
        require_unclipped(frame.dn[part][seen[part]], frame.white_level_dn)
    except PhotositeError as error:
        raise error.with_file(frame.name) from error
    return signal[part], seen[part]


def rise(distance_px: np.ndarray, spread: np.ndarray) -> float:
    """Return the way from the last 10 % of an edge's profile to the first 90 % [px]; nan where noise hides it."""
    quarter = max(2, len(spread) // 8)
    dark, bright = spread[:quarter].mean(), spread[-quarter:].mean()
    share = (spread - dark) / (bright - dark)
    above = np.nonzero(share >= 0.9)[0]
    if len(above) == 0 or above[0] == 0:
        return math.nan
    below = np.nonzero(share[: above[0]] <= 0.1)[0]
    if len(below) == 0:
        return math.nan
    ends = [
        float(np.interp(level, share[first : first + 2], distance_px[first : first + 2]))
        for level, first in ((0.9, int(above[0]) - 1), (0.1, int(below[-1])))
    ]
    return ends[0] - ends[1]
