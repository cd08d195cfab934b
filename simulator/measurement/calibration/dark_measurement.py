"""Black levels, read noise and DSNU from the dark frames of one ISO."""

from dataclasses import dataclass

import numpy as np

from simulator.measurement.statistics.dsnu import DsnuMeasurement, measure_dsnu, subtract_plane_means
from simulator.measurement.statistics.interval import Interval, normal_interval
from simulator.measurement.statistics.read_noise import read_noise, row_residuals
from simulator.measurement.statistics.row_noise import row_noise
from simulator.measurement.statistics.temporal_noise import PairNoise, pair_noise
from simulator.measurement.statistics.tukey_lambda_fit import TukeyLambda, fit_tukey_lambda, rounding_doubt_dn2

NORMAL_SHAPE = 0.14  # Tukey's lambda of a distribution close to normal
LARGEST_DOUBT = 0.01  # of the variance; a larger error due to rounding makes the fitted distribution meaningless
_KEPT_RESIDUALS = 200_000  # for the plot
_ZERO = Interval(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class DarkMeasurement:
    """Results of dark frames.

    levels_dn: mean by plane. black_level_dn: mean of the planes' levels. color_bias_dn: each plane's level less that mean.
    read_noise_dn: of single photosites, without rounding and row noise. Dark current is taken off black level and read noise by
    `without_dark_current`, where it is known, and is in levels_dn. shape: Tukey-lambda fit, None where it cannot be made.
    row_noise_dn, dsnu: row noise and fixed pattern. residuals_dn: differences of frame pairs, for a plot.
    """

    levels_dn: dict[str, float]
    black_level_dn: float
    color_bias_dn: dict[str, Interval]
    read_noise_dn: Interval
    shape: TukeyLambda | None
    row_noise_dn: Interval
    dsnu: DsnuMeasurement
    residuals_dn: np.ndarray


def measure_darks(darks: list[np.ndarray], places: dict[str, tuple[int, int]]) -> DarkMeasurement:
    """Measure two or more dark frames, mosaics (height, width) uint16.

    places: row and column of each plane in the 2x2 block.
    """
    levels = {
        name: float(np.mean([select_plane(dark, name, places).mean(dtype=np.float64) for dark in darks])) for name in places
    }
    pairs = measure_pairs(darks)
    residuals = np.concatenate([row_residuals(first, second) for first, second in zip(darks[0::2], darks[1::2], strict=False)])
    shape = fit_tukey_lambda(residuals)
    doubt_dn2 = rounding_doubt_dn2(shape.shape.value, shape.sigma_dn.value) if shape else rounding_doubt_dn2(NORMAL_SHAPE, 0.0)
    sigma, rows = read_noise(pairs, doubt_dn2), row_noise(pairs)
    pixel_dn2, row_dn2 = (float(np.mean([getattr(pair, name) for pair in pairs])) for name in _PARTS)
    dsnu = measure_dsnu([subtract_plane_means(dark, list(places.values())) for dark in darks], pixel_dn2, row_dn2)
    black_dn = float(np.mean(list(levels.values())))
    error_dn = _plane_mean_error(dsnu, sigma.value, rows.value, darks, places)
    return DarkMeasurement(
        levels_dn=levels,
        black_level_dn=black_dn,
        color_bias_dn={name: normal_interval(level - black_dn, error_dn) for name, level in levels.items()},
        read_noise_dn=sigma,
        shape=shape if doubt_dn2 <= LARGEST_DOUBT * sigma.value**2 else None,
        row_noise_dn=rows,
        dsnu=dsnu,
        residuals_dn=residuals[:: max(1, residuals.size // _KEPT_RESIDUALS)],
    )


_PARTS = ("pixel_variance_dn2", "row_variance_dn2")


def dark_measurement_without_pedestal(
    black_dn: float, places: dict[str, tuple[int, int]], read_noise_dn: Interval, row_noise_dn: Interval
) -> DarkMeasurement:
    """Return the dark noise of a camera without pedestal, whose dark frames are clipped at code 0, from its flat frames.

    black_dn: black level in the files' metadata [DN].
    """
    return DarkMeasurement(
        levels_dn=dict.fromkeys(places, black_dn),
        black_level_dn=black_dn,
        color_bias_dn=dict.fromkeys(places, _ZERO),
        read_noise_dn=read_noise_dn,
        shape=None,
        row_noise_dn=row_noise_dn,
        dsnu=DsnuMeasurement(_ZERO, _ZERO, _ZERO, 0.0, 0.0),
        residuals_dn=np.zeros(0),
    )


def select_plane(codes: np.ndarray, name: str, places: dict[str, tuple[int, int]]) -> np.ndarray:
    """Return a view of one colour plane of a mosaic."""
    step = 1 if len(places) == 1 else 2
    row, column = places[name]
    return codes[row::step, column::step]


def measure_pairs(frames: list[np.ndarray]) -> list[PairNoise]:
    """Measure the temporal noise of the first and second frame, of the third and fourth, and so on."""
    return [pair_noise(first, second) for first, second in zip(frames[0::2], frames[1::2], strict=False)]


def _plane_mean_error(
    dsnu: DsnuMeasurement, sigma_dn: float, row_dn: float, darks: list[np.ndarray], places: dict[str, tuple[int, int]]
) -> float:
    """Standard error of a plane's mean code, from temporal noise and fixed pattern of photosites, rows and columns [DN]."""
    height, width = select_plane(darks[0], next(iter(places)), places).shape
    photosites = (sigma_dn**2 / len(darks) + dsnu.photosite_dn.value**2) / (height * width)
    rows = (row_dn**2 / len(darks) + dsnu.row_dn.value**2) / height
    return float(np.sqrt(photosites + rows + dsnu.column_dn.value**2 / width))
