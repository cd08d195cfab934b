"""What a data set will take, from a small batch that is really made."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from data_gen.generate import Generator
from data_gen.recipe.dataset_config import DataSet
from data_gen.recipe.distributions import support_of
from data_gen.sources.collections import open_collection
from data_gen.storage.shards import Shard, plan_shards, write_shard
from data_gen.storage.writers.writer import find_writer
from simulator.device import open_device

LEAST_SECONDS = 2.0  # of measuring, so that the clock's grain and one slow picture do not decide
MOST_SAMPLES = 256


@dataclass(frozen=True)
class Estimate:
    """What one sample takes on this machine, in one process.

    seconds_per_sample: picture, noise and writing, kernels already built; cpu_seconds_per_sample: of all its threads, which
        other processes on the machine hardly change. bytes_per_sample: on disk.
    pictures: of each collection. ratios: least and greatest exposure ratio.
    problems: what was wrong with pictures of the batch -> samples that had drawn them.
    """

    shards: int
    seconds_per_sample: float
    cpu_seconds_per_sample: float
    bytes_per_sample: float
    pictures: dict[str, int]
    ratios: tuple[float, float]
    problems: dict[str, int]


def estimate(config: DataSet, device: str | None = None) -> Estimate:
    """Make some samples of a data set and write them to a temporary folder. Raises PhotositeError as a run does."""
    format_writer, options = find_writer(config.writer.format), config.writer.options
    generator = Generator(config, open_device(device))
    sizes = [format_writer.bytes_per_sample(sample, options) for sample in generator.samples(range(min(4, config.count)))]
    spent, busy, made, count = 0.0, 0.0, 0, 4
    with tempfile.TemporaryDirectory() as folder:
        while spent < LEAST_SECONDS and made < MOST_SAMPLES:
            count = min(2 * count, MOST_SAMPLES)
            shard = Shard(0, 1, made, count)
            start, begun = time.perf_counter(), time.process_time()
            write_shard(Path(folder), shard, format_writer, generator.samples(shard.indices), options)
            spent, busy, made = spent + time.perf_counter() - start, busy + time.process_time() - begun, made + count
    camera = config.noise.list_cameras()[0]
    listed = {name: len(open_collection(config.pictures, name, camera).names()) for name in config.pictures}
    return Estimate(
        shards=len(plan_shards(config.count, config.writer.samples_per_shard)),
        seconds_per_sample=spent / made,
        cpu_seconds_per_sample=busy / made,
        bytes_per_sample=sum(sizes) / len(sizes),
        pictures=listed,
        ratios=support_of(config.ratio_distribution),
        problems={message: len(drew) for message, drew in generator.problems.items()},
    )
