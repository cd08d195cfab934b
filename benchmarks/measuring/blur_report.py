"""What the benchmark of the lens blur concludes and draws; rows as `benchmarks/defocus.py` measures them."""

from pathlib import Path

import numpy as np

ASKED_P99 = 0.3
ASKED_SENSOR, ASKED_SCIPY, ASKED_MITSUBA = 5.0, 30.0, 100.0  # times the sensor kernel; times faster at equal error
SERIES = (
    ("Photosite", "", "o", "#c8102e"),
    ("SciPy", ", add", "s", "#5a6472"),
    ("SciPy", ", over", "D", "#9aa5b1"),
    ("Mitsuba", "", "^", "#1a5468"),
)


def verdicts(radii: list[dict], rows: list[dict]) -> list[dict]:
    """What was asked, in processor time, which other programs hardly change."""
    of_sensor = {row["radius_px"]: row["cpu_s"] / row["sensor_cpu_s"] for row in radii}
    layers = [row for row in rows if row["name"].startswith("Photosite, layers")]
    ours = min((row for row in layers if row["p99"] <= ASKED_P99), key=lambda row: row["cpu_s"])
    slabs = min((row for row in rows if row["name"].startswith("SciPy")), key=lambda row: row["p99"])
    growth, faster = of_sensor[32.0] / of_sensor[16.0], slabs["cpu_s"] / ours["cpu_s"]
    told = f"p99 {slabs['p99']:.2f} to {ours['p99']:.2f}"
    found = [
        (
            "one radius of 16 px, against the sensor kernel",
            f"{of_sensor[16.0]:.1f} x",
            "at most 5 x",
            of_sensor[16.0] <= ASKED_SENSOR,
        ),
        ("time at 32 px over that at 16 px", f"{growth:.2f}", "at most 2", growth <= 2.0),
        ("layers, against SciPy's most exact slabs", f"{faster:.1f} x faster, {told}", "30 x", faster >= ASKED_SCIPY),
    ]
    if any(row["name"].startswith("Mitsuba") for row in rows):
        faster = at_equal_error(rows, ours["p99"]) / ours["cpu_s"]
        found.append(
            ("layers, against Mitsuba at equal error", f"{round(faster, -2):,.0f} x faster", "100 x", faster >= ASKED_MITSUBA)
        )
    return [dict(zip(("what", "figure", "asked", "reached"), one, strict=True)) for one in found]


def at_equal_error(rows: list[dict], p99: float) -> float:
    """Processor time that Mitsuba needs for this error [s], by the power law through its two longest renders."""
    first, last = [row for row in rows if row["name"].startswith("Mitsuba")][-2:]
    slope = np.log(last["cpu_s"] / first["cpu_s"]) / np.log(last["p99"] / first["p99"])
    return float(last["cpu_s"] * (p99 / last["p99"]) ** slope)


def chart(rows: list[dict], path: Path) -> None:
    """Run time against error."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    for method, last, marker, colour in SERIES:
        own = [row for row in rows if row["name"].startswith(method) and row["name"].endswith(last)]
        if not own:
            continue
        line = "none" if method == "Photosite" else ":"
        times, errors = [row["cpu_s"] for row in own], [row["p99"] for row in own]
        axes.plot(times, errors, marker=marker, color=colour, linestyle=line, label=f"{method}{last}")
        for row in own:
            text = row["name"].split(", ", 1)[1].removesuffix(last).removeprefix("slabs of ")
            axes.annotate(text, (row["cpu_s"], row["p99"]), textcoords="offset points", fontsize=8, **_beside(text, last))
    axes.set(xscale="log", yscale="log", xlabel="processor time, 12 megapixels [s]", ylabel="p99 of |z| at 2000 e⁻")
    axes.axhline(ASKED_P99, color="0.7", linewidth=1)
    axes.margins(x=0.35, y=0.12)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)


def _beside(text: str, last: str) -> dict[str, object]:
    """Where a label stands, so that none lies on another."""
    if last == ", add":
        return {"xytext": (-5, 5), "ha": "right"} if text.startswith("4") else {"xytext": (5, 5)}
    if last:
        return {"xytext": (0, -14), "ha": "center"}
    if text.startswith("one picture"):
        return {"xytext": (-7, -4), "ha": "right"}
    if text.startswith("the same"):
        return {"xytext": (0, -26), "ha": "center"}
    return {"xytext": (7, 4)}
