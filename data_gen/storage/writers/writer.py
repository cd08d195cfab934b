"""File formats of a data set. A writer puts the samples of one shard into one file or folder, with the same bytes each time."""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol, get_args

from data_gen.samples.packing import Channels
from data_gen.samples.sample import Sample
from simulator.errors import PhotositeError, require


@dataclass(frozen=True)
class WriterOptions:
    """What a user may choose about the files, and what the writer of a shard adds.

    channels: mosaic as the sensor has it, or four planes in the order rggb or rgbg (data_gen/samples/packing.py).
    index_digits: least number of digits of a sample's index in names; `write_shard` sets it to those of its last index, so
        that the names of a shard sort by index.
    """

    channels: Channels = "mosaic"
    index_digits: int = 9

    def __post_init__(self) -> None:
        known = get_args(Channels)
        require(self.channels in known, "writer.channels", self.channels, f"give one of {', '.join(known)}")

    def index_name(self, index: int) -> str:
        """Return a sample's index as it stands in names, filled up with zeros."""
        return f"{index:0{self.index_digits}d}"


AS_IT_IS = WriterOptions()


class Writer(Protocol):
    """One file format.

    format: its name in a configuration. suffix: ends the name of a shard. folder: a shard is a folder of files, not one file.
    """

    format: str
    suffix: str
    folder: bool

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one shard to a path that is not there yet; samples come one at a time and need not fit into memory together.

        Raises PhotositeError for samples that the format cannot hold, OSError when the disk is full.
        """
        ...

    def read(self, path: Path, places: Iterable[int]) -> Iterable[Sample]:
        """Read samples back by their places in the shard, 0 for its first, as mosaics."""
        ...

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Bytes on disk that one sample such as this takes, within a few percent."""
        ...


# Name in a configuration -> package of the extra `dataset` that it needs.
FORMATS = {"webdataset": None, "npz": None, "dng": None, "hdf5": "h5py", "zarr": "zarr", "lmdb": "lmdb", "eld": "lmdb"}


def find_writer(name: str) -> Writer:
    """Return a writer by its name in a configuration.

    Raises PhotositeError for an unknown name and when the format's library is not installed.
    """
    require(name in FORMATS, "writer.format", name, f"give one of {', '.join(FORMATS)}")
    library = FORMATS[name]
    if library is not None and find_spec(library) is None:
        raise PhotositeError(f"needs {library}: pip install 'photosite[dataset]'", key="writer.format", value=name)
    return import_module(f"data_gen.storage.writers.{name}").WRITER
