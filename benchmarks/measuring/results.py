"""Results by commit, in the folders and files of airspeed velocity (asv), so that its `compare` and `publish` read them, too.

It asks for an asv.conf.json with `results_dir` at the folder and `repo` at the checkout; of it nothing else is used.

<folder>/<machine>/<commit, 8 characters>-<size>.json holds for each section a benchmark `<section>.time` and, where there is an
error, `<section>.error`, whose parameters are "<case>: <name>" of the rows of Photosite (asv 0.6, result files of version 2).
"""

import json
import platform
from pathlib import Path
from typing import Any

from measuring.record import is_ours, machine
from simulator.atomic_files import atomic_write

VERSION = 2  # of asv's result files
UNITS = {"time": ("cpu_s", "seconds", "time"), "error": ("error", "error", "track")}  # key of a row, unit, asv's type
Numbers = dict[str, dict[str, float]]  # benchmark, then parameter


def numbers_of(record: dict[str, Any]) -> Numbers:
    """Processor times [s] and errors of Photosite's rows of a record."""
    found: Numbers = {}
    for row in record["rows"]:
        if is_ours(row):
            for what, (key, _, _) in UNITS.items():
                if row.get(key) is not None:
                    found.setdefault(f"{record['section']}.{what}", {})[f"{row['case']}: {row['name']}"] = row[key]
    return found


def keep(records: list[dict[str, Any]], folder: Path) -> Path | None:
    """Write records of one commit and one size under that commit; other sections that are there stay.

    None: they are of no commit, or of files that differ from it.
    """
    commit, size = records[0]["commit"], records[0]["size"]
    if commit["is_changed"] or commit["hash"] == "unknown":
        return None
    where = folder / platform.node()
    path = where / f"{commit['hash'][:8]}-{size}.json"
    numbers = load(path) if path.exists() else {}
    for record in records:
        numbers |= numbers_of(record)
    about = machine()
    # asv writes parameters as Python's repr.
    results = {name: [list(values.values()), [[repr(one) for one in values]], str(VERSION)] for name, values in numbers.items()}
    data = {
        "commit_hash": commit["hash"],
        "env_name": size,
        "date": commit["date"],
        "params": {"machine": platform.node(), "cpu": about["processor"], "num_cpu": str(about["cores"]), "python": size},
        "python": about["versions"]["python"],
        "requirements": {},
        "env_vars": {},
        "result_columns": ["result", "params", "version"],
        "results": results,
        "durations": {},
        "version": VERSION,
    }
    _write(path, data)
    of_machine = {"machine": platform.node(), "cpu": about["processor"], "num_cpu": str(about["cores"]), "version": 1}
    _write(where / "machine.json", of_machine)
    _list_benchmarks(folder, results)
    return path


def _list_benchmarks(folder: Path, results: dict[str, list]) -> None:
    """Describe the benchmarks in benchmarks.json, without which asv shows none."""
    path = folder / "benchmarks.json"
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    for name, (_, params, version) in results.items():
        _, unit, kind = UNITS[name.rpartition(".")[2]]
        about = {"name": name, "params": params, "param_names": ["setting"], "type": kind, "unit": unit, "version": version}
        known[name] = about | {"code": "", "timeout": 60.0}
    _write(path, known | {"version": VERSION})


def _write(path: Path, data: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def load(path: Path) -> Numbers:
    """Numbers of a result file."""
    results = json.loads(path.read_text(encoding="utf-8"))["results"]
    return {
        name: dict(zip((one[1:-1] for one in params[0]), values, strict=True)) for name, (values, params, *_) in results.items()
    }


def kept_of(folder: Path, commit: str) -> list[Path]:
    """Result files of a commit in the folder of a machine, of all sizes."""
    return sorted(folder.glob(f"{commit[:8]}-*.json"))
