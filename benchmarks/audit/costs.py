"""Costs of an audit's shots alone: predicted times beside measured ones, without truths."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from audit.drawn_shots import DrawnShot
from audit.measured_shot import COSTLY_MS, METHODS, MOST_MS, least_time, method_of, run
from audit.shot_truth import NoTruthError
from audit.summary import ASKED_FACTOR, ASKED_RANKED, median_factor, ranked_share
from simulator import load_shot
from simulator.device import Device
from simulator.pipeline.planner import measure, plan


@dataclass(frozen=True)
class Cost:
    """Predicted and measured time of a shot, as of `Record` [ms]."""

    seed: int
    number: int
    kinds: tuple[str, ...]
    method: str
    cost_ms: float
    cpu_ms: float

    def as_json(self) -> dict:
        """Plain data."""
        return asdict(self)


def measure_cost(drawn: DrawnShot, folder: Path, device: Device) -> Cost:
    """Take a drawn shot for its time. Raises NoTruthError of one that takes too long."""
    shot = load_shot(drawn.write(folder))
    planned = measure(plan(shot), device)
    if planned.cost_ms() > MOST_MS:
        raise NoTruthError(f"predicted to take {1e-3 * planned.cost_ms():.2g} s")
    if planned.cost_ms() <= COSTLY_MS:
        run(planned, shot, device)  # compiles the kernels
    _, cpu_ms, _ = least_time(planned, shot, device)
    return Cost(drawn.seed, drawn.number, drawn.kinds, method_of(planned), planned.cost_ms(), cpu_ms)


def read_costs(path: Path) -> list[Cost]:
    """Return the records of a file."""
    lines = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    return [Cost(**line | {"kinds": tuple(line["kinds"])}) for line in lines if "cpu_ms" in line]


def show_costs(costs: Sequence[Cost], console: Console) -> bool:
    """Print a table by method, shots that are farthest off, and both figures; returns whether what is asked is reached."""
    table = Table(title="predicted times, by method", title_justify="left")
    for heading in ("method", "shots", "pairs ranked", "median factor", "median measured / predicted"):
        table.add_column(heading, justify="left" if heading == "method" else "right")
    ranked = factor = 0.0
    for method in (*METHODS, "all"):
        own = [one for one in costs if method in (one.method, "all")]
        if not own:
            continue
        predicted, measured = [one.cost_ms for one in own], [one.cpu_ms for one in own]
        ranked, factor = ranked_share(predicted, measured), median_factor(predicted, measured)
        ratios = sorted(one.cpu_ms / one.cost_ms for one in own)
        table.add_row(method, str(len(own)), f"{100 * ranked:.0f} %", f"{factor:.2f}", f"{ratios[len(own) // 2]:.2f}")
    console.print(table)
    for one in sorted(costs, key=lambda one: -abs(median_factor([one.cost_ms], [one.cpu_ms])))[:5]:
        console.print(
            f"{one.seed}:{one.number} {one.method}: predicted {one.cost_ms:.3g} ms, {one.cpu_ms:.3g} ms; {', '.join(one.kinds)}"
        )
    return ranked >= ASKED_RANKED and factor <= ASKED_FACTOR
