"""Whether a change made Photosite slower or less accurate: processor times and errors of the benchmark at two commits.

    python benchmarks/checkouts/compare_results.py BASE [NEW] [--only defocus,motion] [--rounds 3] [--size quick]
    python benchmarks/checkouts/compare_results.py BASE [NEW] --kept

BASE and NEW are commits, branches, or folders with checkouts; NEW is this checkout as it is, unless another is named. Both are
measured now, in turns, by this checkout's benchmark in fresh processes, because times of two days do not compare. With --kept
the results that are kept of both commits on this machine are compared instead, of which nothing is run.

A setting is slower where every round takes more processor time than all rounds of BASE, the best over 10 % and 1 ms more, and
less accurate where its error grows by over 5 % and 0.001. Exit status: 0 neither, 1 one of both, 2 wrong options.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from measuring.results import Numbers, kept_of, load, numbers_of  # noqa: E402

BENCH, ROOT = HERE.parent / "bench.py", HERE.parent.parent
SECTIONS = "defocus,psf,motion,moving,spectra,skips,lenses"
SLOWER, LEAST_S = 1.10, 1e-3
LESS_ACCURATE, LEAST_ERROR = 1.05, 1e-3


@dataclass(frozen=True)
class Change:
    """A setting at both commits. benchmark: <section>.time or <section>.error. old, new: by round."""

    benchmark: str
    setting: str
    old: tuple[float, ...]
    new: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """New over old: of the best times, or of the errors."""
        return min(self.new) / min(self.old) if min(self.old) else (1.0 if min(self.new) == 0 else float("inf"))

    @property
    def is_time(self) -> bool:
        """Whether it is a time, not an error."""
        return self.benchmark.endswith(".time")

    @property
    def is_worse(self) -> bool:
        """Whether it is slower, apart from what varies between rounds, or less accurate."""
        old, new = min(self.old), min(self.new)
        if self.is_time:
            return new > max(self.old) and new > SLOWER * old and new - old > LEAST_S
        return new > LESS_ACCURATE * old and new - old > LEAST_ERROR


def changes(old: Sequence[Numbers], new: Sequence[Numbers]) -> tuple[list[Change], list[str]]:
    """What both commits measured in each round, and a line for each setting that only one of them has."""
    found, lonely = [], []
    for benchmark in sorted({name for one in (*old, *new) for name in one}):
        sides = [[one.get(benchmark, {}) for one in rounds] for rounds in (old, new)]
        settings = dict.fromkeys(name for side in sides for one in side for name in one)
        for setting in settings:
            values = [[one[setting] for one in side if setting in one] for side in sides]
            if all(len(kept) == len(side) for kept, side in zip(values, sides, strict=True)):
                found.append(Change(benchmark, setting, tuple(values[0]), tuple(values[1])))
            elif benchmark.endswith(".time"):
                lonely.append(f"{benchmark} {setting}: only in {'OLD' if values[0] else 'NEW'}")
    return found, lonely


def show(found: list[Change], lonely: list[str]) -> bool:
    """Print all that changed by over 5 %, worst first, and return whether nothing is worse."""
    worse = [change for change in found if change.is_worse]
    moved = [change for change in found if not change.is_worse and abs(change.ratio - 1.0) > 0.05]
    for word, some in (("WORSE", worse), ("", moved)):
        for change in sorted(some, key=lambda one: -one.ratio):
            unit = "s" if change.is_time else ""
            numbers = f"{min(change.old):.4g} -> {min(change.new):.4g} {unit}"
            print(f"{word:5s} {change.ratio:6.2f} x  {numbers:26s} {change.benchmark}  {change.setting}")
    for line in lonely:
        print(f"      {line}")
    times = sum(change.is_time for change in found)
    print(f"{times} times and {len(found) - times} errors compared, {len(worse)} worse, {len(moved)} others moved by over 5 %")
    return not worse


def commit_of(name: str) -> str:
    """Full hash of a commit. Raises SystemExit with status 2 for one that there is not."""
    command = ["git", "-C", str(ROOT), "rev-parse", "--verify", "--quiet", f"{name}^{{commit}}"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode:
        print(f"{name}: no commit, branch or folder with a checkout of Photosite", file=sys.stderr)
        raise SystemExit(2)
    return ended.stdout.strip()


@contextmanager
def checkout_of(name: str, folder: Path) -> Iterator[Path]:
    """A folder with the files of a commit, or the folder itself that is named."""
    if (Path(name) / "simulator" / "__init__.py").is_file():
        yield Path(name).resolve()
        return
    place, git = folder / commit_of(name)[:12], ["git", "-C", str(ROOT), "worktree"]
    subprocess.run([*git, "add", "--quiet", "--detach", str(place), commit_of(name)], check=True)
    try:
        yield place
    finally:
        subprocess.run([*git, "remove", "--force", str(place)], check=True)


def measure(checkout: Path, out: Path, section: str, size: str) -> Numbers:
    """Numbers of a section of this checkout's benchmark with the simulator of a checkout; none, and a line, when it fails."""
    command = [sys.executable, str(BENCH), "--size", size, "--only", section, "--out", str(out), "--results", str(out / "kept")]
    environment = os.environ | {"PYTHONPATH": str(checkout), "MPLBACKEND": "Agg"}
    ended = subprocess.run(command, env=environment, cwd=out.parent, capture_output=True, text=True, check=False)
    if ended.returncode:
        print(f"{section} is not measured in {checkout}: {ended.stderr.strip().splitlines()[-1]}", flush=True)
        return {}
    return numbers_of(json.loads((out / f"{section}.json").read_text(encoding="utf-8")))


def in_turns(checkouts: tuple[Path, Path], folder: Path, only: str, size: str, rounds: int) -> list[list[Numbers]]:
    """Numbers of both checkouts by round; each section of a round is measured in both, one behind the other."""
    found: list[list[Numbers]] = [[], []]
    for turn in range(rounds):
        numbers: list[Numbers] = [{}, {}]
        for section in only.split(","):
            for side in (0, 1) if turn % 2 == 0 else (1, 0):
                out = folder / f"{turn}-{side}-{section}"
                numbers[side] |= measure(checkouts[side], out, section, size)
            print(f"round {turn + 1} of {rounds}: {section}", file=sys.stderr, flush=True)
        for side in (0, 1):
            found[side].append(numbers[side])
    return found


def kept(name: str, folder: Path, size: str) -> Numbers:
    """Numbers that are kept of a commit on this machine. Raises SystemExit with status 2 where there are none."""
    commit = commit_of(name)
    paths = [path for path in kept_of(folder / platform.node(), commit) if path.stem.endswith(f"-{size}")]
    if not paths:
        print(f"{name}: {folder} holds no results of size {size}; check it out and run `make bench`", file=sys.stderr)
        raise SystemExit(2)
    return load(paths[0])


def main() -> int:
    """Measure or load, compare, print, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", metavar="BASE", help="a commit, a branch, or a folder with a checkout")
    parser.add_argument("new", metavar="NEW", nargs="?", default=None, help="another; default: this checkout as it is")
    parser.add_argument("--only", default=SECTIONS, help="sections of the benchmark, separated by commas")
    parser.add_argument("--size", choices=("quick", "standard", "full"), default="quick", help="of the benchmark")
    parser.add_argument("--rounds", type=int, default=3, help="how often both are measured")
    parser.add_argument("--kept", action="store_true", help="compare the results that are kept, and run nothing")
    parser.add_argument("--results", type=Path, default=ROOT / ".asv" / "results", help="folder of the results by commit")
    options = parser.parse_args()
    if options.kept:
        sides = [[kept(name, options.results, options.size)] for name in (options.base, options.new or "HEAD")]
        return 0 if show(*changes(*sides)) else 1
    with tempfile.TemporaryDirectory(prefix="photosite-") as temporary, ExitStack() as stack:
        folder = Path(temporary)
        old, new = (stack.enter_context(checkout_of(name, folder)) for name in (options.base, options.new or str(ROOT)))
        sides = in_turns((old, new), folder, options.only, options.size, options.rounds)
    return 0 if show(*changes(*sides)) else 1


if __name__ == "__main__":
    sys.exit(main())
