"""A sample as named members, for formats that hold a list of small files."""

import io
from collections.abc import Mapping

import numpy as np
from numpy.lib import format as npy_format

from data_gen.samples.record import ARRAYS, sample_arrays, sample_facts, sample_from
from data_gen.samples.sample import Sample
from data_gen.storage.writers.writer import WriterOptions

FACTS = "json"
Pieces = list[bytes | memoryview]  # buffers that make one member, in order; arrays are not copied


def members(sample: Sample, options: WriterOptions) -> dict[str, Pieces]:
    """Encode a sample as members by name, sorted: `INDEX.clean.npy`, `INDEX.json`, `INDEX.noisy.npy`, `INDEX.variance.npy`.

    The variance is left out where it is not known.
    """
    found = {f"{name}.npy": _npy(array) for name, array in sample_arrays(sample, options.channels).items()}
    found[FACTS] = [sample_facts(sample, options.channels).encode("ascii")]
    return {f"{options.index_name(sample.index)}.{name}": found[name] for name in sorted(found)}


def byte_count(pieces: Pieces) -> int:
    """Bytes of one member."""
    return sum(len(piece) for piece in pieces)


def from_members(contents: Mapping[str, bytes]) -> Sample:
    """Rebuild a sample from its members by name, without the index: `clean.npy`, `json`, ..."""
    arrays = {name: np.load(io.BytesIO(contents[f"{name}.npy"])) for name in ARRAYS if f"{name}.npy" in contents}
    return sample_from(arrays, contents[FACTS])


def _npy(array: np.ndarray) -> Pieces:
    """Encode an array in NumPy's file format 1.0: header and data."""
    header = io.BytesIO()
    npy_format.write_array_header_1_0(header, npy_format.header_data_from_array_1_0(array))
    return [header.getvalue(), memoryview(array.data).cast("B")]
