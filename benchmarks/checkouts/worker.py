"""One checkout on one device, in a process of its own: does the items and writes what came out, a line of JSON for each.

Compare_checkouts.py starts it with PYTHONPATH at the checkout. The public names of Photosite are all it uses.

    python benchmarks/checkouts/worker.py JOB.json
"""

import contextlib
import importlib.metadata
import io
import json
import os
import runpy
import shutil
import sys
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from items import Item
from records import VERSION, folder_record, masked, plain, printed

KEPT_VALUES = 2**20  # larger arrays are compared, but not kept for `differing values`


def fix_version() -> None:
    """Give Photosite one version, whatever the checkout's is, before anything takes it from the package."""
    import simulator

    simulator.__version__ = VERSION
    installed = importlib.metadata.version
    importlib.metadata.version = lambda name: VERSION if name == "photosite" else installed(name)


def check_origin(checkout: Path) -> None:
    """Raise SystemExit when another Photosite than the checkout's would be used."""
    import data_gen
    import simulator

    for package in (simulator, data_gen):
        if not Path(str(package.__file__)).resolve().is_relative_to(checkout.resolve()):
            raise SystemExit(f"{package.__file__}: not of {checkout}; is it a checkout of Photosite?")


def take_shot(item: Item, job: dict[str, Any], out: Path) -> dict[str, Any]:
    """Take a shot, write its files, and return the arrays and other fields of the frame."""
    from simulator import develop, load_shot, resimulate, save, simulate

    checkout = Path(job["checkout"])
    path = checkout / item.file if item.file else Path(job["shots"]) / f"{item.name}.yaml"
    raw = simulate(load_shot(path, item.settings), device=job["device"])
    files = save(raw, out)
    arrays, values = raw_record(raw)
    keep_arrays(arrays, Path(job["arrays"]) / item.name)
    if item.again:
        values["develop"] = plain(develop(files.dng))
        values["resimulate"] = raw_record(resimulate(files.dng, device=job["device"]))[1]
    return values


def raw_record(raw: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return the arrays of a frame by name, and all fields but `resolved`, whose content is in the sidecar, as plain data."""
    values = {field.name: getattr(raw, field.name) for field in fields(raw) if field.name != "resolved"}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray) and value.size > 16}
    arrays |= {f"truth.{name}": value for name, value in raw.truth.items()}
    return arrays, {name: plain(value) for name, value in values.items()}


def keep_arrays(arrays: dict[str, np.ndarray], folder: Path) -> None:
    """Keep small arrays, so that the comparison can say how much differs."""
    folder.mkdir(parents=True)
    for name, array in arrays.items():
        if array.size <= KEPT_VALUES:
            np.save(folder / f"{name}.npy", array)


def run_commands(item: Item, job: dict[str, Any]) -> dict[str, Any]:
    """Run the commands of an item in the current folder; return their exit status and what they print."""
    values: dict[str, Any] = {}
    places = {name: job[name] or "" for name in ("inputs", "shots", "checkout", "device")}
    for number, words in enumerate(item.commands):
        words = [word if word.startswith("camera=") else word.format(**places) for word in words]
        if words[-2:] == ["--device", ""]:
            words = words[:-2]
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = exit_status(words)
        texts = {"stdout": out.getvalue(), "stderr": err.getvalue()}
        told = {name: printed(text, job["checkout"]).splitlines() for name, text in texts.items()}
        values[f"{number} {' '.join(item.commands[number][:2])}"] = {"status": status, **told}
    return values


def exit_status(words: list[str]) -> object:
    """Run one command line in this process; return what it gives to SystemExit, 0 when it gives nothing."""
    program, *arguments = words
    try:
        if program == "photosite":
            from data_gen.command_line import main

            main(arguments)
        else:
            sys.argv = words
            run = runpy.run_path if program.endswith(".py") else runpy.run_module
            run(program, run_name="__main__")
    except SystemExit as end:
        return end.code or 0
    return 0


def done(item: Item, job: dict[str, Any]) -> dict[str, Any]:
    """Do one item in an empty folder; return its record. An error is part of it, and no other item's concern."""
    out = Path(job["out"])
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    os.chdir(out)
    values, error, start = {}, None, time.perf_counter()
    try:
        values = run_commands(item, job) if item.commands else take_shot(item, job, out)
    except Exception as problem:  # whatever a checkout raises is compared
        error = printed(f"{type(problem).__name__}: {problem}", job["checkout"])
    written, plans = folder_record(out, job["checkout"])
    record = {"name": item.name, "seconds": time.perf_counter() - start, "error": error, "plans": plans}
    return record | {"values": masked(values, job["checkout"]), "files": written}


def do_items(job: dict[str, Any]) -> None:
    """Write a line for each item as soon as it is done: after a crash the lines before it are there."""
    with open(job["record"], "w", encoding="utf-8") as record:
        for data in job["items"]:
            data["commands"] = tuple(map(tuple, data["commands"]))
            record.write(json.dumps(done(Item(**data), job)) + "\n")
            record.flush()
            print(".", end="", flush=True)
    print(flush=True)


def main() -> None:
    """Do the job of a file."""
    (path,) = sys.argv[1:]
    job = json.loads(Path(path).read_text(encoding="utf-8"))
    fix_version()
    check_origin(Path(job["checkout"]))
    do_items(job)


if __name__ == "__main__":
    main()
