"""Helpers for the figures of reports. matplotlib is an optional dependency, imported when the first figure is made."""

import io
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from simulator.atomic_files import atomic_write
from simulator.errors import PhotositeError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED, TRUTH, ALLOWED, FAILED = "#0b5fa5", "#333333", "#dde7f0", "#c0392b"


def new_figure(rows: int, columns: int, width_in: float, height_in: float) -> tuple["Figure", list["Axes"]]:
    """Return an empty figure and its axes, row by row. Raises PhotositeError when matplotlib is missing."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise PhotositeError("plots need matplotlib, which is not installed: pip install 'photosite[report]'") from error
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.grid(True, which="major", color="#e5e5e5", linewidth=0.7)
        one.set_axisbelow(True)
    return figure, axes


def iso_axis(axes: "Axes", isos: Sequence[int]) -> None:
    """Make the x axis a logarithmic ISO axis, labelled every two stops."""
    low, high = min(isos), max(isos)
    dial = [100.0 * 4.0**power for power in range(-2, 9) if 0.9 * low <= 100 * 4**power <= 1.1 * high]
    axes.set(xscale="log", xlabel="ISO", xlim=(low / 1.25, high * 1.25))
    axes.set_xticks(dial, [f"{iso:g}" for iso in dial], minor=False)
    axes.set_xticks([], minor=True)


def decade_axis(axes: "Axes", low: float, high: float) -> None:
    """Make the y axis logarithmic, for one or two decades, labelled with plain numbers at 1, 2 and 5."""
    ticks = [step * 10.0**power for power in range(-6, 8) for step in (1, 2, 5)]
    kept = [tick for tick in ticks if low / 1.3 <= tick <= high * 1.3]
    axes.set(yscale="log", ylim=(low / 1.3, high * 1.3))
    axes.set_yticks(kept, [f"{tick:g}" for tick in kept], minor=False)
    axes.set_yticks([], minor=True)


def svg_of(figure: "Figure") -> str:
    """Return a figure as an SVG element to stand in an HTML page, with the same bytes each time."""
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "photosite", "svg.fonttype": "none"}):
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def write_figure(figure: "Figure", path: str | os.PathLike) -> None:
    """Write a figure in the format of the suffix, with the same bytes each time. Raises PhotositeError."""
    with atomic_write(path) as temporary:
        figure.savefig(temporary, dpi=120, metadata={"Software": None} if str(path).endswith(".png") else {"Date": None})
