"""Writing a raw file beside a plain write of its bytes, and beside taking the shot: all in one run, in turns.

A plain write is written beside and renamed, too, and reaches the disk in the same way, so that only the making of the
file differs.

    python benchmarks/raw.py [--rounds 5] [--out build/benchmarks]
"""

import argparse
import json
import tempfile
from pathlib import Path

from measuring.contest import Contestant, contest

from simulator import load_shot, simulate
from simulator.atomic_files import atomic_write
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.raw.save import save

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "color_checker.yaml"
ASKED_BEYOND_S = 0.1  # of a DNG beyond a plain write of its bytes
ASKED_RATIO = 2.0  # of a DNG with its twin to taking the shot


def measure(rounds: int, folder: Path) -> dict[str, object]:
    """Best and median times [s] by contestant, and the two verdicts."""
    shot = load_shot(SHOT)
    raw = simulate(shot)
    payload = dng_bytes(raw)

    def plain() -> None:
        with atomic_write(folder / "plain.dng") as path:
            path.write_bytes(payload)

    runs = {
        "plain write of the DNG's bytes": plain,
        "DNG": lambda: write_dng(raw, folder / "a.dng"),
        "DNG, truth twin and settings": lambda: save(raw, folder),
        "simulate": lambda: simulate(shot),
    }
    timings = contest([Contestant(name, run, lambda: raw.dn) for name, run in runs.items()], rounds)
    rows = [timing.summary(raw.dn.size / 1e6) for timing in timings.values()]
    best = {row["name"]: row["best_s"] for row in rows}
    beyond_s = best["DNG"] - best["plain write of the DNG's bytes"]
    ratio = best["DNG, truth twin and settings"] / best["simulate"]
    verdicts = [
        ("a DNG beyond a plain write of its bytes", f"{beyond_s:.3f} s", f"{ASKED_BEYOND_S} s", beyond_s <= ASKED_BEYOND_S),
        ("a DNG with twin, over taking the shot", f"{ratio:.2f}", f"{ASKED_RATIO:g}", ratio <= ASKED_RATIO),
    ]
    return {
        "photosites": raw.dn.shape[::-1],
        "rows": rows,
        "verdicts": [dict(zip(("what", "figure", "asked", "reached"), verdict, strict=True)) for verdict in verdicts],
    }


def main() -> None:
    """Measure, print, and write raw.json."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5, help="turns of each contestant")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for raw.json")
    settings = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        record = measure(settings.rounds, Path(folder))
    for row in record["rows"]:
        print(f"{row['name']:32s} best {row['best_s']:.3f} s  median {row['median_s']:.3f} s")
    for verdict in record["verdicts"]:
        word = "reached" if verdict["reached"] else "missed"
        print(f"{verdict['what']}: {verdict['figure']} (asked: at most {verdict['asked']}): {word}")
    settings.out.mkdir(parents=True, exist_ok=True)
    with atomic_write(settings.out / "raw.json") as path:
        path.write_text(json.dumps(record, indent=1), encoding="utf-8")
    print(f"wrote {settings.out / 'raw.json'}")


if __name__ == "__main__":
    main()
