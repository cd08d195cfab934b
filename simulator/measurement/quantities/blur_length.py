"""Length of the blur across an edge: of a motion, or of a circle of confusion."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.mtf import area_of
from simulator.measurement.quantities.quantity import Figure, Measured
from simulator.measurement.shutter_check.fits import box_sum_share, fit_curve
from simulator.measurement.statistics.slanted_edge import LocatedEdge, locate_edge

NODES = 32  # of the circle's profile, by Gauss and Chebyshev
LEAST_SIDE_PX = 0.02  # side of a box that is left out of the profile
LEAST_STEP = 4.0  # standard deviations of the scatter about the profile; a lower step is no edge


@dataclass(frozen=True)
class BlurLength:
    """Length of the blur along the normal of a straight edge, beyond the photosites' own aperture.

    Fitted by least squares: place and angle of a step, blurred by the kind's kernel and by the aperture of a photosite, a
    square seen along the normal: two boxes of cos(a) and sin(a) at the edge's angle a.
    Figures: length_px and its standard error from the scatter about the fit, and residual, the root mean square of that
    scatter over the step, which is above the noise where the blur is of another kind.

    area: [top, left, height, width] in photosites, with one edge and nothing else; left out, the whole frame.
    plane: R, G (both greens), Gr, Gb, B or MONO; left out, G, and MONO of a camera without a filter.
    kind: motion, an even blur of this length (of an edge at the angle b to the path: path times sin b); or circle, an even disk
        of this diameter, as a lens out of focus makes it.
    """

    area: Area | None = None
    plane: Plane | None = None
    kind: Literal["motion", "circle"] = "motion"

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Measure the blur.

        Raises PhotositeError for an area without an edge, or a colour that the frame does not have, and where too many
        photosites clip.
        """
        signal, seen = area_of(frame, self.plane, self.area)
        try:
            length, error, residual = self._fit(locate_edge(signal, seen))
        except PhotositeError as problem:
            raise problem.with_file(frame.name) from problem
        return Measured({"length_px": Figure(length, "px", error), "residual": Figure(residual, "")})

    def _fit(self, edge: LocatedEdge) -> tuple[float, float, float]:
        """Return length and standard error [px], and the scatter about the profile over the step."""
        x, along, data = edge.distance_px, edge.along_px, edge.signal
        angle = math.radians(edge.angle_deg)
        square = [side for side in (math.cos(angle), math.sin(angle)) if side > LEAST_SIDE_PX]
        kept = np.abs(x) <= edge.reach_px
        x, along, data = x[kept], along[kept], data[kept]
        low, high = (float(np.median(data[side])) for side in (x < -0.7 * edge.reach_px, x > 0.7 * edge.reach_px))

        def model(values: np.ndarray) -> np.ndarray:
            length, offset, tilt, left, right = values
            place = x - offset - tilt * along
            return left + (right - left) * self._profile(place, max(abs(float(length)), LEAST_SIDE_PX), square)

        first_px = _first_length(x, (data - low) / (high - low) if high != low else data)
        step = abs(high - low)
        scale = np.array([0.1, 0.1, 0.1 / edge.rows, 0.01 * step + 1e-9, 0.01 * step + 1e-9])
        fit = fit_curve(model, data, np.array([first_px, 0.0, 0.0, low, high]), scale)
        scatter = float(np.sqrt(np.mean((data - fit.fitted) ** 2)))
        step = abs(float(fit.values[4] - fit.values[3]))
        if step <= LEAST_STEP * scatter or abs(float(fit.values[1])) > edge.reach_px:
            raise PhotositeError(
                f"no edge: the sides differ by {step:.3g}, and the photosites scatter by {scatter:.3g} about it"
            )
        return abs(float(fit.values[0])), float(fit.errors()[0]), scatter / step

    def _profile(self, x: np.ndarray, length: float, square: list[float]) -> np.ndarray:
        """Return the share of the step at distances x [px]."""
        if self.kind == "motion":
            return box_sum_share(x, [length, *square])
        # Light of a disk along its diameter is proportional to sqrt(1 - t^2), the weight of Chebyshev's second kind.
        place = np.arange(1, NODES + 1) * math.pi / (NODES + 1)
        weights = 2.0 / (NODES + 1) * np.sin(place) ** 2
        parts = zip(np.cos(place), weights, strict=True)
        return np.sum([weight * box_sum_share(x - 0.5 * length * t, square) for t, weight in parts], axis=0)


def _first_length(x: np.ndarray, share: np.ndarray) -> float:
    """Return about how far apart the profile passes its tenth and nine tenths [px], at least 0.5."""
    order = np.argsort(x)
    count = max(1, len(x) // 200)
    usable = order[: len(order) // count * count].reshape(-1, count)
    place, level = x[usable].mean(axis=1), share[usable].mean(axis=1)
    inside = place[(level > 0.1) & (level < 0.9)]
    return max(float(np.ptp(inside)) / 0.8 if inside.size else 0.0, 0.5)
