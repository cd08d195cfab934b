"""A hand that shakes the camera: how far an edge is spread along the lines, against the path that the shot states.

The extent is that between 95 % and 5 % of the edge's light, which is that of the path without its outermost twentieths.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from simulator.exposure.hand_tremor import HandTremor
from simulator.exposure.motion import Motion
from simulator.measurement.noise_check.flat_bench import white_light
from simulator.measurement.shutter_check.case import Curve, Findings, check_number
from simulator.measurement.shutter_check.frames import EdgeScene, Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lamp import SHARE
from simulator.measurement.shutter_check.lines import over_flat

TIME_S = 0.25
LINES = 64  # in the middle of the frame, whose profiles are averaged
SPREAD = 1.0 / 20.0  # of a line: root mean square that the path shall have about
MEAN_HZ = 6.0  # about that of the tremor
INSTANTS = 1000  # of the stated path, for each line
LEVELS = (0.95, 0.05)
STILL = "shake_flat"


def crossings(profile: np.ndarray, error: np.ndarray | float = 0.0) -> tuple[float, float]:
    """Return how far apart a falling profile passes LEVELS [photosites], and its standard error.

    profile: (photosites,), from 1 to 0, linear between them. error: standard error of each photosite.
    """
    errors, places, variance = np.broadcast_to(error, profile.shape), [], 0.0
    for level in LEVELS:
        after = int(np.argmax(profile < level))
        slope = profile[after - 1] - profile[after]
        share = (profile[after - 1] - level) / slope
        places.append(after - 1 + share)
        variance += float(((1.0 - share) * errors[after - 1] / slope) ** 2 + (share * errors[after] / slope) ** 2)
    return float(places[1] - places[0]), float(np.sqrt(variance))


def stated_profile(bench: ShutterBench, motion: Motion, frame: Frame, lines: np.ndarray) -> np.ndarray:
    """Return the profile of the edge, mean of lines, by the path that the shot states, (photosites,).

    lines: numbers of lines of the sensor. The edge is a plane through the lens, which, turned into the camera's axes, meets
    each line in a place.
    """
    openings = bench.shutter.line_times(bench.camera, frame.exposure.time_s, bench.f_number, bench.f_number)
    own = openings[0]
    index = lines if own.axis != "all" else np.zeros(lines.size, int)
    opens, is_open, closes, closed = (one[index, None] for one in (own.opens_s, own.open_s, own.closes_s, own.closed_s))
    times = opens + (closed - opens) * (np.arange(INSTANTS) + 0.5) / INSTANTS
    with np.errstate(divide="ignore", invalid="ignore"):
        rising = np.where(is_open > opens, (times - opens) / (is_open - opens), 1.0)
        falling = np.where(closed > closes, (closed - times) / (closed - closes), 1.0)
    weights = np.minimum(np.minimum(rising, falling), 1.0)
    turned = motion.camera_poses(frame.exposure.start_s + times.ravel()).matrices().reshape(*times.shape, 3, 3)
    camera, strip, distance = bench.camera, bench.strip.frame, bench.distance_px
    if bench.by_columns:
        normal, along = turned[..., 1, :], lines[:, None] + 0.5 - 0.5 * camera.width_px
        place = (normal[..., 0] * along - normal[..., 2] * distance) / normal[..., 1] + 0.5 * camera.height_px - strip.y
    else:
        normal, along = turned[..., 0, :], lines[:, None] + 0.5 - 0.5 * camera.height_px
        place = (normal[..., 1] * along + normal[..., 2] * distance) / normal[..., 0] + 0.5 * camera.width_px - strip.x
    bright = [float(np.average(place > x + 0.5, weights=weights)) for x in range(bench.across)]
    return np.array(bright)


@dataclass(frozen=True)
class ShakeCase:
    """An edge under a shaking camera. seed: of the path."""

    seed: int = 1

    def motion(self, bench: ShutterBench) -> Motion:
        """Return the path: its speed makes about SPREAD of a line."""
        angle_deg = float(np.degrees(SPREAD * bench.across / bench.distance_px))
        return Motion(camera=HandTremor(float(f"{np.sqrt(3.0) * angle_deg * 2.0 * np.pi * MEAN_HZ:.3g}"), seed=self.seed))

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return the frame, and one of even light; the camera is at rest in the scene's view halfway through."""
        exposure = bench.exposure(TIME_S, start_s=-0.5 * (TIME_S + (bench.scan.time_s if bench.scan else 0.0)))
        scene = EdgeScene(white_light(), bench.by_columns)
        return [
            Frame(STILL, exposure, SHARE, middle=LINES),
            Frame("shake", exposure, SHARE, scene=scene, motion=self.motion(bench), middle=LINES),
        ]

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure the extent of the blur in the lines in the middle."""
        own = replace(bench, middle=LINES)
        light = over_flat(own, files["shake"], files[STILL])
        places = own.line_places(light.shape[0])
        numbers = np.round((1.0 - places if own.is_reversed else places) * own.lines - 0.5).astype(int)
        profile = light.mean(axis=0)
        scatter = np.sqrt(0.5 * np.mean(np.diff(light, axis=0) ** 2, axis=0) / light.shape[0])
        extent, error = crossings(profile, scatter)
        motion = self.motion(bench)
        model = stated_profile(own, motion, self.frames(bench)[1], numbers)
        stated, _ = crossings(model)
        camera = motion.camera
        assert isinstance(camera, HandTremor)
        where = f"{camera.rms_deg_per_s:g} deg/s, {1e3 * TIME_S:g} ms"
        labels = "photosite of the line", "light over that of a flat"
        curve = Curve(f"edge, hand of {where}", *labels, np.arange(profile.size), profile, model, "stated path")
        return Findings((check_number("shake", where, extent, stated, error, "px", bench.reason_edge_is_soft),), (curve,))
