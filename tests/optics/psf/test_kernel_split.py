"""Core, arms and tail of a kernel: what they leave, against float64 convolutions."""

import numpy as np
import pytest
from scipy.signal import convolve2d, fftconvolve

from simulator.optics.psf.kernel_split import split_kernel, visible_error


def ringing_kernel(half_px: int = 24) -> np.ndarray:
    """A sharp middle, tails that fall as the Airy pattern's do, and a line transfer that is cut at half a cycle."""
    places = np.arange(-half_px, half_px + 1)
    away = np.hypot(places[:, None], places[None, :])
    kernel = 0.02 / (1.0 + away**3)
    signs = np.where(places % 2 == 0, -1.0, 1.0) * 6e-2 / (1.0 + places**2)
    kernel[half_px] += np.where(places == 0, 1.0, signs)
    kernel[:, half_px] += np.where(places == 0, 0.0, signs)
    return kernel / kernel.sum()


@pytest.mark.parametrize("cell_px", [0, 2, 4])
@pytest.mark.parametrize("arm_px", [0, 12])
def test_the_parts_of_a_kernel_have_its_sum(cell_px, arm_px):
    split = split_kernel(ringing_kernel(), 1, 5, arm_px, cell_px)
    parts = [part.sum() for part in (split.core, split.arms, split.tail) if part is not None]
    assert sum(parts) == pytest.approx(1.0, abs=1e-12)
    assert (split.tail is None) == (cell_px == 0) and (split.arms is None) == (arm_px == 0)


def test_arms_take_the_ringing_along_the_axes():
    errors = [split_kernel(ringing_kernel(), 1, 5, arm_px, 4).error for arm_px in (0, 8, 16)]
    assert errors[0] > 1.5 * errors[1] > 2.0 * errors[2]


def test_cells_are_smaller_where_the_error_is():
    assert split_kernel(ringing_kernel(), 1, 4, 16, 2).error < split_kernel(ringing_kernel(), 1, 4, 16, 4).error


def test_the_predicted_error_is_that_of_squares_and_texture():
    """p99.9 of the error of a kernel that is cut, on squares of light 1 on 0 and on a texture of single photosites."""
    rng, kernel = np.random.default_rng(3), ringing_kernel()
    rest = kernel.copy()
    rest[16:33, 16:33] = 0.0
    squares = np.kron(rng.random((20, 20)) < 0.6, np.ones((20, 20)))
    errors = [np.quantile(np.abs(fftconvolve(one, rest, mode="valid")), 0.999) for one in (squares, rng.random((400, 400)))]
    assert 0.5 * visible_error(rest) < max(errors) < 1.1 * visible_error(rest)


@pytest.mark.parametrize(("over", "half_px"), [(1, 24), (3, 22)])
def test_what_is_left_counts_in_the_light_of_wide_samples(over, half_px):
    """Ringing from sample to sample shows little where each has light of those beside it."""
    spread, table = np.array([0.05, 0.25, 0.4, 0.25, 0.05]), ringing_kernel(half_px)
    split, size = split_kernel(table, over, 3, spread=spread), len(table)
    left = table - np.pad(split.core, (size - len(split.core)) // 2)
    seen = convolve2d(left, np.outer(spread, spread), mode="same")
    shown = seen.reshape(size // over, over, size // over, over).sum(axis=(1, 3))
    assert split.error == pytest.approx(visible_error(shown), rel=1e-9)
    assert split.error < split_kernel(table, over, 3).error
