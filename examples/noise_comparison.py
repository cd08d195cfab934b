"""Noise that data_gen makes for the Sony A7S II, and what it must agree with by the published calibration."""

from typing import Any

import numpy as np
from noise_classifier import told_apart
from noise_statistics import (
    Finding,
    divergence,
    horizontal_correlation,
    row_line,
    row_power_finding,
    vertical_correlation,
)
from published_noise import BLACK_DN, SONY_A7S2, Published
from scipy import stats

from data_gen.generate import Generator
from data_gen.recipe.camera_noise import CameraChoice, CameraNoise
from data_gen.recipe.dataset_config import DataSet, NoiseOnly
from simulator.config import load_camera
from simulator.config.distributions import LogUniform
from simulator.device import Device

CAMERA = "sony_a7s2"
LIT_E = 4.0  # mean electrons of the lit histogram: its steps of K are seen beside read noise and shot noise
COLUMN = (2048, 2)  # a frame of which one column is looked at: one photosite a row, so that row noise leaves codes independent
FIELD, PATCH = (256, 256), (32, 32)


def data_set(iso: int | None, crop_px: tuple[int, int], count: int, **settings: Any) -> DataSet:
    """Flat or dark frames of the camera; all measured ISOs for None."""
    choice = CameraChoice(load_camera(CAMERA)) if iso is None else CameraChoice(load_camera(CAMERA), iso)
    return DataSet(count, crop_px, CameraNoise({CAMERA: choice}), **settings)


def frames(config: DataSet, device: Device) -> np.ndarray:
    """All noisy frames, (count, height, width) uint16 [DN]."""
    return np.concatenate([sample.noisy_dn for sample in Generator(config, device).samples(range(config.count))])


def histogram_finding(iso: int, mean_e: float, published: Published, device: Device, count: int) -> Finding:
    """Divergence of a column's codes, `count` frames of it, at this mean."""
    if mean_e:
        lit = {"mode": "noise_only", "noise_only": NoiseOnly(1.0), "exposure_ratio": _ratio(iso, mean_e)}
        config = data_set(iso, COLUMN, count, seed=2 * 10**6 + iso, **lit)
    else:
        config = data_set(iso, COLUMN, count, mode="dark", seed=10**6 + iso)
    codes = frames(config, device)[..., 0]
    first, last = int(codes.min()), int(codes.max())
    return divergence(codes, first, published.shares(np.arange(first, last + 1), mean_e))


def _ratio(iso: int, mean_e: float) -> float:
    """Exposure ratio at which a saturated reference leaves this mean."""
    setting = CameraNoise({CAMERA: CameraChoice(load_camera(CAMERA), iso)}).setting(CAMERA, iso)
    return setting.reference_electrons / mean_e


def findings(iso: int, device: Device, count: int) -> dict[str, Finding]:
    """All statistics of one ISO, from `count` frames of each kind."""
    published = SONY_A7S2[iso].with_gaussian_width()
    noise = frames(data_set(iso, FIELD, count, mode="dark", seed=iso), device).astype(np.float64) - BLACK_DN
    photosite_dn2, row_dn2 = published.read_noise_dn**2 + 1.0 / 12.0, published.row_noise_dn**2
    return {
        "divergence, dark": histogram_finding(iso, 0.0, published, device, count),
        "divergence, lit": histogram_finding(iso, LIT_E, published, device, count),
        "row power": row_power_finding(noise, photosite_dn2, row_dn2),
        "row line": row_line(noise, photosite_dn2, row_dn2),
        "vertical correlation": vertical_correlation(noise, photosite_dn2, row_dn2),
        "horizontal correlation": horizontal_correlation(noise, photosite_dn2, row_dn2),
    }


def patches(device: Device, count: int) -> dict[str, np.ndarray]:
    """Noise of flat patches over all ISOs and levels, in units of its standard deviation, by what made it.

    Each patch is a frame of its own. Beside ours: the published model, and Gaussian noise of the same variance everywhere.
    """
    level = NoiseOnly(LogUniform((1e-3, 1.0)))
    config = data_set(None, PATCH, count, mode="noise_only", noise_only=level, exposure_ratio=100.0, seed=2)
    draw, found = np.random.default_rng(3), {"Photosite": [], "NumPy model": [], "Gaussian": []}
    for sample in Generator(config, device).samples(range(count)):
        published = SONY_A7S2[sample.iso].with_gaussian_width()
        mean_dn = (sample.clean_dn[0].astype(np.float64) - BLACK_DN) / sample.exposure_ratios[0]
        mean_e = mean_dn / published.gain_dn_per_e
        middle, deviation = BLACK_DN + mean_dn, np.sqrt(published.variance_dn2(mean_e))
        normal = np.rint(middle + np.sqrt(deviation**2 - 1.0 / 12.0) * draw.standard_normal(mean_dn.shape))
        for name, codes in zip(found, (sample.noisy_dn[0], published.codes(mean_e, draw), normal), strict=True):
            found[name].append((codes - middle) / deviation)
    return {name: np.stack(parts) for name, parts in found.items()}


def classified(device: Device, count: int) -> dict[str, Finding]:
    """How often a classifier is right on patches it has not seen: ours against the model, and Gaussian against the model."""
    by_name = patches(device, count)
    return {name: told_apart(by_name["NumPy model"], by_name[name]) for name in ("Photosite", "Gaussian")}


def smallest_p(by_iso: dict[int, dict[str, Finding]]) -> tuple[float, int]:
    """Smallest p-value of all tests, as the chance that as many would give one as small (Sidak), and how many there are."""
    p_values = [finding.p_value for found in by_iso.values() for finding in found.values()]
    return float(-np.expm1(len(p_values) * np.log1p(-min(p_values)))), len(p_values)


def gaussian_divergence(published: Published) -> float:
    """Divergence of the published dark noise from a Gaussian of the same variance [nat]: what the test could see."""
    reach = int(12 * published.read_noise_dn) + 4
    codes = np.arange(BLACK_DN - reach, BLACK_DN + reach + 1)
    deviation = np.sqrt(published.read_noise_dn**2 + published.row_noise_dn**2)
    below = stats.norm.cdf((codes[:-1] + 0.5 - BLACK_DN) / deviation)
    normal, shares = np.diff([0.0, *below, 1.0]), published.shares(codes)
    kept = (normal > 1e-12) & (shares > 1e-12)
    return float(np.sum(shares[kept] * np.log(shares[kept] / normal[kept])))
