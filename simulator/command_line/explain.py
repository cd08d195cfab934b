"""`photosite explain` and `photosite devices` as tables."""

from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from simulator.command_line.lens_numbers import lens_facts
from simulator.command_line.screen import console, shown
from simulator.command_line.shot_numbers import Fact, white_facts
from simulator.config import load_shot, located, shot_warnings
from simulator.device import Device, has_devices, open_device
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import execute
from simulator.pipeline.stopwatch import Stopwatch

Kept = Literal["exposure", "brightness"]  # what stays the same over the ISO range


def show_devices() -> None:
    """Print every OpenCL device. Raises PhotositeError when there is none."""
    from simulator.device import devices

    table = Table(title="OpenCL devices, the default first")
    for column in ("name", "version", "units", "memory"):
        table.add_column(column, justify="right" if column in ("units", "memory") else "left", overflow="fold")
    for device in devices():
        memory = f"{device.memory_bytes / 2**30:.1f} GiB"
        table.add_row(escape(device.name), escape(device.version), str(device.compute_units), memory)
    console().print(table)


def show_plan(path: Path, settings: list[str], reflectance: float, keep: Kept, device: str | None, measured: bool) -> None:
    """Print plan, lens, white, and a grey patch of a shot with its noise over the ISO range.

    device: where the methods of tiles, which depend on the picture's depths, are measured; without any they are left open.
    measured: take the shot, too, and print the time of each pass beside the predicted one. Raises PhotositeError.
    """
    shot = load_shot(path, settings)
    times_ms: dict[str, float] = {}
    with located(path, settings):
        planned = plan(shot)
        if measured:
            planned, times_ms = _measured_times(planned, shot, open_device(device))
        elif has_devices():
            planned = measure(planned, open_device(device))
    out = console()
    out.print(_steps(planned, shot.name))
    out.print(_passes(planned, times_ms))
    out.print(_facts("Lens", lens_facts(shot, planned)))
    out.print(_facts("A white surface at the centre", white_facts(shot, planned)))
    _show_patch(out, shot, planned, reflectance, keep)
    for note in planned.optics.scene.notes:
        out.print(f"note: {escape(note)}")
    for warning in shot_warnings(shot):
        out.print(f"warning: {escape(warning)}")


def _measured_times(planned: Plan, shot: Shot, device: Device) -> tuple[Plan, dict[str, float]]:
    """Plan with the methods of its tiles, and milliseconds by pass, of a second run: the first builds the kernels."""
    with shown(shot.name) as progress:
        execute(planned, shot, device, progress, Stopwatch())
        stopwatch = Stopwatch(running=True)
        execute(planned, shot, device, progress, stopwatch)
    return measure(planned, device), stopwatch.times_ms


def _steps(planned: Plan, name: str) -> Table:
    table = Table(title=f"Plan of {escape(name)}")
    for column in ("stage", "", "why"):
        table.add_column(column)
    for step in planned.steps:
        table.add_row(
            escape(step.stage), "kept" if step.kept else "skipped", escape(step.why), style=None if step.kept else "dim"
        )
    return table


def _passes(planned: Plan, times_ms: dict[str, float]) -> Table:
    """What the executor runs: how, how large, what it holds, and what error and time it has."""
    table = Table(title="Passes on the device, in order")
    columns = ["pass", "method, or why it is skipped", "Mpx", "MB", "error [sigma]", "predicted [ms]"]
    for column in columns + ["measured [ms]"] * bool(times_ms):
        table.add_column(escape(column), justify="left" if column in columns[:2] else "right")
    for one in planned.passes:
        error = "" if one.error_sigma is None else f"{one.error_sigma:.2g}"
        numbers = [f"{1e-6 * one.size:.2f}", f"{1e-6 * one.memory_bytes:.0f}", error, f"{one.cost_ms:.3g}"] if one.kept else []
        if times_ms and one.kept:
            numbers.append(f"{times_ms[one.name]:.3g}" if one.name in times_ms else "")
        table.add_row(escape(one.name), escape(one.method), *numbers, style=None if one.kept else "dim")
    sums = ["", f"{1e-6 * planned.memory_bytes():.0f}", "", f"{planned.cost_ms():.3g}"]
    table.add_section()
    table.add_row("together", "", *sums, *([f"{sum(times_ms.values()):.3g}"] if times_ms else []))
    return table


def _show_patch(out: Console, shot: Shot, planned: Plan, reflectance: float, keep: Kept) -> None:
    from simulator.command_line.patch_numbers import budget_table, channel_names, patch_facts, shown_isos
    from simulator.pipeline.explain.grey_patch import grey_patch
    from simulator.pipeline.explain.noise_budget import iso_budgets

    patch = grey_patch(shot, planned.optics.scene, reflectance)
    if patch is None:
        return
    out.print(
        _facts(f"A grey patch, {100 * reflectance:g} % of white, at the centre", patch_facts(shot, planned.sensor, patch))
    )
    channel = 1 if len(patch.electrons) == 3 else 0
    budgets = iso_budgets(planned.sensor, shot.exposure, float(patch.electrons[channel]), shown_isos(shot), keep)
    kept = "the shutter stays" if keep == "exposure" else "the shutter gets shorter as the ISO grows"
    title = f"Noise of the patch, {channel_names(shot.camera)[channel]}: shares of the temporal variance [%]; {kept}"
    out.print(budget_table(title, budgets))


def _facts(title: str, facts: list[Fact]) -> Table:
    table = Table(title=escape(title))
    for column in ("quantity", "value", "formula"):
        table.add_column(column, justify="right" if column == "value" else "left")
    for fact in facts:
        table.add_row(escape(fact.quantity), escape(fact.value), escape(fact.formula))
    return table
