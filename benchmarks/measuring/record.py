"""What a section of the benchmark measured: the one shape of its JSON, its table on the console, and what it concludes.

A row is one setting of one program on one case: `case`, `name`, `best_s`, `median_s`, `cpu_s` (processor time over all
threads), `runs`, and where an error is known `error`. Rows of Photosite have names that begin with "Photosite"; `is_default`
marks the setting that a user gets. Sections add fields of their own.
"""

import json
import math
import os
import platform
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import simulator
from simulator.atomic_files import atomic_write

if TYPE_CHECKING:
    from rich.console import Console

Row = dict[str, Any]
OURS = "Photosite"
OWN_MARGIN = 0.9  # a setting of ours dominates another of ours where it takes and errs less than this share of it
TIE = 0.95  # times of which the lesser is more than this share of the greater are one time, as runs of one program are
SHAPE = 2  # of the JSON; a record of another shape is left out of the page
ERROR_COLUMNS = {
    "case": ["scene", ""],
    "name": ["method", ""],
    "best_s": ["time [s]", ".3g"],
    "cpu_s": ["processor time [s]", ".3g"],
}


@dataclass
class Record:
    """One section.

    section: name, of its files too. heading, text: of the page. text may name facts in braces.
    error: what `error` of the rows is, with its unit; empty: it has none.
    columns: of the table, key of the rows to heading and number format; empty: no table.
    chart: "error", "scaling", "rates" or empty. x: what `x` of the rows is, of the chart of scaling.
    verdicts: what, figure, asked, reached. notes: what was left out. facts: numbers about the whole section.
    """

    section: str
    heading: str
    text: str
    error: str = ""
    columns: dict[str, list[str]] = field(default_factory=dict)
    chart: str = ""
    rows: list[Row] = field(default_factory=list)
    verdicts: list[dict] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)

    def add(self, case: str, name: str, timing: dict[str, float], **more: Any) -> Row:
        """Add a row; returns it."""
        self.rows.append({"case": case, "name": name, **timing, **more})
        return self.rows[-1]

    def judge(self, what: str, figure: str, asked: str, reached: bool) -> None:
        """Note a verdict."""
        self.verdicts.append({"what": what, "figure": figure, "asked": asked, "reached": bool(reached)})

    def note(self, text: str) -> None:
        """Remember once what was left out."""
        if text not in self.notes:
            self.notes.append(text)

    def cases(self) -> dict[str, list[Row]]:
        """Rows by case."""
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            found.setdefault(row["case"], []).append(row)
        return found

    def mark_dominated(self) -> None:
        """Say of each row of ours which rows dominate it, and judge the defaults of each case."""
        for case, rows in self.cases().items():
            ours = [row for row in rows if is_ours(row) and "error" in row]
            for row in ours:
                row["dominated_by"] = [other["name"] for other in dominating(row, rows)]
            defaults = [row for row in ours if row.get("is_default")]
            beaten = [f"{row['name']}: by {', '.join(row['dominated_by'])}" for row in defaults if row["dominated_by"]]
            if defaults:
                self.judge(f"{case}: default dominated", "; ".join(beaten) or "by none", "by none", not beaten)

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"shape": SHAPE, **vars(self), "machine": machine(), "commit": commit()}

    def write(self, folder: Path, size: str, seconds: float, cpu_seconds: float) -> Path:
        """<folder>/<section>.json. size: quick, standard or full. seconds, cpu_seconds: that the section took."""
        folder.mkdir(parents=True, exist_ok=True)
        written = folder / f"{self.section}.json"
        with atomic_write(written) as path:
            data = self.as_json() | {"size": size, "seconds": round(seconds, 1), "cpu_seconds": round(cpu_seconds, 1)}
            path.write_text(json.dumps(data, indent=1, default=plain) + "\n", encoding="utf-8")
        return written

    def show(self, console: "Console") -> None:
        """Table and verdicts on the console."""
        from rich.table import Table

        if self.columns:
            headings, *lines = table_of(vars(self))
            table = Table(*headings, title=self.heading, title_justify="left")
            for line in lines:
                table.add_row(*line)
            console.print(table)
        for verdict in self.verdicts:
            word = "reached" if verdict["reached"] else "missed"
            console.print(f"{verdict['what']}: {verdict['figure']} (asked: {verdict['asked']}): {word}")
        for note in self.notes:
            console.print(f"left out: {note}")


def plain(value: Any) -> Any:
    """NumPy's numbers and arrays for JSON."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def is_ours(row: Row) -> bool:
    """Whether a row is Photosite's."""
    return row["name"].startswith(OURS)


def dominating(row: Row, rows: Iterable[Row]) -> list[Row]:
    """Rows of the same case that are neither slower, in processor time, nor more wrong, and better in one; of ours, in both."""
    found = []
    for other in rows:
        share = OWN_MARGIN if is_ours(other) and is_ours(row) else 1.0
        if other is row or other["case"] != row["case"] or "error" not in other:
            continue
        is_better = other["cpu_s"] < TIE * row["cpu_s"] or other["error"] < TIE * row["error"]
        if is_better and all(other[key] <= share * row[key] for key in ("cpu_s", "error")):
            found.append(other)
    return found


def table_of(record: dict[str, Any]) -> list[list[str]]:
    """Cells of a record's table, headings first; of a dominated setting the error has a star."""
    columns = record["columns"]
    lines = [[heading for heading, _ in columns.values()]]
    for row in record["rows"]:
        if any(key in row for key in columns if key not in ("case", "name")):
            lines.append([_cell(row, key, form) for key, (_, form) in columns.items()])
    return lines


def _cell(row: Row, key: str, form: str) -> str:
    if key not in row or row[key] is None:
        return ""
    value = row[key]
    if isinstance(value, str):
        return value
    if form.endswith("g"):
        text = f"{value:{form}}" if abs(value) < 1000 else f"{value:,.0f}"
    else:
        text = f"{value:{form}}"
    return f"{text} *" if key == "error" and row.get("dominated_by") else text


def slope(sizes: Iterable[float], times_s: Iterable[float]) -> float:
    """Slope of the logarithm of time over that of size, least squares over sizes above 0: 1 is in proportion."""
    kept = [(math.log(size), math.log(time_s)) for size, time_s in zip(sizes, times_s, strict=True) if size > 0]
    return float(np.polyfit(*np.array(kept).T, 1)[0])


def z_errors(found: np.ndarray, truth: np.ndarray, electrons: float, read_noise_e: float = 2.0) -> dict[str, float]:
    """Deviation in units of each photosite's noise: p99.9 of its size as `error`, p99 and rms.

    found, truth: light of one shape, in any unit. electrons: of light 1 in that unit [e-].
    """
    mean_e = electrons * np.asarray(truth, np.float64)
    z = np.abs(electrons * np.asarray(found, np.float64) - mean_e) / np.sqrt(np.maximum(mean_e, 0.0) + read_noise_e**2)
    return {"error": float(np.quantile(z, 0.999)), "p99": float(np.quantile(z, 0.99)), "rms": float(np.sqrt((z**2).mean()))}


Z_ERROR = "p99.9 of abs(z) [σ]"


def machine() -> dict[str, Any]:
    """Processor, cores, load and versions."""
    versions = {"python": platform.python_version(), "numpy": np.__version__}
    return {"processor": _processor(), "cores": os.cpu_count(), "load": os.getloadavg(), "versions": versions}


def _processor() -> str:
    """Name of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def commit() -> dict[str, Any]:
    """Commit of the checkout whose simulator is measured, its date [ms since 1970], and whether files differ from it."""
    root = Path(simulator.__file__).resolve().parents[1]
    try:
        lines = [_git(root, "log", "-1", "--format=%H %ct"), _git(root, "status", "--porcelain", "--untracked-files=no")]
    except (OSError, subprocess.CalledProcessError):
        return {"hash": "unknown", "date": 0, "is_changed": False}
    name, date = lines[0].split()
    return {"hash": name, "date": 1000 * int(date), "is_changed": bool(lines[1])}


def _git(root: Path, *arguments: str) -> str:
    return subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=True).stdout.strip()
