"""Row noise from pairs of dark frames: a random offset of each row, independent in each frame."""

import numpy as np

from simulator.measurement.statistics.interval import Interval, root, shifted, variance_interval
from simulator.measurement.statistics.temporal_noise import PairNoise


def row_noise(pairs: list[PairNoise]) -> Interval:
    """Return the standard deviation of the offsets of rows [DN].

    Analysis of variance with one random effect: the means of rows of n photosites have the variance row + pixel / n, whose
    estimate has a chi-square distribution; pixel / n is known far better and is subtracted as if exact.
    pairs: of dark frames, of one size; at least one.
    """
    columns = pairs[0].columns
    of_photosites = float(np.mean([pair.pixel_variance_dn2 for pair in pairs])) / columns
    of_means = float(np.mean([pair.row_variance_dn2 + pair.pixel_variance_dn2 / columns for pair in pairs]))
    degrees = sum(pair.rows - 1 for pair in pairs)
    return root(shifted(variance_interval(of_means, degrees), -of_photosites))
