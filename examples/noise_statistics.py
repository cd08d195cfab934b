"""Statistics of noise whose distribution is known, each with its sampling error: no tolerance in here is a matter of taste."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

LEAST_EXPECTED = 20  # counts in a bin, below which the chi-square limit of the likelihood ratio is poor


@dataclass(frozen=True)
class Finding:
    """A statistic, what it should be, its standard error, and the chance of a deviation as large."""

    value: float
    expected: float
    error: float
    p_value: float

    @classmethod
    def normal(cls, value: float, expected: float, error: float) -> "Finding":
        """Two-sided z-test."""
        return cls(float(value), float(expected), float(error), float(2.0 * stats.norm.sf(abs(value - expected) / error)))


def divergence(codes: np.ndarray, first_code: int, shares: np.ndarray) -> Finding:
    """Kullback-Leibler divergence of independent codes' histogram from a distribution [nat].

    shares: probabilities of first_code, first_code + 1, ...; neighbouring codes are put together up to 20 expected counts.
    Of codes that follow the distribution, 2 n D is chi-square with as many degrees of freedom as bins but one (Wilks 1938).
    """
    counts = np.bincount(np.clip(codes.ravel().astype(np.int64) - first_code, 0, len(shares) - 1), minlength=len(shares))
    starts, gathered = [0], 0.0
    for place, share in enumerate(shares * codes.size):
        gathered += share
        if gathered >= LEAST_EXPECTED and shares[place + 1 :].sum() * codes.size >= LEAST_EXPECTED:
            starts.append(place + 1)
            gathered = 0.0
    seen, expected = np.add.reduceat(counts, starts) / codes.size, np.add.reduceat(shares, starts)
    value = float(np.sum(seen * np.log(np.where(seen > 0, seen, 1.0) / expected)))
    freedom = len(starts) - 1
    return Finding(
        value,
        freedom / (2 * codes.size),
        math.sqrt(2 * freedom) / (2 * codes.size),
        float(stats.chi2.sf(2 * codes.size * value, freedom)),
    )


def row_power(noise: np.ndarray) -> np.ndarray:
    """Power of the rows' means by frequency, (height / 2 - 1,), a mean over frames (frames, height, width).

    Scaled so that white noise has its variance at every frequency; the constant and the fastest frequency are left out.
    """
    spectrum = np.abs(np.fft.rfft(noise.mean(axis=2), axis=1)) ** 2 / noise.shape[1]
    return spectrum[:, 1 : (noise.shape[1] + 1) // 2].mean(axis=0)


def row_power_finding(noise: np.ndarray, photosite_dn2: float, row_dn2: float) -> Finding:
    """Mean power of the rows against row_dn2 + photosite_dn2 / width: each frequency's is exponential (Bartlett 1955)."""
    level, power = row_dn2 + photosite_dn2 / noise.shape[2], row_power(noise)
    return Finding.normal(power.mean(), level, level / math.sqrt(power.size * noise.shape[0]))


def row_line(noise: np.ndarray, photosite_dn2: float, row_dn2: float) -> Finding:
    """Largest power of the rows at any frequency, over that of white noise: banding stands out as a line.

    A mean over frames is gamma distributed; expected and error are median and quarter of the 95 % interval of the largest.
    """
    power = row_power(noise) / (row_dn2 + photosite_dn2 / noise.shape[2])
    white = stats.gamma(noise.shape[0], scale=1.0 / noise.shape[0])
    low, middle, high = (float(white.isf(-np.expm1(np.log(share) / power.size))) for share in (0.025, 0.5, 0.975))
    p_value = float(-np.expm1(power.size * white.logcdf(power.max())))
    return Finding(float(power.max()), middle, (high - low) / 4.0, p_value)


def vertical_correlation(noise: np.ndarray, photosite_dn2: float, row_dn2: float) -> Finding:
    """Correlation of each photosite with the one below it: none. noise: (frames, height, width) about its known mean.

    A row's mean product has the variance r^4 + (2 r^2 p^2 + p^4) / width, r of the rows and p of the photosites.
    """
    frames, height, width = noise.shape
    variance = row_dn2**2 + (2.0 * row_dn2 * photosite_dn2 + photosite_dn2**2) / width
    error = math.sqrt(variance / (frames * (height - 1)))
    total = photosite_dn2 + row_dn2
    return Finding.normal((noise[:, 1:] * noise[:, :-1]).mean() / total, 0.0, error / total)


def horizontal_correlation(noise: np.ndarray, photosite_dn2: float, row_dn2: float) -> Finding:
    """Correlation of each photosite with the one beside it: the share of row noise in the variance.

    A row's mean product has the variance 2 r^4 + (4 r^2 p^2 + p^4) / width, up to 1 / width^2.
    """
    frames, height, width = noise.shape
    variance = 2.0 * row_dn2**2 + (4.0 * row_dn2 * photosite_dn2 + photosite_dn2**2) / (width - 1)
    error, total = math.sqrt(variance / (frames * height)), photosite_dn2 + row_dn2
    return Finding.normal((noise[..., 1:] * noise[..., :-1]).mean() / total, row_dn2 / total, error / total)
