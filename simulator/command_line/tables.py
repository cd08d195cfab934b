"""`photosite explain` and `photosite devices` as tables."""

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from simulator.command_line.lens_numbers import lens_facts
from simulator.command_line.screen import console
from simulator.command_line.shot_numbers import Fact, white_facts
from simulator.config import load_shot, located, shot_warnings
from simulator.planner import Plan, plan
from simulator.shot import Shot


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


def show_plan(path: Path, settings: list[str], reflectance: float, keep: str) -> None:
    """Print plan, lens, white, and a grey patch of a shot with its noise over the ISO range. Raises PhotositeError."""
    shot = load_shot(path, settings)
    with located(path, settings):
        planned = plan(shot)
    out = console()
    steps = Table(title=f"Plan of {escape(shot.name)}")
    for column in ("stage", "", "why"):
        steps.add_column(column)
    for step in planned.steps:
        steps.add_row(
            escape(step.stage), "kept" if step.kept else "skipped", escape(step.why), style=None if step.kept else "dim"
        )
    out.print(steps)
    out.print(_facts("Lens", lens_facts(shot, planned)))
    out.print(_facts("A white surface at the centre", white_facts(shot, planned)))
    _show_patch(out, shot, planned, reflectance, keep)
    for note in planned.optics.scene.notes:
        out.print(f"note: {escape(note)}")
    for warning in shot_warnings(shot):
        out.print(f"warning: {escape(warning)}")


def _show_patch(out: Console, shot: Shot, planned: Plan, reflectance: float, keep: str) -> None:
    from simulator.command_line.patch_numbers import budget_table, channel_names, patch_facts, shown_isos
    from simulator.grey_patch import grey_patch
    from simulator.noise_budget import iso_budgets

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
