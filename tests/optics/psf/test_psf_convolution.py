"""Spatially varying point spread functions: against sums written out in float64, flat, without seams."""

import numpy as np
import pytest
from helpers.psf_grid import PsfGrid, convolve
from scipy.signal import convolve2d, fftconvolve

from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil


def kernels_of(seed: int, *shape: int, size=9) -> np.ndarray:
    """Random kernels of sum 1, lopsided on purpose."""
    found = np.random.default_rng(seed).random((*shape, size, size)) ** 4
    return found / found.sum(axis=(-2, -1), keepdims=True)


def hats(nodes, count) -> np.ndarray:
    """Bilinear weights (nodes, pixels), written out."""
    nodes, pixels = np.asarray(nodes, float), np.arange(count)
    return np.array([np.interp(pixels, nodes, np.eye(len(nodes))[index]) for index in range(len(nodes))])


def written_out(plane, kernels, x_px, y_px) -> np.ndarray:
    reach = kernels.shape[-1] // 2
    padded = np.pad(plane.astype(np.float64), reach, mode="edge")
    down, across = hats(y_px, plane.shape[0]), hats(x_px, plane.shape[1])
    return sum(
        down[row][:, None] * across[column][None, :] * fftconvolve(padded, kernels[row, column], mode="valid")
        for row in range(len(y_px))
        for column in range(len(x_px))
    )


@pytest.mark.parametrize("shape", [(60, 90), (1, 200), (57, 1100), (5, 7)])
def test_one_kernel_is_a_convolution_with_the_edge_going_on(shape):
    plane = np.random.default_rng(1).gamma(4.0, 250.0, (1, *shape)).astype(np.float32)
    kernel = kernels_of(2, 1, 1, 1, size=11)
    expected = convolve2d(np.pad(plane[0].astype(np.float64), 5, mode="edge"), kernel[0, 0, 0], mode="valid")
    found = convolve(plane, PsfGrid(kernel, np.array([3.0]), np.array([3.0])))
    assert found.dtype == np.float32 and found.shape == plane.shape
    assert np.max(np.abs(found[0] / expected - 1.0)) < 1e-6


@pytest.mark.parametrize("nodes", [((-0.5, 40.2, 89.5), (-0.5, 30.0, 59.5)), ((-30.0, 20.0, 300.0), (10.5, 40.0))])
def test_kernels_between_nodes_are_mixed_bilinearly(nodes):
    plane = np.random.default_rng(3).gamma(4.0, 250.0, (2, 60, 90))
    kernels = kernels_of(4, 2, len(nodes[1]), len(nodes[0]))
    found = convolve(plane, PsfGrid(kernels, np.array(nodes[0]), np.array(nodes[1])))
    for channel in (0, 1):
        assert np.allclose(found[channel], written_out(plane[channel], kernels[channel], *nodes), rtol=1e-12)


def test_a_flat_field_stays_flat():
    """To 1e-6 under kernels that differ wildly from node to node, dim or bright."""
    grid = PsfGrid(kernels_of(5, 3, 4, 5, size=31), np.linspace(-0.5, 299.5, 5), np.linspace(-0.5, 199.5, 4))
    for level in (1e-3, 1234.5, 1e6):
        found = convolve(np.full((3, 200, 300), level, np.float32), grid)
        assert np.max(np.abs(found / level - 1.0)) < 1e-6


def test_a_point_moves_smoothly_across_a_border_of_patches():
    """A bright point in steps of one pixel over a node at 60.3: its image's centroid and sum change evenly."""
    axis, grid = np.arange(21) - 10, []
    for x in (-3.0, 0.0, 3.0):  # a lens that shifts: to the left, not at all, to the right
        spot = np.exp(-0.5 * ((axis[None, :] - x) / 2.0) ** 2 - 0.5 * (axis[:, None] / 2.0) ** 2)
        grid.append(spot / spot.sum())
    grid = PsfGrid(np.array(grid).reshape(1, 1, 3, 21, 21), np.array([0.0, 60.3, 120.0]), np.array([20.0]))
    places, sums = [], []
    for x in range(50, 71):
        plane = np.zeros((1, 41, 121))
        plane[0, 20, x] = 1000.0
        found = convolve(plane, grid)[0]
        sums.append(found.sum())
        places.append(found.sum(axis=0) @ np.arange(121) / found.sum())
    assert np.max(np.abs(np.diff(places, 2))) < 0.01  # without mixing it would jump by 3
    assert np.diff(places) == pytest.approx(1.06, abs=0.02)  # 3 pixels more on a way of 60, and the image's own width
    assert np.max(np.abs(np.diff(sums, 2))) / 1000.0 < 6e-3


def test_tiles_leave_no_trace():
    plane = np.random.default_rng(6).gamma(4.0, 250.0, (1, 130, 170))
    grid = PsfGrid(kernels_of(7, 1, 2, 3), np.array([0.0, 70.7, 169.0]), np.array([10.0, 100.0]))
    whole = convolve(plane, grid)
    assert np.allclose(convolve(plane, grid, tile_px=37, most_spectra=2), whole, rtol=1e-12)


def test_bright_points_do_not_disturb_dim_surroundings():
    """10^6 e- points over 100 e-: float32 planes agree with float64 ones to 0.005 of the shot noise."""
    rng = np.random.default_rng(8)
    plane = rng.gamma(4.0, 25.0, (1, 300, 400)) + 1e6 * (rng.random((1, 300, 400)) > 0.999)
    grid = PsfGrid(kernels_of(9, 1, 2, 2, size=15), np.array([0.0, 399.0]), np.array([0.0, 299.0]))
    exact = convolve(plane.astype(np.float32).astype(np.float64), grid)
    error = np.abs(convolve(plane.astype(np.float32), grid) - exact) / np.sqrt(exact + 4.0)
    assert error.max() < 5e-3


def test_lateral_colour_moves_red_inwards_and_blue_outwards():
    """2 um at field 1 for 450 nm and nothing for 550 nm: 1.8 um for 460 nm; photosites of 1 um."""
    shifts = (ChromaticShift(450.0, 0.0, 2.0), ChromaticShift(550.0), ChromaticShift(650.0, 0.0, -2.0))
    lens = WavefrontPsf(Aberrations(chromatic=shifts), 2.8, 1.0, ((640.0,), (550.0,), (460.0,)), 15, cells=3)
    psf = FieldPsf(lens, Pupil(), Sampling(), 1.0, 1, (0.0,), True, (800, 600), (5, 5))
    kernels = [[[psf.kernel(0, c, False, row, column)[0] for column in range(5)] for row in range(5)] for c in range(3)]
    grid = PsfGrid(np.array(kernels), psf.x_px - 60, psf.y_px - 40)
    planes = np.zeros((3, 60, 60), np.float32)
    planes[:, 30, 30] = 1000.0  # 310 left of and 230 above the centre of the sensor, half diagonal 500
    for plane, shift_um in zip(convolve(planes, grid), (-1.8, 0.0, 1.8), strict=True):
        x = plane.sum(axis=0) @ np.arange(60) / plane.sum() - 30.0
        y = plane.sum(axis=1) @ np.arange(60) / plane.sum() - 30.0
        assert (x, y) == pytest.approx((-shift_um * 309.5 / 500, -shift_um * 229.5 / 500), abs=0.03)
