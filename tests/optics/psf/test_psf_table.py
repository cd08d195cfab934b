"""Tables of kernels: from a wavefront and from files, turned to the field, sampled by photosites, refused when wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_file import read_psf
from simulator.optics.psf.psf_table import PsfTable, rotate_kernel, skew_kernel
from simulator.optics.psf.wavefront_psf import WavefrontPsf, channel_wavelengths, kernel_size_px

GREEN = ((550.0,),)


def gaussian(size, sigma_x, sigma_y=None, x=0.0, y=0.0) -> np.ndarray:
    axis = np.arange(size) - size // 2
    kernel = np.exp(-0.5 * ((axis[None, :] - x) / sigma_x) ** 2 - 0.5 * ((axis[:, None] - y) / (sigma_y or sigma_x)) ** 2)
    return kernel / kernel.sum()


def table(*kernels, blur=(0.0,), fields=(0.0,), cells=1, **settings) -> PsfTable:
    stack = np.array(kernels).reshape(len(blur), len(fields), -1, *np.shape(kernels[0]))
    return PsfTable(stack, np.array(blur), np.array(fields), cells, 4.0, **settings)


def test_kernels_between_entries_are_mixed_in_proportion():
    """Straight in the signed blur radius, which is linear in the inverse distance, and in the field; constant beyond."""
    parts = [gaussian(9, sigma) for sigma in (1.0, 1.2, 1.4, 1.6)]
    found = table(*parts, blur=(-2.0, 2.0), fields=(0.0, 1.0))
    expected = 0.25 * (0.4 * parts[0] + 0.6 * parts[1]) + 0.75 * (0.4 * parts[2] + 0.6 * parts[3])
    assert np.allclose(found.kernel(0, 1.0, (0.6, 0.0)), expected, atol=1e-7)
    assert np.allclose(found.kernel(0, 9.0, (3.0, 0.0)), parts[3], atol=1e-7)


def test_one_channel_stands_for_all():
    red, green = gaussian(5, 0.6), gaussian(5, 1.0)
    assert np.allclose(table(red).kernel(2, 0.0, (0.0, 0.0)), red, atol=1e-7)
    assert np.allclose(table(red, green).kernel(1, 0.0, (0.0, 0.0)), green, atol=1e-7)


@pytest.mark.parametrize("angle_deg", [0, 90, 180, 270, 30, -123, 45])
def test_a_kernel_turns_with_the_field(angle_deg):
    """A shifted, elongated Gaussian, against the same Gaussian evaluated in turned coordinates."""
    angle = math.radians(angle_deg)
    cosine, sine = math.cos(angle), math.sin(angle)
    y, x = np.mgrid[:61, :61] - 30
    along, across = cosine * x + sine * y, cosine * y - sine * x
    expected = np.exp(-0.5 * ((along - 8.0) / 4.0) ** 2 - 0.5 * (across / 2.0) ** 2)
    found = rotate_kernel(gaussian(61, 4.0, 2.0, x=8.0), angle)
    assert np.max(np.abs(found - expected / expected.sum())) < 2e-3 * found.max()
    assert found.sum() == pytest.approx(1.0, abs=1e-12)


def test_a_table_of_a_wavefront_gives_the_kernels_of_the_wavefront():
    lens = WavefrontPsf(Aberrations(coma_um=0.6, field_curvature_um=0.4), 4.0, 4.0, GREEN, 21, cells=5)
    made = lens.table([0.0], [0.0, 0.25, 0.5])
    for field_xy in ((0.5, 0.0), (0.0, 0.25), (0.3, 0.4)):
        direct, read = lens.kernel(0, 0.0, field_xy), made.kernel(0, 0.0, field_xy)
        assert np.max(np.abs(direct - read)) < 0.01 * direct.max()
    assert made.kernel(0, 0.0, (0.3, 0.4)).sum() == pytest.approx(1.0, abs=1e-6)
    with pytest.raises(PhotositeError, match=r"lens.aberrations.zernike = \[8\]: a table is turned"):
        WavefrontPsf(Aberrations(zernike_um={8: 0.1, 11: 0.1}), 4.0, 4.0, GREEN, 21).table([0.0], [0.0])


def test_a_photosite_sees_the_airy_pattern_through_its_aperture():
    """Line transfer of the sampled kernel: the circular pupil's, times the sinc of the photosite, below its Nyquist limit."""
    kernel = WavefrontPsf(Aberrations(), 22.0, 2.0, GREEN, 201, cells=3).kernel(0, 0.0, (0.0, 0.0))
    frequency = np.fft.rfftfreq(201, 2.0)
    u = np.minimum(frequency * 0.55 * 22.0, 1.0)
    expected = 2.0 / math.pi * (np.arccos(u) - u * np.sqrt(1.0 - u**2)) * np.sinc(2.0 * frequency)
    found = np.abs(np.fft.rfft(kernel.sum(axis=0)))
    assert np.max(np.abs(found - expected)) < 0.012  # light beyond 201 photosites is put back in proportion


@pytest.mark.parametrize(("fill_factor", "low_pass_um"), [(0.49, 0.0), (1.0, 3.0), (0.64, 4.0)])
def test_aperture_and_low_pass_filter_follow_sinc_and_cosine(fill_factor, low_pass_um):
    """A Gaussian spot of known transfer; the photosites' grid is finer than the spot, so that nothing aliases."""
    sampling = Sampling(fill_factor, low_pass_um)
    cells, pitch_um, sigma_um = 5, 4.0, 7.5
    spot = gaussian(61 * cells, sigma_um / (pitch_um / cells))
    found = sampling.photosites(spot, cells, pitch_um)
    frequency = np.fft.rfftfreq(61, pitch_um)
    side_um = pitch_um * math.sqrt(fill_factor)
    expected = np.sinc(side_um * frequency) * np.cos(math.pi * low_pass_um * frequency)
    expected = expected * np.exp(-2.0 * (math.pi * sigma_um * frequency) ** 2)
    for line in (found.sum(axis=0), found.sum(axis=1)):
        phase = np.exp(2j * math.pi * 30 * np.arange(len(frequency)) / 61)
        measured = np.fft.rfft(line) * phase
        cell_width = np.sinc(frequency * pitch_um / cells)  # the spot was given as points, not as means over cells
        assert np.max(np.abs(measured * cell_width - expected)) < 1e-5
    assert found.sum() == pytest.approx(1.0, abs=1e-12)


def test_four_spots_lie_half_the_distance_to_either_side():
    point = np.zeros((45, 45))
    point[22, 22] = 1.0
    found = Sampling(1.0, 8.0).photosites(point, 5, 4.0)  # a distance of two photosites: one to either side
    corners = found[3:6:2, 3:6:2]
    assert np.allclose(corners, 0.25, atol=1e-9) and np.abs(found).sum() == pytest.approx(1.0, abs=1e-6)


def test_wavelengths_share_a_channel_in_parts_of_equal_light():
    wavelengths = np.arange(400.0, 701.0, 1.0)
    light = np.stack([np.where(wavelengths < 550, 1.0, 0.0), np.where(wavelengths >= 550, 2.0, 0.0)], axis=-1)
    found = channel_wavelengths(wavelengths, light, 3)
    assert np.allclose(found[0], [424.5, 474.5, 524.5], atol=0.01)
    assert np.allclose(found.mean(axis=1), [474.5, 625.0], atol=0.01)


def test_kernels_are_as_large_as_rays_and_diffraction_want():
    blurred = kernel_size_px(Aberrations(), 2.8, 4.0, GREEN, blur_radii_px=(-10.0, 3.0))
    assert blurred == 27  # 20 + 1 + 2 x 6 x 0.55 x 2.8 / 4 = 25.6
    lateral = Aberrations(chromatic=(ChromaticShift(550.0, 0.0, 12.0),))
    assert kernel_size_px(lateral, 2.8, 4.0, GREEN) == kernel_size_px(Aberrations(), 2.8, 4.0, GREEN) + 6
    with pytest.raises(PhotositeError, match="lens.aberrations = .* photosites wide: a kernel has at most 511"):
        kernel_size_px(Aberrations(spherical_um=200.0), 2.8, 4.0, GREEN)


def test_stopping_down_is_advised_where_it_helps_which_is_where_the_wavefront_is_that_of_one_f_number():
    """Coefficients without at_f_number are those of any pupil: rays land at 2 N dW/dr, farther the smaller the pupil."""
    for stated, shrinks in ((None, False), (2.8, True)):
        coefficients = Aberrations(spherical_um=20.0, at_f_number=stated)
        assert (kernel_size_px(coefficients, 5.6, 4.0, GREEN) < kernel_size_px(coefficients, 2.8, 4.0, GREEN)) == shrinks
        with pytest.raises(PhotositeError) as told:
            kernel_size_px(replace(coefficients, spherical_um=200.0), 2.8, 4.0, GREEN)
        assert ("stop down" in str(told.value)) == shrinks and ("state at_f_number" in str(told.value)) != shrinks


def test_files_of_numpy_arrays_are_tables(tmp_path):
    kernels = np.array([gaussian(15, 1.0), gaussian(15, 2.0)]).reshape(2, 1, 1, 15, 15)
    np.savez(tmp_path / "lens.npz", kernels=0.9 * kernels, blur_radii_px=[0.0, 4.0], cells=3, light=0.9)
    found = read_psf(tmp_path / "lens.npz", 4.0)
    assert found.size_px == 5 and found.kernel(0, 2.0, (0.1, 0.0)).sum() == pytest.approx(0.9, abs=1e-6)
    np.save(tmp_path / "lens.npy", gaussian(7, 1.1))
    assert np.allclose(read_psf(tmp_path / "lens.npy", 4.0).kernel(1, 0.0, (0.0, 0.0)), gaussian(7, 1.1), atol=1e-7)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"cells": 1.5}, "cells = 1.5: give an odd integer of 1 or more"),
        ({"cells": np.nan}, "cells = nan: give an odd integer"),
        ({"cells": -1}, "cells = -1: give an odd number of cells"),
        ({"cells": 2}, "cells = 2: give an odd number of cells"),
        ({"cells": [1, 3]}, r"cells = \[1, 3\]: give one real number"),
        ({"light": "all"}, "light = all: give one real number"),
        ({"light": np.nan}, "light = nan: give the share that arrives"),
        ({"fields": [-1.0]}, "fields = .*-1.0.*: give shares of the half diagonal, 0 or more"),
    ],
)
def test_numbers_of_a_table_that_mean_nothing_are_refused(tmp_path, entry, message):
    np.savez(tmp_path / "lens.npz", kernels=np.ones((1, 1, 1, 3, 3)) / 9.0, **entry)
    with pytest.raises(PhotositeError, match=f"lens.npz: {message}"):
        read_psf(tmp_path / "lens.npz", 4.0)


def test_cells_may_be_a_whole_floating_point_number(tmp_path):
    np.savez(tmp_path / "lens.npz", kernels=np.ones((1, 1, 1, 3, 3)) / 9.0, cells=3.0)
    assert read_psf(tmp_path / "lens.npz", 4.0).size_px == 1


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_text_grid_is_put_onto_photosites(tmp_path, encoding):
    """A Gaussian given every 0.5 um, its middle at a stated point, against the integral over photosites of 4 um."""
    from scipy.special import erf

    grid = np.roll(gaussian(64 + 1, 6.0), 2, axis=1)[:, :64]  # middle: column 34 from 0, row 32
    lines = ["Polychromatic Huygens PSF", "Data spacing is 0.500 µm.", "Center point is: 35, 33", ""]
    lines += ["\t".join(f"{value:.7E}" for value in row) for row in grid / grid.max()]
    (tmp_path / "lens.txt").write_text("\n".join(lines) + "\n", encoding=encoding)
    found = read_psf(tmp_path / "lens.txt", 4.0).kernel(0, 0.0, (0.0, 0.0))
    edges = (np.arange(len(found) + 1) - len(found) / 2) * 4.0
    share = np.diff(0.5 * (1 + erf(edges / (3.0 * math.sqrt(2)))))
    assert np.max(np.abs(found - share[:, None] * share[None, :])) < 2e-3


def save_listing(path, *lines, code="utf-8"):
    """A grid of 9 rows and 11 columns whose light is in row 4, column 8, both from 1."""
    grid = np.zeros((9, 11))
    grid[3, 7] = 1.0
    rows = [" ".join(f"{value:.1f}" for value in row) for row in grid]
    path.write_bytes("\n".join([*lines, "", *rows, ""]).encode(code))
    return path


@pytest.mark.parametrize("stated", ["8, 4", "8, 4 (column, row)", "row 4, column 8", "Row 4, Column 8."])
def test_the_centre_of_a_listing_may_be_named_or_a_pair(tmp_path, stated):
    path = save_listing(tmp_path / "lens.txt", "Data spacing is 1.000 µm.", f"Center point is: {stated}")
    kernel = read_psf(path, 3.0).kernels[0, 0, 0]
    assert kernel[len(kernel) // 2, len(kernel) // 2] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "stated", ["", "near 4", "row 4", "4.5, 8.5", "8, 4 (row, column)", "0, 4", "12, 4", "row 10, column 8"]
)
def test_a_centre_that_is_no_point_of_the_grid_is_refused(tmp_path, stated):
    path = save_listing(tmp_path / "lens.txt", "Data spacing is 1.000 um", f"Center point is: {stated}")
    with pytest.raises(PhotositeError, match=r"lens.txt: Center point = .*give column and row from 1"):
        read_psf(path, 3.0)


@pytest.mark.parametrize("stated", ["1.000 µm.", "1 um", "1.0E+00 microns", "0.001 mm", "1000 nm"])
@pytest.mark.parametrize("code", ["utf-8", "latin-1", "utf-16"])
def test_the_spacing_of_a_listing_has_a_unit(tmp_path, stated, code):
    """The light of one point fills one cell of a third of 3 um, in the grid's own place: 2 columns right and 1 row up."""
    kernel = read_psf(save_listing(tmp_path / "lens.txt", f"Data spacing is {stated}", code=code), 3.0).kernels[0, 0, 0]
    middle = len(kernel) // 2
    assert kernel[middle - 1, middle + 2] == pytest.approx(1.0)


@pytest.mark.parametrize("stated", ["1.000 mr", "1.000 inches", "1.000", "0 um", "-1 mm"])
def test_a_spacing_that_is_no_length_is_refused(tmp_path, stated):
    with pytest.raises(PhotositeError, match=r"lens.txt: Data spacing = .*give a distance above 0 in um, mm or nm"):
        read_psf(save_listing(tmp_path / "lens.txt", f"Data spacing is {stated}"), 3.0)


def wrong(change) -> np.ndarray:
    kernel = gaussian(5, 1.0)
    change(kernel)
    return kernel


@pytest.mark.parametrize(
    ("kernel", "message"),
    [
        (wrong(lambda k: k.__imul__(0.9)), r"PSF: kernel \(0, 0, 0\) sums to 0.9, not to 1: divide"),
        (wrong(lambda k: k.__setitem__((0, 0), -0.01)), r"PSF: kernel \(0, 0, 0\) holds -0.01; light is not negative"),
        (wrong(lambda k: k.__setitem__((1, 1), np.nan)), r"PSF: kernel \(0, 0, 0\) is not finite"),
        (np.full((4, 4), 1 / 16), "PSF: size of the kernels = 4 x 4: give an odd square"),
    ],
)
def test_kernels_that_are_no_psf_are_refused(kernel, message):
    with pytest.raises(PhotositeError, match=message):
        table(kernel)


def test_a_skewed_kernel_takes_light_aside_by_its_row():
    skew, matrix = (0.25, -0.1), np.array([[1.0, 0.25], [0.0, 0.9]])
    y, x = np.mgrid[-30:31, -30:31]
    back = np.einsum("ij,jyx->iyx", np.linalg.inv(matrix), np.stack([x, y]))
    expected = np.exp(-0.5 * ((back[0] / 5.0) ** 2 + (back[1] / 3.0) ** 2))
    found = skew_kernel(gaussian(61, 5.0, 3.0), skew)
    assert found.sum() == pytest.approx(gaussian(61, 5.0, 3.0).sum())
    assert np.abs(found / found.sum() - expected / expected.sum()).max() < 1e-3 * found.max() / found.sum()


def test_files_that_hold_no_psf_are_refused(tmp_path):
    def refused(name, content, message):
        path = tmp_path / name
        path.write_bytes(content) if isinstance(content, bytes) else np.save(path, content)
        with pytest.raises(PhotositeError, match=rf"{name}.*{message}"):
            read_psf(path, 4.0)

    with pytest.raises(PhotositeError, match="no such file"):
        read_psf(tmp_path / "none.npy", 4.0)
    refused("a.fits", b"SIMPLE", "no known kind of PSF file; give .npz, .npy, .txt or .csv")
    refused("b.npy", b"nothing", "cannot be read")
    refused("c.npz", b"nothing", "cannot be read")
    refused("d.npy", np.ones(5), "give one kernel")
    refused("e.npy", np.ones((5, 5), complex), "give real numbers")
    refused("f.txt", b"1 2 3\n4 5 6\n7 8 9\n", "Data spacing is 0.250 um")
    refused("g.txt", b"Data spacing is 1 um\nnothing\n", "holds no grid of numbers")
    refused("h.txt", b"Data spacing is 1 um\n0 0 0\n0 0 0\n0 0 0\n", "sum of the grid")
    np.savez(tmp_path / "i.npz", kernel=np.ones((1, 1, 1, 3, 3)))
    with pytest.raises(PhotositeError, match="i.npz: keys = kernel: unknown; give .*kernels"):
        read_psf(tmp_path / "i.npz", 4.0)
