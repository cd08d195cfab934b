"""The list of a complete data set: what it was made from, its shards with their SHA-256, and what went wrong on the way.

It is written last, so a folder that has it is complete. It is sorted and contains no time and nothing about the machine,
so equal data sets have equal manifests.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from data_gen.storage.shards import RECORD, Shard, ShardRecord, find_problem, finished_shards, record_path
from data_gen.storage.writers.writer import WriterOptions
from simulator.atomic_files import atomic_write, remove_abandoned
from simulator.errors import PhotositeError, reading
from simulator.progress import Progress, Steps, silent
from simulator.raw.software import software

MANIFEST = "manifest.json"


def write_manifest(
    folder: Path, plan: Sequence[Shard], dataset: str, options: WriterOptions, problems: Iterable[str] = ()
) -> Path:
    """Write `manifest.json` for a folder whose shards are all finished, and remove what killed runs left there.

    dataset: hash of the configuration. problems: one line for each picture that was left out or file that was refused.
    Raises PhotositeError when a shard is missing.
    """
    records = finished_shards(folder, dataset)
    missing = [shard.index for shard in plan if shard.index not in records]
    if missing:
        state = f"{len(missing)} of {len(plan)} shards are not there, the first is {missing[0]}"
        raise PhotositeError(f"{state}; run the same command again", file=folder)
    shards = [records[shard.index] for shard in plan]
    listed = sorted(problems)
    content = {
        "software": software(),
        "dataset": dataset,
        "format": shards[0].format,
        "channels": options.channels,
        "samples": sum(record.count for record in shards),
        "bytes": sum(record.bytes for record in shards),
        "shards": [asdict(record) for record in shards],
        "problem_count": len(listed),
        "problems": listed,
    }
    remove_abandoned(folder)
    path = folder / MANIFEST
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, sort_keys=True, allow_nan=False) + "\n", encoding="utf-8")
    return path


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the content of `manifest.json`, `shards` as ShardRecord. Raises PhotositeError when it is missing or damaged."""
    path = folder / MANIFEST
    if not path.exists():
        raise PhotositeError("is missing: the data set is not complete; run the same command again", file=path)
    with reading(path, "run the same command again"):
        content = json.loads(path.read_text(encoding="utf-8"))
        content["shards"] = [ShardRecord(**record) for record in content["shards"]]
    return content


def verify(folder: Path, progress: Progress = silent) -> list[str]:
    """Compare every byte of a data set with its manifest; return what is wrong, one line each, and [] when all is well.

    progress: called after each shard.
    A shard found wrong loses its record, so that the next run makes it anew.
    """
    try:
        manifest = read_manifest(folder)
    except PhotositeError as error:
        return [str(error)]
    found: list[str] = []
    steps = Steps(progress, len(manifest["shards"]))
    for record in manifest["shards"]:
        problem = find_problem(folder, record, verify=True)
        steps.add("shards")
        if problem is not None:
            record_path(folder / record.name).unlink(missing_ok=True)
            found.append(f"{problem}; run the same command again to make it anew")
    known = {record.name for record in manifest["shards"]}
    strangers = sorted(path.name for path in folder.glob("shard-*") if path.name.removesuffix(RECORD) not in known)
    return found + [f"{folder / name}: is no part of this data set; delete it" for name in strangers]
