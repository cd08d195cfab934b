"""Zarr, format 3: one array each for `noisy`, `clean` and `variance`, the samples along the first axis.

Format 3 because of its sharding codec: each sample stays a chunk that can be read alone, but many chunks share a file, where
format 2 would make a file for every one. Arrays are (samples, frames, height, width), or packed
(samples, frames, 4, height / 2, width / 2); the group's attribute `samples` is a list of all that is known of each.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from data_gen.samples.record import UNITS, sample_arrays, sample_facts, sample_from, stackable_arrays
from data_gen.samples.sample import Sample
from data_gen.storage.writers.writer import WriterOptions
from simulator.raw.software import software

if TYPE_CHECKING:
    import zarr

_FILE_BYTES = 2**25  # about, of the file that holds several samples of one array; it is made in memory
_INDEX_BYTES = 16  # of each chunk in the index of its file


@dataclass(frozen=True)
class ZarrWriter:
    """A folder per shard, without compression: noise has nothing to compress.

    most_per_file: greatest number of chunks in a file; the index of a file has an entry for each, also for missing ones.
    """

    most_per_file: int = 256

    format: ClassVar = "zarr"
    suffix: ClassVar = ".zarr"
    folder: ClassVar = True

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one group; see `Writer`. Raises PhotositeError unless all samples have one shape."""
        import zarr

        group = zarr.open_group(str(path), mode="w", zarr_format=3)
        facts: list[str] = []
        waiting: list[dict[str, np.ndarray]] = []
        for arrays in stackable_arrays(samples, options.channels, facts):
            waiting.append(arrays)
            if len(waiting) == self._samples_per_file(arrays):
                self._append(group, waiting)
        if waiting:
            self._append(group, waiting)
        about = {"software": software(), "channels": options.channels, "units": UNITS}
        group.attrs.update(about | {"samples": [json.loads(line) for line in facts]})

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read samples by their places; see `Writer`."""
        import zarr

        group = zarr.open_group(str(path), mode="r")
        metadata: dict[str, Any] = group.attrs.asdict()
        facts, arrays = metadata["samples"], {name: _array(group, name) for name in UNITS if name in group}
        for place in places:
            yield sample_from({name: np.asarray(array[place]) for name, array in arrays.items()}, json.dumps(facts[place]))

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Chunks, their places in the index, and the facts with their indentation; see `Writer`."""
        arrays = sample_arrays(sample, options.channels).values()
        facts = json.dumps([json.loads(sample_facts(sample, options.channels))], indent=2)
        deeper = 4 * facts.count("\n")  # the list stands two levels down in the file
        return sum(array.nbytes + _INDEX_BYTES for array in arrays) + len(facts) + deeper

    def _samples_per_file(self, arrays: dict[str, np.ndarray]) -> int:
        """Return how many samples of these arrays share a file."""
        return min(max(1, _FILE_BYTES // max(array.nbytes for array in arrays.values())), self.most_per_file)

    def _append(self, group: "zarr.Group", waiting: list[dict[str, np.ndarray]]) -> None:
        """Write the samples that wait as the next file of each array, and empty the list."""
        for name, first in waiting[0].items():
            if name not in group:
                axes = ("frame", "row", "column") if first.ndim == 3 else ("frame", "channel", "row", "column")
                group.create_array(
                    name,
                    shape=(0, *first.shape),
                    chunks=(1, *first.shape),
                    shards=(self._samples_per_file(waiting[0]), *first.shape),
                    dtype=first.dtype,
                    compressors=None,
                    dimension_names=("sample", *axes),
                    attributes={"unit": UNITS[name]},
                    config={"write_empty_chunks": True},
                )
            _array(group, name).append(np.stack([arrays[name] for arrays in waiting]))
        waiting.clear()


def _array(group: "zarr.Group", name: str) -> "zarr.Array[Any]":
    """Return an array of the group. Raises KeyError for a group of that name."""
    import zarr

    found = group[name]
    if not isinstance(found, zarr.Array):
        raise KeyError(f"{name} is no array")
    return found


WRITER = ZarrWriter()
