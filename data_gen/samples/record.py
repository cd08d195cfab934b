"""A sample as every file format stores it: a few arrays of fixed type, and all other fields as JSON."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from data_gen.samples.packing import Channels, pack, unpack
from data_gen.samples.sample import Sample
from simulator.errors import PhotositeError

# Name in a file -> field of Sample.
ARRAYS = {"noisy": "noisy_dn", "clean": "clean_dn", "variance": "variance_dn2", "sharp": "sharp_dn", "flow": "flow_px"}
NO_MOSAIC = ("flow",)  # arrays that are not packed
TYPES: dict[str, np.dtype[Any]] = {name: np.dtype("<u2" if name == "noisy" else "<f4") for name in ARRAYS}
UNITS = {"noisy": "DN", "clean": "DN", "variance": "DN^2", "sharp": "DN", "flow": "px"}
_FACTS = [one.name for one in fields(Sample) if one.name not in ARRAYS.values()]
_OF_MOTION = [one.name for one in fields(Sample) if one.default is None]  # left out where the camera stands still


def sample_arrays(sample: Sample, channels: Channels) -> dict[str, np.ndarray]:
    """Arrays by their names in files, little-endian and contiguous; without those that the sample does not have.

    Each is (frames, height, width), packed (frames, 4, height / 2, width / 2); "noisy" uint16 codes with their pedestal,
    "clean" and "sharp" float32 [DN], "variance" float32 [DN^2]. "flow" is (frames, 2, height, width) float32 [px].
    Raises PhotositeError for what cannot be packed.
    """
    found: dict[str, np.ndarray | None] = {name: getattr(sample, field) for name, field in ARRAYS.items()}
    return {
        name: np.ascontiguousarray(array if name in NO_MOSAIC else pack(array, sample.cfa, channels), TYPES[name])
        for name, array in found.items()
        if array is not None
    }


def sample_facts(sample: Sample, channels: Channels) -> str:
    """Everything but the arrays as one line of JSON, keys sorted; a number reads back as the same number.

    Besides the fields of Sample: `channels`, and `shape`, that of the mosaics (frames, height, width).
    """
    known = {name: getattr(sample, name) for name in _FACTS}
    known = {name: value for name, value in known.items() if value is not None or name not in _OF_MOTION}
    facts = known | {"channels": channels, "shape": sample.noisy_dn.shape}
    return json.dumps(facts, sort_keys=True, allow_nan=False, default=lambda value: value.tolist())


def stackable_arrays(samples: Iterable[Sample], channels: Channels, facts: list[str]) -> Iterator[dict[str, np.ndarray]]:
    """Yield the arrays of each sample, which must have the first sample's names and shapes, and append its JSON to `facts`.

    Raises PhotositeError for a sample whose arrays differ, because it could not be stacked with the others.
    """
    first: dict[str, tuple[int, ...]] | None = None
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
    """Rebuild a sample, as mosaics, from the results of `sample_arrays` and `sample_facts`."""
    known: dict[str, Any] = json.loads(facts)
    channels = known.pop("channels")
    del known["shape"]
    known = {name: _to_tuples(value) for name, value in known.items()}
    mosaics: dict[str, Any] = {}
    for name, field in ARRAYS.items():
        stored = np.asarray(arrays[name]) if name in arrays else None
        mosaics[field] = stored if stored is None or name in NO_MOSAIC else unpack(stored, known["cfa"], channels)
    return Sample(**mosaics, **known)


def _to_tuples(value: Any) -> Any:
    """Turn JSON's lists into tuples, as the fields of Sample have them."""
    return tuple(_to_tuples(one) for one in value) if isinstance(value, list) else value
