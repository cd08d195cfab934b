"""The benchmarks measure what they say: peers make the frame of the model, and a sampler's error is computed right."""

import importlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bench import SECTIONS, chosen, is_measured, measure_sections
from defocus import at_equal_error, judge
from helpers.randomness import accept
from live import WARM_UP, Waits, take_steps
from measuring.contest import Contestant, contest, turns
from measuring.processes import time_process
from measuring.record import Record, dominating, slope, z_errors
from measuring.samplers import SHORTCUTS, Probe, errors, from_normals
from measuring.work import CHAIN, ELD, ONE_READ_NOISE, ramp
from motion import (
    BLUR_PX,
    WAY_PX,
    Frames,
    accumulate,
    by_shift,
    by_slices,
    dense_truth,
    error,
    launches_of,
    middle_of,
    moving_shot,
    points_of,
    squares,
    surfaces,
)
from pairs import one_by_one, ours, patches
from peers.mitsuba_lens import MitsubaLens
from rich.console import Console
from scipy import stats
from skips import Skips

from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.sensor.camera.camera import Window

ROOT = Path(__file__).parents[2]
PICTURE = ramp(0.5, 5.0, 1e3)


@pytest.mark.parametrize(
    ("module", "sensor"),
    [
        ("numpy_chain", CHAIN),
        ("numpy_chain", ONE_READ_NOISE),
        ("numpy_eld", ELD),
        ("torch_eld", ELD),
        ("getframes_camera", ONE_READ_NOISE),
        ("galsim_ccd", ONE_READ_NOISE),
    ],
)
def test_a_peer_makes_the_frame_of_the_model(module, sensor):
    """Mean and variance over the frame; peers that are not installed are those the benchmark leaves out."""
    pytest.importorskip({"torch_eld": "torch", "getframes_camera": "getframes", "galsim_ccd": "galsim"}.get(module, "numpy"))
    peer = importlib.import_module(f"peers.{module}")
    sensor = replace(sensor, row_dn=0.01 if sensor.row_dn else 0.0)  # a row is one draw: too few for the variance
    for one in peer.contestants(PICTURE, sensor) if hasattr(peer, "contestants") else [peer.contestant(PICTURE, sensor)]:
        one.run()
        mean_error, variance = sensor.check(one.codes(), PICTURE)
        kurtosis = 0.2 + 2.0 * (sensor.tukey_lambda is not None)  # of Poisson numbers above 5, and of the tails
        count = PICTURE.size
        checks = {"mean": mean_error * np.sqrt(count), "variance": (variance - 1) * np.sqrt(count / (2 + kurtosis))}
        accept({name: 2 * stats.norm.sf(abs(z)) for name, z in checks.items()})


def test_the_check_sees_a_wrong_frame():
    sensor, rng = CHAIN, np.random.default_rng(1)
    variance = sensor.gain_dn_per_e**2 * (PICTURE + sensor.before_e**2) + sensor.after_dn**2
    wrong = np.rint(512 + sensor.gain_dn_per_e * PICTURE + np.sqrt(1.04 * variance) * rng.standard_normal(PICTURE.shape))
    assert abs(sensor.check(wrong, PICTURE)[1] - 1.04) < 0.01


def test_patches_are_a_ramp_cut_up():
    mean_e = patches(16, 1.0, 1000.0)
    assert mean_e.shape == (16, 512, 512) and (mean_e[:, 0] == mean_e[:, -1]).all()
    assert np.array_equal(mean_e[:8], mean_e[8:]) and (np.diff(np.log(mean_e[:8, 0].ravel())) > 0).all()
    assert (mean_e.min(), mean_e.max()) == pytest.approx((1.0, 1000.0))


def test_patches_captured_at_once_are_those_captured_one_by_one(device):
    mean_e = patches(3, 1.0, 1000.0)
    at_once, single = (ours(mean_e, ELD, device.info, count) for count in (3, 1))
    for one in (at_once, single):
        one.run()
    assert np.array_equal(at_once.codes(), single.codes()) and len({frame.tobytes() for frame in single.codes()}) == 3
    column = tuple(importlib.import_module("peers.numpy_eld").contestants(patch, ELD)[1] for patch in mean_e)
    peers = one_by_one(column)
    peers.run()
    assert all(np.array_equal(frame, each.codes()) for frame, each in zip(peers.codes(), column, strict=True))


def test_the_distribution_of_a_shortcut_is_that_of_its_formula(device):
    """rint(N(mean, mean)), whose probabilities scipy knows."""
    counts, shares = from_normals(Probe(device, SHORTCUTS[0].of_normal, "w"), 100.0)
    exact = stats.norm.cdf(counts + 0.5, 100.0, 10.0) - stats.norm.cdf(counts - 0.5, 100.0, 10.0)
    assert np.abs(shares - exact).max() < 1e-7
    assert errors(counts, shares, 100.0)[1] == pytest.approx(1 / 1200, abs=2e-6)  # rounding adds 1/12; the root is 8e-7 off


def test_errors_of_known_distributions():
    counts = np.arange(60)
    assert errors(counts, stats.poisson.pmf(counts, 8.0), 8.0) == pytest.approx((0.0, 0.0), abs=1e-12)
    shifted = stats.poisson.pmf(counts - 1, 8.0)  # one more: the distance is the greatest probability
    assert errors(counts, shifted, 8.0) == pytest.approx((stats.poisson.pmf(8, 8.0), 0.0), abs=1e-9)


def test_contestants_take_turns():
    order = []
    many = [Contestant(name, lambda name=name: order.append(name), lambda: None) for name in "ab"]
    timings = contest(many, rounds=2, turn_s=1e-3)
    firsts = [name for name, before in zip(order[2:], order[1:], strict=False) if name != before]
    assert order[:2] == ["a", "b"] and firsts == ["a", "b", "a", "b"]
    assert all(len(timing.wall_s) == len(timing.cpu_s) > 2 for timing in timings.values())


def test_a_step_that_waits_a_fourth_of_its_time_is_told_so(monkeypatch):
    """Batches take 1 s and 9 s to come behind the warm-up, training 15 s: 10 of 40."""
    clock = [0.0]
    monkeypatch.setattr("live.time.perf_counter", lambda: clock[0])

    def batches():
        for seconds in [100.0] * WARM_UP + [1.0, 9.0]:
            clock[0] += seconds
            yield seconds

    def train(batch):
        clock[0] += 15.0

    waits, seen = Waits([], []), []
    take_steps(waits, batches(), train, 2, lambda: seen.append(1))
    assert waits.waiting_s == [1.0, 9.0] and waits.share == 0.25 and waits.step_s == 20.0 and len(seen) == WARM_UP + 2


def test_mitsuba_sees_the_surfaces_that_the_lens_blur_is_measured_against(device):
    """A tilted wall behind a disk: the render comes to the rays through the lens as its own noise falls."""
    pytest.importorskip("mitsuba")
    margin, size = 10, 48
    y, x = np.mgrid[: size + 2 * margin, : size + 2 * margin]
    rng = np.random.default_rng(3)
    colours = np.stack([0.3 + np.kron(rng.random((17, 17)), np.ones((4, 4)))] * 2)[..., None] * [1.0, 0.6, 0.3]
    coverage = np.stack([(x - 30) ** 2 + (y - 25) ** 2 < 15**2, np.ones_like(x, bool)]).astype(float)
    radius = np.stack([np.full(x.shape, -3.0), 4.0 + 0.02 * x])
    light = colours * coverage[..., None]
    render = MitsubaLens(0.018, 2.0, 6000.0).renderer(light, coverage[0], radius, margin)
    points = ray_samples(4096)
    points[..., :2] = 0.5
    surfaces = upload_surfaces(device, light.transpose(0, 3, 1, 2)[:, :1], coverage, radius, margin)
    truth = sample_lens(device, surfaces, points, Window(0, 0, size, size), cells=False)
    truth = device.download(truth, (size, size), np.float32)
    picture = render(256)
    assert np.allclose(picture[..., 1:], picture[..., :1] * [0.6, 0.3], rtol=1e-4)
    few, many = (np.sqrt(np.mean((render(rays)[..., 0] - truth) ** 2)) for rays in (16, 256))
    assert many < few / 4 and many < 0.01  # independent rays: a fourth
    assert abs(np.mean(picture[..., 0] - truth)) < 5 * many / size


def test_the_time_at_equal_error_follows_the_power_law():
    """Error as time to the power -1/2: a tenth of the error takes a hundred times as long."""
    rows = [{"name": f"Mitsuba, {rays} rays", "cpu_s": 1.0 * rays, "p99": rays**-0.5} for rays in (4, 100)]
    assert at_equal_error(rows, 0.01) == pytest.approx(1e4)
    rows += [{"name": "Photosite, layers", "cpu_s": 50.0, "p99": 0.01}, {"name": "SciPy, slabs", "cpu_s": 100.0, "p99": 1.0}]
    record = Record("defocus", "", "", rows=rows)
    judge(record)
    assert [verdict["reached"] for verdict in record.verdicts] == [False, True]
    assert record.verdicts[1]["figure"] == "200 x faster"


@pytest.mark.parametrize("radius_px", [(0.0, 0.0), pytest.param(BLUR_PX, marks=pytest.mark.slow)])
def test_photosite_and_accumulated_frames_see_one_moving_scene(device, radius_px):
    """The planned method keeps its tolerance; more frames of a peer come closer to the same truth; both readers see alike."""
    width, height = 128, 96
    held, window = surfaces(squares(width, height, 2), radius_px, (WAY_PX, (0.0, 0.0))), middle_of(width, height)
    here = np.s_[window.y : window.y + window.height, window.x : window.x + window.width]
    frames, truth = Frames(device, held), dense_truth(held, window, 16384 if any(radius_px) else 512)
    frames.photosite()
    name = next(name for name in frames.runs if name.endswith(" 0.1 σ"))
    frames.runs[name]()
    assert error(frames.made[name]()[here], truth)["error"] < 0.15
    planes = held.padded(np.float32)

    def accumulated(count, read):
        return accumulate(planes, radius_px, held.ways_px, points_of(count, held.is_blurred), read)[here]

    few, many = (error(accumulated(count, by_slices), truth)["rms"] for count in (4, 32))
    assert many < few / 2
    assert np.abs(accumulated(4, by_shift) - accumulated(4, by_slices)).max() < 1e-5


def test_a_peer_dominates_where_it_is_neither_slower_nor_more_wrong():
    ours = {"case": "a", "name": "Photosite, swept", "cpu_s": 2.0, "error": 0.1, "is_default": True}
    better = {"case": "a", "name": "NumPy, 8 frames", "cpu_s": 1.0, "error": 0.1}
    others = [better | {"cpu_s": 3.0}, better | {"error": 0.2}, better | {"case": "b"}]
    assert dominating(ours, [ours, better, *others]) == [better]
    assert dominating(ours, [ours, better | {"cpu_s": 1.95}]) == []  # the same within the noise of times
    for rows, reached in (([ours, *others[:2]], True), ([ours, better], False)):
        record = Record("motion", "", "", rows=[dict(row) for row in rows])
        record.mark_dominated()
        assert [one["reached"] for one in record.verdicts] == [reached]


def test_a_setting_of_ours_dominates_another_only_clearly():
    slow = {"case": "a", "name": "Photosite, 0.1", "cpu_s": 1.0, "error": 0.1}
    noise, clear = (slow | {"name": "Photosite, 1", "cpu_s": share, "error": 0.1 * share} for share in (0.95, 0.8))
    assert dominating(slow, [slow, noise, clear]) == [clear]


def test_a_slope_is_that_of_the_logarithms_without_zero():
    sizes = [0.0, 1.0, 2.0, 4.0, 8.0]
    assert slope(sizes, [9.0, *(3.0 * size**1.5 for size in sizes[1:])]) == pytest.approx(1.5)


def test_an_error_is_counted_in_the_noise_of_its_photosite():
    """One photosite in 200 is wrong by 3 sigma of 1000 e- with 2 e- of read noise."""
    truth, sigma = np.ones(100_000), np.sqrt(1004.0) / 1000.0
    found = truth.copy()
    found[::200] += 3.0 * sigma
    assert z_errors(found, truth, 1000.0) == pytest.approx({"error": 3.0, "p99": 0.0, "rms": 3.0 * 0.005**0.5}, rel=1e-6)


def test_a_long_peer_runs_once_and_a_long_photosite_builds_its_kernels_first():
    runs = []
    many = {name: lambda name=name: runs.append(name) for name in ("Photosite", "NumPy")}
    found = turns(many, 3, long_s=-1.0)
    assert sorted(runs) == ["NumPy", "Photosite", "Photosite"] and found["NumPy"]["runs"] == found["Photosite"]["runs"] == 1


def test_no_time_of_one_that_builds_its_kernels_counts_the_build():
    """Its first run sums two million numbers, which is long here; the others do nothing."""
    work = [range(2_000_000)]
    builder = Contestant("every stage", lambda: sum(work.pop() if work else ()), lambda: np.empty(0), builds=True)
    timing = contest([builder], 3, turn_s=1e-9, long_s=0.01)["every stage"]
    assert len(timing.cpu_s) == 3 and max(timing.cpu_s) < 0.01


def test_sections_have_functions_and_the_standard_size_leaves_the_long_ones():
    assert all(callable(section.measure) for section in SECTIONS.values())
    standard, full = chosen(None, "standard"), chosen(None, "full")
    assert full == list(SECTIONS) and set(full) - set(standard) == {"live", "large", "cats_eyes"}
    assert chosen("raw,psf", "quick") == ["raw", "psf"]
    with pytest.raises(PhotositeError, match="no such section"):
        chosen("raw,blur", "quick")


def test_a_section_is_measured_written_drawn_and_put_on_the_page(tmp_path, monkeypatch):
    """Its rows say which settings are dominated; the page of one measured section names all others as missing."""
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    page = importlib.import_module("make_benchmarks")
    (record,) = measure_sections(["spectra"], "quick", tmp_path, Console(quiet=True))
    factored = [row for row in record["rows"] if row["name"] == "Photosite, factored"]
    cubes = {row["name"]: row["error"] for row in record["rows"] if row["case"] == "smooth light"}
    assert all(row["error"] < 0.01 for row in factored)
    assert cubes["Photosite, 61 wavelengths"] == pytest.approx(cubes["NumPy, 61 wavelengths"], abs=1e-3)
    assert cubes["Photosite, 61 wavelengths"] < cubes["Photosite, 31 wavelengths"] / 3
    assert all(("dominated_by" in row) == row["name"].startswith("Photosite") for row in record["rows"])
    assert is_measured(tmp_path / "spectra.json", "quick") and not is_measured(tmp_path / "spectra.json", "full")
    missing = page.write_page(tmp_path, tmp_path / "figures", tmp_path / "page.md")
    text = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert missing == [name for name in SECTIONS if name != "spectra"]
    assert "images/benchmarks/spectra.png" in text and (tmp_path / "figures" / "spectra.png").exists()
    assert text.count("Photosite, factored") >= 2 and f"{record['facts']['size']} photosites" in text


def test_a_record_of_another_shape_is_left_out_of_the_page(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    page = importlib.import_module("make_benchmarks")
    (tmp_path / "raw.json").write_text(json.dumps({"rows": []}), encoding="utf-8")
    assert "raw" in page.write_page(tmp_path, tmp_path, tmp_path / "page.md")


def test_pages_of_stages_state_the_measured_price(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    writer = importlib.import_module("make_benchmarks")
    pages = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "stages").glob("*.md")}
    for name, text in pages.items():
        (tmp_path / name).write_text(text.replace(" times the kernel of", "1 times the kernel of"), encoding="utf-8")
    writer.write_stage_costs(ROOT / "docs" / "images" / "benchmarks", tmp_path)
    assert {name: (tmp_path / name).read_text(encoding="utf-8") for name in pages} == pages


def test_each_skip_is_off_and_on_and_both_are_legal(device):
    """Both lights keep the tolerance against rays; what is skipped is not done."""
    skips = Skips(device, 0.02)
    pairs = skips.pairs()
    assert len(pairs) == 9 and all([one.name for one in pair] == ["off", "on"] for pair in pairs.values())
    for case in ("no blur in a sharp scene", "no motion"):
        for setting in pairs[case]:
            assert skips.error(setting, 8)["error"] < 0.15
    off, on = pairs["no blur in a sharp scene"]
    assert off.planned.optics.defocus is not None and on.planned.optics.defocus is None


def test_a_tripod_launches_what_a_still_shot_launches(device):
    moving = moving_shot(surfaces(squares(128, 96, 1), (0.0,), (WAY_PX,)), 1, 0.1)
    still, tripod = (launches_of(replace(moving, motion=motion)) for motion in (None, Motion(camera=SteadyMotion())))
    assert tripod == still and "swept_projection" not in still
    assert launches_of(moving) != still


def test_the_peak_of_a_process_is_its_own():
    """Memory that the benchmark itself holds when it starts the process does not count."""
    held = np.ones(40_000_000)  # 320 MB
    small, large = time_process("-c", "pass"), time_process("-c", "held = bytearray(100_000_000)")
    assert small.peak_bytes < 60_000_000 < held.nbytes and 100_000_000 < large.peak_bytes < 160_000_000


def test_a_process_that_fails_says_why():
    with pytest.raises(RuntimeError, match="no light"):
        time_process("-c", "raise SystemExit('no light')")
