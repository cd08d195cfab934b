"""Shards of toy samples, the same for every caller."""

from collections.abc import Container
from pathlib import Path
from typing import Any

from data_gen.storage.manifest import write_manifest
from data_gen.storage.shards import Shard, ShardRecord, plan_shards, write_shard
from data_gen.storage.writers.writer import WriterOptions, find_writer
from helpers.toy_samples import toy_sample


def write_toy_shard(folder: Path, name: str, count: int = 40, **changes: Any) -> ShardRecord:
    """Write one shard of small samples in the format `name`; return its record."""
    samples = (toy_sample(index, **changes) for index in range(count))
    return write_shard(folder, Shard(0, 1, 0, count), find_writer(name), samples, toy_options(name))


def toy_options(name: str) -> WriterOptions:
    """Colour planes in each format that has them."""
    return WriterOptions({"eld": "rgbg", "dng": "mosaic"}.get(name, "rggb"))


def mosaic_options(name: str) -> WriterOptions:
    """One plane in each format that has it."""
    return WriterOptions("rgbg" if name == "eld" else "mosaic")


def write_toy_folder(
    folder: Path, name: str = "webdataset", count: int = 7, only: Container[int] | None = None
) -> tuple[Shard, ...]:
    """Write shards of three samples, and the manifest when all of them are made; return the plan."""
    plan, options = plan_shards(count, 3), mosaic_options(name)
    for shard in plan:
        if only is None or shard.index in only:
            write_shard(folder, shard, find_writer(name), map(toy_sample, shard.indices), options, "abc")
    if only is None:
        write_manifest(folder, plan, "abc", options, ["b.png: is grey", "a.png: cannot be read"])
    return plan
