"""A classifier two-sample test (Lopez-Paz and Oquab, ICLR 2017): are two noises told apart by what learned from both."""

import numpy as np
from noise_statistics import Finding
from scipy import special

STEPS, RIDGE = 30, 1e-3


def patch_statistics(noise: np.ndarray) -> np.ndarray:
    """Statistics of patches (patches, height, width) of noise in units of its standard deviation: (patches, 14)."""
    flat = noise.reshape(len(noise), -1)
    rows, columns = noise.mean(axis=2), noise.mean(axis=1)
    quantiles = np.quantile(flat, (0.0, 0.02, 0.25, 0.5, 0.75, 0.98, 1.0), axis=1)
    products = [(noise[:, 1:] * noise[:, :-1]).mean(axis=(1, 2)), (noise[..., 1:] * noise[..., :-1]).mean(axis=(1, 2))]
    powers = [flat.mean(axis=1), (flat**2).mean(axis=1), (flat**3).mean(axis=1)]
    return np.stack([*powers, rows.var(axis=1), columns.var(axis=1), *products, *quantiles], axis=-1)


def told_apart(first: np.ndarray, second: np.ndarray) -> Finding:
    """Share of patches that logistic regression assigns rightly, of those that it did not learn from: 1/2 when it cannot.

    first, second: as many patches (patches, height, width) each, independent of one another. Even ones teach, odd ones test.
    """
    statistics = np.concatenate([patch_statistics(first), patch_statistics(second)])
    truth = np.repeat([0.0, 1.0], [len(first), len(second)])
    teaches = np.concatenate([np.arange(len(first)), np.arange(len(second))]) % 2 == 0
    middle, spread = statistics[teaches].mean(axis=0), statistics[teaches].std(axis=0)
    scaled = (statistics - middle) / spread
    terms = np.concatenate([np.ones((len(scaled), 1)), scaled, scaled**2], axis=1)
    weights = logistic_weights(terms[teaches], truth[teaches])
    right = (terms[~teaches] @ weights > 0) == (truth[~teaches] > 0.5)
    return Finding.normal(right.mean(), 0.5, 0.5 / np.sqrt(right.size))


def logistic_weights(terms: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Logistic regression by Newton's method with a slight ridge. terms: (samples, terms); truth: 0 or 1, (samples,)."""
    weights = np.zeros(terms.shape[1])
    ridge = RIDGE * len(terms) * np.eye(len(weights))
    for _ in range(STEPS):
        share = special.expit(terms @ weights)
        slope = terms.T @ (truth - share) - ridge @ weights
        curvature = (terms * (share * (1.0 - share))[:, np.newaxis]).T @ terms + ridge
        weights = weights + np.linalg.solve(curvature, slope)
    return weights
