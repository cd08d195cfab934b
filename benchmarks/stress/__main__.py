"""Search every kernel, or those named, for the inputs at which it is farthest from float64, and write the worst.

    PYTHONPATH=tests:benchmarks python -m stress [CASE...] [--seconds 10] [--seed N] [--out build/benchmarks]

What was found is kept in stress.json by case: a run of some cases replaces theirs alone, so that a search that was stopped
goes on with the cases that are left. The inputs of the worst lie beside it in stress/CASE.npz. `python docs/make_stress.py`
writes docs/stress.md from it. Exit status: 0 all errors are within their bounds, 1 one is not.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

from simulator.device import Device, open_device

from .cases import CASES
from .search import Found, StressCase, search
from .space import Inputs

EXAMPLES, STEPS = 2000, 10**6  # more than fit into the seconds of a case


def told(inputs: Inputs) -> dict[str, float | int | str]:
    """Return inputs for people: pictures by their least and greatest value."""
    found: dict[str, float | int | str] = {}
    for name, value in inputs.items():
        found[name] = f"{value.min():.3g} to {value.max():.3g}" if isinstance(value, np.ndarray) else value
    return found


def record_of(found: Found, device: Device, seconds: float) -> dict[str, object]:
    """Return what is kept of a search. seconds: that it had, of processor time."""
    case = found.case
    return {
        "kernels": list(case.kernels),
        "ulps": found.worst["ulps"] if case.most_ulps is not None else None,
        "sigma": found.worst["sigma"],
        "promises": found.worst["promises"] if case.keeps else None,
        "tried": found.tried,
        "refused": found.refused,
        "seed": found.seed,
        "seconds": seconds,
        "device": device.info.label,
        "worst": told(found.at.get(case.climbs, {})),
    }


def bounds_of(case: StressCase) -> dict[str, object]:
    """Return what is kept of a case's bounds, of earlier runs, too."""
    return {"most_ulps": case.most_ulps, "most_sigma": case.most_sigma, "why": case.why}


def keep_inputs(found: Found, folder: Path) -> None:
    """Write the worst inputs of a search, so that they can be tried again."""
    folder.mkdir(parents=True, exist_ok=True)
    inputs = found.at.get(found.case.climbs, {})
    np.savez_compressed(folder / f"{found.case.name}.npz", **{name: np.asarray(value) for name, value in inputs.items()})


def run(case: StressCase, device: Device, number: int, seconds: float) -> Found:
    """Search a case and print its worst."""
    found = search(case, device, number, EXAMPLES, STEPS, seconds)
    ulps = f"{found.worst['ulps']:10.3g} ulps" if case.most_ulps is not None else " " * 15
    word = "" if found.within_bounds() else f"  ABOVE ITS BOUND: {told(found.at[case.climbs])}"
    kept = f"{found.worst['promises']:10.3g} promises" if case.keeps else " " * 19
    print(f"{case.name:24}{ulps} {found.worst['sigma']:10.3g} sigma {kept} {found.tried:7} inputs{word}", flush=True)
    return found


def main() -> int:
    """Search, write, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [case.name for case in CASES]
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(names)}; none: all")
    parser.add_argument("--seconds", type=float, default=12.0, help="of processor time, for a case")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the search; a new one in each run")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder of stress.json and stress/")
    options = parser.parse_args()
    if unknown := sorted(set(options.cases) - set(names)):
        parser.error(f"unknown: {', '.join(unknown)}; there are {', '.join(names)}")
    device, file = open_device(), options.out / "stress.json"
    print(f"seed {options.seed}, {options.seconds:g} s a case, {device.info.label}")
    options.out.mkdir(parents=True, exist_ok=True)
    records = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    good = True
    for case in CASES:
        if options.cases and case.name not in options.cases:
            continue
        found = run(case, device, options.seed, options.seconds)
        good = good and found.within_bounds()
        records[case.name] = record_of(found, device, options.seconds)
        keep_inputs(found, options.out / "stress")
        kept = {one.name: records[one.name] | bounds_of(one) for one in CASES if one.name in records}
        file.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {file}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
