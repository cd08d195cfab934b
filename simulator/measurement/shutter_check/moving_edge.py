"""An edge that moves steadily along the lines: the skew that a rolling shutter gives it, v T_read, and the length of its blur.

The middle of the edge in a line is the sum of the line's light over that of the bright side, whatever the edge's blur.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.measurement.noise_check.flat_bench import white_light
from simulator.measurement.shutter_check.case import Curve, Findings, check_number
from simulator.measurement.shutter_check.fits import Fit, box_sum_share, fit_curve, fit_linear
from simulator.measurement.shutter_check.frames import MOTION_TOLERANCE, EdgeScene, Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lamp import FLAT, SHARE, LampCase, flat_frame
from simulator.measurement.shutter_check.lines import over_flat
from simulator.measurement.shutter_check.scan import crossing_share, crossing_speed

SKEW = 0.4  # way of the edge in the time of the scan, over the length of a line
EXPOSURE = 0.2  # of the time of the scan
AROUND_PX = 6.0  # photosites beyond the blur that the fit of its profile takes in
LEAST_BOX = 0.02  # of the blur: a narrower penumbra is left out of the profile


def edge_places(light: np.ndarray) -> np.ndarray:
    """Return the middle of the edge in each line [photosites], (lines,).

    light: (lines, photosites of a line) over that of the bright side, bright at the beginning of a line, 0 at its end.
    """
    return light.sum(axis=1)


def measure_blur(
    light: np.ndarray, places: np.ndarray, penumbra: np.ndarray | float, first_px: float, aperture_px: float
) -> Fit:
    """Fit the profile of an edge: a box of the blur, one of the photosite's own width, and one of the penumbra of curtains.

    light: (lines, photosites of a line). places: middle of the edge in each line, (lines,). penumbra: way of the edge while a
    curtain crosses the cone of light, (lines,) or one [photosites]. first_px: about how long the blur is. aperture_px: side of
    a photosite's light-sensitive square [photosites], whose mean light a photosite tells; 0: a point.
    Parameters: length of the blur [photosites], offset [photosites], bright and dark level.
    """
    x = np.arange(light.shape[1]) + 0.5 - places[:, None]
    kept = np.abs(x) < 0.5 * first_px + AROUND_PX
    x, data = x[kept], light[kept]
    soft = np.broadcast_to(np.reshape(penumbra, (-1, 1)), light.shape)[kept]
    others = [soft] if (soft > LEAST_BOX * first_px).all() else []
    others += [aperture_px] if aperture_px > LEAST_BOX * first_px else []

    def model(values: np.ndarray) -> np.ndarray:
        length, offset, bright, dark = values
        return bright + (dark - bright) * box_sum_share(x - offset, [abs(length), *others])

    level = float(np.median(data[x < -0.5 * first_px]))
    first = np.array([first_px, 0.0, level, 0.0])
    spread = np.sqrt(np.clip(data / level, 0.02, 1.0))
    return fit_curve(model, data, first, np.array([0.1, 0.1, 0.01 * level, 0.01 * level]), spread)


def allowed_error_px(light: np.ndarray, blur_px: float) -> float:
    """Return the error of the blur that the accuracy of the frame allows: MOTION_TOLERANCE standard deviations of its noise.

    light: as of `measure_blur`. A profile that is wrong by a share at both of its ends has a ramp that is wrong by twice that.
    """
    bright = light[:, : max(light.shape[1] // 16, 2)]
    return 2.0 * MOTION_TOLERANCE * float(bright.std()) * blur_px


@dataclass(frozen=True)
class MovingEdgeCase:
    """An edge that moves across the strip while the shutter crosses it."""

    lamp: LampCase

    def speed_px_per_s(self, bench: ShutterBench) -> float:
        """Of the edge on the sensor; three digits."""
        return float(f"{SKEW * bench.across / self.lamp.scan.time_s:.3g}")

    @property
    def time_s(self) -> float:
        """Exposure time."""
        return EXPOSURE * self.lamp.scan.time_s

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return the frame; the edge is in the middle halfway through the exposure."""
        speed = Speed(self.speed_px_per_s(bench) * 2.0 / max(bench.camera.width_px, bench.camera.height_px), "px/s")
        still = Speed(0.0, "px/s")
        motion = Motion(layers={0: LayerMotion((still, speed) if bench.by_columns else (speed, still))})
        scan_s = self.lamp.scan.time_s
        exposure = bench.exposure(self.time_s, start_s=-0.5 * (scan_s + self.time_s))
        return [
            flat_frame(bench),
            Frame("edge", exposure, SHARE, scene=EdgeScene(white_light(), bench.by_columns), motion=motion),
        ]

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure skew and length of the blur."""
        light, scan, stated = over_flat(bench, files["edge"], files[FLAT]), self.lamp.find_scan(bench, files), self.lamp.scan
        found = edge_places(light)
        place, speed = bench.line_places(found.size), self.speed_px_per_s(bench)
        when = crossing_share(place, scan.bend)
        line = fit_linear(np.stack([np.ones(found.size), when], axis=1), found)
        where = f"{speed:g} px/s"
        soft = line.values[1] * scan.cone / crossing_speed(place, scan.bend)
        blur_px = speed * self.time_s
        aperture_px = math.sqrt(bench.camera.fill_factor)
        blur = measure_blur(light, line.fitted, soft, EXPOSURE * float(line.values[1]), aperture_px)
        blur_at = f"{where}, {1e3 * self.time_s:.4g} ms"
        skew = float(line.values[1]), speed * stated.time_s, float(line.errors()[1])
        found_blur = float(blur.values[0]), blur_px, math.hypot(float(blur.errors()[0]), allowed_error_px(light, blur_px))
        checks = (
            check_number("skew", where, *skew, "px", bench.reason_dark_is_clipped),
            check_number("blur", blur_at, *found_blur, "px", bench.reason_edge_is_soft),
        )
        title = f"edge of {where}"
        curves = (
            Curve(title, "line, as opened", "place of the edge [photosites]", np.arange(found.size), found, line.fitted),
            _profile(light, line.fitted, blur, EXPOSURE * float(line.values[1]), f"edge of {blur_at}"),
        )
        return Findings(checks, curves)


def _profile(light: np.ndarray, places: np.ndarray, blur: Fit, first_px: float, title: str) -> Curve:
    """Return the profile of the edge, means over fifths of a photosite."""
    x = np.arange(light.shape[1]) + 0.5 - places[:, None]
    kept = np.abs(x) < 0.5 * first_px + AROUND_PX
    bins = np.round(5.0 * x[kept]).astype(int)
    first = int(bins.min())
    count = np.maximum(np.bincount(bins - first), 1)
    middle = (first + np.arange(count.size)) / 5.0
    mean, fitted = (np.bincount(bins - first, one) / count for one in (light[kept], blur.fitted))
    return Curve(title, "from the middle of the edge [photosites]", "light over that of a flat", middle, mean, fitted)
