"""Divides the tolerance of a photograph among the approximations of its light."""

from collections.abc import Callable
from dataclasses import replace

from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.error_budget import ErrorBudget, error_budget

TRIES = 3  # tighter plans that are looked at
MARGIN = 0.9  # of what is left for the terms that fall, since numbers of samples grow in steps
TIGHTEST = 0.05  # smallest tolerance of one approximation, in that of the photograph


def allot(tolerance: float, make: Callable[[float], OpticsPlan]) -> OpticsPlan:
    """Return the plan whose approximations together keep a tolerance, where there is one.

    make: plans the optics with each approximation at a tolerance. The first plan has the whole tolerance for each. Where their
    sum is larger, those that can be finer get a smaller share in proportion. Where no share is small enough, because a term
    does not fall, the first plan is returned, and its budget says what it leaves.
    """
    first = make(tolerance)
    budget, own = error_budget(first), tolerance
    for _ in range(TRIES if tolerance else 0):
        if not budget.is_clamped:
            break
        falling = falling_sigma(budget)
        left = tolerance - (budget.predicted_sigma - falling)
        own *= MARGIN * left / falling if falling else 0.0
        if own < TIGHTEST * tolerance:
            return first
        planned = replace(make(own), tolerance=tolerance)
        budget = error_budget(planned)
        if not budget.is_clamped:
            return planned
    return first


def falling_sigma(budget: ErrorBudget) -> float:
    """Return the sum of the terms that a smaller tolerance makes smaller [standard deviations of the noise]."""
    return sum(term.sigma for term in budget.terms if term.limit == "method" and term.falls)
