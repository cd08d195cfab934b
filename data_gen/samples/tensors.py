"""Samples as a network takes them: float32, black 0, white 1, beside the numbers that lead back to codes."""

from dataclasses import dataclass
from typing import get_args

import numpy as np

from data_gen.samples.packing import Channels, pack
from data_gen.samples.sample import Sample
from simulator.errors import require

SEVERAL_FRAMES = ("burst", "multi_exposure")  # modes whose arrays keep the axis of frames
Value = np.ndarray | str


@dataclass(frozen=True)
class TensorForm:
    """How samples become tensors.

    channels: `rggb` or `rgbg`, four planes of half the size in this order (data_gen/samples/packing.py), or `mosaic`, one
    plane. amplify: noisy frames are multiplied by their exposure ratio, so that they are as bright as the clean ones.
    """

    channels: Channels = "rggb"
    amplify: bool = True

    def __post_init__(self) -> None:
        known = get_args(Channels)
        require(self.channels in known, "channels", self.channels, f"give one of {', '.join(known)}")

    def of(self, sample: Sample) -> dict[str, Value]:
        """Arrays and words of one sample, by name. (...) is (frames,) in modes of several frames, else ().

        noisy, clean: (..., planes, height, width) float32, (code - black) / unit; nothing is clipped, so noise in the dark
            goes below 0 and what is amplified goes above 1.
        variance: like noisy, its variance; missing when the sample has none.
        sharp: like clean, in an instant; flow: (..., 2, height, width) float32 way y and x from the first frame, in photosites
            whatever the planes; both of a moving camera alone.
        gain, read_noise: (...) float32. The variance of noisy is gain * mean + read_noise^2 (`gain_dn_per_e` and
            `read_noise_dn` of `Sample` in the units of noisy).
        noisy_unit_dn: (...), clean_unit_dn, black_level_dn: () float32; noisy code = noisy * noisy_unit_dn + black_level_dn,
            clean code = clean * clean_unit_dn + black_level_dn. The clean unit is white - black, the noisy one the same, over
            the ratio when amplified.
        ratio: (...) float32, light of the clean frame over that of the noisy one.
        white_balance: (3,) float32 gains of R, G, B. color_matrix: (3, 3) float32 XYZ to camera, NaN when not known.
        offsets_px: (frames, 2) float32 shift along y and x, only of a burst.
        index, iso: () int64. camera, cfa, source: words as in `Sample`.
        """
        several = sample.mode in SEVERAL_FRAMES
        black_dn, clean_unit_dn = np.float32(sample.black_level_dn), np.float32(sample.white_level_dn - sample.black_level_dn)
        ratio = np.array(sample.exposure_ratios, np.float32)
        unit_dn = clean_unit_dn / ratio if self.amplify else np.full_like(ratio, clean_unit_dn)
        found: dict[str, np.ndarray] = {
            "noisy": self._planes(sample, sample.noisy_dn, black_dn, unit_dn),
            "clean": self._planes(sample, sample.clean_dn, black_dn, np.full_like(unit_dn, clean_unit_dn)),
            "gain": np.float32(sample.gain_dn_per_e) / unit_dn,
            "read_noise": np.float32(sample.read_noise_dn) / unit_dn,
            "noisy_unit_dn": unit_dn,
            "ratio": ratio,
        }
        if sample.variance_dn2 is not None:
            found["variance"] = self._planes(sample, sample.variance_dn2, np.float32(0), unit_dn * unit_dn)
        if sample.sharp_dn is not None and sample.flow_px is not None:
            found["sharp"] = self._planes(sample, sample.sharp_dn, black_dn, np.full_like(unit_dn, clean_unit_dn))
            found["flow"] = np.asarray(sample.flow_px, np.float32)
        if not several:
            found = {name: array[0] for name, array in found.items()}
        elif sample.mode == "burst":
            found["offsets_px"] = np.array(sample.offsets_px, np.float32)
        matrix = np.full((3, 3), np.nan) if sample.color_matrix is None else sample.color_matrix
        constants = {
            "clean_unit_dn": clean_unit_dn,
            "black_level_dn": black_dn,
            "white_balance": np.array(sample.white_balance, np.float32),
            "color_matrix": np.array(matrix, np.float32),
            "index": np.int64(sample.index),
            "iso": np.int64(sample.iso),
        }
        numbers = {name: np.asarray(value) for name, value in (found | constants).items()}
        return numbers | {"camera": sample.camera, "cfa": sample.cfa, "source": sample.source}

    def _planes(self, sample: Sample, mosaics: np.ndarray, zero: np.float32, units: np.ndarray) -> np.ndarray:
        """(mosaics - zero) / units as (frames, planes, height, width) float32. mosaics: (frames, height, width)."""
        planes = pack(mosaics, sample.cfa, self.channels) if self.channels != "mosaic" else mosaics[:, np.newaxis]
        result = np.subtract(planes, zero, dtype=np.float32)
        result /= units[:, np.newaxis, np.newaxis, np.newaxis]
        return result
