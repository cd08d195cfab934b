"""What the audit measures of a shot: its error against the reference path, the prediction, and the run time."""

import math
import re
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from audit.drawn_shots import DrawnShot, saturation_electrons
from audit.float64_truth import Truth, exact_means, is_simple, sum_rays
from simulator import load_shot
from simulator.device import Device
from simulator.errors import PhotositeError
from simulator.optics.ray_reference.convergence import FEWEST_RAYS
from simulator.pipeline.execution import execute
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.progress import silent

TIGHTER = 1 / 3  # tolerance of the second shot, in that of the first
TRUTH_SHARE = 0.15  # largest standard error of the truth, in the tolerance
LEAST_TRUTH_ERROR, MOST_TRUTH_ERROR = 0.006, 0.03  # [standard deviations of the noise]
MOST_RAYS = 16384  # of a photosite and replication
CHECKED = 4  # one in so many shots that float64 knows has the reference path held against it
SUMMED_POINTS = 1024, 8192  # rays of each set of a float64 sum, as many as are needed
CORES = 2  # over which predicted times divide the processor time
METHODS = ("reference", "joint", "instants", "swept", "points", "mean", "copy", "psf", "sharp")


class NoTruthError(Exception):
    """A shot that neither float64 nor the reference path knows."""


@dataclass(frozen=True)
class Record:
    """Figures of a shot; errors in standard deviations of each photosite's own temporal noise.

    truth: "rays" of the reference path, or "float64". reference_p99_9: of the rays against float64; None: not compared.
    p99_9, worst: of abs(z). tighter_p99_9: at a third of the tolerance. truth_sigma: largest standard error of the truth's
    photosites. predicted: by the plan. clamped: whether the plan says that it may not keep the tolerance. cost_ms: predicted.
    cpu_ms: processor time of the passes of the second run, over two as predicted times are. wall_ms: of all of that run.
    """

    seed: int
    number: int
    kinds: tuple[str, ...]
    method: str
    truth: str
    reference_p99_9: float | None
    tolerance: float
    p99_9: float
    worst: float
    tighter_p99_9: float
    truth_sigma: float
    predicted: float
    clamped: bool
    warnings: tuple[str, ...]
    cost_ms: float
    cpu_ms: float
    wall_ms: float
    electrons: float
    photosites: int

    def as_json(self) -> dict:
        """Plain data."""
        return asdict(self)

    @property
    def allowed(self) -> float:
        """Error up to which the promise is kept: the tolerance, or what the plan states where it says that it cannot."""
        return max(self.tolerance, self.predicted) if self.clamped else self.tolerance

    @property
    def excess(self) -> float:
        """Error in units of the allowed one, less what the truth itself may be off by (3.3 standard errors)."""
        return max(self.p99_9 - 3.3 * self.truth_sigma, 0.0) / self.allowed


def predicted_error(planned: Plan) -> tuple[float, bool]:
    """Predicted error [standard deviations], and whether the plan says that it may not keep the tolerance."""
    budget = planned.error_budget
    return budget.predicted_sigma + budget.sigma("input"), bool(budget.warnings())


def method_of(planned: Plan) -> str:
    """Name of the method that decides on the error, one of METHODS."""
    optics = planned.optics
    if optics.motion is not None:
        return optics.motion.method
    if planned.tiles is not None:
        shares = planned.tiles.shares()
        names = {method.name.lower() for method, share in shares.items() if share > 0.0}
        if names & {"occlusion", "wide", "corrected"}:
            return "points"
        return "mean" if names & {"mean", "composite"} else "copy"
    return "psf" if optics.psf is not None else "sharp"


class ProcessorClock(Stopwatch):
    """Processor time of each pass, of all cores over two [ms]."""

    def __init__(self) -> None:
        super().__init__(running=True)

    @contextmanager
    def __call__(self, name: str, device: Device) -> Iterator[None]:
        """Add the time of the block to the pass of this name."""
        device.finish()
        start_s = time.process_time()
        yield
        device.finish()
        self.times_ms[name] = self.times_ms.get(name, 0.0) + 1e3 * (time.process_time() - start_s) / CORES


def run(planned: Plan, shot: Shot, device: Device, timed: Stopwatch | None = None) -> np.ndarray:
    """Mean electrons of a plan's frame (height, width) float64."""
    return execute(planned, shot, device, silent, timed or Stopwatch()).mean_electrons.astype(np.float64)


def true_electrons(shot: Shot, device: Device) -> tuple[np.ndarray, float]:
    """Mean electrons by the reference path, and the largest standard error of its photosites [standard deviations].

    Rays are added until the error is TRUTH_SHARE of the shot's tolerance, within limits.
    """
    allowed = _wanted_error(shot.tolerance)
    reference = replace(shot, tolerance=0.0)
    planned = plan(reference)
    images = _images(planned)
    exact = {"ray_error": allowed * math.sqrt(images), "rays": max(MOST_RAYS // images, FEWEST_RAYS)}
    accuracy, defocus = replace(planned.optics.accuracy, **exact), planned.optics.defocus
    if defocus is not None:
        defocus = replace(defocus, accuracy=replace(defocus.accuracy, **exact))
    planned = replace(planned, optics=replace(planned.optics, accuracy=accuracy, defocus=defocus))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = run(measure(planned, device), reference, device)
    if defocus is None:
        return found, 0.0
    return found, max([allowed, *(_left_error(one.message) for one in caught)])


def _images(planned: Plan) -> int:
    """Images of which a moving frame is the mean, up to 16; 1 where rays carry instants or nothing moves."""
    motion = planned.optics.motion
    return 1 if motion is None or motion.method != "instants" else min(max(motion.count, 1), 16)


def _left_error(message: object) -> float:
    """Standard error that a warning of the reference path tells of more than a thousandth of the photosites."""
    found = re.match(r"(\d+) of (\d+) photosites have an estimated error .* at most ([\d.e+-]+) sigma", str(message))
    return 0.0 if found is None or 1000 * int(found[1]) <= int(found[2]) else float(found[3])


def z_scores(found: np.ndarray, truth: np.ndarray, planned: Plan) -> np.ndarray:
    """Deviations in standard deviations of each photosite's own temporal noise; light above the white level is white.

    The noise is that of photons and read-out at the shot's ISO; below 1 e- it counts as 1 e-.
    """
    white_e = saturation_electrons(planned.sensor)
    return (np.minimum(found, white_e) - np.minimum(truth, white_e)) / noise_electrons(truth, planned)


def noise_electrons(electrons: np.ndarray, planned: Plan) -> np.ndarray:
    """Standard deviation of photosites with these mean electrons [e-], at least 1."""
    sensor = planned.sensor
    dark_e2 = sensor.moments(0.0).variance / sensor.gain_dn_per_e() ** 2
    return np.sqrt(np.maximum(electrons + dark_e2, 1.0))


def _truth_of(shot: Shot, planned: Plan, device: Device, is_checked: bool) -> tuple[np.ndarray, float, str, float | None]:
    """Return mean electrons, their largest standard error, what they are from, and p99.9 of the reference path against them.

    is_checked: whether the reference path is followed where float64 knows the shot. Raises NoTruthError.
    """
    summed, summed_sigma, wanted = None, math.inf, _wanted_error(shot.tolerance)
    if is_simple(shot, planned):
        summed = exact_means(shot, planned)
        for points in SUMMED_POINTS if summed is None else ():
            summed = sum_rays(shot, planned, points=points)
            if _largest_error(summed, planned) <= wanted:
                break
        assert summed is not None
        summed_sigma = _largest_error(summed, planned)
        if summed_sigma <= max(wanted, TRUTH_SHARE * shot.tolerance) and not is_checked:
            return summed.electrons, summed_sigma, "float64", None
    try:
        truth, truth_sigma = true_electrons(shot, device)
    except PhotositeError as error:
        raise NoTruthError(error) from error
    if summed is None or summed_sigma > max(truth_sigma, TRUTH_SHARE * shot.tolerance):
        return truth, truth_sigma, "rays", None
    reference = float(np.quantile(np.abs(z_scores(truth, summed.electrons, planned)), 0.999))
    return summed.electrons, summed_sigma, "float64", reference


def _largest_error(summed: Truth, planned: Plan) -> float:
    """Standard error that 99.9 % of the photosites keep [standard deviations of the noise]."""
    return float(np.quantile(summed.error / noise_electrons(summed.electrons, planned), 0.999))


def _wanted_error(tolerance: float) -> float:
    """Standard error of a truth at which it suffices [standard deviations of the noise]."""
    return min(max(TRUTH_SHARE * tolerance, LEAST_TRUTH_ERROR), MOST_TRUTH_ERROR)


def measure_shot(drawn: DrawnShot, folder: Path, device: Device) -> Record:
    """Take a drawn shot at its tolerance, at a tighter one and by the reference path or in float64. Raises NoTruthError."""
    shot = load_shot(drawn.write(folder))
    planned = measure(plan(shot), device)
    truth, truth_sigma, kind, reference = _truth_of(shot, planned, device, is_checked=drawn.number % CHECKED == 0)
    found = run(planned, shot, device)
    started_s, timed = time.perf_counter(), ProcessorClock()
    run(planned, shot, device, timed)
    wall_s = time.perf_counter() - started_s
    tight = replace(shot, tolerance=TIGHTER * shot.tolerance)
    tighter = run(measure(plan(tight), device), tight, device)
    z, tighter_z = (np.abs(z_scores(one, truth, planned)) for one in (found, tighter))
    predicted, clamped = predicted_error(planned)
    return Record(
        drawn.seed,
        drawn.number,
        drawn.kinds,
        method_of(planned),
        kind,
        reference,
        shot.tolerance,
        float(np.quantile(z, 0.999)),
        float(z.max()),
        float(np.quantile(tighter_z, 0.999)),
        truth_sigma,
        float(predicted),
        clamped,
        tuple(planned.warnings()),
        planned.cost_ms(),
        sum(timed.times_ms.values()),
        1e3 * wall_s,
        float(planned.optics.accuracy.electrons),
        int(truth.size),
    )
