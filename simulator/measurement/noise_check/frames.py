"""Planning and simulation of the frames that a noise validation needs (`photosite validate noise`)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simulator.measurement.noise_check.expected import is_pedestal_sufficient
from simulator.measurement.noise_check.flat_bench import FlatBench, bench_camera, white_light
from simulator.progress import Steps
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.stage import Moments

EXPOSURE_TIME_S = 0.01
WINDOW_PX = 512
GAIN_ERROR = 0.0015  # wanted relative standard error of K, a quarter of its tolerance
LEVELS = (0.25, 0.4, 0.55, 0.68)  # of saturation, in the most sensitive colour; EMVA 1288 fits up to 0.7
LOW_LEVEL = 0.03  # replaces the first where dark frames clip: a line with a free intercept needs a wide range of signals
DARK_PAIRS = 4
MOST_PAIRS = 16  # per level

Pair = tuple[Path, Path]


@dataclass(frozen=True)
class NoiseFiles:
    """DNG files taken at one ISO."""

    iso: int
    dark: tuple[Pair, ...]
    flat: tuple[Pair, ...]
    saturated: Path


@dataclass(frozen=True)
class FramePlan:
    """Frames of one ISO: levels of light, pairs of flats per level, and the relative standard error of K they allow."""

    levels: tuple[float, ...]
    pairs: int
    gain_error: float

    @property
    def frames(self) -> int:
        """Number of frames of this ISO."""
        return 2 * (DARK_PAIRS + self.pairs * len(self.levels)) + 1


def make_noise_bench(camera: Camera, iso: int, folder: Path, device: str | None = None) -> FlatBench:
    """Return the bench at one ISO: daylight, 1/100 s, a window in the middle of the sensor."""
    return FlatBench(bench_camera(camera, WINDOW_PX, WINDOW_PX), iso, EXPOSURE_TIME_S, white_light(), folder, device)


def plan_frames(bench: FlatBench) -> FramePlan:
    """Choose levels and number of pairs so that K has the standard error GAIN_ERROR, with MOST_PAIRS per level at most."""
    levels = LEVELS
    if not is_pedestal_sufficient(bench.sensor):
        dark, weakest = bench.sensor.moments(0.0), float(bench.electrons.min() / bench.electrons.max())
        clear = 5.0 * math.sqrt(dark.variance + dark.fixed_variance) / (bench.sensor.white_level_dn() * weakest)
        levels = (max(LOW_LEVEL, clear), *LEVELS[1:])
    single = FramePlan(levels, 1, _gain_error(bench, levels))
    pairs = min(max(math.ceil((single.gain_error / GAIN_ERROR) ** 2), 1), MOST_PAIRS)
    return replace(single, pairs=pairs, gain_error=single.gain_error / math.sqrt(pairs))


def _gain_error(bench: FlatBench, levels: tuple[float, ...]) -> float:
    """Predict the relative standard error of K from one pair per level; the sample variance has the variance 2 V^2 / N."""
    frame, dark = bench.camera.frame, bench.sensor.moments(0.0)
    places = [0] if bench.camera.channels == 1 else [0, 1, 1, 2]
    points = [bench.sensor.moments(bench.factor_of(level) * e) for level in levels for e in bench.electrons[places]]
    signal = np.array([point.mean for point in points]) - dark.mean
    variance, count = np.array([point.variance for point in points]), frame.width * frame.height / len(places)
    if not is_pedestal_sufficient(bench.sensor):
        signal = signal - np.average(signal, weights=variance**-2.0)  # a free intercept
        return float(np.sqrt(2.0 / count / (signal**2 / variance**2).sum())) / _slope(points)
    leverage = signal / variance**2 / (signal**2 / variance**2).sum()
    of_dark = leverage.sum() * dark.variance * math.sqrt(2.0 / (frame.width * frame.height * DARK_PAIRS))
    return float(np.hypot(np.linalg.norm(leverage * variance) * math.sqrt(2.0 / count), of_dark)) / _slope(points)


def _slope(points: Sequence[Moments]) -> float:
    """Slope of the variance over the mean, which is K."""
    return float(np.polyfit([point.mean for point in points], [point.variance for point in points], 1)[0])


def take_frames(bench: FlatBench, wanted: FramePlan, first_seed: int, steps: Steps | None = None) -> NoiseFiles:
    """Simulate and save the dark pairs, the flat pairs and one frame in which every colour is saturated.

    first_seed: of the frames, which count up from it. steps: counts the frames. Raises PhotositeError.
    """
    seeds = iter(range(first_seed, first_seed + wanted.frames))

    def take(name: str, share: float) -> Path:
        path = bench.take(f"iso{bench.iso:06d}_{name}", bench.factor_of(share), next(seeds))
        if steps is not None:
            steps.add(f"ISO {bench.iso}")
        return path

    def pair(name: str, share: float) -> Pair:
        return take(f"{name}a", share), take(f"{name}b", share)

    dark = tuple(pair(f"dark{index:02d}", 0.0) for index in range(DARK_PAIRS))
    flat = tuple(
        pair(f"flat{round(1000 * level):03d}_{index:02d}", level) for level in wanted.levels for index in range(wanted.pairs)
    )
    weakest = float(bench.electrons.min() / bench.electrons.max())
    return NoiseFiles(bench.iso, dark, flat, take("saturated", 1.5 / weakest))
