"""Searches for the inputs at which a kernel is farthest from float64: examples of hypothesis, then a hill climb."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings, target

from simulator.device import Device
from simulator.errors import PhotositeError
from simulator.pipeline.planner import Plan

from .space import Domain, Inputs, inputs_strategy, mutated

LARGEST_E = 1e7  # electrons of the largest wells: beyond it a photosite has no sigma
UNITS = ("ulps", "sigma", "promises")  # of errors; the last one in what a shot's plan promises
READ_NOISE_E = 1.0  # of a good camera
KEPT = 0.999  # share of the photosites for which a shot's error budget holds
CLIMBERS = 6  # worst inputs that the hill climb starts from


@dataclass(frozen=True)
class Outcome:
    """What a kernel made of inputs, beside the same in float64.

    found: of the kernel. exact: same shape, float64. scale: size of the terms that were added, whose last place is the
        unit of errors where they cancel.
    sigma: noise of each photosite in the unit of `found`; None: that of `exact` electrons.
    promised_sigma: error that the plan promises not to exceed (`promised_sigma`); None: there is no plan.
    """

    found: np.ndarray
    exact: np.ndarray
    scale: np.ndarray | float = 0.0
    sigma: np.ndarray | float | None = None
    promised_sigma: float | None = None

    def share_of_promise(self) -> float:
        """Return the error of KEPT of the photosites in units of what is promised; 0 where nothing is."""
        return float(np.quantile(self.errors()[1], KEPT)) / self.promised_sigma if self.promised_sigma else 0.0

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the errors in ulps of float32 and in sigma; infinite where a number is lost, 0 where float32 holds none."""
        exact = np.asarray(self.exact, np.float64)
        with np.errstate(all="ignore"):
            miss = np.abs(np.asarray(self.found, np.float64) - exact)
            size = np.maximum(np.abs(exact), self.scale)
            beyond = size > np.finfo(np.float32).max / 4.0
            ulp = np.spacing(np.where(beyond, 1.0, size).astype(np.float32)).astype(np.float64)
            sigma = np.sqrt(np.abs(exact) + READ_NOISE_E**2) if self.sigma is None else self.sigma
            holds = (np.abs(exact) <= LARGEST_E) if self.sigma is None else np.full(exact.shape, True)
            lost = ~np.isfinite(miss)
            ulps = np.where(beyond, 0.0, np.where(lost, np.inf, miss / ulp))
            sigmas = np.where(beyond | ~holds, 0.0, np.where(lost, np.inf, miss / sigma))
        return ulps, sigmas


def promised_sigma(planned: Plan) -> float:
    """Return the error that a shot promises: its tolerance, or what its budget states where that is more [sigma].

    Of KEPT of the photosites, each in its own noise.
    """
    budget = planned.error_budget
    return max(budget.tolerance, budget.predicted_sigma + budget.sigma("input"))


@dataclass(frozen=True)
class StressCase:
    """A kernel, what its inputs may be, and how it is run beside float64.

    name: of the case. kernels: functions of kernels/*.cl that it runs. space: what is varied. run: the kernel, as users run it.
    most_ulps, most_sigma: bounds that hold; None: there is none. keeps: whether shots have plans, whose promise is the bound.
    why: where the bounds come from.
    """

    name: str
    kernels: tuple[str, ...]
    space: Mapping[str, Domain]
    run: Callable[[Device, Inputs], Outcome]
    why: str
    most_ulps: float | None = None
    most_sigma: float | None = None
    keeps: bool = False

    @property
    def climbs(self) -> str:
        """The unit in which the hill climb looks for the worst."""
        return "ulps" if self.most_ulps is not None else "promises" if self.keeps else "sigma"

    @property
    def bounds(self) -> dict[str, float | None]:
        """Largest error by unit."""
        return {"ulps": self.most_ulps, "sigma": self.most_sigma, "promises": 1.0 if self.keeps else None}

    def measure(self, device: Device, inputs: Inputs) -> dict[str, float] | None:
        """Return the worst error of these inputs by unit; None where they are refused with a message."""
        try:
            outcome = self.run(device, inputs)
        except PhotositeError:
            return None
        ulps, sigma = outcome.errors()
        worst = {"ulps": float(ulps.max(initial=0.0)), "sigma": float(sigma.max(initial=0.0))}
        return worst | {"promises": outcome.share_of_promise()}


@dataclass
class Found:
    """The worst of a search. worst, at: error and inputs by unit. tried, refused: inputs."""

    case: StressCase
    seed: int
    worst: dict[str, float] = field(default_factory=lambda: dict.fromkeys(UNITS, -1.0))
    at: dict[str, Inputs] = field(default_factory=dict)
    best: list[tuple[float, Inputs]] = field(default_factory=list)
    tried: int = 0
    refused: int = 0

    def note(self, device: Device, inputs: Inputs) -> float:
        """Measure these inputs, keep them where they are among the worst, and return their error in the unit of the climb."""
        errors = self.case.measure(device, inputs)
        self.tried += 1
        if errors is None:
            self.refused += 1
            return 0.0
        for unit, error in errors.items():
            if error > self.worst[unit]:
                self.worst[unit], self.at[unit] = error, inputs
        error = errors[self.case.climbs]
        if len(self.best) < CLIMBERS or error > self.best[-1][0]:
            self.best = sorted([*self.best, (error, inputs)], key=lambda one: -one[0])[:CLIMBERS]
        return error

    def within_bounds(self) -> bool:
        """Whether no error exceeds its bound."""
        return all(bound is None or self.worst[unit] <= bound for unit, bound in self.case.bounds.items())


def search(case: StressCase, device: Device, number: int, examples: int, steps: int, seconds: float = np.inf) -> Found:
    """Search a case: at most so many examples of hypothesis and steps of the hill climb, each for half of the time.

    number: seed of both. seconds: of processor time, from the first example on, which builds the kernels.
    """
    found, clock = Found(case, number), [0.0]

    @seed(number)
    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=(Phase.generate, Phase.target),
        suppress_health_check=list(HealthCheck),
    )
    @given(inputs_strategy(case.space))
    def draw(inputs: Inputs) -> None:
        if not found.tried or time.process_time() - clock[0] < 0.5 * seconds:
            error = found.note(device, inputs)
            target(float(min(error, 1e30)), label=case.climbs)
            clock[0] = clock[0] or time.process_time()

    draw()
    rng = np.random.default_rng(number)
    for _ in range(steps):
        if time.process_time() - clock[0] > seconds or not found.best:
            break
        _, inputs = found.best[int(rng.integers(len(found.best)))]
        found.note(device, mutated(case.space, inputs, rng))
    return found
