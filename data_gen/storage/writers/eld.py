"""LMDB in the layout that ELD trains from. It loses information, because ELD's does.

ELD (Vandermode/ELD at 39846c7, util/lmdb_data.py and dataset/lmdb_dataset.py) has one database for noisy and one for clean
frames: key `{:08}` from 0, value uint16 (4, h, w) R, G1, B, G2 of (code - black) / (white - black), the noisy one times the
exposure ratio, clipped to 0 ... 1 and scaled to 65535; `meta_info.pkl` holds `shape`, `dtype` and per key (wb, ccm).
So what lies below black is lost, and noise near black is no longer symmetric. The format `lmdb` keeps it.
ELD rounds down; this rounds to the nearest, which does not darken the frame.
"""

import json
import pickle
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from data_gen.samples.camera_color import camera_to_srgb
from data_gen.samples.packing import pack
from data_gen.samples.record import sample_facts, sample_from
from data_gen.samples.sample import Sample
from data_gen.storage.writers.lmdb_file import new_lmdb, page_bytes, read_lmdb
from data_gen.storage.writers.writer import WriterOptions
from simulator.errors import PhotositeError

if TYPE_CHECKING:
    import lmdb

_FULL = 65535


class EldWriter:
    """A folder with the databases `noisy` and `clean`, and `facts.jsonl`: a line of all that is known for each sample."""

    format = "eld"
    suffix = ".eld"
    folder = True

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write both databases; see `Writer`. Raises PhotositeError unless the channels are rgbg and samples have one frame."""
        if options.channels != "rgbg":
            raise PhotositeError("ELD reads R, G1, B, G2; set rgbg", key="writer.channels", value=options.channels)
        meta: dict[object, object] = {"dtype": np.uint16}
        path.mkdir()
        with new_lmdb(path / "noisy") as put_noisy, new_lmdb(path / "clean") as put_clean:
            with open(path / "facts.jsonl", "w", encoding="ascii") as facts:
                for place, sample in enumerate(samples):
                    noisy, clean = _to_signals(sample)
                    if meta.setdefault("shape", noisy.shape) != noisy.shape:
                        raise PhotositeError(
                            f"{noisy.shape} after {meta['shape']}: ELD wants one size", part=f"sample {sample.index}"
                        )
                    put_noisy(f"{place:08d}", noisy.tobytes())
                    put_clean(f"{place:08d}", clean.tobytes())
                    red, green, blue = sample.white_balance
                    meta[place] = (_Array((red, green, blue, green)), _Array(camera_to_srgb(sample.color_matrix).tolist()))
                    facts.write(sample_facts(sample, options.channels) + "\n")
        for name in ("noisy", "clean"):
            (path / name / "meta_info.pkl").write_bytes(pickle.dumps(meta, protocol=4))

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read the samples, in codes; what lay below black or above white is lost; see `Writer`."""
        facts = (path / "facts.jsonl").read_text(encoding="ascii").splitlines()
        with read_lmdb(path / "noisy") as noisy, read_lmdb(path / "clean") as clean:
            for place in places:
                key = b"%08d" % place
                yield _to_sample(facts[place], _stored(noisy, key), _stored(clean, key))

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Pages of both databases and the facts; see `Writer`."""
        facts = len(sample_facts(sample, options.channels)) + 1
        return 2 * page_bytes({"00000000": sample.noisy_dn.nbytes}) + facts + 2 * 280  # of meta_info.pkl


WRITER = EldWriter()


class _Array:
    """Pickled as a call of numpy.array, which every version of NumPy reads; an array itself names modules that moved."""

    def __init__(self, values: object) -> None:
        self.values = values

    def __reduce__(self) -> tuple[Callable[..., np.ndarray], tuple[object]]:
        return np.array, (self.values,)


def _to_signals(sample: Sample) -> tuple[np.ndarray, np.ndarray]:
    """Scale the noisy and the clean frame as ELD stores them, (4, h, w) uint16."""
    if len(sample.noisy_dn) != 1:
        raise PhotositeError(f"{len(sample.noisy_dn)} frames: ELD's layout holds one; use lmdb", part=f"sample {sample.index}")
    span_dn = sample.white_level_dn - sample.black_level_dn
    stored = []
    for frame, ratio in ((sample.noisy_dn[0], sample.exposure_ratios[0]), (sample.clean_dn[0], 1.0)):
        signal = (pack(frame, sample.cfa, "rgbg").astype(np.float64) - sample.black_level_dn) / span_dn * ratio
        stored.append(np.rint(np.clip(signal, 0.0, 1.0) * _FULL).astype("<u2"))
    return stored[0], stored[1]


def _stored(transaction: "lmdb.Transaction[bytes]", key: bytes) -> bytes:
    """Read one value. Raises KeyError when it is missing."""
    value = transaction.get(key)
    if value is None:
        raise KeyError(f"{transaction.env.path()} has no {key.decode()}")
    return value


def _to_sample(facts: str, noisy: bytes, clean: bytes) -> Sample:
    """Rebuild a sample, in codes, from its stored signals."""
    known = json.loads(facts)
    black_dn, ratio = known["black_level_dn"], known["exposure_ratios"][0]
    span_dn = known["white_level_dn"] - black_dn
    _, height, width = known["shape"]
    one, other = (np.frombuffer(stored, "<u2").reshape(1, 4, height // 2, width // 2) / _FULL for stored in (noisy, clean))
    codes = np.rint(black_dn + span_dn * one / ratio).astype(np.uint16)
    return sample_from({"noisy": codes, "clean": (black_dn + span_dn * other).astype(np.float32)}, facts)
