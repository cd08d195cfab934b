"""Names of a noisy and a clean file from which LED, PMN and SID loaders take the exposure ratio.

They look for `_SECONDSs.` in both names and divide. Only the quotient matters, so the noisy frame counts as one second.
"""

from collections.abc import Iterator

import numpy as np

from data_gen.samples.sample import Sample
from data_gen.storage.writers.writer import WriterOptions


def pair_names(sample: Sample, options: WriterOptions) -> Iterator[tuple[str, str]]:
    """Names without suffix of each frame's noisy and clean file, such as 000000012_00_1s.noisy and 000000012_00_250s.clean."""
    for frame, ratio in enumerate(sample.exposure_ratios):
        start, seconds = f"{options.index_name(sample.index)}_{frame:02d}", np.format_float_positional(ratio, trim="-")
        yield f"{start}_1s.noisy", f"{start}_{seconds}s.clean"


def pairs_by_sample(text: str) -> list[list[list[str]]]:
    """Lines of a `pairs.txt`, as lists of two names, put together by sample."""
    found: dict[str, list[list[str]]] = {}
    for line in text.splitlines():
        found.setdefault(line.split("_")[0], []).append(line.split())
    return list(found.values())
