"""Tests of randomness: every check gives a p-value, and `accept` corrects for how many there are (Sidak)."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

SIGNIFICANCE = 0.001  # chance that a right program fails one test function; seeds are fixed, so it fails never or always


def mean_p(sample: ArrayLike, mean: float, variance: float) -> float:
    """Two-sided z-test of a sample's mean."""
    z = (np.mean(sample, dtype=np.float64) - mean) / np.sqrt(variance / np.size(sample))
    return float(2.0 * stats.norm.sf(abs(z)))


def variance_p(sample: ArrayLike, variance: float, excess_kurtosis: float = 0.0) -> float:
    """Two-sided test of a sample's variance: chi-square for a normal one, its normal limit with excess kurtosis."""
    count = np.size(sample)
    ratio = np.var(np.asarray(sample, dtype=np.float64), ddof=1) / variance
    if excess_kurtosis == 0.0:
        chi2 = ratio * (count - 1)
        return float(2.0 * min(stats.chi2.cdf(chi2, count - 1), stats.chi2.sf(chi2, count - 1)))
    return float(2.0 * stats.norm.sf(abs(ratio - 1.0) / np.sqrt((2.0 + excess_kurtosis) / count)))


def counts_p(sample: ArrayLike, mean: float, times: ArrayLike | None = None) -> float:
    """Chi-square test of a sample of counts against the Poisson distribution, bins of at least 20 expected.

    times: how often each count of the sample occurs; each once by default.
    """
    sample = np.asarray(sample, dtype=np.int64).ravel()
    size = sample.size if times is None else int(np.sum(times))
    support = np.arange(int(stats.poisson.ppf(1e-12, mean)), int(stats.poisson.ppf(1 - 1e-12, mean)) + 2)
    cumulative = stats.poisson.cdf(support, mean)
    edges, last = [], 0.0
    for value, share in zip(support, cumulative, strict=True):
        if (share - last) * size >= 20 and (1.0 - share) * size >= 20:
            edges.append(value)
            last = share
    shares = np.diff(np.concatenate([[0.0], stats.poisson.cdf(edges, mean), [1.0]]))
    observed = np.bincount(np.searchsorted(edges, sample), times, minlength=len(edges) + 1)
    return float(stats.chisquare(observed, shares * size).pvalue)


def correlation_p(first: ArrayLike, second: ArrayLike) -> float:
    """Test that two samples are uncorrelated."""
    first, second = np.ravel(first).astype(np.float64), np.ravel(second).astype(np.float64)
    return float(2.0 * stats.norm.sf(abs(np.corrcoef(first, second)[0, 1]) * np.sqrt(first.size)))


def accept(p_values: dict[object, float]) -> None:
    """Fail when the smallest p-value is too small for that many checks."""
    threshold = 1.0 - (1.0 - SIGNIFICANCE) ** (1.0 / len(p_values))
    low = {check: p for check, p in p_values.items() if not p > threshold}
    assert not low, f"p below {threshold:.2g} in {len(low)} of {len(p_values)} checks: {low}"
