"""What every case of the search gives on a device, bit for bit: the same inputs on each, compared between devices.

    PYTHONPATH=tests:benchmarks PHOTOSITE_DEVICE="PoCL 3.1" python -m stress.bits a.npz [CASE...]
    PYTHONPATH=tests:benchmarks PHOTOSITE_DEVICE="PoCL 3.0" python -m stress.bits b.npz [CASE...]
    PYTHONPATH=tests:benchmarks python -m stress.bits --compare a.npz b.npz

Exit status of the comparison: 0 all bits are equal, 1 some differ.
"""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings

from simulator.device import open_device
from simulator.errors import PhotositeError

from .cases import CASES
from .space import Domain, Inputs, inputs_strategy

COUNT, SEED = 6, 7  # inputs of a case


def drawn(space: Mapping[str, Domain], number: int, count: int) -> list[Inputs]:
    """Draw so many inputs, the same on every machine with this version of hypothesis."""
    found: list[Inputs] = []

    @seed(number)
    @settings(
        max_examples=count, deadline=None, database=None, phases=(Phase.generate,), suppress_health_check=list(HealthCheck)
    )
    @given(inputs_strategy(space))
    def draw(inputs: Inputs) -> None:
        found.append(inputs)

    draw()
    return found


def write_bits(file: Path, names: list[str]) -> None:
    """Run the cases on the device and keep what they give."""
    device, kept = open_device(), {}
    for case in CASES:
        if names and case.name not in names:
            continue
        for place, inputs in enumerate(drawn(case.space, SEED, COUNT)):
            try:
                kept[f"{case.name}.{place}"] = np.asarray(case.run(device, inputs).found)
            except PhotositeError:
                continue
        print(case.name, flush=True)
        np.savez_compressed(file, **kept)
    print(f"{device.info.label}: {len(kept)} results in {file}")


def compare_bits(one: Path, other: Path) -> bool:
    """Print for each case how many values differ, and by how much at most; return whether none does."""
    first, second = np.load(one), np.load(other)
    equal = True
    for case in CASES:
        keys = [key for key in first.files if key.rpartition(".")[0] == case.name and key in second.files]
        pairs = [(first[key].ravel(), second[key].ravel()) for key in keys]
        a, b = (np.concatenate(side) if pairs else np.zeros(0) for side in (zip(*pairs, strict=True) if pairs else ((), ())))
        apart = (a != b) & ~(np.isnan(a) & np.isnan(b))
        size = np.abs(a[apart].astype(np.float64) - b[apart]).max(initial=0.0)
        word = f"{apart.sum()} of {a.size} values differ, by at most {size:.3g}" if apart.any() else f"{a.size} values equal"
        print(f"{case.name:24} {word}" if pairs else f"{case.name:24} not compared")
        equal = equal and not apart.any()
    return equal


def main() -> int:
    """Write or compare, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("A", "B"), help="files of two devices")
    parser.add_argument("file", nargs="?", type=Path, help="that is written")
    parser.add_argument("cases", nargs="*", metavar="CASE", help="none: all")
    options = parser.parse_args()
    if options.compare:
        return 0 if compare_bits(*options.compare) else 1
    if options.file is None:
        parser.error("give a file to write, or two to compare")
    write_bits(options.file, options.cases)
    return 0


if __name__ == "__main__":
    sys.exit(main())
