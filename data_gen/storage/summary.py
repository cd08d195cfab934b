"""Histograms of the samples of a shard, which can be added: cameras, ISO, exposure ratios, light, sources."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np

from data_gen.samples.sample import Sample

# Name of a histogram -> what a sample counts as. Those in stops are rounded down: 3 stands for 3 up to 4.
KINDS = ("camera", "iso", "mode", "cfa", "shape", "ratio_stops", "light_stops", "source")
DARKEST_STOP = -16


class Summary:
    """Counts of the samples seen so far, frame by frame for the exposure ratio, else sample by sample."""

    def __init__(self) -> None:
        self._counts: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}

    def add(self, sample: Sample) -> None:
        """Count one sample."""
        values = {
            "camera": sample.camera,
            "iso": sample.iso,
            "mode": sample.mode,
            "cfa": sample.cfa,
            "shape": " x ".join(map(str, sample.noisy_dn.shape)),
            "light_stops": light_stops(sample),
            "source": sample.source,
        }
        for kind, value in values.items():
            self._counts[kind][str(value)] += 1
        for ratio in sample.exposure_ratios:
            self._counts["ratio_stops"][str(math.floor(math.log2(ratio)))] += 1

    def counts(self) -> dict[str, dict[str, int]]:
        """Plain data: value -> count for each of KINDS, sorted."""
        return {kind: dict(sorted(counter.items())) for kind, counter in self._counts.items()}


def light_stops(sample: Sample) -> int:
    """Return log2 of the mean clean signal (1 = saturation), rounded down and at least DARKEST_STOP."""
    span_dn = sample.white_level_dn - sample.black_level_dn
    signal = (float(np.mean(sample.clean_dn, dtype=np.float64)) - sample.black_level_dn) / span_dn
    return math.floor(math.log2(max(signal, 2.0**DARKEST_STOP)))


def merge_counts(parts: Iterable[Mapping[str, Mapping[str, int]]]) -> dict[str, dict[str, int]]:
    """Add the counts of several shards; numeric values are sorted as numbers, then words."""
    total: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    for part in parts:
        for kind, counts in part.items():
            total[kind].update(counts)
    return {kind: dict(sorted(counter.items(), key=lambda item: _order(item[0]))) for kind, counter in total.items()}


def _order(value: str) -> tuple[int, float, str]:
    """Sort key of a value: numbers by size, before words."""
    try:
        return 0, float(value), value
    except ValueError:
        return 1, 0.0, value
