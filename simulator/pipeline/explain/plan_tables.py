"""A plan and its noise as tables of plain values with units, for files that programs read."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from simulator.pipeline.explain.noise_budget import NoiseBudget
from simulator.pipeline.passes import PROGRAM_BYTES
from simulator.pipeline.planner import Plan

Value = str | int | float | bool | None


@dataclass(frozen=True)
class Column:
    """name: of a column. unit: of its numbers, "" of a ratio or text."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class ExplainedTable:
    """name: of the section, one word. title: of its heading. rows: a value for each column; None: there is none."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Value, ...], ...]


def step_table(planned: Plan) -> ExplainedTable:
    """Return the effects on light and signal, in physical order: kept or skipped, and why."""
    rows = tuple((step.stage, step.kept, step.why) for step in planned.steps)
    return ExplainedTable("plan", "Plan", (Column("stage"), Column("kept"), Column("why")), rows)


def pass_table(planned: Plan, times_ms: dict[str, float]) -> ExplainedTable:
    """Return the passes in order, with method, size, memory, predicted error and time. times_ms: measured; {}: not measured.

    A pass that is skipped has neither size nor memory, error or time.
    """
    columns = [Column("pass"), Column("kept"), Column("method"), Column("size"), Column("memory", "byte")]
    columns += [Column("scratch memory", "byte"), Column("predicted error", "sigma"), Column("predicted time", "ms")]
    columns += [Column("measured time", "ms")] * bool(times_ms)
    rows = []
    for one in planned.passes:
        numbers = (one.size, one.memory_bytes, one.scratch_bytes, one.error_sigma, one.cost_ms)
        row: tuple[Value, ...] = (one.name, one.kept, one.method, *(numbers if one.kept else (None,) * len(numbers)))
        rows.append((*row, times_ms.get(one.name) if one.kept else None) if times_ms else row)
    return ExplainedTable("passes", "Passes on the device, in order", tuple(columns), tuple(rows))


def error_table(planned: Plan) -> ExplainedTable:
    """Return what the light may be wrong by: of each approximation, then of all methods together."""
    budget = planned.error_budget
    columns = (Column("effect"), Column("cause"), Column("error", "sigma"), Column("limited by"), Column("what helps"))
    rows: list[tuple[Value, ...]] = [(one.effect, one.cause, one.sigma, one.limit, one.fix) for one in budget.terms]
    told = f"tolerance {budget.tolerance:g} is {'not met' if budget.is_clamped else 'met'}"
    rows.append(("all methods together", "", budget.predicted_sigma, "", told))
    return ExplainedTable("errors", "Error budget, in sigma of a frame's noise", columns, tuple(rows))


def plan_totals(planned: Plan, times_ms: dict[str, float]) -> dict[str, Value]:
    """Return numbers of the whole plan by name with unit. times_ms: measured time of each pass [ms]; {}: not measured."""
    budget = planned.error_budget
    totals: dict[str, Value] = {
        "memory [byte]": planned.memory_bytes() + PROGRAM_BYTES,
        "predicted time [ms]": planned.cost_ms(),
        "predicted error [sigma]": budget.predicted_sigma,
        "tolerance [sigma]": budget.tolerance,
        "tolerance is met": not budget.is_clamped,
    }
    if times_ms:
        totals["measured time [ms]"] = sum(times_ms.values())
    if planned.fitted is not None:
        totals |= {"time budget [s]": planned.fitted.budget_s, "predicted time in the budget [s]": planned.fitted.predicted_s}
    return totals


def noise_table(budgets: Sequence[NoiseBudget], title: str) -> ExplainedTable:
    """Return a line for each ISO: signal, share of each source in the temporal variance, noise, SNR, dynamic range.

    Shares and noise of a patch that clips are None, since the budget does not hold there.
    """
    sources = list(dict.fromkeys(name for budget in budgets for name in budget.shares))
    columns = [Column("ISO"), Column("time", "s"), Column("signal", "e-"), Column("clipped")]
    columns += [Column(f"share of {name}") for name in sources]
    columns += [Column("sigma", "DN"), Column("sigma", "e-"), Column("SNR"), Column("fixed pattern", "DN")]
    columns.append(Column("dynamic range", "stops"))
    rows = []
    for one in budgets:
        shares = [one.shares.get(name, 0.0) for name in sources]
        noise = [*shares, one.sigma_dn, one.sigma_e, one.snr, one.fixed_sigma_dn]
        held: list[Value] = [None] * len(noise) if one.is_clipped else [*noise]
        stops = one.dynamic_range_stops
        last = stops if math.isfinite(stops) else None
        rows.append((one.iso, one.time_s, one.mean_electrons, one.is_clipped, *held, last))
    return ExplainedTable("noise", title, tuple(columns), tuple(rows))
