"""Charts of a record: run time against error, scaling, and rates of whole frames. All need matplotlib."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from measuring.record import OURS, Z_ERROR, Record, Row, is_ours, slope

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RED = "#c8102e"
PEER_COLOURS = ("#1a5468", "#8a6d3b", "#5a6472", "#6b8e23", "#7b5ea7", "#3d8ba6", "#b07aa1")
PEER_MARKERS = "sD^vP<>"
LIGHTS_OURS, LIGHTS_PEER = ("#7fb7c9", "#3d8ba6", "#1a5468"), ("#dccdb0", "#c8b08a", "#a08558")  # brightest first
LEAST_DECADES = (1.0, 2.0)  # of the axes of time and error
LEAST_ERROR = {Z_ERROR: 1e-4}  # what is below counts as this in the charts
NEAR = (0.09, 0.035)  # shares of the axes within which a second label is left out


def draw(record: Record, folder: Path) -> Path | None:
    """Write <folder>/<section>.png, as the record asks; None where it asks for none, or matplotlib is missing."""
    figures = {"error": time_against_error, "scaling": scaling, "rates": rates}
    if record.chart not in figures or not record.rows:
        return None
    try:
        import matplotlib as mpl
    except ImportError:
        record.note("the chart, because matplotlib is missing: pip install 'photosite[bench]'")
        return None
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure = figures[record.chart](record)
    path = folder / f"{record.section}.png"
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path


def _panels(count: int) -> tuple["Figure", list["Axes"]]:
    """A figure with so many axes, and the axes."""
    from matplotlib import pyplot as plt

    columns = {1: 1, 2: 2, 4: 2}.get(count, 3)
    rows = math.ceil(count / columns)
    size = (max(4.4 * columns, 6.4), 3.6 * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    for axis in axes.ravel()[count:]:
        axis.set_visible(False)
    for axis in axes.ravel():
        axis.spines[["top", "right"]].set_visible(False)
    return figure, list(axes.ravel()[:count])


def family_of(row: Row) -> str:
    """What settings of one program share in their names: all before the first comma, or what the row says itself."""
    return row.get("family") or row["name"].split(", ")[0]


def time_against_error(record: Record) -> "Figure":
    """Both logarithmic, a panel for each case; lower left is better. Defaults are ringed, dominated settings hollow.

    An error of 0 stands below all others, one below LEAST_ERROR at that.
    """
    from matplotlib.ticker import NullFormatter

    cases = {case: [row for row in rows if "error" in row] for case, rows in record.cases().items()}
    cases = {case: rows for case, rows in cases.items() if rows}
    families = list(dict.fromkeys(family_of(row) for rows in cases.values() for row in rows))
    peers = [family for family in families if not family.startswith(OURS)]
    figure, axes = _panels(len(cases))
    for axis, (case, rows) in zip(axes, cases.items(), strict=True):
        positive = [row["error"] for row in rows if row["error"] > 0]
        floor = LEAST_ERROR.get(record.error, 0.3 * min(positive, default=1e-6))
        for family in families:
            own = [row for row in rows if family_of(row) == family]
            if not own:
                continue
            place = peers.index(family) % len(PEER_MARKERS) if family in peers else 0
            colour, marker = (PEER_COLOURS[place], PEER_MARKERS[place]) if family in peers else (RED, "o")
            points = [(row["cpu_s"], max(row["error"], floor)) for row in own]
            axis.plot(*zip(*points, strict=True), color=colour, linewidth=0.8, label=family)
            for row, point in zip(own, points, strict=True):
                face = "white" if row.get("dominated_by") else colour
                axis.plot(*point, marker=marker, color=colour, markerfacecolor=face, markersize=6)
                if row.get("is_default"):
                    axis.plot(*point, marker="o", color="black", markerfacecolor="none", markersize=12, markeredgewidth=0.8)
        times, errors = ([row["cpu_s"] for row in rows], [max(row["error"], floor) for row in rows])
        limits = [_limits(values, least) for values, least in zip((times, errors), LEAST_DECADES, strict=True)]
        axis.set(xscale="log", yscale="log", xlim=limits[0], ylim=limits[1])
        for one in (axis.xaxis, axis.yaxis):
            one.set_minor_formatter(NullFormatter())
        axis.set_title(case, fontsize=9, loc="left")
        _label(axis, rows, floor)
    figure.supxlabel("processor time [s]", fontsize=9)
    figure.supylabel(record.error, fontsize=9)
    handles, labels = [], []
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            if label not in labels:
                handles.append(handle)
                labels.append(label)
    figure.legend(handles, labels, frameon=False, fontsize=8, loc="outside upper center", ncols=5)
    return figure


def _limits(values: Sequence[float], least_decades: float) -> tuple[float, float]:
    """Limits of a logarithmic axis with room for labels, over so many decades at least."""
    low, high = math.log10(min(values)), math.log10(max(values))
    wider = 0.5 * max(least_decades - (high - low), 0.0)
    room = 0.12 * max(high - low, least_decades)
    return 10.0 ** (low - wider - room), 10.0 ** (high + wider + 2.0 * room)


def _label(axis: "Axes", rows: list[Row], floor: float) -> None:
    """Name settings beside their points, the default and ours first; none where another one stands."""
    to_share, placed = axis.transAxes.inverted(), []
    order = sorted(rows, key=lambda row: (not row.get("is_default"), not is_ours(row)))
    for row in order:
        point = row["cpu_s"], max(row["error"], floor)
        place = to_share.transform(axis.transData.transform(point))
        if any(abs(place[0] - other[0]) < NEAR[0] and abs(place[1] - other[1]) < NEAR[1] for other in placed):
            continue
        placed.append(place)
        text = row["name"].removeprefix(family_of(row)).removeprefix(", ")
        axis.annotate(text, point, xytext=(6, 3), textcoords="offset points", fontsize=6.5)


def scaling(record: Record) -> "Figure":
    """Processor time over what grows, both logarithmic, a panel for each case; slopes are those of all sizes above 0.

    A size of 0 stands at the left edge. Rows that say `is_wall` are drawn with their wall time.
    """
    cases = record.cases()
    figure, axes = _panels(len(cases))
    for axis, (case, rows) in zip(axes, cases.items(), strict=True):
        left = 0.5 * min(row["x"] for row in rows if row["x"] > 0)
        for place, family in enumerate(dict.fromkeys(family_of(row) for row in rows)):
            own = [row for row in rows if family_of(row) == family]
            times = [row["best_s" if row.get("is_wall") else "cpu_s"] for row in own]
            sizes = [row["x"] for row in own]
            label = family
            if sum(size > 0 for size in sizes) > 1:
                label += f", slope {slope(sizes, times):.2f}"
            colour = RED if place == 0 else PEER_COLOURS[place % len(PEER_COLOURS)]
            axis.plot([max(size, left) for size in sizes], times, "o-", color=colour, label=label, markersize=4)
        drawn = [row["best_s" if row.get("is_wall") else "cpu_s"] for row in rows]
        axis.set(xscale="log", yscale="log", xlabel=case, ylim=_limits(drawn, LEAST_DECADES[0]))
        sizes = sorted({row["x"] for row in rows})
        axis.set_xticks([max(size, left) for size in sizes], [f"{size:.3g}" for size in sizes], fontsize=7)
        axis.minorticks_off()
        axis.legend(frameon=False, fontsize=7)
        wall = any(row.get("is_wall") for row in rows)
        axis.set_ylabel("time [s]" if wall else "processor time [s]", fontsize=8)
    return figure


def rates(record: Record) -> "Figure":
    """Bars of `mpixel_per_s`: a panel for each `contest`, a bar for each `light`."""
    contests: dict[str, dict[str, list[Row]]] = {}
    for row in record.rows:
        if "mpixel_per_s" in row:
            contests.setdefault(row["contest"], {}).setdefault(row["light"], []).append(row)
    counts = [len(next(iter(lights.values()))) for lights in contests.values()]
    from matplotlib import pyplot as plt

    ratios: dict[str, Any] = {"height_ratios": [count + 0.5 for count in counts]}
    size = (9.5, 1.0 + 0.55 * sum(counts) + 0.35 * len(counts))
    figure, axes = plt.subplots(len(counts), 1, figsize=size, sharex=True, gridspec_kw=ratios, squeeze=False)
    for axis, (title, lights) in zip(axes[:, 0], contests.items(), strict=True):
        _bars(axis, title, lights)
    fastest = max(row["mpixel_per_s"] for row in record.rows if "mpixel_per_s" in row)
    axes[-1, 0].set(xlim=(0, 1.15 * fastest), xlabel="million photosites per second, best of the run (longer is better)")
    figure.tight_layout()
    return figure


def _bars(axis: "Axes", title: str, lights: dict[str, list[Row]]) -> None:
    """One panel."""
    thick = 0.8 / len(lights)
    for place, (light, rows) in enumerate(lights.items()):
        for line, row in enumerate(rows):
            ours, y = is_ours(row), line + (place - 1) * thick
            axis.barh(y, row["mpixel_per_s"], 0.9 * thick, color=(LIGHTS_OURS if ours else LIGHTS_PEER)[place])
            times = "" if ours else f"  {row['ratio']:.1f} times slower"
            axis.text(row["mpixel_per_s"], y, f" {row['mpixel_per_s']:.0f}, {light}{times}", va="center", fontsize=7)
    first = next(iter(lights.values()))
    axis.set_yticks(range(len(first)), [row["name"] for row in first], fontsize=8)
    axis.set_title(title, loc="left", fontsize=9, fontweight="bold")
    axis.invert_yaxis()
    axis.spines[["top", "right"]].set_visible(False)
