"""The loop closes in colour under A, D50 and D65: noise-free ColorChecker, DNG, LibRaw, XYZ, against colour-science."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from simulator import load_camera
from simulator.color.colour_science import colour_science
from simulator.color.root_polynomials import fit_color_correction

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def color_tables(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    return importlib.import_module("make_color_tables")


@pytest.mark.parametrize("camera", ["sony_a7_iii", "canon_5d_mark_iv"])
@pytest.mark.parametrize("light", ["A", "D50", "D65"])
def test_mean_color_difference_is_below_1_and_none_above_3(camera, light, tmp_path, color_tables):
    chart = color_tables.photograph(camera, light, tmp_path)
    difference = chart.by_root_polynomials()
    print(f"\n{camera} {light}: mean {difference.mean():.2f}, max {difference.max():.2f} ({chart.names[difference.argmax()]})")
    assert difference.mean() < 1.0 and difference.max() < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 1])
def test_the_tables_in_the_docs_are_those_of_the_script(which, color_tables):
    mark, make = list(color_tables.TABLES.items())[which]
    assert color_tables.written_table(mark) == make(), "docs/raw_files.md is out of date; run `make docs`"


@pytest.mark.parametrize("light", ["A", "D65", "3200 K"])
def test_greys_stay_grey_and_exposure_only_scales(light):
    response = load_camera("sony_a7_iii").response
    correction = fit_color_correction(response.wavelengths_nm, response.quantum_efficiency, light)
    levels = np.array([1e-3, 0.1, 1.0])
    grey = correction.xyz(levels[:, None] * correction.neutral)
    np.testing.assert_allclose(grey, levels[:, None] * correction.white_xyz, rtol=1e-12)
    colour = np.array([0.3, 0.2, 0.05])
    np.testing.assert_allclose(correction.xyz(7.0 * colour), 7.0 * correction.xyz(colour), rtol=1e-12)
    assert np.isfinite(correction.xyz([-0.01, 0.02, 0.0])).all()


def test_a_camera_that_sees_as_the_eye_is_corrected_exactly(color_tables):
    """Curves that are sums of the eye's (Luther condition): XYZ itself comes out, to rounding."""
    observer = colour_science().MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    wavelengths = observer.wavelengths  # by 1 nm, so that 1 / lambda is as good as linear in between
    mix = np.array([[0.8, 0.3, 0.0], [0.1, 0.9, 0.1], [0.0, 0.1, 0.8]])
    efficiency = observer.values @ mix / wavelengths[:, None]  # per photon, so that per watt it is the eye's
    correction = fit_color_correction(wavelengths, efficiency, "D65")
    true, _ = color_tables.true_patches("D65")
    camera = true @ mix / (correction.white_xyz @ mix).max()
    np.testing.assert_allclose(correction.xyz(camera), true, atol=1e-4)
