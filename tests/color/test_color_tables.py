"""The tables of configs/color are those of colour-science, and of the search that they save."""

import numpy as np
import pytest

from simulator import load_camera
from simulator.color import color_tables
from simulator.color.camera_matrices import (
    CALIBRATION_LIGHTS,
    TRAINING_REFLECTANCES,
    forward_matrix,
    response_key,
    search_forward_matrix,
)
from simulator.color.color_tables import read_forward_matrices, read_rows, read_spectra
from simulator.color.colour_science import colour_science
from simulator.color.spectra import ILLUMINANTS


def _same(table, name, wavelengths_nm, values):
    grid, found = table.curve(name)
    assert np.array_equal(grid, wavelengths_nm) and np.array_equal(found, values), name


def test_the_observer_is_that_of_colour_science():
    observer = colour_science().MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    table = read_spectra(color_tables.OBSERVER)
    assert np.array_equal(table.wavelengths_nm, observer.wavelengths)
    assert np.array_equal(table.columns(), observer.values)


def test_the_light_sources_are_those_of_colour_science():
    table = read_spectra(color_tables.ILLUMINANTS)
    assert tuple(table.curves) == ILLUMINANTS
    for name in ILLUMINANTS:
        light = colour_science().SDS_ILLUMINANTS[name]
        _same(table, name, light.wavelengths, light.values)


def test_the_patches_and_the_reflectances_of_srgb_are_those_of_colour_science():
    patches = colour_science().SDS_COLOURCHECKERS[TRAINING_REFLECTANCES]
    table = read_spectra(color_tables.COLOR_CHECKER)
    assert list(table.curves) == list(patches)
    for name, patch in patches.items():
        _same(table, name, patch.wavelengths, patch.values)
    basis = colour_science().recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019
    table = read_spectra(color_tables.BASIS)
    assert np.array_equal(table.wavelengths_nm, basis.wavelengths) and np.array_equal(table.columns(), basis.values)


CAMERAS = {name: key for key, _, names, *_ in read_rows(color_tables.FORWARD_MATRICES)[1:] for name in names.split()}


FEW = {"nikon_d850", "imx385", "raspberry_pi_hq", "sony_a7s2"}


@pytest.mark.parametrize("name", [name if name in FEW else pytest.param(name, marks=pytest.mark.slow) for name in CAMERAS])
def test_the_forward_matrices_of_the_library_are_those_that_a_search_finds(name):
    response = load_camera(name).response
    curves = response.wavelengths_nm, response.quantum_efficiency
    assert response_key(*curves) == CAMERAS[name]
    for light in CALIBRATION_LIGHTS:
        known = read_forward_matrices()[CAMERAS[name], light]
        # Processors differ in the last bits on which the search ends; entries are whole ten-thousandths.
        assert np.allclose(known, search_forward_matrix(*curves, light), rtol=0, atol=3e-4)
        assert np.array_equal(forward_matrix(*curves, light), known)


def test_every_camera_with_colours_has_its_matrices():
    for path in (color_tables.FOLDER.parent / "cameras").glob("*.yaml"):
        assert (load_camera(path.stem).channels == 3) == (path.stem in CAMERAS)
