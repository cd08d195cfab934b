"""Row noise of pairs of dark frames: one offset per row and frame, drawn anew in each."""

import numpy as np

from simulator.measurement.statistics.interval import Interval, root, shifted, variance_interval
from simulator.measurement.statistics.temporal_noise import PairNoise


def row_noise(pairs: list[PairNoise]) -> Interval:
    """Standard deviation of the offsets of whole rows [DN].

    Analysis of variance with one random effect: the means of rows of n photosites have the variance row + pixel / n, which
    follows chi-square; the photosites' part is known far better and is taken off as it is.
    pairs: of dark frames, of one size; at least one.
    """
    columns = pairs[0].columns
    of_photosites = float(np.mean([pair.pixel_variance_dn2 for pair in pairs])) / columns
    of_means = float(np.mean([pair.row_variance_dn2 + pair.pixel_variance_dn2 / columns for pair in pairs]))
    degrees = sum(pair.rows - 1 for pair in pairs)
    return root(shifted(variance_interval(of_means, degrees), -of_photosites))
