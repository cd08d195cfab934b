"""The chain stays whole at every setting: no NaN, no wrap, no stray code, and single precision loses next to nothing.

Ranges: radiance 1e-12 to 1e12 of the test scene's, 1 us to 1 h, ISO 25 to 4 million, wells of 1 to 1e7 e-, one electron
0.001 to 1000 DN, 8 to 16 bits, black 0 to 4096. Cases are drawn by hypothesis, the same ones in every run.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.stability_cases import FEW, HEIGHT, LONG, QUICK, WIDTH, Body, Case, bodies, cases, code_range
from hypothesis import example, given, target
from hypothesis import strategies as st

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window
from simulator.sensor.readout import read_mean_electrons, read_noise_free
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Moments

# Single precision against double, in roundings of 2^-24 relative each; one rounding is at most one ulp.
#   tan^2: two squares and their sum, the product with its rounded factor          4
#   1 + tan^2: one more; its reciprocal 2e-7 (kernels/plain_math.h)                5 + 3.4
#   squared for cos^4: twice that and one product                                  17.8
#   radiance times the rounded solid angle times cos^4                             + 3
#   rounded area times rounded time, times the irradiance                          + 4  = 24.8: mean electrons
#   + rounded rate times rounded time                                              + 1
#   gain, rounded, and its product; + black, rounded, and its sum                  + 2 + 1 + 1
# The worst of thousands of drawn cameras: 9.8 ulps in mean electrons, 10.7 in the code.
ULPS_ELECTRONS = 25
ULPS_CODE = 30


def check_noisy(case: Case) -> None:
    raw = simulate(case.shot())
    assert np.isfinite(raw.mean_electrons).all() and (raw.mean_electrons >= 0).all()
    assert np.isfinite(raw.noise_free_dn).all() and 0 <= raw.noise_free_dn.min() and raw.noise_free_dn.max() <= 2**case.bits - 1
    low, high = code_range(case, raw.mean_electrons)
    stray = (raw.dn < np.floor(low)) | (raw.dn > np.ceil(high))
    assert not stray.any(), (raw.mean_electrons[stray], raw.dn[stray], low[stray], high[stray])
    assert raw.black_level_dn < raw.white_level_dn <= 2**case.bits - 1
    assert all(0 < slope < math.inf and 0 < offset < math.inf for slope, offset in raw.noise_profile)


def check_noise_free(case: Case) -> None:
    raw = simulate(case.shot())
    assert np.array_equal(raw.dn, np.rint(raw.noise_free_dn)), "the frame is the rounded truth"
    for image in (raw.mean_electrons, raw.noise_free_dn, raw.dn.astype(int)):
        assert (np.diff(image, axis=1) >= 0).all(), "more light never gives less"
    assert (raw.dn[:, 0] == np.rint(np.float32(case.black))).all()


DARK_FILLS_THE_WELL = Case(1.0, 1.0, 3600.0, 100, 1.0, 12, 64.0, 0.0, 0.0, 1000.0, 1e5, True)
WELL_BELOW_ONE_CODE = Case(1.0, 6.0, 1.0, 100, 0.001, 14, 64.0, 3.0, 1.0, 1.0, 0.0, True)
BRIGHTEST = Case(1e6, 6.0, 3600.0, 4_000_000, 1000.0, 16, 4096.0, 1000.0, 1000.0, 0.0, 1e5, True)
NO_PEDESTAL = Case(1e-12, 0.0, 1e-6, 25, 1000.0, 8, 0.0, 1000.0, 1000.0, 1.0, 0.0, True)


@example(DARK_FILLS_THE_WELL)
@example(WELL_BELOW_ONE_CODE)
@example(BRIGHTEST)
@example(NO_PEDESTAL)
@given(cases())
@FEW
def test_every_code_lies_where_its_mean_and_noise_allow(case):
    check_noisy(case)


@pytest.mark.slow
@given(cases())
@LONG
def test_every_code_lies_where_its_mean_and_noise_allow_in_thousands_of_cameras(case):
    check_noisy(case)


@given(cases(noisy=False))
@QUICK
def test_without_noise_the_frame_is_the_rounded_truth_and_rises_with_light(case):
    check_noise_free(case)


@pytest.mark.slow
@given(cases(noisy=False))
@LONG
def test_without_noise_the_frame_is_the_rounded_truth_in_thousands_of_cameras(case):
    check_noise_free(case)


@dataclass(frozen=True)
class Optics:
    """What the float64 chain needs beside a Case."""

    focal_mm: float
    f_number: float
    x: int
    y: int


def optics():
    window = st.sampled_from([0, 17, 2980, 5960])
    return st.builds(Optics, st.floats(4.0, 400.0), st.floats(0.5, 64.0), window, window)


def ulps(found: np.ndarray, exact: np.ndarray) -> float:
    """Largest distance in units of the last place of float32."""
    assert found.dtype == np.float32
    return float(np.max(np.abs(found - exact) / np.spacing(exact.astype(np.float32)).astype(np.float64)))


def worst_ulps(case: Case, lens: Optics, device) -> tuple[float, float]:
    """Ulps of mean electrons and of noise-free codes against the formulas of docs in NumPy's float64."""
    shot = case.shot()
    camera = dataclasses.replace(shot.camera, width_px=6000, height_px=6000, window=Window(lens.x, lens.y, WIDTH, HEIGHT))
    thin = ThinLens(lens.focal_mm, lens.f_number)
    planned = plan(dataclasses.replace(shot, camera=camera, lens=thin))
    radiance = (1e5 * case.picture()).astype(np.float32)  # a weight of 1 in a scene of 100 cd/m^2, about
    light = device.upload(radiance)
    electrons, code = read_mean_electrons(device, planned.sensor, light), read_noise_free(device, planned.sensor, light)
    y, x = np.mgrid[lens.y : lens.y + HEIGHT, lens.x : lens.x + WIDTH] + 0.5 - 3000.0
    cos2 = 1.0 / (1.0 + (x**2 + y**2) * (5e-3 / lens.focal_mm) ** 2)
    solid_angle = np.pi / (4.0 * lens.f_number**2 + 1.0)
    exact = radiance.astype(np.float64) * solid_angle * cos2**2 * 25.0 * case.time_s
    dark = case.dark_e_per_s * case.time_s if case.noisy else 0.0
    signal = case.gain * np.minimum(exact + dark, case.well_e or math.inf) + case.black
    return ulps(electrons, exact), ulps(code, np.clip(signal, 0.0, 2.0**case.bits - 1.0))


def check_ulps(case: Case, lens: Optics, device) -> None:
    in_electrons, in_code = worst_ulps(case, lens, device)
    target(in_electrons, label="ulps of mean electrons")
    target(in_code, label="ulps of the code")
    assert in_electrons <= ULPS_ELECTRONS and in_code <= ULPS_CODE


@given(cases(), optics())
@QUICK
def test_single_precision_is_within_30_ulps_of_double(device, case, lens):
    check_ulps(case, lens, device)


@pytest.mark.slow
@given(cases(), optics())
@LONG
def test_single_precision_is_within_30_ulps_of_double_in_thousands_of_cameras(device, case, lens):
    check_ulps(case, lens, device)


def check_body(bench, case: Case, body: Body) -> None:
    case = dataclasses.replace(case, well_e=case.well_e or 1e7)
    mean = np.broadcast_to(np.geomspace(1e-3, 10.0 ** (1 + case.decades), WIDTH), (HEIGHT, WIDTH)).astype(np.float32).copy()
    mean[:, 0] = 0.0
    stages = body.stages(case)
    codes = bench.sensor(mean, *stages, gain=case.gain, bits=case.bits, black=case.black)
    low, high = body.code_range(case, mean.astype(np.float64))
    stray = (codes < np.floor(low)) | (codes > np.ceil(high))
    assert not stray.any(), (mean[stray], codes[stray], low[stray], high[stray])
    for light in (0.0, 1.0, 1e6):
        signal = Moments(light, 0.0)
        for stage in stages:
            signal = stage.moments(signal)
        assert all(map(math.isfinite, (signal.mean, signal.variance, signal.fixed_variance)))
        assert signal.variance >= 0 and signal.fixed_variance >= 0


@given(cases(complete=True), bodies(complete=True))
@FEW
def test_every_stage_at_once_keeps_every_code_where_it_belongs(bench, case, body):
    check_body(bench, case, body)


@pytest.mark.slow
@given(cases(), bodies())
@LONG
def test_every_stage_at_once_keeps_every_code_where_it_belongs_in_thousands_of_cameras(bench, case, body):
    check_body(bench, case, body)


@pytest.mark.parametrize("gain", [0.001, 1.0, 1000.0])
@pytest.mark.parametrize("bits", [8, 16])
def test_more_electrons_than_any_type_holds_saturate(bench, gain, bits):
    """Means from far above every well to infinity, with every noise; a wrap or a NaN would give a small code."""
    means = np.repeat(np.float32([1e9, 3e9, 1e12, 1e20, 1e30, 3e38, np.inf]), 64)[None]
    noises = (STAGES["photon_shot_noise"](), STAGES["read_noise_before_gain"](100.0), STAGES["read_noise_after_gain"](10.0))
    for stages in ((), noises, (*noises, STAGES["dark_current"](1e9, 1.0))):
        assert (bench.sensor(means, *stages, gain=gain, bits=bits, black=300.0 if bits > 8 else 0.0) == 2**bits - 1).all()


@pytest.mark.parametrize("seconds", [1e30, 1e38])
def test_light_beyond_single_precision_is_refused_not_turned_into_nan(seconds):
    shot = BRIGHTEST.shot()
    with pytest.raises(PhotositeError, match="scene: the brightest place gives .* electrons"):
        simulate(dataclasses.replace(shot, exposure=Exposure(seconds, shot.exposure.iso)))


def test_a_shutter_that_never_closes_is_refused():
    with pytest.raises(PhotositeError, match="must open and close"):
        Exposure(math.inf)


def test_white_is_the_code_that_saturated_photosites_have():
    """3 e- of 0.3 DN above 64 is 64.9, which the ADC rounds to 65."""
    case = Case(1.0, 0.0, 1.0, 100, 0.3, 12, 64.0, 0.0, 0.0, 3.0, 0.0, False)
    raw = simulate(case.shot())
    assert raw.white_level_dn == raw.dn.max() == 65


def test_noise_profile_is_that_of_the_unclipped_chain_in_the_smallest_well():
    raw = simulate(Case(1.0, 0.0, 1.0, 100, 1000.0, 12, 64.0, 0.0, 0.0, 1.0, 0.0, True).shot())
    assert raw.white_level_dn == 1064
    assert raw.noise_profile[0] == pytest.approx((1.0, (1 / 12) / 1e6))
