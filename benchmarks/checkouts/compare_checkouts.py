"""Two checkouts of Photosite: whether they give the same bits and files. compare_results.py compares times and errors.

Each checkout does the same shots and commands in a process of its own, one after the other, from the same inputs and into the
same folder. Compared are SHA-256 of all arrays of each frame, its other fields, all files written, what commands print, and
messages. What is left out of the comparison stands in records.py. A shot that fails with the same message in both is equal.

    python benchmarks/checkouts/compare_checkouts.py OLD NEW [--device PART]... [--only PATTERN]...
    python benchmarks/checkouts/compare_checkouts.py . . --device "PoCL 3.1" --against "PoCL 3.0"

Exit status: 0 nothing differs, 1 something does or most items fail, 2 wrong options.
"""

import argparse
import fnmatch
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from inputs import write_inputs
from items import Item, dataset_documents, items, sweep_product
from records import count_differences, differences, has_failed

WORKER = Path(__file__).parent / "worker.py"
SIDES = ("OLD", "NEW")
SHOWN_LINES = 6  # of one item
LONGEST_S = 3600


@dataclass(frozen=True)
class Work:
    """Folders of a run. Both checkouts write into `out`, so that paths in files are the same."""

    folder: Path
    checkouts: tuple[Path, Path]

    @property
    def inputs(self) -> Path:
        """Pictures and kernels."""
        return self.folder / "inputs"

    @property
    def shots(self) -> Path:
        """Shot files and data set files."""
        return self.folder / "shots"

    def job(self, side: int, device: str | None, **more: object) -> dict[str, Any]:
        """Return what a worker is told."""
        places = {"inputs": self.inputs, "shots": self.shots, "out": self.folder / "out", "checkout": self.checkouts[side]}
        return {name: str(path) for name, path in places.items()} | {"device": device} | more


def write_documents(work: Work, todo: list[Item]) -> None:
    """Write the inputs, and the shot and data set files."""
    write_inputs(work.inputs)
    work.shots.mkdir()
    documents = {item.name: item.document for item in todo if item.document}
    documents["sweep_product"] = sweep_product(work.inputs)
    documents |= {f"dataset_{name}": document for name, document in dataset_documents(work.inputs).items()}
    for name, document in documents.items():
        text = yaml.safe_dump(document, sort_keys=False).replace("{shots}", str(work.shots))
        (work.shots / f"{name}.yaml").write_text(text, encoding="utf-8")


def start_worker(work: Work, side: int, job: dict[str, Any]) -> subprocess.CompletedProcess:
    """Run a worker to its end, with the checkout first on Python's path and the caller's own path behind it."""
    file = work.folder / "job.json"
    file.write_text(json.dumps(job), encoding="utf-8")
    paths = [str(work.checkouts[side]), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "COLUMNS": "140", "MPLBACKEND": "Agg"}
    environment |= {"PHOTOSITE_DEVICE": job["device"]} if job["device"] else {}
    command = [sys.executable, str(WORKER), str(file)]
    return subprocess.run(command, env=environment, cwd=work.folder, timeout=LONGEST_S, check=False)


def records_of(work: Work, side: int, device: str | None, todo: list[Item]) -> dict[str, dict[str, Any]]:
    """Return the records of one checkout on one device by name of the item; where it crashed, those before."""
    record, arrays = work.folder / f"{SIDES[side]}.jsonl", work.folder / SIDES[side]
    shutil.rmtree(arrays, ignore_errors=True)
    record.write_text("", encoding="utf-8")
    print(f"{SIDES[side]} {work.checkouts[side]} ", end="", flush=True)
    told = [asdict(item) for item in todo]
    ended = start_worker(work, side, work.job(side, device, record=str(record), arrays=str(arrays), items=told))
    if ended.returncode:
        print(f"\n{SIDES[side]}: the worker ended with status {ended.returncode}")
    found = [json.loads(line) for line in record.read_text(encoding="utf-8").splitlines()]
    print(f"  {len(found)} items, {sum(one['seconds'] for one in found):.0f} s")
    return {one["name"]: one for one in found}


def array_differences(work: Work, name: str) -> list[str]:
    """Return for each array that was kept on both sides how many values differ, and by how much at most."""
    lines = []
    for old_file in sorted((work.folder / "OLD" / name).glob("*.npy")):
        new_file = work.folder / "NEW" / name / old_file.name
        if not new_file.exists():
            continue
        old, new = np.load(old_file), np.load(new_file)
        if old.shape != new.shape:
            lines.append(f"{old_file.stem}: shape {old.shape} | {new.shape}")
        elif old.tobytes() != new.tobytes():
            with np.errstate(invalid="ignore"):
                step = np.abs(new.astype(np.float64) - old)
            unequal = ~((old == new) | (np.isnan(old) & np.isnan(new)))
            largest = np.nanmax(step[unequal], initial=0.0)
            lines.append(f"{old_file.stem}: {unequal.sum()} of {old.size} values differ, by at most {largest:.6g}")
    return lines


def differing(
    work: Work, item: Item, old: dict[str, Any] | None, new: dict[str, Any] | None, two_devices: bool = False
) -> list[str]:
    """Return a line for each difference of an item; of text for people, none but that a command fails.

    two_devices: sidecars name different devices, which is no difference.
    """
    if old is None or new is None:
        return ["not done: the worker ended before" if old is new else f"done only in {'NEW' if old is None else 'OLD'}"]
    kept = ("error", "files") if item.wording else ("error", "values", "files")
    if item.wording:
        old, new = ({**one, "status": [told["status"] for told in one["values"].values()]} for one in (old, new))
        kept += ("status",)
    lines = list(differences({key: old[key] for key in kept}, {key: new[key] for key in kept}))
    lines = [line for line in lines if not (two_devices and ".json.device." in line)]
    return [*array_differences(work, item.name), *lines] if lines else []


def compare(work: Work, device: str | None, todo: list[Item], against: str | None = None) -> bool:
    """Do everything in both checkouts, in the second on `against`, print the table, and return whether nothing differs."""
    print(f"\ndevice: {device or 'the default'}" + (f", NEW on {against}" if against else ""))
    old, new = (records_of(work, side, one, todo) for side, one in enumerate((device, against or device)))
    found = {item.name: differing(work, item, old.get(item.name), new.get(item.name), bool(against)) for item in todo}
    failed = {name: old[name]["error"] for name in found if not found[name] and old[name]["error"]}
    both = [item for item in todo if item.name in old and item.name in new]
    worded = sum(bool(count_differences(old[item.name]["plans"], new[item.name]["plans"])) for item in both)
    printed = sum(bool(count_differences(old[item.name]["values"], new[item.name]["values"])) for item in both if item.wording)
    for name, error in failed.items():
        print(f"  equal, fails in both: {name}: {error}")
    for name, lines in found.items():
        for line in lines[:SHOWN_LINES]:
            print(f"  DIFFERENT {name}: {line}")
        if len(lines) > SHOWN_LINES:
            print(f"  DIFFERENT {name}: and {len(lines) - SHOWN_LINES} more")
    different = [name for name, lines in found.items() if lines]
    rows = {
        "items equal": len(found) - len(different),
        "  of them fail in both, with one message": len(failed),
        "items different": len(different),
        "sidecars whose plan for people differs (no difference)": worded,
        "explanations whose wording differs (no difference)": printed,
        "shots": sum(not item.commands for item in todo),
        "command items": sum(bool(item.commands) for item in todo),
    }
    for what, count in rows.items():
        print(f"{what:58s} {count:5d}")
    most_fail = 2 * sum(has_failed(old[item.name]) for item in both) > len(both)
    if most_fail:
        print("most items fail in OLD already, so this comparison says nothing: does the device work?")
    return not different and not most_fail


def chosen(name: str, patterns: list[str] | None) -> bool:
    """Whether a name fits one of the patterns; without patterns every name does."""
    return not patterns or any(fnmatch.fnmatch(name, pattern) for pattern in patterns)


def configured(checkouts: tuple[Path, Path], pattern: str) -> list[str]:
    """Return the files of a pattern that either checkout has, as paths in the checkout."""
    return sorted({path.relative_to(root).as_posix() for root in checkouts for path in root.glob(pattern)})


def everything(work: Work) -> list[Item]:
    """Return all items: those of items.py, with the shots, cameras and data sets that either checkout brings."""
    cameras = [Path(path).stem for path in configured(work.checkouts, "configs/cameras/*.yaml")]
    data_sets = [path for folder in ("configs/datasets", "examples") for path in configured(work.checkouts, f"{folder}/*.yaml")]
    return items(work.inputs, configured(work.checkouts, "configs/shots/*.yaml"), cameras, data_sets)


def main() -> int:
    """Compare, print, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path, metavar="OLD", help="a checkout of Photosite")
    parser.add_argument("new", type=Path, metavar="NEW", help="another")
    parser.add_argument("--device", action="append", metavar="PART", help="part of a device's name; repeatable")
    parser.add_argument(
        "--against", metavar="PART", help="of the device of NEW: compares two devices where OLD and NEW are one"
    )
    parser.add_argument("--only", action="append", metavar="PATTERN", help="of names, such as 'dataset_*'; repeatable")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="new folder where inputs, records and arrays are kept")
    parser.add_argument("--list", action="store_true", help="only print the names of the items")
    settings = parser.parse_args()
    checkouts = settings.old.resolve(), settings.new.resolve()
    for checkout in checkouts:
        if not (checkout / "simulator" / "__init__.py").is_file():
            parser.error(f"{checkout}: no checkout of Photosite")
    with tempfile.TemporaryDirectory(prefix="photosite-") as temporary:
        work = Work((settings.keep or Path(temporary)).resolve(), checkouts)
        todo = everything(work)
        if settings.list:
            print("\n".join(item.name for item in todo))
            return 0
        if settings.keep:
            settings.keep.mkdir(parents=True)
        write_documents(work, todo)
        todo = [item for item in todo if chosen(item.name, settings.only)]
        equal = True
        for device in settings.device or [None]:
            equal = compare(work, device, todo, settings.against) and equal
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
