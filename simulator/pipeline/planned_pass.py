"""A pass of a plan: its size, memory, predicted error and predicted time."""

from dataclasses import dataclass

from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.error_budget import ErrorBudget


@dataclass(frozen=True)
class Pass:
    """One pass of the executor.

    kept: whether it runs; a pass that is skipped has no size, memory or cost. method: how it runs, or why it is skipped.
    size: photosites, or the unit that `method` names. memory_bytes: on device and host together, held until the frame is done.
    scratch_bytes: the same, of buffers that are freed when the pass is done.
    error_sigma: what its methods leave, or what leaving it out does, by the error budget [standard deviations of the noise];
    None: exact except for rounding. cost_ms: predicted time.
    """

    name: str
    kept: bool
    method: str
    size: int = 0
    memory_bytes: int = 0
    error_sigma: float | None = None
    cost_ms: float = 0.0
    scratch_bytes: int = 0


def pixels_of(optics: OpticsPlan) -> int:
    """Return the number of photosites of a plan's window."""
    return optics.window.width * optics.window.height


def error_of(budget: ErrorBudget, *effects: str) -> float | None:
    """Return the predicted error of a pass by its effects; None where there is none."""
    return budget.sigma_of(*effects) or None
