"""A sample as every format holds it: a few arrays of fixed type, and facts that JSON can hold."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields

import numpy as np

from data_gen.samples.packing import Channels, packed, unpacked
from data_gen.samples.sample import Sample
from simulator.errors import PhotositeError

ARRAYS = {"noisy": "noisy_dn", "clean": "clean_dn", "variance": "variance_dn2"}  # name in a file -> field of Sample
TYPES = {"noisy": np.dtype("<u2"), "clean": np.dtype("<f4"), "variance": np.dtype("<f4")}
UNITS = {"noisy": "DN", "clean": "DN", "variance": "DN^2"}
_FACTS = [one.name for one in fields(Sample) if one.name not in ARRAYS.values()]


def sample_arrays(sample: Sample, channels: Channels) -> dict[str, np.ndarray]:
    """Arrays by their names in files, little-endian and contiguous; without "variance" when the sample has none.

    Each is (frames, height, width), packed (frames, 4, height / 2, width / 2); "noisy" uint16 codes with their pedestal,
    "clean" float32 [DN], "variance" float32 [DN^2]. Raises PhotositeError for what cannot be packed.
    """
    found = {name: getattr(sample, field) for name, field in ARRAYS.items()}
    return {
        name: np.ascontiguousarray(packed(array, sample.cfa, channels), TYPES[name])
        for name, array in found.items()
        if array is not None
    }


def sample_facts(sample: Sample, channels: Channels) -> str:
    """Everything but the arrays as one line of JSON, keys sorted; a number reads back as the same number.

    Besides the fields of Sample: `channels`, and `shape`, that of the mosaics (frames, height, width).
    """
    facts = {name: getattr(sample, name) for name in _FACTS} | {"channels": channels, "shape": sample.noisy_dn.shape}
    return json.dumps(facts, sort_keys=True, allow_nan=False, default=lambda value: value.tolist())


def alike(samples: Iterable[Sample], channels: Channels, facts: list[str]) -> Iterator[dict[str, np.ndarray]]:
    """Pass on the arrays of samples that can be stacked, and append their facts.

    Raises PhotositeError for one whose shape or arrays differ from the first's.
    """
    first = None
    for sample in samples:
        arrays = sample_arrays(sample, channels)
        layout = {name: array.shape for name, array in arrays.items()}
        first = first or layout
        if layout != first:
            fix = "give all patches one size, or choose the format webdataset, npz or lmdb"
            raise PhotositeError(
                f"arrays {layout} after {first}: this format stacks them; {fix}", part=f"sample {sample.index}"
            )
        facts.append(sample_facts(sample, channels))
        yield arrays


def sample_from(arrays: Mapping[str, np.ndarray], facts: str | bytes) -> Sample:
    """Put a sample together again, as mosaics, from what `sample_arrays` and `sample_facts` gave."""
    known = json.loads(facts)
    channels = known.pop("channels")
    del known["shape"]
    known = {name: _tuples(value) for name, value in known.items()}
    mosaics = {
        field: unpacked(np.asarray(arrays[name]), known["cfa"], channels) if name in arrays else None
        for name, field in ARRAYS.items()
    }
    return Sample(**mosaics, **known)


def _tuples(value: object) -> object:
    return tuple(_tuples(one) for one in value) if isinstance(value, list) else value
