"""What a data set will take, from a small batch that is really made."""

import math
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from data_gen.generate import Generator
from data_gen.recipe.dataset_config import DataSet
from data_gen.sources.collections import open_collection
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.photographs import Photographs
from data_gen.storage.shards import Shard, plan_shards, write_shard
from data_gen.storage.writers.writer import find_writer
from simulator.config.distributions import support_of
from simulator.device import open_device

LEAST_SECONDS, MOST_SECONDS = 2.0, 10.0  # of measuring: without decoding, so that no slow sample decides; and with it
MOST_SAMPLES = 256


@dataclass(frozen=True)
class Estimate:
    """What a data set takes on this machine, in one process.

    seconds_per_sample: picture, noise and writing, kernels already built, without decoding files that are kept decoded;
        cpu_seconds_per_sample: of all its threads, which other processes on the machine hardly change.
    bytes_per_sample: on disk. samples: of the data set.
    decodings: how often a photograph is decoded, beginning with an empty cache. seconds_per_decoding: file to cache.
    decoded_bytes: of the photographs that are drawn. pictures: of each collection.
    ratios: least and greatest exposure ratio.
    made: samples that were made to measure this, the first ones of the data set and, where it has fewer, others behind them.
    problems: what was wrong with pictures -> samples, of those that were made, that had drawn them.
    """

    shards: int
    samples: int
    seconds_per_sample: float
    cpu_seconds_per_sample: float
    bytes_per_sample: float
    decodings: float
    seconds_per_decoding: float
    decoded_bytes: float
    pictures: dict[str, int]
    ratios: tuple[float, float]
    made: int
    problems: dict[str, int]

    @property
    def seconds(self) -> float:
        """Time of the whole data set in one process [s]."""
        return self.samples * self.seconds_per_sample + self.decodings * self.seconds_per_decoding


def estimate(config: DataSet, device: str | None = None, decoded: DecodedPictures | None = None) -> Estimate:
    """Make some samples of a data set and write them to a temporary folder, where decoded pictures are kept, too.

    decoded: of the run; only its limit is used. Raises PhotositeError as a run does.
    """
    format_writer, options = find_writer(config.writer.format), config.writer.options
    limit_bytes = (DecodedPictures() if decoded is None else decoded).limit_bytes
    spent, busy, total, made, count = 0.0, 0.0, 0.0, 0, 4
    with tempfile.TemporaryDirectory() as folder:
        kept = DecodedPictures(limit_bytes, Path(folder) / "decoded")
        generator, cost = Generator(config, open_device(device), decoded=kept), kept.cost
        sizes = [format_writer.bytes_per_sample(sample, options) for sample in generator.samples(range(min(4, config.count)))]
        while spent < LEAST_SECONDS and total < MOST_SECONDS and made < MOST_SAMPLES:
            count = min(2 * count, MOST_SAMPLES)
            shard, decoding, decoding_cpu = Shard(0, 1, made, count), cost.seconds, cost.cpu_seconds
            start, begun = time.perf_counter(), time.process_time()
            write_shard(Path(folder), shard, format_writer, generator.samples(shard.indices), options)
            took, made = time.perf_counter() - start, made + count
            total, spent = total + took, spent + took - (cost.seconds - decoding)
            busy += time.process_time() - begun - (cost.cpu_seconds - decoding_cpu)
    camera = config.noise.list_cameras()[0]
    sources = {name: open_collection(config.pictures, name, camera) for name in config.pictures}
    listed = {name: len(source.names()) for name, source in sources.items()}
    drawn = {name: listed[name] for name, source in sources.items() if isinstance(source, Photographs)}
    bytes_each = cost.decoded_bytes / max(cost.pictures, 1)
    different, decodings = expected_decodings(config, drawn, int(limit_bytes / max(bytes_each, 1)))
    return Estimate(
        shards=len(plan_shards(config.count, config.writer.samples_per_shard)),
        samples=config.count,
        seconds_per_sample=spent / made,
        cpu_seconds_per_sample=busy / made,
        bytes_per_sample=sum(sizes) / len(sizes),
        decodings=decodings,
        seconds_per_decoding=cost.seconds / max(cost.pictures, 1),
        decoded_bytes=different * bytes_each,
        pictures=listed,
        ratios=support_of(config.ratio_distribution),
        made=made,
        problems={message: len(set(drew)) for message, drew in generator.problems.items()},
    )


def expected_decodings(config: DataSet, pictures: Mapping[str, int], room: int) -> tuple[float, float]:
    """Return how many different photographs are drawn on average, and how often one is decoded.

    n draws from N pictures take N (1 - (1 - 1 / N)^n) different ones. Where the cache has room for R of them and fewer, it is
    full after about N ln(N / (N - R)) draws, and each draw after that misses it with the probability 1 - R / N.
    pictures: number of photographs of each collection that has such. room: photographs that the cache holds.
    """
    groups, weights = -(-config.count // config.crops_per_picture), sum(config.weights or (1.0,))
    draws = {name: groups * config.picture_weights.get(name, 1.0) / weights for name in pictures}
    different = sum(count * (1.0 - (1.0 - 1.0 / count) ** draws[name]) for name, count in pictures.items())
    total, drawn = sum(pictures.values()), sum(draws.values())
    if room >= different:
        return different, different
    until_full = total * math.log((total + 0.5) / (total - room + 0.5))
    return different, room + max(drawn - until_full, 0.0) * (1.0 - room / total)
