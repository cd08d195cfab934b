"""docs/cameras.md says what the camera files say."""

import importlib
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def make_cameras(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    return importlib.import_module("make_cameras")


def test_the_page_is_that_of_the_camera_files(make_cameras):
    written = make_cameras.PAGE.read_text(encoding="utf-8")
    assert written == make_cameras.page(), "docs/cameras.md is not what configs/cameras says; run `make docs`"


def test_every_camera_has_a_chart_of_less_than_60_kb(make_cameras):
    sizes = {path.stem: path.stat().st_size for path in make_cameras.CHARTS.glob("*.png")}
    assert sorted(sizes) == make_cameras.names()
    assert max(sizes.values()) < 60_000


def test_the_published_matrices_develop_the_simulated_color_checker_nearly_as_well_as_the_fitted_ones(make_cameras):
    from simulator.config import load_camera

    colors = sys.modules["camera_colors"]
    cameras = [camera for name in make_cameras.names() if (camera := load_camera(name)).color_matrix is not None]
    errors = [colors.matrix_errors(camera) for camera in cameras]
    assert len(errors) == 9
    # Swapped curves, or the matrix of a camera with another sensor, are off by 4 and more.
    assert max(fitted for fitted, _ in errors) < 1.5 and max(published for _, published in errors) < 2.5


def test_dynamic_range_is_full_scale_over_read_noise(make_cameras):
    from simulator.config import load_camera

    camera = load_camera("sony_a7s2")
    stops = [make_cameras.dynamic_range_stops(camera, camera.iso_setting(iso)) for iso in (100, 1600, 2000, 25600)]
    assert stops == pytest.approx([13.94, 11.30, 12.55, 9.26], abs=0.01)  # megvii-research/PMN@d207d3e
