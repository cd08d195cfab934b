"""Pairs for examples/denoiser.py: clean patches under our noise, the published one, and plain Gaussian noise."""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from published_noise import SONY_A7S2

from data_gen.generate import Generator
from data_gen.recipe.dataset_config import DataSet
from data_gen.samples.packing import pack
from data_gen.samples.sample import Sample
from simulator.config import load_file
from simulator.device import Device
from simulator.errors import PhotositeError

CONFIG = Path(__file__).parent / "denoiser.yaml"
TRAINED_ON = ("chelsea.png", "rocket.jpg", "hubble_deep_field.jpg", "motorcycle_left.png")
HELD_OUT = ("astronaut.png", "coffee.png")
NOISES = OURS, PUBLISHED, GAUSSIAN, GREY = "Photosite", "NumPy model", "Gaussian, mean", "Gaussian, mid-grey"
MID_GREY = 0.18  # signal
DRAWN = 256  # samples at once; their order is shuffled, so that a batch is not cut from one picture


@dataclass(frozen=True)
class Pairs:
    """Planes (samples, 4, height, width) float32 in the order rggb: 0 dark, 1 where the reference exposure saturates.

    noisy: by the noise that made them, times the exposure ratio; codes below black are below 0.
    isos, white_balance: of each sample; white_balance (samples, 3).
    """

    clean: np.ndarray
    noisy: dict[str, np.ndarray]
    isos: np.ndarray
    white_balance: np.ndarray

    def first(self, count: int) -> "Pairs":
        """Return the first pairs alone."""
        noisy = {name: planes[:count] for name, planes in self.noisy.items()}
        return Pairs(self.clean[:count], noisy, self.isos[:count], self.white_balance[:count])


def photographs(names: tuple[str, ...], folder: Path) -> Path:
    """Copy photographs that come with scikit-image to a folder. Raises PhotositeError without it."""
    try:
        import skimage
    except ImportError:
        raise PhotositeError("scikit-image is missing; pip install 'photosite[torch,report,demo]'") from None
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        shutil.copy(Path(skimage.__file__).parent / "data" / name, folder / name)
    return folder


def training_set(seed: int, folder: Path) -> DataSet:
    """Data set of one run, with the photographs of a folder as half of its pictures."""
    return load_file(DataSet, CONFIG, [f"seed={seed}", f"pictures.photographs.photographs={folder.resolve()}"])


def held_out_set(folder: Path) -> DataSet:
    """Other drawings, other photographs, larger patches."""
    other = ["seed=1000", "pictures.drawings.seed=1", "crop=[256, 256]", "crops_per_picture=1", "augment=false"]
    return load_file(DataSet, CONFIG, [*other, f"pictures.photographs.photographs={folder.resolve()}"])


def batches(config: DataSet, device: Device, size: int) -> Iterator[Pairs]:
    """Batches without end. The noise of each is drawn for the same clean patches."""
    generator, order, first = Generator(config, device), np.random.default_rng(config.seed), 0
    while True:
        samples = list(generator.samples(range(first, first + DRAWN)))
        shuffled = order.permutation(DRAWN)
        for start in range(0, DRAWN - size + 1, size):
            yield pairs_of([samples[place] for place in shuffled[start : start + size]], order)
        first += DRAWN


def held_out_pairs(config: DataSet, device: Device, count: int) -> Pairs:
    """Pairs to test on: the published model alone is looked at."""
    return pairs_of(list(Generator(config, device).samples(range(count))), np.random.default_rng(config.seed))


def pairs_of(samples: list[Sample], draw: np.random.Generator) -> Pairs:
    """All kinds of noise for the clean patches of some samples."""
    clean, noisy = [], {name: [] for name in NOISES}
    for sample in samples:
        clean.append(_planes(sample, sample.clean_dn[0]))
        for name, codes in _exposures(sample, draw).items():
            noisy[name].append(_planes(sample, codes, sample.exposure_ratios[0]))
    return Pairs(
        np.stack(clean),
        {name: np.stack(planes) for name, planes in noisy.items()},
        np.array([sample.iso for sample in samples]),
        np.array([sample.white_balance for sample in samples]),
    )


def _exposures(sample: Sample, draw: np.random.Generator) -> dict[str, np.ndarray]:
    """Codes of the sample's short exposure, by the noise in them.

    Gaussian noise is as strong everywhere as the published one is on average over this patch, or as it is at mid-grey.
    """
    published, ratio = SONY_A7S2[sample.iso], sample.exposure_ratios[0]
    mean_dn = (sample.clean_dn[0].astype(np.float64) - sample.black_level_dn) / ratio
    mean_e = np.maximum(mean_dn / published.gain_dn_per_e, 0.0)
    grey_e = MID_GREY * (sample.white_level_dn - sample.black_level_dn) / ratio / published.gain_dn_per_e
    deviations_dn = np.sqrt([published.variance_dn2(mean_e).mean(), published.variance_dn2(grey_e)])
    middle_dn = sample.black_level_dn + mean_dn
    plain = [middle_dn + deviation * draw.standard_normal(mean_dn.shape) for deviation in deviations_dn]
    return dict(zip(NOISES, (sample.noisy_dn[0], published.codes(mean_e, draw), *plain), strict=True))


def _planes(sample: Sample, codes: np.ndarray, ratio: float = 1.0) -> np.ndarray:
    scale = ratio / (sample.white_level_dn - sample.black_level_dn)
    return pack((codes.astype(np.float32) - sample.black_level_dn) * np.float32(scale), sample.cfa, "rggb")
