"""DNG files, a noisy and a clean one a frame: what every raw reader, and so most training code, opens.

The metadata are true of the frame: levels, ISO, colour matrix, neutral of the light, and NoiseProfile from K and the read
noise (DNG 1.4: variance S x + O of the signal x). Exposure times are the ratio's: one second for the noisy frame, ratio
seconds for the clean one. Clean codes are rounded, and the variance of that, 1/12 DN^2, is all their NoiseProfile tells.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from data_gen.samples.record import sample_facts, sample_from
from data_gen.samples.sample import Sample
from data_gen.storage.writers.pair_names import pair_names, pairs_by_sample
from data_gen.storage.writers.writer import WriterOptions
from simulator.errors import PhotositeError
from simulator.raw.dng.writer import dng_bytes
from simulator.raw.raw_image import Raw
from simulator.raw.raw_reader import read_raw_file

_NO_SHOT_NOISE = 1e-12  # Adobe's reader takes no slope of 0


class DngWriter:
    """A folder of DNG files, `pairs.txt` as LED reads it (`postfix: null`), and `INDEX.json` with all that is known.

    Variance maps have no place here; K and the read noise are in NoiseProfile.
    """

    format = "dng"
    suffix = "-dng"
    folder = True

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one folder; see `Writer`. Raises PhotositeError for packed channels and for a camera without colour matrix."""
        path.mkdir()
        pairs = []
        for sample in samples:
            for names, contents in _frames(sample, options):
                for name, content in zip(names, contents, strict=True):
                    (path / name).write_bytes(content)
                pairs.append(" ".join(names) + "\n")
            facts = path / f"{options.index_name(sample.index)}.json"
            facts.write_text(sample_facts(sample, "mosaic") + "\n", encoding="ascii")
        (path / "pairs.txt").write_text("".join(pairs), encoding="utf-8")

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read samples by their places, clean codes rounded and without variance; see `Writer`."""
        pairs = pairs_by_sample((path / "pairs.txt").read_text(encoding="utf-8"))
        for place in places:
            noisy, clean = (np.stack([read_raw_file(path / names[kind]).mosaic for names in pairs[place]]) for kind in (0, 1))
            index = pairs[place][0][0].split("_")[0]
            facts = (path / f"{index}.json").read_text(encoding="ascii")
            yield sample_from({"noisy": noisy, "clean": clean.astype(np.float32)}, facts)

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Size of one sample's files and lines; see `Writer`."""
        frames = sum(sum(map(len, contents)) + len(" ".join(names)) + 1 for names, contents in _frames(sample, options))
        return frames + len(sample_facts(sample, "mosaic")) + 1


WRITER = DngWriter()


def _frames(sample: Sample, options: WriterOptions) -> Iterator[tuple[tuple[str, str], tuple[bytes, bytes]]]:
    """Names and contents of the noisy and the clean DNG of each frame."""
    if options.channels != "mosaic":
        raise PhotositeError("a DNG holds the mosaic; set mosaic", key="writer.channels", value=options.channels)
    if sample.color_matrix is None and sample.cfa != "MONO":
        fix = "take a source or camera that has a color_matrix, or another format"
        raise PhotositeError(
            f"its colour matrix is not known, a DNG needs one; {fix}", part=f"sample {sample.index} ({sample.source})"
        )
    span_dn = sample.white_level_dn - sample.black_level_dn
    noisy_profile = sample.gain_dn_per_e / span_dn, (sample.read_noise_dn / span_dn) ** 2
    clean_profile = _NO_SHOT_NOISE, 1.0 / 12.0 / span_dn**2
    clean = np.rint(np.clip(sample.clean_dn, 0, 65535)).astype(np.uint16)
    for frame, (names, ratio) in enumerate(zip(pair_names(sample, options), sample.exposure_ratios, strict=True)):
        yield (
            (f"{names[0]}.dng", f"{names[1]}.dng"),
            (
                dng_bytes(_raw(sample, names[0], sample.noisy_dn[frame], noisy_profile, 1.0)),
                dng_bytes(_raw(sample, names[1], clean[frame], clean_profile, ratio)),
            ),
        )


def _raw(sample: Sample, name: str, dn: np.ndarray, profile: tuple[float, float], exposure_time_s: float) -> Raw:
    """Frame as the raw module writes it; what a sample does not know is 0 or empty, which leaves the tag out."""
    mono = sample.cfa == "MONO"
    gains = np.array(sample.white_balance)
    return Raw(
        name=name,
        dn=np.ascontiguousarray(dn),
        mean_electrons=np.empty((0, 0), np.float32),  # for the twin, which is not written
        noise_free_dn=np.empty((0, 0), np.float32),
        cfa=sample.cfa,
        bit_depth=sample.bit_depth,
        black_level_dn=sample.black_level_dn,
        white_level_dn=sample.white_level_dn,
        noise_profile=(profile,) * (1 if mono else 3),
        color_matrix=None if mono else np.array(sample.color_matrix),
        as_shot_neutral=(1.0,) if mono else tuple(float(value) for value in gains.min() / gains),
        make="Photosite",
        model=sample.camera,
        lens_model="",
        exposure_time_s=exposure_time_s,
        f_number=0.0,
        focal_length_mm=0.0,
        focal_length_35mm_mm=0.0,
        focus_distance_m=0.0,
        iso=sample.iso,
    )
