"""Error of Poisson samplers against their time: ours, the usual shortcuts, NumPy.

For 30 means from 0 to 1e6 electrons: total variation distance to the exact distribution and relative error of the
variance, computed in float64 from the samplers' own arithmetic, not sampled; and the time of one count in CPU time (all cores
added up), Philox and normal number included. NumPy's sampler is exact. Writes poisson.json and poisson.png.

    python benchmarks/poisson.py [--out build/benchmarks]
"""

import argparse
import json
from pathlib import Path

import numpy as np
from measuring.contest import Contestant, contest
from measuring.samplers import SHORTCUTS, Probe, Sampler, errors, from_normals, from_words, photosite
from rich.console import Console
from rich.progress import track

from simulator.device import Device, open_device
from simulator.sensor.stages.poisson_variants import POISSON_SWITCH_E, PoissonVariant

MEANS = np.concatenate([[0.0], np.geomspace(1e-2, 1e6, 29)]).astype(np.float32)
SIZE = 2**21
ASKED_DISTANCE, ASKED_VARIANCE = 2e-4, 5e-4


def variant_of(mean: float) -> PoissonVariant:
    """The cheapest variant that a tile of this mean gets."""
    fitting = [variant for variant in PoissonVariant if photosite(variant).low <= mean < photosite(variant).high]
    return max(fitting, key=lambda variant: (variant != PoissonVariant.ALL, int(variant)))


def error_of(device: Device, sampler: Sampler, mean: float) -> tuple[float, float]:
    """Distance and variance error of a sampler at a mean."""
    if sampler.of_word and mean < POISSON_SWITCH_E:
        return errors(*from_words(Probe(device, sampler.of_word, "word"), mean), mean)
    return errors(*from_normals(Probe(device, sampler.of_normal, "w"), mean), mean)


def timed(device: Device, rounds: int) -> dict[str, float]:
    """CPU time per count [ns] of every sampler on the device, by name, measured in turns; best of several."""
    counts, contestants = device.empty((SIZE,), np.float32), []
    for sampler in [*(photosite(variant) for variant in PoissonVariant), *SHORTCUTS]:
        probe = Probe(device, sampler.draw)
        level = 0.99 * sampler.high if sampler.high < np.inf else max(100.0, sampler.low)
        means = device.upload(np.full(SIZE, level, np.float32))

        def run(probe=probe, means=means) -> None:
            probe.enqueue(means, counts, SIZE)
            device.finish()

        contestants.append(Contestant(sampler.name, run, lambda: counts))
    return {name: 1e9 * min(timing.cpu_s) / SIZE for name, timing in contest(contestants, rounds).items()}


def numpy_times(rounds: int) -> dict[float, float]:
    """CPU time per count [ns] of NumPy's Generator.poisson at each mean."""
    rng = np.random.default_rng(1)
    contestants = [
        Contestant(f"{mean:g}", lambda mean=mean: rng.poisson(mean, SIZE // 16), lambda: None) for mean in MEANS.tolist()
    ]
    found = contest(contestants, rounds)
    return {mean: 1e9 * min(found[f"{mean:g}"].cpu_s) / (SIZE // 16) for mean in MEANS.tolist()}


def _row(sampler: Sampler, mean: float, distance: float, variance: float, nanoseconds: dict[str, float]) -> dict:
    return {
        "sampler": sampler.name,
        "mean_e": mean,
        "distance": distance,
        "variance_error": variance,
        "ns_per_count": nanoseconds[sampler.name],
    }


def rows_of(device: Device, rounds: int) -> list[dict]:
    """One row per sampler and mean."""
    nanoseconds, rows = timed(device, rounds), []
    for mean in track(MEANS.tolist(), "distributions", console=Console(stderr=True)):
        chosen, mixed = photosite(variant_of(mean)), photosite(PoissonVariant.ALL)
        for sampler in (chosen, *SHORTCUTS):
            if sampler.low <= mean < sampler.high:
                rows.append(_row(sampler, mean, *error_of(device, sampler, mean), nanoseconds))
        rows.append({**next(row for row in rows if row["sampler"] == chosen.name and row["mean_e"] == mean)})
        rows[-1].update(sampler=mixed.name, ns_per_count=nanoseconds[mixed.name])  # the same numbers, in more steps
    for mean, ns in numpy_times(rounds).items():
        rows.append({"sampler": "NumPy", "mean_e": mean, "distance": 0.0, "variance_error": 0.0, "ns_per_count": ns})
    return rows


def chart(rows: list[dict], label: str, path: Path) -> None:
    """Three panels: distance and variance error against the mean, distance against time."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    families = {"Photosite": "#1f6f8b", "normal, rounded": "#b5483a", "Giles Q1": "#d59a3a", "Giles Q2": "#7a9e4e"}
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.6))
    for family, colour in families.items():
        mine = [row for row in rows if row["sampler"].startswith(family)]
        means = [max(row["mean_e"], 3e-3) for row in mine]
        distances = [max(row["distance"], 1e-8) for row in mine]
        axes[0].plot(means, distances, "o-", color=colour, ms=3, lw=1, label=family)
        axes[1].plot(means, [max(abs(row["variance_error"]), 1e-8) for row in mine], "o-", color=colour, ms=3, lw=1)
        axes[2].plot([row["ns_per_count"] for row in mine], distances, "o", color=colour, ms=4, alpha=0.7)
    for row in rows:
        if row["sampler"].startswith("NumPy"):
            axes[2].axvline(row["ns_per_count"], color="#999999", lw=0.5)
    axes[2].plot([], [], color="#999999", lw=0.5, label="NumPy, exact, one line per mean")
    for axis, asked in ((axes[0], ASKED_DISTANCE), (axes[1], ASKED_VARIANCE), (axes[2], ASKED_DISTANCE)):
        axis.axhline(asked, color="black", lw=0.8, ls=":", label=f"asked: {asked:g}")
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_ylim(0.6e-8, 2)
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(fontsize=8, loc="upper right")
    axes[2].set_xlim(2, 200)
    axes[2].set_xticks([2, 5, 10, 20, 50, 100, 200], ["2", "5", "10", "20", "50", "100", "200"])
    axes[2].minorticks_off()
    axes[0].set(xlabel="mean [e-] (leftmost: 0)", ylabel="total variation distance to Poisson")
    axes[1].set(xlabel="mean [e-]", ylabel="relative error of the variance")
    axes[2].set(xlabel="CPU time of a count [ns]", ylabel="total variation distance, one dot per mean")
    figure.suptitle(f"Poisson samplers: error against time. {label}", fontsize=10)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="turns of each sampler")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for poisson.json and poisson.png")
    options = parser.parse_args()
    device = open_device()
    rows = rows_of(device, options.rounds)
    print(f"{'sampler':32}{'means':>20}{'worst distance':>17}{'worst variance':>17}{'ns/count':>11}")
    for name in dict.fromkeys(row["sampler"] for row in rows):
        mine = [row for row in rows if row["sampler"] == name]
        span = f"{mine[0]['mean_e']:.3g} to {mine[-1]['mean_e']:.3g}"
        distance, variance = (max(abs(row[key]) for row in mine) for key in ("distance", "variance_error"))
        slowest = max(row["ns_per_count"] for row in mine)
        print(f"{name:32}{span:>20}{distance:17.2e}{variance:17.2e}{slowest:11.2f}")
    ours = [row for row in rows if row["sampler"].startswith("Photosite")]
    for key, asked in (("distance", ASKED_DISTANCE), ("variance_error", ASKED_VARIANCE)):
        worst = max(ours, key=lambda row: abs(row[key]))
        word = "reached" if abs(worst[key]) < asked else "missed"
        print(f"worst {key} {worst[key]:.2e} at a mean of {worst['mean_e']:.3g} (asked: {asked:g}): {word}")
    options.out.mkdir(parents=True, exist_ok=True)
    record = {"device": device.info.label, "rows": rows}
    (options.out / "poisson.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    chart(rows, device.info.label, options.out / "poisson.png")
    print(f"wrote {options.out}/poisson.json, {options.out}/poisson.png")


if __name__ == "__main__":
    main()
