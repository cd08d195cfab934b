"""What a benchmark leaves: a table on stdout, a JSON file, a bar chart."""

import json
import os
import platform
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

OURS, PEER = ("#7fb7c9", "#3d8ba6", "#1a5468"), ("#dccdb0", "#c8b08a", "#a08558")  # by light, brightest first


@dataclass
class Section:
    """One contest: rows of Timing.summary, with ratio (wall) and cpu_ratio of a row to the first row.

    compared: whether it compares whole frames with those of peers, and so is drawn.
    """

    title: str
    light: str
    rows: list[dict]
    compared: bool = False

    def __post_init__(self) -> None:
        first = self.rows[0]
        for row in self.rows:
            row["ratio"] = row["best_s"] / first["best_s"]
            row["cpu_ratio"] = row["cpu_s"] / first["cpu_s"]


@dataclass
class Report:
    """Everything one run measured. verdicts: (what, figure, asked, reached) for each target; notes: what was left out."""

    width: int
    height: int
    sections: list[Section] = field(default_factory=list)
    verdicts: list[dict] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def as_json(self) -> dict:
        """Plain data."""
        return {
            "machine": {"processor": _processor(), "cores": os.cpu_count(), "load": os.getloadavg()},
            "numpy": np.__version__,
            "photosites": [self.width, self.height],
            "sections": [vars(section) for section in self.sections],
            "verdicts": self.verdicts,
            "notes": self.notes,
        }

    def show(self, console: "Console") -> None:
        """Tables on the console."""
        from rich.table import Table

        console.print(f"{self.width} x {self.height} photosites on {os.cpu_count()} cores of {_processor()}")
        for section in self.sections:
            table = Table(title=f"{section.title}; {section.light}", title_justify="left")
            table.add_column("")
            for heading in ("Mpixel/s", "median", "CPU ms", "time ratio", "CPU ratio", "mean error", "variance"):
                table.add_column(heading, justify="right")
            for row in section.rows:
                table.add_row(*_cells(row))
            console.print(table)
        for verdict in self.verdicts:
            word = "reached" if verdict["reached"] else "missed"
            console.print(f"{verdict['what']}: {verdict['figure']} (asked: {verdict['asked']}): {word}")
        for note in self.notes:
            console.print(f"left out: {note}")

    def write(self, stem: Path) -> list[Path]:
        """<stem>.json and <stem>.png; the chart needs matplotlib."""
        stem.parent.mkdir(parents=True, exist_ok=True)
        written = [stem.with_suffix(".json")]
        written[0].write_text(json.dumps(self.as_json(), indent=1) + "\n", encoding="utf-8")
        try:
            written.append(_chart(self, stem.with_suffix(".png")))
        except ImportError:
            self.notes.append("the chart, because matplotlib is missing: pip install 'photosite[bench]'")
        return written


def _processor() -> str:
    """Name of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _cells(row: dict) -> list[str]:
    mean_error, variance = row.get("mean_error", None), row.get("variance", None)
    return [
        row["name"],
        f"{row['mpixel_per_s']:.1f}",
        f"{row['median_mpixel_per_s']:.1f}",
        f"{1e3 * row['cpu_s']:.0f}",
        f"{row['ratio']:.2f}",
        f"{row['cpu_ratio']:.2f}",
        "" if mean_error is None else f"{mean_error:+.4f}",
        "" if variance is None else f"{variance:.4f}",
    ]


def _chart(report: Report, path: Path) -> Path:
    """Bars of Mpixel/s: a panel for each contest of whole frames, a bar for each light level."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    contests: dict[str, list[Section]] = {}
    for section in report.sections:
        if section.compared:
            contests.setdefault(section.title, []).append(section)
    counts = [len(sections[0].rows) for sections in contests.values()]
    layout = {"height_ratios": [count + 0.5 for count in counts]}
    size = (9.5, 1.0 + 0.55 * sum(counts) + 0.35 * len(counts))
    figure, axes = plt.subplots(len(counts), 1, figsize=size, sharex=True, gridspec_kw=layout, squeeze=False)
    for axis, (title, sections) in zip(axes[:, 0], contests.items(), strict=True):
        _bars(axis, title, sections)
    axes[-1, 0].set_xlabel("million photosites per second, best of the run (longer is better)")
    fastest = max(row["mpixel_per_s"] for sections in contests.values() for section in sections for row in section.rows)
    axes[-1, 0].set_xlim(0, 1.15 * fastest)
    figure.suptitle(f"{report.width} x {report.height} photosites, {os.cpu_count()} cores of {_processor()}", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def _bars(axis: "Axes", title: str, sections: list[Section]) -> None:
    """One panel."""
    thick = 0.8 / len(sections)
    for place, section in enumerate(sections):
        for line, row in enumerate(section.rows):
            ours, y = row["name"].startswith("Photosite"), line + (place - 1) * thick
            axis.barh(y, row["mpixel_per_s"], 0.9 * thick, color=OURS[place] if ours else PEER[place])
            times = "" if ours else f"  {row['ratio']:.1f} times slower"
            axis.text(row["mpixel_per_s"], y, f" {row['mpixel_per_s']:.0f}, {section.light}{times}", va="center", fontsize=7)
    axis.set_yticks(range(len(sections[0].rows)), [row["name"] for row in sections[0].rows], fontsize=8)
    axis.set_title(title, loc="left", fontsize=9, fontweight="bold")
    axis.invert_yaxis()
    axis.spines[["top", "right"]].set_visible(False)
