"""NoiseProfile is true: on flat fields of 20 levels, read back from the files alone, variance = S x + O."""

from dataclasses import replace

import numpy as np
import pytest
import tifffile
from helpers.randomness import accept
from scipy import stats

from simulator.config import load_camera
from simulator.measurement.noise_check.flat_bench import FlatBench, bench_camera, white_light
from simulator.measurement.statistics.temporal_noise import pair_noise
from simulator.raw.dng.tags import Tag
from simulator.raw.raw_reader import read_raw_file
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.dark_current import DarkCurrent

LEVELS = 20
BRIGHTEST = 0.85  # of white in the most sensitive colour, where noise is not yet cut off


def noise_profile(path) -> tuple[float, float]:
    """S and O as another reader finds them in the file; all colours have the same."""
    with tifffile.TiffFile(path) as file:
        values = file.pages[0].pages[0].tags[Tag.NOISE_PROFILE].value
    assert values == values[:2] * (len(values) // 2)
    return values[:2]


def variance_ratios(
    folder, camera: Camera, iso: int, frames: int, width: int, height: int, time_s: float = 1 / 60
) -> tuple[np.ndarray, np.ndarray]:
    """Measured over promised variance, and its standard error: (LEVELS, planes and pairs)."""
    body = bench_camera(camera, width, height)
    bench = FlatBench(body, iso, time_s, white_light(), folder)
    dark = bench.planned.sensor.moments(0.0)
    # A camera without pedestal cuts off its darkest noise, which no S x + O describes.
    darkest = (
        max(0.0, 6.0 * dark.variance**0.5 - bench.planned.sensor.stage("adc").black_level_dn)
        / bench.planned.sensor.white_level_dn()
    )
    shares = np.linspace(darkest, BRIGHTEST, LEVELS) if darkest else np.geomspace(1e-3, BRIGHTEST, LEVELS) - 1e-3
    found, errors = [], []
    for level, share in enumerate(shares):
        names = [f"{level}_{number}" for number in range(frames)]
        paths = [bench.take(name, bench.factor_of(share), 1000 * level + number) for number, name in enumerate(names)]
        files, (slope, offset) = [read_raw_file(path) for path in paths], noise_profile(paths[0])
        black, span = files[0].black_level_dn.mean(), files[0].white_level_dn - files[0].black_level_dn.mean()
        pairs = [
            pair_noise(a.planes()[n], b.planes()[n]) for a, b in zip(files[::2], files[1::2], strict=True) for n in a.planes()
        ]
        promised = [span**2 * (slope * (pair.mean_dn - black) / span + offset) for pair in pairs]
        found.append([pair.variance_dn2 / value for pair, value in zip(pairs, promised, strict=True)])
        errors.append([pair.variance_error_dn2 / value for pair, value in zip(pairs, promised, strict=True)])
        for path in paths:
            path.unlink()
    return np.array(found), np.array(errors)


def check(found: np.ndarray, errors: np.ndarray) -> None:
    """Every level within 1 %, and all of them as near as the number of photosites allows (chi-square)."""
    means = found.mean(axis=1)
    standard_errors = np.sqrt((errors**2).mean(axis=1) / found.shape[1])
    assert np.abs(means - 1.0).max() < 0.01, means
    z = (means - 1.0) / standard_errors
    accept({"chi-square": float(stats.chi2.sf((z**2).sum(), z.size)), **dict(enumerate(2.0 * stats.norm.sf(abs(z))))})


def test_the_variance_of_twenty_levels_is_that_of_the_noise_profile(tmp_path):
    check(*variance_ratios(tmp_path, load_camera("sony_a7s2"), 1600, frames=8, width=400, height=300))


def test_the_noise_of_dark_current_counts_once_in_the_noise_profile(tmp_path):
    """3000 dark electrons stand above the black level, as light does."""
    body = load_camera("sony_a7s2")
    warm = replace(body, stages={**body.stages, "dark_current": DarkCurrent(100.0)})
    check(*variance_ratios(tmp_path, warm, 1600, frames=8, width=400, height=300, time_s=30.0))


CAMERAS = [
    ("sony_a7s2", 100),
    ("sony_a7s2", 12800),
    ("nikon_d850", 100),
    ("imx385", 1600),
    ("nikon_d3", 6400),
    ("sony_a7_iii", 800),
]


@pytest.mark.slow
@pytest.mark.parametrize(("camera", "iso"), CAMERAS)
def test_the_variance_of_twenty_levels_is_that_of_the_noise_profile_at_a_thousandth(tmp_path, camera, iso):
    check(*variance_ratios(tmp_path, load_camera(camera), iso, frames=16, width=640, height=480))
