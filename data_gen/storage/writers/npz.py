"""NumPy archives, two a frame, with the keys that LED reads.

LED (Srameo/LED, led/data/paired_raw_dataset.py at 0b16687) wants `im` (4, h, w) R, G1, B, G2 in codes, `black_level` and
`white_level` (4, 1, 1), `wb` (4,) with green = 1, `ccm` (3, 3) from balanced camera colours to linear sRGB. `pairs.txt` is
its `data_pair_list`, with the shard's folder as `dataroot` and `npz` as `postfix`; the exposure ratio stands in the names.
"""

import io
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from data_gen.samples.camera_color import camera_to_srgb
from data_gen.samples.record import sample_arrays, sample_facts, sample_from
from data_gen.samples.sample import Sample
from data_gen.storage.writers.pair_names import pair_names, pairs_by_sample
from data_gen.storage.writers.writer import WriterOptions


class NpzWriter:
    """A folder of `INDEX_FRAME_1s.noisy.npz` and `INDEX_FRAME_RATIOs.clean.npz`, with `pairs.txt`.

    LED reads it when the channels are rgbg; a mosaic has one plane. The noisy file also holds `variance`, when the sample
    has it, and in `facts`, a JSON text, all else that is known; LED overlooks both.
    """

    format = "npz"
    suffix = "-npz"
    folder = True

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one folder; see `Writer`."""
        path.mkdir()
        pairs = []
        for sample in samples:
            for names, archives in _frames(sample, options):
                for name, content in zip(names, archives, strict=True):
                    (path / f"{name}.npz").write_bytes(content)
                pairs.append(" ".join(names) + "\n")
        (path / "pairs.txt").write_text("".join(pairs), encoding="utf-8")

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read samples by their places; see `Writer`."""
        pairs = pairs_by_sample((path / "pairs.txt").read_text(encoding="utf-8"))
        for place in places:
            yield _sample(path, pairs[place])

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Size of one sample's files and lines; see `Writer`."""
        frames = list(_frames(sample, options))
        return sum(sum(map(len, archives)) + len(" ".join(names)) + 1 for names, archives in frames)


WRITER = NpzWriter()


def _frames(sample: Sample, options: WriterOptions) -> Iterator[tuple[tuple[str, str], tuple[bytes, bytes]]]:
    """Names without suffix, and contents, of the noisy and the clean archive of each frame."""
    arrays = sample_arrays(sample, options.channels)
    planes = 1 if options.channels == "mosaic" else 4
    red, green, blue = sample.white_balance
    letters = {"mosaic": (), "rggb": (red, green, green, blue), "rgbg": (red, green, blue, green)}[options.channels]
    shared = {
        "black_level": np.full((planes, 1, 1), sample.black_level_dn, "<f4"),
        "white_level": np.full((planes, 1, 1), sample.white_level_dn, "<f4"),
        "wb": np.array(letters or sample.white_balance, "<f4"),
        "ccm": camera_to_srgb(sample.color_matrix).astype("<f4"),
    }
    facts = np.array(sample_facts(sample, options.channels).encode("ascii"))
    for frame, names in enumerate(pair_names(sample, options)):
        one = {name: array[frame].reshape(planes, *array.shape[-2:]) for name, array in arrays.items()}
        noisy, clean = {"im": one.pop("noisy")}, {"im": one.pop("clean")}
        yield names, (_archive(noisy | shared | one | {"facts": facts}), _archive(clean | shared))


def _archive(arrays: dict[str, np.ndarray]) -> bytes:
    """Encode arrays as an uncompressed npz archive."""
    buffer = io.BytesIO()
    named: dict[str, Any] = arrays  # checkers take ** for the keyword allow_pickle, too
    np.savez(buffer, **named)
    return buffer.getvalue()


def _sample(path: Path, pairs: list[list[str]]) -> Sample:
    """Read the files of one sample's frames and rebuild the sample."""
    found: dict[str, list[np.ndarray]] = {}
    facts = b""
    for noisy, clean in pairs:
        with np.load(path / f"{noisy}.npz") as archive:
            facts = archive["facts"].item()
            for name in {"im", "variance"} & set(archive):
                found.setdefault("noisy" if name == "im" else name, []).append(archive[name])
        with np.load(path / f"{clean}.npz") as archive:
            found.setdefault("clean", []).append(archive["im"])
    mosaic = found["noisy"][0].shape[0] == 1
    arrays = {name: np.concatenate(frames) if mosaic else np.stack(frames) for name, frames in found.items()}
    return sample_from(arrays, facts)
