"""Laws of small blur circles in fine scenes against float64: what 99.9 % of the photosites of random squares keep."""

from collections.abc import Callable

import numpy as np
from scipy.signal import fftconvolve

from simulator.optics.defocus.accuracy import Accuracy, crossing_error
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.defocus.predicted_error import OF_CROSSING, squares_left

SIDE = 64  # photosites
PARTS = 24  # per photosite and axis, on which float64 integrates
SCALES = 2.0, 3.0, 4.0, 8.0  # pixels per photosite
RADII_PX = 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 2.0, 4.0
LEAST_COPIED = 0.3  # largest radius at which leaving out the blur is looked at
FULL = Accuracy(detail=1.0)  # of squares that differ by all of the light
COUNTS = 0, 1, 2, 4  # samples per photosite and axis; 0: no blur


def measure_laws(tell: Callable[[str], object]) -> bool:
    """Tell the largest p99 and p99.9 over their law, of each number of samples; returns whether no law is exceeded."""
    worst: dict[int, tuple[float, float]] = {}
    for scale in SCALES:
        fine = _squares(scale)
        for radius_px in RADII_PX:
            for count in COUNTS:
                is_exact = count == scale or (count == 0 and radius_px > LEAST_COPIED)
                if is_exact:
                    continue
                error = _left(fine, radius_px, count)
                law = squares_left(FULL, radius_px, count, scale) if count else OF_CROSSING * crossing_error(radius_px, 1.0)
                shares = float(np.quantile(error, 0.99)) / law, float(np.quantile(error, 0.999)) / law
                worst[count] = max(worst.get(count, (0.0, 0.0)), shares, key=lambda pair: pair[1])
    for count, (most, all_but_one) in worst.items():
        name = f"{count} x {count} samples" if count else "no blur"
        tell(f"{name}: p99 {most:.2f}, p99.9 {all_but_one:.2f} of what is stated")
    return max(pair[1] for pair in worst.values()) <= 1.0


def _squares(scale: float) -> np.ndarray:
    """Random pixels in greys on parts of photosites, (SIDE PARTS, SIDE PARTS)."""
    count = int(SIDE * scale) + 2
    values = np.random.default_rng(1).random((count, count))
    place = ((np.arange(SIDE * PARTS) + 0.5) / PARTS * scale).astype(int)
    return values[np.ix_(place, place)]


def _means(fine: np.ndarray, count: int) -> np.ndarray:
    """Means over so many samples per photosite and axis."""
    size = SIDE * count
    return fine.reshape(size, PARTS // count, size, PARTS // count).mean(axis=(1, 3))


def _spread(light: np.ndarray, radius: float) -> np.ndarray:
    """Light behind a blur circle of so many elements; unchanged where the circle lies inside one."""
    return fftconvolve(light, disk_weights(radius), mode="same") if radius > 0.5 else light


def _left(fine: np.ndarray, radius_px: float, count: int) -> np.ndarray:
    """Error of samples whose means are blurred, in place of the blur's means, away from the border."""
    truth, found = _means(_spread(fine, PARTS * radius_px), 1), _means(fine, 1)
    if count:
        found = _spread(_means(fine, count), count * radius_px).reshape(SIDE, count, SIDE, count).mean(axis=(1, 3))
    return np.abs(found - truth)[8:-8, 8:-8]
