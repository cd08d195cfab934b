"""HDF5: one dataset for each array, the samples along its first axis, each sample a chunk of its own.

Datasets `noisy`, `clean` and, where the samples have it, `variance`: (samples, frames, height, width), or packed
(samples, frames, 4, height / 2, width / 2). Each number that every sample has is a dataset of its field's name, such as
`gain_dn_per_e`; `facts` holds all that is known of a sample as JSON. Attributes say the units.
"""

import io
import json
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from data_gen.samples.record import UNITS, sample_arrays, sample_facts, sample_from, stackable_arrays
from data_gen.samples.sample import Sample
from data_gen.storage.writers.writer import WriterOptions
from simulator.errors import require
from simulator.raw.software import software

if TYPE_CHECKING:
    import h5py
    from typing_extensions import Buffer


OLDEST_H5PY = (3, 15)


class Hdf5Writer:
    """One file per shard, without compression (noise has nothing to compress) and without times.

    The same samples give the same bytes in every process and on every worker. This needs h5py 3.15: those before store when the
    root group was made, and with HDF5 before 1.14.6 bytes of memory that nobody has set.
    """

    format = "hdf5"
    suffix = ".h5"
    folder = False

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one file; see `Writer`. Raises PhotositeError for an old h5py, and unless all samples have one shape."""
        import h5py

        rule = "its files differ from run to run; install 3.15 or newer: pip install 'photosite[dataset]'"
        require(h5py.version.version_tuple[:2] >= OLDEST_H5PY, "version of h5py", h5py.version.version, rule)
        facts: list[str] = []
        datasets: dict[str, h5py.Dataset] = {}
        with _DeferredErrorFile(path) as target:
            with h5py.File(target, "w", libver=("v110", "v110"), track_times=False) as file:
                file.attrs["software"], file.attrs["channels"] = software(), options.channels
                for place, arrays in enumerate(stackable_arrays(samples, options.channels, facts)):
                    for name, array in arrays.items():
                        if name not in datasets:
                            datasets[name] = _create_dataset(file, name, array)
                        datasets[name].resize(place + 1, axis=0)
                        datasets[name][place] = array
                    target.raise_error()
                _write_columns(file, facts)
            target.raise_error()

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read samples by their places; see `Writer`."""
        import h5py

        with h5py.File(path, "r") as file:
            arrays, facts = {name: _dataset(file, name) for name in UNITS if name in file}, _dataset(file, "facts")
            for place in places:
                yield sample_from({name: array[place] for name, array in arrays.items()}, facts[place])

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Arrays, columns and the index of the chunks; see `Writer`."""
        arrays, facts = sample_arrays(sample, options.channels), sample_facts(sample, options.channels)
        columns = sum(array.itemsize * array[0].size for array in _numbers([json.loads(facts)]).values())
        return sum(array.nbytes + 8 for array in arrays.values()) + columns + len(facts)


WRITER = Hdf5Writer()


class _DeferredErrorFile(io.FileIO):
    """A new file that stores its first write error until `raise_error` is called, and ignores what is written after it.

    HDF5 cannot close a file after a failed write: it would try again, and print errors, when the process ends.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self.error: OSError | None = None

    def write(self, data: "Buffer", /) -> int:
        """Write all of it, or nothing once an error has occurred."""
        rest = memoryview(data).cast("B")
        try:
            while rest and self.error is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.error = error
        return memoryview(data).nbytes

    def raise_error(self) -> None:
        """Raise the error that occurred, if any."""
        if self.error is not None:
            raise self.error


def _create_dataset(file: "h5py.File", name: str, array: np.ndarray) -> "h5py.Dataset":
    """Create an empty dataset that can grow along its first axis, one sample per chunk."""
    made = file.create_dataset(
        name,
        shape=(0, *array.shape),
        maxshape=(None, *array.shape),
        chunks=(1, *array.shape),
        dtype=array.dtype,
        track_times=False,
    )
    made.attrs["unit"] = UNITS[name]
    made.attrs["axes"] = "sample, frame, row, column" if array.ndim == 3 else "sample, frame, channel, row, column"
    return made


def _dataset(file: "h5py.File", name: str) -> "h5py.Dataset":
    """Return a dataset of a file. Raises KeyError for anything else of that name."""
    import h5py

    found = file[name]
    if not isinstance(found, h5py.Dataset):
        raise KeyError(f"{name} is no dataset")
    return found


def _write_columns(file: "h5py.File", facts: list[str]) -> None:
    """Write the JSON of all samples, and a dataset for each numeric field."""
    file.create_dataset("facts", data=np.array([line.encode("ascii") for line in facts]), track_times=False)
    for name, column in _numbers([json.loads(line) for line in facts]).items():
        file.create_dataset(name, data=column, track_times=False)


def _numbers(facts: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Columns of the facts that are numbers, or equally long lists of them, in every sample; whole numbers stay whole."""
    found = {}
    for name in facts[0]:
        values = [one[name] for one in facts]
        leaves = list(chain.from_iterable(np.ravel(np.array(value, dtype=object)) for value in values))
        if len({np.shape(value) for value in values}) == 1 and all(type(leaf) in (int, float) for leaf in leaves):
            # NumPy makes float64 of whole numbers on both sides of 2^63, such as seeds.
            large = all(type(leaf) is int and leaf >= 0 for leaf in leaves) and max(leaves, default=0) >= 2**63
            found[name] = np.array(values, dtype=np.uint64 if large else None)
    return found
