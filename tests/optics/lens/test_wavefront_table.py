"""A wavefront over field and wavelength: the sum of its terms, between its entries, in kernels and in shot files."""

import numpy as np
import pytest

from simulator.config import build_shot_from_data, load_shot
from simulator.errors import PhotositeError
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.lens.wavefront_table import WavefrontTable, power_pairs
from simulator.optics.psf.wavefront_psf import WavefrontPsf

SEIDEL = Aberrations(spherical_um=0.7, coma_um=0.9, astigmatism_um=0.5, field_curvature_um=-0.4, defocus_um=0.2)


def table_of_seidel(fields):
    """The same wavefront as SEIDEL at these fields, order 4."""
    pairs = power_pairs(4)
    rows = []
    for h in fields:
        terms = dict.fromkeys(pairs, 0.0)
        terms[2, 0] = 0.7
        terms[1, 1] = 0.9 * h
        terms[0, 2] = 0.5 * h**2
        terms[1, 0] = -0.4 * h**2 + 0.2
        rows.append(tuple(terms[pair] for pair in pairs))
    return WavefrontTable(4, tuple(fields), (550.0,), (tuple(rows),))


def test_terms_are_those_of_a_symmetric_lens_up_to_the_order():
    assert power_pairs(4) == ((0, 1), (1, 0), (0, 2), (1, 1), (0, 3), (2, 0), (1, 2), (0, 4))
    assert all(1 <= 2 * p + q <= 10 for p, q in power_pairs(10)) and len(set(power_pairs(10))) == len(power_pairs(10)) == 35


@pytest.mark.parametrize("field_xy", [(0.0, 0.0), (0.5, 0.0), (0.3, -0.4), (-0.6, 0.8)])
def test_a_table_of_primary_aberrations_is_those(field_xy):
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 200))
    table = Aberrations(traced=table_of_seidel((0.0, 0.5, 1.0)), at_f_number=2.8)
    given = (x, y, 5.6, 550.0, field_xy, 1.5)
    np.testing.assert_allclose(
        table.wavefront_error_um(*given),
        Aberrations(**{**vars(SEIDEL), "at_f_number": 2.8}).wavefront_error_um(*given),
        atol=1e-12,
    )


def test_entries_are_linear_between_fields_and_wavelengths():
    values = np.random.default_rng(2).normal(size=(3, 2, len(power_pairs(3))))
    coefficients = tuple(tuple(tuple(row) for row in plane) for plane in values.tolist())
    table = WavefrontTable(3, (0.0, 0.8), (400.0, 500.0, 700.0), coefficients)
    expected = 0.75 * (0.5 * values[0, 0] + 0.5 * values[1, 0]) + 0.25 * (0.5 * values[0, 1] + 0.5 * values[1, 1])
    np.testing.assert_allclose(table.terms_um(0.2, 450.0), expected, atol=1e-12)
    np.testing.assert_allclose(table.terms_um(1.0, 900.0), values[2, 1], atol=1e-12)


def test_kernels_are_those_of_the_same_wavefront():
    make = {"f_number": 5.6, "pitch_um": 4.0, "wavelengths_nm": ((550.0,),), "size_px": 15}
    for field_xy in ((0.0, 0.0), (0.0, -1.0), (0.6, 0.8)):
        kernels = [
            WavefrontPsf(aberrations, **make).kernel(0, 0.5, field_xy)
            for aberrations in (SEIDEL, Aberrations(traced=table_of_seidel((0.0, 0.5, 1.0))))
        ]
        np.testing.assert_allclose(*kernels, atol=1e-12)


def test_the_file_of_a_frame_holds_it(tmp_path):
    (tmp_path / "shot.yaml").write_text(
        "scene: {chart: grey_ramp, luminance: 100 cd/m^2}\n"
        "lens: {focal_length: 50 mm, f_number: f/4, aberrations: {at_f_number: f/2, traced: {order: 1, fields: [0, 1],\n"
        "  wavelengths: [450 nm, 650 nm], coefficients: [[[0 um], [0.5 um]], [[0 um], [-250 nm]]]}}}\n"
        "exposure: {time: 1/100 s, iso: 100}\ncamera: sony_a7s2\n"
    )
    shot = load_shot(tmp_path / "shot.yaml")
    table = WavefrontTable(1, (0.0, 1.0), (450.0, 650.0), (((0.0,), (0.5,)), ((0.0,), (-0.25,))))
    assert shot.lens.aberrations == Aberrations(at_f_number=2.0, traced=table)
    assert build_shot_from_data(shot.resolved, "again", {}).lens == shot.lens


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"order": 13}, "traced.order = 13: give 1 to 12"),
        ({"fields": (0.1, 1.0)}, "the first field is the axis"),
        ({"fields": (0.0, 0.0)}, "traced.fields .*ascending"),
        ({"wavelengths_nm": (650.0, 450.0)}, "traced.wavelengths .*ascending"),
        ({"coefficients_um": (((0.0,), (0.5,)),)}, "give 2 wavelengths of 2 fields of 1 coefficients"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(change, says):
    good = {"order": 1, "fields": (0.0, 1.0), "wavelengths_nm": (450.0, 650.0)}
    good["coefficients_um"] = (((0.0,), (0.5,)), ((0.0,), (-0.25,)))
    with pytest.raises(PhotositeError, match=says):
        WavefrontTable(**(good | change))
