"""Read samples back from the folder of a data set, in any of the formats."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from data_gen.samples.sample import Sample
from data_gen.storage.manifest import MANIFEST, read_manifest
from data_gen.storage.shards import ShardRecord, finished_shards
from data_gen.storage.writers.writer import find_writer
from simulator.errors import PhotositeError, reading


class SampleFolder:
    """The samples of a data set by their index. It holds no open file, so it may be pickled and used after a fork.

    Without a manifest the data set is not complete; then the shards that are finished can be read.
    Raises PhotositeError when the folder holds no data set.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        there = (self.folder / MANIFEST).is_file()
        records = read_manifest(self.folder)["shards"] if there else list(finished_shards(self.folder).values())
        if not records:
            raise PhotositeError(f"holds no data set: neither {MANIFEST} nor a finished shard", file=self.folder)
        self.records: list[ShardRecord] = sorted(records, key=lambda record: record.first)
        self._starts = [record.first for record in self.records]

    def __len__(self) -> int:
        return sum(record.count for record in self.records)

    def __iter__(self) -> Iterator[Sample]:
        return self.read()

    def __getitem__(self, index: int) -> Sample:
        return next(self.read([index]))

    @property
    def indices(self) -> Iterator[int]:
        """Indices of all samples, in order."""
        for record in self.records:
            yield from range(record.first, record.first + record.count)

    def read(self, indices: Iterable[int] | None = None) -> Iterator[Sample]:
        """Samples in the order of the indices, or all of them. Neighbours in one shard are read together.

        Raises PhotositeError for an index that is not there and for a shard that cannot be read.
        """
        for record, group in groupby(self.indices if indices is None else indices, self._shard):
            source, path = find_writer(record.format), self.folder / record.name
            with reading(path, "check it with `photosite dataset --verify`"):
                yield from source.read(path, [index - record.first for index in group])

    def _shard(self, index: int) -> ShardRecord:
        record = self.records[max(bisect_right(self._starts, index) - 1, 0)]
        if not record.first <= index < record.first + record.count:
            raise PhotositeError(f"has no sample {index}; it holds {len(self)}", file=self.folder)
        return record


def read_samples(folder: str | Path, indices: Iterable[int] | None = None) -> Iterator[Sample]:
    """Samples of a data set's folder, all or those of these indices, as mosaics; see `SampleFolder`."""
    return SampleFolder(folder).read(indices)
