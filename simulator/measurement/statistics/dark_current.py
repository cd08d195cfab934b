"""Dark current from dark frames of several exposure times (EMVA 1288 R4.0 Linear, 7)."""

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.statistics.interval import Interval, student_interval


def fit_slope_over_time(times_s: np.ndarray, values: np.ndarray) -> tuple[Interval, Interval]:
    """Fit a line by least squares: slope per second and value at time 0, with intervals from the residuals' scatter.

    times_s, values: (n,), three or more at two or more times. Raises PhotositeError otherwise.
    """
    times_s, values = np.asarray(times_s, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if times_s.size < 3 or np.ptp(times_s) == 0:
        raise PhotositeError("dark current: needs three or more dark frames at two or more exposure times; shoot more")
    centred = times_s - times_s.mean()
    slope = float(centred @ values / (centred @ centred))
    start = float(values.mean() - slope * times_s.mean())
    degrees = times_s.size - 2
    scatter = float(np.sum((values - start - slope * times_s) ** 2)) / degrees
    slope_error = np.sqrt(scatter / (centred @ centred))
    start_error = np.sqrt(scatter * (1.0 / times_s.size + times_s.mean() ** 2 / (centred @ centred)))
    return student_interval(slope, float(slope_error), degrees), student_interval(start, float(start_error), degrees)
