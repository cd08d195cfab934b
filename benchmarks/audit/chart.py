"""Chart of an audit: the error of each shot beside its prediction."""

from collections.abc import Sequence
from pathlib import Path

from audit.measured_shot import METHODS, Record

LOW, HIGH = 1e-4, 1e3  # ends of both axes [standard deviations]
MARKERS = {
    "points": ("o", "#1a5468"),
    "mean": ("s", "#3d8ba6"),
    "copy": ("D", "#7fb7c9"),
    "psf": ("P", "#a08558"),
    "swept": ("^", "#c8763b"),
    "swept_first": ("<", "#e0a080"),
    "joint": ("v", "#9b3d3d"),
    "instants": (">", "#d8a84e"),
    "sharp": ("x", "#777777"),
}
NAMES = {
    "points": "points of the aperture",
    "mean": "means over the aperture",
    "copy": "no blur",
    "psf": "point spread function",
    "swept": "motion, swept",
    "swept_first": "motion, swept before a blur",
    "joint": "motion, with the aperture's points",
    "instants": "motion, sum of instants",
    "sharp": "sharp",
}


def draw_chart(records: Sequence[Record], path: Path) -> Path:
    """Write a PNG: error against predicted error, a marker for each judged shot; rings are shots that break the promise.

    Needs matplotlib. Errors beyond the axes stand at their ends.
    """
    import matplotlib

    records = [one for one in records if one.is_judged]
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axis = plt.subplots(figsize=(7.5, 6.2))
    axis.fill_between([LOW, HIGH], [LOW, HIGH], HIGH, color="#f3e3dc", lw=0, zorder=0)
    axis.plot([LOW, HIGH], [LOW, HIGH], color="#9b3d3d", lw=1, label="error = prediction")
    axis.plot([LOW, HIGH], [0.1 * LOW, 0.1 * HIGH], color="#999999", lw=1, ls=":", label="a tenth of it")

    def place(value: float) -> float:
        return min(max(value, LOW), HIGH)

    for method in METHODS:
        own = [one for one in records if one.method == method]
        if not own:
            continue
        marker, color = MARKERS[method]
        x, y = [place(one.predicted) for one in own], [place(one.p99_9) for one in own]
        axis.scatter(x, y, 26, color=color, marker=marker, lw=1, alpha=0.8, label=f"{NAMES[method]} ({len(own)})", zorder=2)
    broken = [one for one in records if one.excess > 1.0]
    if broken:
        x, y = [place(one.predicted) for one in broken], [place(one.p99_9) for one in broken]
        axis.scatter(
            x, y, 110, facecolors="none", edgecolors="#c00000", lw=1.2, label=f"promise broken ({len(broken)})", zorder=3
        )
    axis.set(xscale="log", yscale="log", xlim=(0.8 * LOW, 1.2 * HIGH), ylim=(0.8 * LOW, 1.2 * HIGH))
    axis.set_xlabel("predicted error [σ of the photosite's noise]")
    axis.set_ylabel("error, 99.9 % of the photosites [σ]")
    axis.set_title(f"{len(records)} random shots", loc="left", fontsize=10)
    axis.grid(alpha=0.25, lw=0.5)
    axis.legend(fontsize=8, loc="upper left", framealpha=0.9)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path
