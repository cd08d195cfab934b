"""`photosite explain` and `photosite devices` as tables, and the first as JSON, CSV and HTML."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from simulator.command_line.explain_formats import (
    FORMATS,
    explanation_csv,
    explanation_html,
    explanation_json,
    fact_table,
)
from simulator.command_line.exposure_numbers import exposure_facts
from simulator.command_line.lens_numbers import lens_facts
from simulator.command_line.patch_numbers import budget_tables, channel_names, patch_facts, shown_isos
from simulator.command_line.screen import console, show_progress
from simulator.command_line.shot_numbers import Fact, white_facts
from simulator.config import load_shot, locate_errors, shot_warnings
from simulator.device import Device, has_devices, open_device
from simulator.displays.explanation import Explanation, explain_plan
from simulator.errors import require
from simulator.pipeline.execution import execute
from simulator.pipeline.explain.grey_patch import GreyPatch, grey_patch
from simulator.pipeline.explain.noise_budget import NoiseBudget, iso_budgets
from simulator.pipeline.explain.plan_tables import noise_table
from simulator.pipeline.light_reuse import describe_reuse
from simulator.pipeline.passes import PROGRAM_BYTES
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.pipeline.time_budget import plan_in_time

Kept = Literal["exposure", "brightness"]  # what stays the same over the ISO range
COLUMNS = 100  # of the tables where they go into a file


def show_devices() -> None:
    """Print every OpenCL device. Raises PhotositeError when there is none, or when the default builds no kernels."""
    from simulator.device import devices, open_device

    table = Table(title="OpenCL devices, the default first")
    for column in ("name", "version", "units", "memory"):
        table.add_column(column, justify="right" if column in ("units", "memory") else "left", overflow="fold")
    for device in devices():
        memory = f"{device.memory_bytes / 2**30:.1f} GiB"
        table.add_row(escape(device.name), escape(device.version), str(device.compute_units), memory)
    console().print(table)
    open_device().check()


@dataclass(frozen=True)
class Explained:
    """Everything that `explain` tells of a shot.

    shot: as it is planned. times_ms: measured time of each pass [ms]; {}: not measured. patch: the grey patch; None where the
    scene states no luminance. budgets: its noise by ISO, titled noise_title.
    """

    shot: Shot
    planned: Plan
    times_ms: dict[str, float]
    reflectance: float
    patch: GreyPatch | None
    budgets: list[NoiseBudget]
    noise_title: str

    @property
    def warnings(self) -> list[str]:
        """What the shot does not hold, and promises of the plan that are not kept."""
        return [*shot_warnings(self.shot), *self.planned.warnings()]

    def facts(self) -> dict[str, tuple[str, list[Fact]]]:
        """Return titles and quantities by section: lens, exposure, white, patch."""
        shot, planned = self.shot, self.planned
        found = {
            "lens": ("Lens", lens_facts(shot, planned)),
            "exposure": ("Exposure", exposure_facts(shot, planned)),
            "white": ("A white surface at the centre", white_facts(shot, planned)),
        }
        if self.patch is not None:
            title = f"A grey patch, {100 * self.reflectance:g} % of white, at the centre"
            found["patch"] = (title, patch_facts(shot, planned.sensor, self.patch))
        return found


def show_plan(
    path: Path,
    settings: list[str],
    reflectance: float,
    keep: Kept,
    device: str | None,
    measured: bool,
    form: str = "table",
) -> None:
    """Print the plan of a shot, its lens, its exposure, a white surface, and a grey patch with its noise over the ISO range.

    reflectance: of the grey patch, 0 to 1. keep: what stays the same over the ISO range.
    device: part of the name of the OpenCL device that measures blur radii, which decide the method of each tile of the blur.
        Where there is no device, these methods stay open.
    measured: take the shot as well, and print the measured time of each pass beside the predicted one.
    form: table, json, csv or html.
    Raises PhotositeError.
    """
    require(form in FORMATS, "--format", form, f"give one of {', '.join(FORMATS)}")
    told = explain_shot(path, settings, reflectance, keep, device, measured)
    if form == "table":
        return _show_tables(told)
    made = _make_explanation(told)
    text = {"json": explanation_json, "csv": explanation_csv, "html": explanation_html}[form](made)
    print(text.rstrip("\n"))


def explain_shot(
    path: Path, settings: list[str], reflectance: float, keep: Kept, device: str | None, measured: bool
) -> Explained:
    """Return what `show_plan` prints. Raises PhotositeError."""
    shot = load_shot(path, settings)
    times_ms: dict[str, float] = {}
    with locate_errors(path, settings):
        planned = plan(shot) if shot.time_budget_s is None else plan_in_time(shot, open_device(device))
        if measured:
            planned, times_ms = _measure_times(planned, shot, open_device(device))
        elif has_devices():
            planned = measure(planned, open_device(device))
    shot = planned.settle(shot)
    patch = grey_patch(shot, planned.optics.scene, reflectance, planned.exposed.components[0].most)
    if patch is None:
        return Explained(shot, planned, times_ms, reflectance, None, [], "")
    channel = 1 if len(patch.electrons) == 3 else 0
    budgets = iso_budgets(planned.sensor, shot.exposure, float(patch.electrons[channel]), shown_isos(shot), keep)
    kept = "the shutter stays" if keep == "exposure" else "the shutter gets shorter as the ISO grows"
    title = f"Noise of the patch, {channel_names(shot.camera)[channel]}: shares of the temporal variance [%]; {kept}"
    return Explained(shot, planned, times_ms, reflectance, patch, budgets, title)


def _show_tables(told: Explained) -> None:
    out, shot, planned = _open_page(), told.shot, told.planned
    out.print(_make_step_table(planned, shot.name))
    out.print(_make_pass_table(planned, told.times_ms))
    out.print(_make_budget_table(planned))
    for title, facts in told.facts().values():
        out.print(_make_fact_table(title, facts))
    if told.budgets:
        for part in budget_tables(told.noise_title, told.budgets, out):
            out.print(part)
    out.print(f"reuse: {escape(describe_reuse(planned))}")
    for note in planned.notes:
        out.print(f"note: {escape(note)}")
    for warning in told.warnings:
        out.print(f"warning: {escape(warning)}")


def _open_page() -> Console:
    """Return a console for the tables: the terminal, or COLUMNS wide where there is none."""
    found = console()
    return found if found.is_terminal else Console(highlight=False, width=COLUMNS)


def _make_explanation(told: Explained) -> Explanation:
    """Return what the tables tell, as values with units."""
    tables = [fact_table(name, title, facts) for name, (title, facts) in told.facts().items()]
    if told.budgets:
        tables.append(noise_table(told.budgets, told.noise_title.replace(" [%]", "")))
    return explain_plan(told.planned, told.shot.name, told.times_ms, tables, shot_warnings(told.shot))


def _measure_times(planned: Plan, shot: Shot, device: Device) -> tuple[Plan, dict[str, float]]:
    """Take the shot twice and return the plan with the methods of its tiles, and the time of each pass [ms].

    The times are of the second run, because the first one also compiles the kernels.
    """
    with show_progress(shot.name) as progress:
        execute(planned, shot, device, progress, Stopwatch())
        stopwatch = Stopwatch(running=True)
        raw = execute(planned, shot, device, progress, stopwatch)
        _ = raw.mean_electrons, raw.noise_free_dn  # computed when they are read
    return measure(planned, device), stopwatch.times_ms


def _make_step_table(planned: Plan, name: str) -> Table:
    table = Table(title=f"Plan of {escape(name)}")
    for column in ("stage", "", "why"):
        table.add_column(column, overflow="fold")
    for step in planned.steps:
        table.add_row(
            escape(step.stage), "kept" if step.kept else "skipped", escape(step.why), style=None if step.kept else "dim"
        )
    return table


def _make_pass_table(planned: Plan, times_ms: dict[str, float]) -> Table:
    """Make the table of all passes: method, size, memory, predicted error and time, and the measured time where it is known."""
    table = Table(title="Passes on the device, in order")
    table.add_column("pass", no_wrap=True)
    table.add_column("method, or why it is skipped", overflow="fold")
    # Heads of two lines leave the method more of a narrow terminal.
    for head in ["Mpx", "MB", "error\n[sigma]", "predicted\n[ms]"] + ["measured\n[ms]"] * bool(times_ms):
        table.add_column(escape(head), justify="right")
    for one in planned.passes:
        error = "" if one.error_sigma is None else f"{one.error_sigma:.2g}"
        memory = f"{1e-6 * (one.memory_bytes + one.scratch_bytes):.0f}"
        numbers = [f"{1e-6 * one.size:.2f}", memory, error, f"{one.cost_ms:.3g}"] if one.kept else []
        if times_ms and one.kept:
            numbers.append(f"{times_ms[one.name]:.3g}" if one.name in times_ms else "")
        table.add_row(escape(one.name), escape(one.method), *numbers, style=None if one.kept else "dim")
    sums = ["", f"{1e-6 * (planned.memory_bytes() + PROGRAM_BYTES):.0f}", "", f"{planned.cost_ms():.3g}"]
    table.add_section()
    table.add_row("program", "Python, packages and driver, about", "", f"{1e-6 * PROGRAM_BYTES:.0f}", style="dim")
    table.add_row("together", "", *sums, *([f"{sum(times_ms.values()):.3g}"] if times_ms else []))
    return table


def _make_budget_table(planned: Plan) -> Table:
    """Make the table of what the light may be wrong by: of each approximation, and together against the tolerance."""
    budget, fitted = planned.error_budget, planned.fitted
    table = Table(title="Error budget, in sigma of a frame's noise")
    table.add_column("approximation", overflow="fold")
    table.add_column(escape("error\n[sigma]"), justify="right")
    table.add_column("limited by the")
    table.add_column("what helps", overflow="fold")
    for term in budget.terms:
        style = "dim" if term.limit == "input" else None
        table.add_row(escape(f"{term.effect}: {term.cause}"), f"{term.sigma:.2g}", term.limit, escape(term.fix), style=style)
    table.add_section()
    kept = "the tolerance is not met" if budget.is_clamped else "the tolerance is met"
    told = f"tolerance {budget.tolerance:g}: {kept}" if budget.tolerance else "tolerance 0: the reference path"
    table.add_row("all methods together", f"{budget.predicted_sigma:.2g}", "", told)
    if fitted is not None:
        in_time = f"tolerance {fitted.tolerance:g} takes about {fitted.predicted_s:.2g} s"
        table.add_row(f"time budget {fitted.budget_s:g} s", "", "", in_time)
    return table


def _make_fact_table(title: str, facts: list[Fact]) -> Table:
    table = Table(title=escape(title))
    for column in ("quantity", "value", "formula"):
        table.add_column(column, justify="right" if column == "value" else "left", overflow="fold")
    for fact in facts:
        table.add_row(escape(fact.quantity), escape(fact.value), escape(fact.formula))
    return table
