"""What the run of a data set does, slowly enough to be killed: python shard_run.py FOLDER FORMAT."""

import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from data_gen.samples.sample import Sample
from data_gen.storage.manifest import write_manifest
from data_gen.storage.shards import finished_shards, plan_shards, write_shard
from data_gen.storage.writers.writer import find_writer
from helpers.toy_samples import toy_sample
from helpers.toy_shards import mosaic_options

PLAN = plan_shards(8, 2)
PAUSE_S = 0.03  # before each sample


def make_samples(indices: Iterable[int], pause_s: float, size: dict[str, int]) -> Iterator[Sample]:
    """Yield toy samples of this size, each after a pause."""
    for index in indices:
        time.sleep(pause_s)
        yield toy_sample(index, **size)


def run(folder: Path, name: str, pause_s: float = 0.0, **size: int) -> list[int]:
    """Write the shards that are not there yet, then the manifest; return the indices of those shards."""
    there = finished_shards(folder, "abc")
    made = [shard for shard in PLAN if shard.index not in there]
    for shard in made:
        write_shard(folder, shard, find_writer(name), make_samples(shard.indices, pause_s, size), mosaic_options(name), "abc")
    write_manifest(folder, PLAN, "abc", mosaic_options(name))
    return [shard.index for shard in made]


if __name__ == "__main__":
    run(Path(sys.argv[1]), sys.argv[2], PAUSE_S)
