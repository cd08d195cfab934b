"""What the audit measures of a shot: its error against the truth, the prediction, and the run time."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from audit.drawn_plans import draw_plan
from audit.drawn_shots import DrawnShot
from audit.limits import limited_time
from audit.shot_truth import JUDGED, NoTruthError, find_truth, run, z_scores
from simulator import load_shot
from simulator.device import Device
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch

TIGHTER = 1 / 3  # tolerance of the second shot, in that of the first
TRUTH_S = 5.0  # processor time for the rays of a truth [s]
MOST_TRUTH_S = 240.0  # processor time after which a truth is given up, whatever it is at [s]
COSTLY_MS = 1500.0  # predicted time from which a shot is timed the first time, and has no random plan
MOST_MS = 4000.0  # predicted time from which it is not taken
CHECKED = 4  # one in so many shots that float64 knows has the reference path held against it
TIMED, TIMED_S = 5, 0.5  # most runs that are timed, and processor time after which none follows [s]
CORES = 2  # over which predicted times divide the processor time
METHODS = ("reference", "joint", "instants", "swept", "swept_first", "points", "mean", "copy", "psf", "sharp")


@dataclass(frozen=True)
class Record:
    """Figures of a shot; errors in standard deviations of each photosite's own temporal noise.

    truth: "rays" of the reference path, or "float64". reference_p99_9: of the rays against float64; None: not compared.
    p99_9, worst: of abs(z). tighter_p99_9: at a third of the tolerance. truth_sigma: largest standard error of the truth's
    photosites. predicted: by the plan. clamped: whether the plan says that it may not keep the tolerance. random_p99_9,
    random_predicted: of a random legal plan (`draw_plan`); None: it is the plan itself. input_sigma: predicted, of what the
    scene does not hold. cost_ms: predicted. cpu_ms: least processor time of the passes, with kernels that are compiled,
    over two as predicted times are. wall_ms: least of all of a run.
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
    random_p99_9: float | None = None
    random_predicted: float | None = None
    input_sigma: float = 0.0

    def as_json(self) -> dict:
        """Plain data."""
        return asdict(self)

    @property
    def allowed(self) -> float:
        """Error up to which the promise is kept: the tolerance, or what the plan states where it says that it cannot."""
        return max(self.tolerance, self.predicted) if self.clamped else self.tolerance

    @property
    def is_judged(self) -> bool:
        """Whether the truth is exact enough to judge the shot, whatever its error is."""
        return self.truth_sigma <= JUDGED * self.allowed

    @property
    def excess(self) -> float:
        """Error in units of the allowed one, less what the truth itself may be off by (3.3 standard errors)."""
        return max(self.p99_9 - 3.3 * self.truth_sigma, 0.0) / self.allowed

    @property
    def random_excess(self) -> float:
        """`excess` of the random plan, 0 without one; allowed is what it states where that is more than the tolerance."""
        if self.random_p99_9 is None or self.random_predicted is None:
            return 0.0
        return max(self.random_p99_9 - 3.3 * self.truth_sigma, 0.0) / max(self.tolerance, self.random_predicted)


def predicted_error(planned: Plan) -> tuple[float, bool]:
    """Predicted error [standard deviations], and whether the plan says that it may not keep the tolerance."""
    budget = planned.error_budget
    return budget.total_sigma, bool(budget.warnings())


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


def least_time(planned: Plan, shot: Shot, device: Device, timed_s: float = TIMED_S) -> tuple[np.ndarray, float, float]:
    """Return mean electrons of a plan, and the least processor time of its passes [ms] and time of all [s] of some runs.

    Other programs on the same cores lengthen processor time as well, and never shorten it. Each run makes the images of the
    aperture anew, as predicted times count them. timed_s: processor time after which no further run begins [s].
    """
    cpu_ms, wall_s, begun_s = [], [], time.process_time()
    while True:
        own = _with_nothing_kept(planned, device)
        started_s, timed = time.perf_counter(), ProcessorClock()
        found = run(own, shot, device, timed)
        wall_s.append(time.perf_counter() - started_s)
        cpu_ms.append(sum(timed.times_ms.values()))
        if len(cpu_ms) == TIMED or time.process_time() - begun_s > timed_s:
            return found, min(cpu_ms), min(wall_s)


def _with_nothing_kept(planned: Plan, device: Device) -> Plan:
    """Return a plan whose blur does not hold what frames before it made."""
    defocus = planned.optics.defocus
    if defocus is None:
        return planned
    return measure(replace(planned, optics=replace(planned.optics, defocus=replace(defocus)), tiles=None), device)


def measure_shot(drawn: DrawnShot, folder: Path, device: Device, truth_s: float = TRUTH_S) -> Record:
    """Take a drawn shot at its tolerance, at a tighter one, by a random plan, and its truth.

    truth_s: processor time for the rays of the truth [s]. Raises NoTruthError of a shot that has none or takes too long.
    """
    shot = load_shot(drawn.write(folder))
    if plan(shot).cost_ms() > MOST_MS:
        raise NoTruthError(f"predicted to take {1e-3 * plan(shot).cost_ms():.2g} s")
    planned = measure(plan(shot), device)
    predicted, clamped = predicted_error(planned)
    stated = predicted if clamped else shot.tolerance
    with limited_time(MOST_TRUTH_S, NoTruthError(f"its truth takes more than {MOST_TRUTH_S:g} s of processor time")):
        true = find_truth(shot, planned, stated, device, truth_s, is_checked=drawn.number % CHECKED == 0)
    is_costly = planned.cost_ms() > COSTLY_MS
    if not is_costly:
        run(planned, shot, device)  # compiles the kernels
    found, cpu_ms, wall_s = least_time(planned, shot, device)
    tight = replace(shot, tolerance=TIGHTER * shot.tolerance)
    tighter = run(measure(plan(tight), device), tight, device)
    free = None if is_costly else draw_plan(planned, np.random.default_rng([drawn.seed, drawn.number, 1]), device)
    freely = found if free is None else run(free, shot, device)
    if np.array_equal(freely, found):  # the planner's own plan once more
        free = None
    z, tighter_z, free_z = (np.abs(z_scores(one, true.electrons, planned)) for one in (found, tighter, freely))
    return Record(
        drawn.seed,
        drawn.number,
        drawn.kinds,
        method_of(planned),
        true.kind,
        true.reference_p99_9,
        shot.tolerance,
        float(np.quantile(z, 0.999)),
        float(z.max()),
        float(np.quantile(tighter_z, 0.999)),
        true.sigma,
        float(predicted),
        clamped,
        tuple(planned.warnings()),
        planned.cost_ms(),
        cpu_ms,
        1e3 * wall_s,
        float(planned.optics.accuracy.electrons),
        int(true.electrons.size),
        None if free is None else float(np.quantile(free_z, 0.999)),
        None if free is None else float(predicted_error(free)[0]),
        float(planned.error_budget.sigma("input")),
    )
