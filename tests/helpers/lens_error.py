"""Error of a blurred picture in units of the noise that a sensor adds: z = error / sqrt(mean electrons + read noise^2)."""

from dataclasses import dataclass

import numpy as np

READ_NOISE_E = 2.0
EXPOSURES_E = (2000.0, 20000.0)  # electrons at radiance 1: an ordinary and a bright exposure


@dataclass(frozen=True)
class ErrorStatistics:
    """Of |z| over some photosites; `mean` keeps the sign, so that lost or added light shows."""

    median: float
    rms: float
    p99: float
    p99_9: float
    above_1: float
    above_0_1: float
    mean: float
    count: int


def z_scores(found: np.ndarray, truth: np.ndarray, electrons: float, read_noise_e: float = READ_NOISE_E) -> np.ndarray:
    """Deviation from the truth in standard deviations of a frame; found, truth: radiance; electrons: at radiance 1."""
    found, truth = np.asarray(found, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    assert found.shape == truth.shape
    return electrons * (found - truth) / np.sqrt(electrons * truth + read_noise_e**2)


def statistics(z: np.ndarray, mask: np.ndarray | None = None) -> ErrorStatistics:
    """Statistics of z where the mask is true, everywhere without one."""
    z = np.asarray(z, dtype=np.float64)
    z = z.ravel() if mask is None else z[mask]
    assert z.size and np.isfinite(z).all()
    size = np.abs(z)
    return ErrorStatistics(
        median=float(np.median(size)),
        rms=float(np.sqrt(np.mean(z**2))),
        p99=float(np.quantile(size, 0.99)),
        p99_9=float(np.quantile(size, 0.999)),
        above_1=float(np.mean(size > 1.0)),
        above_0_1=float(np.mean(size > 0.1)),
        mean=float(np.mean(z)),
        count=z.size,
    )
