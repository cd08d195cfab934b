"""Noise of raw files over their signal, and of the models of their cameras; the distribution of codes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.hdr_bench import SHOT_NOISE
from helpers.randomness import accept
from scipy.stats import norm

import simulator
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.measurement.curves.raw_plots import model_plots, raw_plots, wanted_plots
from simulator.raw.raw_reader import RawFile, read_raw_file
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.row_noise import RowNoise

DIFFERENCES = 1.94  # second differences in a row are worth one independent one (single_frame_noise)
BLOCK_PX = 16


def relative_error(blocks: float) -> float:
    """Relative standard error of the noise from the median of so many blocks."""
    return math.sqrt(0.5 * math.pi / blocks / (2.0 * BLOCK_PX * (BLOCK_PX - 2) / DIFFERENCES))


@pytest.fixture(scope="module")
def grey(tmp_path_factory) -> RawFile:
    """An even field of the Sony A7S II at ISO 1600, whose colours have three levels."""
    settings = ["exposure.iso=1600", "exposure.time=1/200 s", "camera.window={x: 2000, y: 1200, width: 768, height: 512}"]
    raw = simulator.simulate(simulator.load_shot("flat_field", settings))
    folder = tmp_path_factory.mktemp("raw")
    simulator.save(raw, folder, truth=False)
    return read_raw_file(folder / f"{raw.name}.dng")


def test_noise_of_a_frame_is_that_of_the_model_of_its_camera(grey):
    measured = raw_plots(grey)[0].lines[0].curve
    model = model_plots(load_camera("sony_a7s2"), grey.iso, grey.exposure_time_s)[0].lines[0].curve
    assert (measured.x_name, measured.y_unit) == (model.x_name, model.y_unit)
    expected = np.exp(np.interp(np.log(measured.x), np.log(model.x), np.log(model.y)))
    blocks = (512 // 2 // BLOCK_PX) * (768 // 2 // BLOCK_PX) / 12
    z = (measured.y / expected - 1.0) / relative_error(blocks)
    accept({f"{signal:.0f} DN": 2.0 * float(norm.sf(abs(one))) for signal, one in zip(measured.x, z, strict=True)})
    assert len(z) == 48 and abs(z.mean()) < 4.0 / math.sqrt(48)


def test_snr_is_signal_over_noise_by_share_of_full_scale(grey):
    noise, snr, _ = (plot.lines[0].curve for plot in raw_plots(grey))
    assert snr.x == pytest.approx(noise.x / (grey.white_level_dn - 512.0), rel=1e-12)
    assert snr.y == pytest.approx(noise.x / noise.y, rel=1e-12)


def test_the_model_has_no_row_noise_and_the_fixed_pattern():
    setting = {"iso_table": {100: IsoSetting(0.25, 3.0)}, "black_level_dn": 500.0}
    noisy = {**SHOT_NOISE, "row_noise": RowNoise(50.0), "prnu": Prnu(0.05)}
    cameras = (small_camera(stages=stages, **setting) for stages in (SHOT_NOISE, noisy))
    first, second = (model_plots(camera, 100, 0.01)[0].lines[0].curve for camera in cameras)
    level = first.x[-20]
    expected = math.hypot(np.interp(level, first.x, first.y), 0.05 * level)
    assert np.interp(level, second.x, second.y) == pytest.approx(expected, rel=0.02)  # linear between points
    assert second.y[0] == pytest.approx(first.y[0], rel=1e-3)


def test_codes_are_counted_by_quarters_of_a_stop_below_white():
    mosaic = np.full((16, 16), 100 + 800, np.uint16)  # half of full scale: one stop
    mosaic[:4] = 100  # black
    mosaic[4:6] = 100 + 1600  # white
    raw = RawFile("a.dng", mosaic, "RGGB", np.full((2, 2), 100.0), 1700, None, None)
    curve = raw_plots(raw)[2].lines[0].curve
    found = {float(x): y for x, y in zip(curve.x, curve.y, strict=True) if y > 0}
    assert found == {-0.875: 62.5, -0.125: 12.5}


def test_photosites_of_one_colour_of_x_trans_are_taken_together():
    """Colours at three levels with normal noise of 10 DN in a pattern of 6 x 6."""
    rows = ("GGRGGB", "GGBGGR", "BRGRBG", "GGBGGR", "GGRGGB", "RBGBRG")
    means = {"R": 2000.0, "G": 4000.0, "B": 1000.0}
    level = np.tile([[means[letter] for letter in row] for row in rows], (64, 64))
    mosaic = np.rint(np.random.default_rng(3).normal(level, 10.0)).astype(np.uint16)
    curve = raw_plots(RawFile("a.dng", mosaic, "/".join(rows), np.full((6, 6), 64.0), 16383, None, None))[0].lines[0].curve
    assert len(curve.x) == 36  # levels, of three colours
    checks = {}
    for letter, mean in means.items():
        near = np.abs(curve.x + 64.0 - mean) < 10.0
        assert near.sum() == 12
        blocks = sum(row.count(letter) for row in rows) * (64 // BLOCK_PX) ** 2
        z = (curve.y[near].mean() / math.hypot(10.0, math.sqrt(1 / 12)) - 1.0) / relative_error(blocks)
        checks[letter] = 2.0 * float(norm.sf(abs(z)))
    accept(checks)


def test_a_file_without_an_iso_needs_one(grey):
    silent = replace(grey, iso=None)
    with pytest.raises(PhotositeError, match="--iso None: the raw file does not say its ISO"):
        model_plots(load_camera("sony_a7s2"), silent.iso, None)


def test_another_plot_is_refused(grey):
    plots = raw_plots(grey)
    assert [plot.name for plot in wanted_plots(plots, ["codes"])] == ["codes"]
    with pytest.raises(PhotositeError, match="plots of raw files are noise_of_signal, snr_of_signal, codes"):
        wanted_plots(plots, ["blur"])
