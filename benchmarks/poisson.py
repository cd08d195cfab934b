"""Error of Poisson samplers against their time: ours, the usual shortcuts, NumPy.

Total variation distance to the exact distribution and relative error of the variance, computed in float64 from the samplers'
own arithmetic, not sampled; and the time of a million counts, Philox and normal number included. NumPy's sampler is exact.
"""

import numpy as np
from measuring.contest import Contestant
from measuring.record import Record
from measuring.run import Run
from measuring.samplers import SHORTCUTS, Probe, Sampler, errors, from_normals, from_words, photosite

from simulator.device import Buffer, Device
from simulator.sensor.stages.poisson_variants import POISSON_SWITCH_E, PoissonVariant

SHOWN = (0.1, 1.0, 10.0, 100.0, 1e3, 1e5)  # means of the chart and the table [e-]
SIZE = 2**20
ASKED_DISTANCE, ASKED_VARIANCE = 2e-4, 5e-4
TEXT = """\
Total variation distance to the exact distribution (SciPy, float64) and relative error of the variance, computed from the
kernel's own arithmetic, not sampled; time of a million counts, Philox and normal number included. NumPy's sampler is exact.
Each tile of a frame gets the cheapest variant for its means. The verdicts are over {means} means from 0 to 10⁶ e⁻.
"""


def variant_of(mean: float) -> PoissonVariant:
    """The cheapest variant that a tile of this mean gets."""
    fitting = [variant for variant in PoissonVariant if photosite(variant).low <= mean < photosite(variant).high]
    return max(fitting, key=lambda variant: (variant != PoissonVariant.ALL, int(variant)))


def error_of(device: Device, sampler: Sampler, mean: float) -> tuple[float, float]:
    """Distance and variance error of a sampler at a mean."""
    if sampler.of_word and mean < POISSON_SWITCH_E:
        return errors(*from_words(Probe(device, sampler.of_word, "word"), mean), mean)
    return errors(*from_normals(Probe(device, sampler.of_normal, "w"), mean), mean)


def timed(run: Run, device: Device) -> dict[str, dict[str, float]]:
    """Times of a million counts of every sampler on the device, by name, measured in turns."""
    counts, contestants = device.empty((SIZE,), np.float32), []
    for sampler in [*(photosite(variant) for variant in PoissonVariant), *SHORTCUTS]:
        probe = Probe(device, sampler.draw)
        level = 0.99 * sampler.high if sampler.high < np.inf else max(100.0, sampler.low)
        means = device.upload(np.full(SIZE, level, np.float32))

        def draw(probe: Probe = probe, means: Buffer = means) -> None:
            probe.enqueue(means, counts, SIZE)
            device.finish()

        contestants.append(Contestant(sampler.name, draw, lambda: np.empty(0), builds=True))
    found = run.contest("samplers", contestants, turn_s=0.1)
    return {name: _of_a_million(timing.summary(), SIZE) for name, timing in found.items()}


def _of_a_million(timing: dict[str, float], count: int) -> dict[str, float]:
    """Times of a million counts from those of `count`."""
    return {key: value * 1e6 / count if key.endswith("_s") else value for key, value in timing.items()}


def numpy_times(run: Run) -> dict[float, dict[str, float]]:
    """Times of a million counts of NumPy's Generator.poisson at each mean."""
    rng, count = np.random.default_rng(1), SIZE // 16
    runs = {f"{mean:g}": lambda mean=mean: rng.poisson(mean, count) for mean in SHOWN}
    found = run.turns("NumPy", runs)
    return {mean: _of_a_million(found[f"{mean:g}"], count) for mean in SHOWN}


def measure_poisson(run: Run) -> Record:
    """Samplers at the shown means, and the worst errors of ours over all means."""
    columns = {"case": ["mean", ""], "name": ["sampler", ""], "ns_per_count": ["CPU ns per count", ".3g"]}
    columns |= {"error": ["distance", ".1e"], "variance_error": ["error of the variance", ".1e"]}
    record = Record("poisson", "Poisson: error against time", TEXT, "total variation distance to Poisson", columns, "error")
    device = run.device()
    times, numpy_s = timed(run, device), numpy_times(run)
    for mean in SHOWN:
        case, mixed = f"{mean:g} e⁻", photosite(PoissonVariant.ALL)
        chosen = photosite(variant_of(mean))
        for sampler in (chosen, *SHORTCUTS):
            if sampler.low <= mean < sampler.high:
                distance, variance = error_of(device, sampler, mean)
                timing, own = times[sampler.name], {"is_default": True} if sampler is chosen else {}
                _add(record, case, sampler.name, timing, distance, variance, **own)
                if sampler is chosen:  # the same numbers, in more steps
                    _add(record, case, mixed.name, times[mixed.name], distance, variance)
        _add(record, case, "NumPy", numpy_s[mean], 0.0, 0.0)
    means = np.concatenate([[0.0], np.geomspace(1e-2, 1e6, run.pick(6, 29, 29))]).astype(np.float32).tolist()
    record.facts["means"] = len(means)
    worst = {mean: error_of(device, photosite(variant_of(mean)), mean) for mean in means}
    for place, (what, asked) in enumerate((("distance", ASKED_DISTANCE), ("variance error", ASKED_VARIANCE))):
        mean = max(worst, key=lambda mean: abs(worst[mean][place]))
        found = abs(worst[mean][place])
        record.judge(f"worst {what}, at {mean:.3g} e⁻", f"{found:.1e}", f"{asked:g}", found < asked)
    record.mark_dominated()
    return record


def _add(
    record: Record, case: str, name: str, timing: dict[str, float], distance: float, variance: float, **more: bool
) -> None:
    """Add a row."""
    found = {"error": distance, "variance_error": abs(variance), "ns_per_count": 1e3 * timing["cpu_s"]}
    record.add(case, name, timing, **found, **more)
