"""`photosite calibrate`: a body made with NumPy comes back from its raw files, and bad frames are named."""

import dataclasses
import math
from collections import defaultdict

import numpy as np
import pytest
from helpers.numpy_body import NumpyBody
from helpers.randomness import accept
from scipy import stats

from simulator.color.color_tables import CONFIGS
from simulator.command_line.main import main
from simulator.config import dump_yaml, load_shot
from simulator.errors import PhotositeError
from simulator.measurement.calibration.assumed_numbers import assumed_numbers
from simulator.measurement.calibration.camera_measurement import Calibration, measure_camera, range_stops
from simulator.measurement.calibration.camera_yaml import camera_document
from simulator.measurement.calibration.frame_checks import problems
from simulator.measurement.calibration.frame_sorting import by_iso, raw_files, read_frames
from simulator.measurement.calibration.iso_measurement import read_codes
from simulator.measurement.calibration.noise_table import noise_table
from simulator.measurement.calibration.plots import calibration_figure
from simulator.measurement.noise_check.flat_bench import FlatBench, bench_camera, white_light
from simulator.measurement.statistics.photon_transfer import dark_noise
from simulator.measurement.statistics.temporal_noise import pair_noise
from simulator.raw.raw_reader import read_raw_file

FLAT = CONFIGS / "shots" / "flat_field.yaml"


def calibration(folder) -> tuple[Calibration, list[str]]:
    groups, notes = problems(by_iso(read_frames(raw_files([folder]))))
    found = measure_camera(groups)
    return found, notes + found.notes


def hits(found: Calibration, body: NumpyBody) -> dict[str, list[bool]]:
    """Whether each interval holds the body's own number, by quantity."""
    held = defaultdict(list)
    for one in found.isos:
        held["K"].append(one.gain_dn_per_e.covers(body.k(one.iso)))
        held["read noise"].append(one.dark.read_noise_dn.covers(body.read_noise(one.iso)))
        held["read noise in e-"].append(one.read_noise_e.covers(body.read_noise(one.iso) / body.k(one.iso)))
        held["row noise"].append(one.dark.row_noise_dn.covers(body.row_noise(one.iso)))
        held["lambda"].append(one.dark.shape.shape.covers(body.lam))
        held["colour bias"].append(one.dark.color_bias_dn["R"].covers(body.bias[0] - np.mean(body.bias)))
    held["DSNU"].append(found.dsnu_e.covers(body.dsnu))
    held["columns"].append(found.column_dn.covers(body.column))
    held["PRNU"].append(found.prnu.covers(body.prnu))
    return held


def test_a_body_comes_back_within_its_intervals(tmp_path):
    held = defaultdict(list)
    for seed in range(4):
        body = NumpyBody(seed=seed, lam=(-0.1, 0.0, 0.14, 0.05)[seed])
        found, _ = calibration(body.shoot(tmp_path / f"{seed}", [100, 400, 1600]))
        for name, parts in hits(found, body).items():
            held[name] += parts
    every = [part for parts in held.values() for part in parts]
    accept({"all intervals": stats.binomtest(sum(every), len(every), 0.95).pvalue})
    assert np.mean(every) > 0.85 and min(np.mean(parts) for parts in held.values()) >= 0.5


@pytest.mark.slow
def test_the_share_of_intervals_that_hold_is_what_95_percent_says(tmp_path):
    held = defaultdict(list)
    for seed in range(100, 160):
        body = NumpyBody(seed=seed, lam=(-0.1, 0.0, 0.14)[seed % 3])
        found, _ = calibration(body.shoot(tmp_path / f"{seed}", [100, 800], darks=4))
        for name, parts in hits(found, body).items():
            held[name] += parts
    accept({name: stats.binomtest(sum(parts), len(parts), 0.95).pvalue for name, parts in held.items()})


def test_dark_current_white_level_and_conversion_gain_are_found(tmp_path):
    body = NumpyBody(switch=800)
    folder = body.shoot(tmp_path, [100, 200, 400, 800, 1600], darks=4)
    for frame in range(2):
        body.write(folder / "flat" / f"clip_{frame}.dng", 100, 30000.0, 1.0, frame)
        for time_s in (1.0, 5.0, 20.0):
            body.write(folder / "dark" / f"long_{time_s:g}_{frame}.dng", 1600, 0.0, time_s, frame)
    found, notes = calibration(folder)
    assert found.dark_current_e_per_s.covers(body.dark_current)
    assert found.dark_current_e_per_s.value == pytest.approx(body.dark_current, rel=0.01)
    assert set(found.white_levels_dn.values()) == {body.white} and found.white_is_measured
    assert found.switch_iso == 800
    low, high = found.sources
    assert low.before_e.covers(body.sigma_pre) and low.after_dn.covers(body.sigma_post)
    assert high.before_e.covers(body.sigma_pre_high)
    assert any("clip_0.dng" in note and "not for K" in note for note in notes)


def camera_file(found, path, **options):
    name = options.pop("name", "Numpy Body")
    path.write_text(dump_yaml(camera_document(found, assumed_numbers(name, found.first_frame, **options))))
    return path


def shot_file(path, camera) -> object:
    scene = "scene: {chart: flat_field, luminance: 100 cd/m^2, depth: infinity}\nlens: {focal_length: 50 mm, f_number: f/4}\n"
    path.write_text(scene + f"exposure: {{time: 1/60 s, iso: 400}}\ncamera: {camera.name}\n")
    return path


def test_the_camera_file_is_ready_for_a_shot_and_names_the_source_of_every_number(tmp_path):
    from simulator import simulate

    found, _ = calibration(NumpyBody().shoot(tmp_path, [100, 400]))
    camera = camera_file(found, tmp_path / "camera.yaml", pixel_pitch="4.3 um", base="sony_a7s2")
    shot = load_shot(shot_file(tmp_path / "shot.yaml", camera))
    one = next(one for one in found.isos if one.iso == 400)
    setting = shot.camera.iso_setting(400)
    assert setting.gain_dn_per_e == pytest.approx(one.gain_dn_per_e.value, rel=1e-5)
    assert setting.row_noise_dn == pytest.approx(one.dark.row_noise_dn.value, rel=1e-3)
    assert shot.camera.pixel_pitch_um == 4.3
    raw = simulate(shot)
    assert raw.dn.shape == found.first_frame.size and raw.dn.max() > 1000
    text = camera.read_text()
    assert "assumed, --pixel-pitch 4.3 um" in text and "assumed, --base sony_a7s2" in text
    assert "measured, photosite calibrate, 8 dark frames, 3 pairs of flat fields, 95 % intervals: gain" in text


def test_a_normal_read_noise_is_split_into_its_two_sources(tmp_path):
    body = NumpyBody(lam=0.14)
    found, _ = calibration(body.shoot(tmp_path, [100, 400, 1600]))
    found = dataclasses.replace(found, has_shape=False)
    document = camera_document(found, assumed_numbers("A B", found.first_frame))
    assert "tukey_lambda" not in document["iso_table"][100]
    assert float(document["read_noise_after_gain"].split()[0]) == pytest.approx(body.sigma_post, abs=0.2)
    camera_file(found, tmp_path / "camera.yaml")
    load_shot(shot_file(tmp_path / "shot.yaml", tmp_path / "camera.yaml"))


@pytest.mark.slow
def test_photosites_own_frames_give_the_camera_they_were_made_with(tmp_path):
    """The Sony A7S II around its conversion-gain switch, with fixed patterns, through simulated DNG files."""
    patterns = {"prnu.sigma": 0.008, "dsnu.sigma": "2 e-", "column_offset.sigma": "0.4 DN"}
    camera = bench_camera(load_shot(FLAT, {f"camera.stages.{key}": value for key, value in patterns.items()}).camera, 320, 240)
    for iso in (100, 400, 1600, 2000, 3200):
        bench = FlatBench(camera, iso, 0.01, white_light(), tmp_path)
        for frame in range(4):
            bench.take(f"dark/{iso}_{frame}", 0.0, 1000 * iso + frame)
        for index, share in enumerate((0.1, 0.3, 0.65)):
            flats = dataclasses.replace(bench, exposure_time_s=0.02 * (index + 1))
            for frame in range(2):
                flats.take(f"flat/{iso}_{index}_{frame}", flats.factor_of(share), 1000 * iso + 10 * (index + 1) + frame)
    found, notes = calibration(tmp_path)
    assert not notes and found.switch_iso == 2000
    held = []
    for one in found.isos:
        truth = camera.iso_setting(one.iso)
        held += [one.gain_dn_per_e.covers(truth.gain_dn_per_e), one.dark.read_noise_dn.covers(truth.read_noise_dn)]
        held += [one.dark.row_noise_dn.covers(truth.row_noise_dn), one.dark.shape.shape.covers(truth.tukey_lambda)]
        held += [part.covers(0.0) for part in list(one.dark.color_bias_dn.values())[:2]]
    held += [found.prnu.covers(0.008), found.dsnu_e.covers(2.0), found.column_dn.covers(0.4)]
    accept({"intervals": stats.binomtest(sum(held), len(held), 0.95).pvalue})


def test_a_monochrome_body_has_one_plane(tmp_path):
    body = NumpyBody(cfa="MONO", bias=(0.0,) * 4, colors=(1.0,) * 4)
    found, _ = calibration(body.shoot(tmp_path, [100, 400]))
    assert list(found.isos[0].gain_by_plane) == ["MONO"]
    assert abs(found.isos[0].gain_dn_per_e.value - body.k(100)) < 4 * found.isos[0].gain_dn_per_e.standard_error
    assert abs(found.prnu.value - body.prnu) < 4 * found.prnu.standard_error
    document = camera_document(found, assumed_numbers("A B", found.first_frame))
    assert document["cfa"] == "MONO" and "color_bias" not in document["iso_table"][100]


def test_a_body_without_pedestal_is_measured_from_its_flats(tmp_path):
    """As Nikon's D3: half of the dark's noise is below 0 and lost."""
    body = NumpyBody(black=0.0, black_in_file=0, bias=(0.0,) * 4, sigma_pre=12.0, lam=0.14)
    found, notes = calibration(body.shoot(tmp_path, [100, 400], levels=(100.0, 300.0, 1000.0)))
    for one in found.isos:
        assert one.gain_dn_per_e.covers(body.k(one.iso)) and one.dark.read_noise_dn.covers(body.read_noise(one.iso))
        assert one.dark.row_noise_dn.covers(body.row_noise(one.iso)) and one.dark.black_level_dn == 0.0
    assert sum("end at 0" in note for note in notes) == 2
    camera_file(found, tmp_path / "camera.yaml")
    load_shot(shot_file(tmp_path / "shot.yaml", tmp_path / "camera.yaml"))


def test_flats_and_darks_that_end_at_0_or_white_do_not_count(tmp_path):
    """Without pedestal the noise of the darkest flats is cut off, and the mean of a dark frame grows by half its electrons."""
    body = NumpyBody(black=0.0, black_in_file=0, bias=(0.0,) * 4, sigma_pre=12.0, lam=0.14, dark_current=20.0)
    folder = body.shoot(tmp_path / "dark_flats", [400], levels=(2.0, 100.0, 300.0, 1000.0))
    for time_s in (0.1, 0.3, 1.0, 5.0, 10.0):
        for frame in range(2):
            body.write(folder / "dark" / f"long_{time_s:g}_{frame}.dng", 400, 0.0, time_s, frame)
    found, notes = calibration(folder)
    gain, sigma = found.isos[0].gain_dn_per_e, found.isos[0].dark.read_noise_dn
    assert gain.covers(body.k(400)) and sigma.covers(body.read_noise(400)) and found.isos[0].pairs_used == 3
    assert found.dark_current_e_per_s.value == pytest.approx(body.dark_current, rel=0.02)
    assert any("iso400_0_0.dng" in note and "% of the codes are 0" in note for note in notes)
    assert any("long_0.1_0.dng" in note and "not used for the dark current" in note for note in notes)
    body = NumpyBody(dark_current=400.0, gain=4.0)
    folder = body.shoot(tmp_path / "full_darks", [100])
    for time_s in (1.0, 3.0, 30.0):  # 48,000 DN
        for frame in range(2):
            body.write(folder / "dark" / f"long_{time_s:g}_{frame}.dng", 100, 0.0, time_s, frame)
    found, notes = calibration(folder)
    assert found.dark_current_e_per_s.value == pytest.approx(body.dark_current, rel=0.01)
    assert any("long_30_0.dng" in note and "long_3_0.dng" not in note and "reach 0 or white" in note for note in notes)


def test_a_body_without_read_noise_is_no_reason_to_fail(tmp_path):
    body = NumpyBody(sigma_pre=0.0, sigma_post=0.0, row=0.0, dsnu=0.0, column=0.0, prnu=0.0, gain=2.0, dark_current=0.0)
    found, notes = calibration(body.shoot(tmp_path, [100, 400, 1600]))
    assert all(one.dark.read_noise_dn.covers(0.0) and one.gain_dn_per_e.covers(body.k(one.iso)) for one in found.isos)
    assert any("too small against a code" in note for note in notes)
    calibration_figure(found, "nothing to draw is no reason to fail")
    camera_file(found, tmp_path / "camera.yaml")
    load_shot(shot_file(tmp_path / "shot.yaml", tmp_path / "camera.yaml"))


def test_the_white_level_of_an_iso_without_clipped_flats_is_that_of_the_others(tmp_path):
    body = NumpyBody(shape=(60, 80))
    folder = body.shoot(tmp_path, [100, 200], darks=2)
    for frame in range(2):
        body.write(folder / "flat" / f"clip_{frame}.dng", 200, 40000.0, 0.9, frame)
    found, _ = calibration(folder)
    assert found.white_levels_dn == {100: body.white, 200: body.white}
    document = camera_document(found, assumed_numbers("A B", found.first_frame))
    assert document["white_level"] == f"{body.white} DN" and "white_level" not in document["iso_table"][200]


@pytest.mark.parametrize("long_darks_iso", [100, 400])
def test_the_written_camera_makes_the_dark_frames_that_were_measured(tmp_path, long_darks_iso):
    """200 e-/s in dark frames of 50 ms: black level and read noise hold none of the 10 electrons that the rate adds."""
    body = NumpyBody(dark_current=200.0)
    folder = body.shoot(tmp_path, [100, 400], darks=0)
    for iso in (100, 400):
        for frame in range(8):
            body.write(folder / "dark" / f"iso{iso}_{frame}.dng", iso, time_s=0.05, frame=frame)
    for time_s in (0.5, 1.0, 2.0):
        for frame in range(2):
            body.write(folder / "dark" / f"long_{time_s:g}_{frame}.dng", long_darks_iso, time_s=time_s, frame=frame)
    found, notes = calibration(folder)
    camera = load_shot(shot_file(tmp_path / "shot.yaml", camera_file(found, tmp_path / "camera.yaml"))).camera
    p_values = {}
    for one in found.isos:
        bench = FlatBench(camera, one.iso, 0.05, white_light(), tmp_path)
        made = [read_raw_file(bench.take(f"made_{one.iso}_{seed}", 0.0, seed)).mosaic.astype(float) for seed in range(8)]
        shot = [read_codes(frame).astype(float) for frame in one.frames.short_darks]
        # Rows are independent in each frame, columns and photosites in each of the two bodies.
        row_dn2 = 2.0 * body.row_noise(one.iso) ** 2 / (8 * body.shape[0])
        fixed_dn2 = 2.0 * (body.column**2 + (body.k(one.iso) * body.dsnu) ** 2 / body.shape[0]) / body.shape[1]
        z = (np.mean(made) - np.mean(shot)) / np.sqrt(row_dn2 + fixed_dn2)
        p_values[f"mean, ISO {one.iso}"] = 2.0 * stats.norm.sf(abs(z))
        (noise, error), (other, other_error) = (
            (dark.variance_dn2, dark.error_dn2)
            for dark in (
                dark_noise([pair_noise(*pair) for pair in zip(each[0::2], each[1::2], strict=True)], False)
                for each in (made, shot)
            )
        )
        p_values[f"noise, ISO {one.iso}"] = 2.0 * stats.norm.sf(abs(noise - other) / math.hypot(error, other_error))
        assert one.dark.black_level_dn == pytest.approx(body.black, abs=0.15)
        assert one.dark.read_noise_dn.covers(body.read_noise(one.iso))
    accept(p_values)
    assert not any("black of the dark frames" in note for note in notes)
    text = (tmp_path / "camera.yaml").read_text()
    assert "8 dark frames at ISO 100, less the dark current of 0.05 s" in text


def test_the_range_is_down_to_snr_1_and_that_of_measure_noise(capsys, tmp_path):
    """EMVA 1288 R4.0 Linear: saturation capacity over the signal of SNR 1, near a read noise of an electron."""
    body = NumpyBody(sigma_pre=0.8, sigma_post=0.0, gain=2.0, row=0.4, lam=0.14, bias=(0.0,) * 4)
    folder = body.shoot(tmp_path, [100], darks=4)
    found, _ = calibration(folder)
    sigma_e = math.sqrt(0.8**2 + (0.4**2 + 1 / 12) / 2.0**2)
    least_e = 0.5 + math.sqrt(sigma_e**2 + 0.25)
    stops = range_stops(found.isos[0], found.white_levels_dn[100])
    assert stops == pytest.approx(math.log2((16383 - body.black) / 2.0 / least_e), abs=0.03)
    (row,) = noise_table(found, 5.0, None)
    assert row.range_ev == stops > row.pdr_ev
    _, text, _ = run(capsys, "calibrate", folder, "--out", tmp_path / "camera.yaml", "--no-plots")
    assert f"{stops:.2f}" in text


def test_sources_that_do_not_fit_are_told(tmp_path):
    """A switch of the conversion gain that lies between ISO settings four stops apart cannot be seen."""
    body = NumpyBody(switch=2000, sigma_pre=6.0, sigma_pre_high=1.0, sigma_post=8.0)
    _, notes = calibration(body.shoot(tmp_path, [100, 1600, 25600], levels=(1500.0, 6000.0)))
    assert any("two sources miss the read noise" in note for note in notes), notes


def test_a_dark_current_whose_mean_the_camera_takes_off_is_told_by_its_variance(tmp_path):
    """Covered photosites give the camera the mean of the dark current; its shot noise stays."""

    class LessMean(NumpyBody):
        def codes(self, iso, level, time_s, frame):
            mean_dn = round(self.k(iso) * self.dark_current * time_s)
            return (super().codes(iso, level, time_s, frame) - mean_dn).astype(np.uint16)

    body = LessMean(dark_current=40.0)
    folder = body.shoot(tmp_path, [400], darks=2)
    for time_s in (2.0, 4.0, 8.0):
        for frame in range(2):
            body.write(folder / "dark" / f"long_{time_s:g}_{frame}.dng", 400, 0.0, time_s, frame)
    found, notes = calibration(folder)
    assert found.dark_current_e_per_s.covers(body.dark_current)
    assert any("told by the variance" in note for note in notes)


def test_frames_without_telling_names_are_sorted_by_level_and_paired_in_order(tmp_path):
    body = NumpyBody(shape=(40, 60))
    for index, (level, time_s) in enumerate([(0, 0.001), (0, 0.001), (4000, 0.02), (4000, 0.02), (4000, 0.02)], start=8):
        body.write(tmp_path / f"IMG_{index}.dng", 200, level, time_s, index)
    (group,) = by_iso(read_frames(raw_files([tmp_path])))
    assert [frame.path[-9:] for frame in group.short_darks] == ["IMG_8.dng", "IMG_9.dng"]
    assert [[frame.path[-10:] for frame in pair] for pair in group.flat_pairs] == [["IMG_10.dng", "IMG_11.dng"]]
    assert [frame.path[-10:] for frame in group.lone_flats] == ["IMG_12.dng"]


def test_a_folder_name_tells_kind_and_iso(tmp_path):
    body = NumpyBody(shape=(40, 60))
    body.write(tmp_path / "Bias_frames" / "iso102400" / "a.dng", 102400, 5000.0)  # the tag of 16 bits says 65535
    body.write(tmp_path / "darktable" / "iso100" / "b.dng", 400, 9000.0)
    frames = {frame.path[-5:]: frame for frame in read_frames(raw_files([tmp_path]))}
    assert (frames["a.dng"].kind, frames["a.dng"].iso) == ("dark", 102400)
    assert (frames["b.dng"].kind, frames["b.dng"].iso) == ("flat", 400), "what the file says of its ISO goes before its name"


def spoiled(tmp_path, **changes) -> list[str]:
    """Notes for a good set of frames to which one bad frame is added."""
    body = NumpyBody(shape=(60, 80))
    folder = body.shoot(tmp_path, [100], darks=4)
    body = dataclasses.replace(body, **changes.pop("body", {}))
    body.write(folder / changes.pop("kind") / "iso100_bad.dng", 100, frame=9, **changes)
    return problems(by_iso(read_frames(raw_files([folder]))))[1]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": "dark", "level": 300.0}, "light leak"),
        ({"kind": "dark", "body": {"black": 1.0}}, "end at 0"),
        ({"kind": "flat", "level": 3000.0, "time_s": 0.5}, "only flat left at ISO 100"),
    ],
)
def test_a_bad_frame_is_named(tmp_path, changes, words):
    notes = spoiled(tmp_path, **changes)
    assert any("iso100_bad.dng" in note and words in note for note in notes), notes


def test_flicker_and_clipping_name_both_files(tmp_path):
    body = NumpyBody(shape=(60, 80))
    folder = body.shoot(tmp_path, [100], darks=2)
    for frame, level in enumerate((3000.0, 3300.0)):
        body.write(folder / "flat" / f"flicker_{frame}.dng", 100, level, 0.3, frame)
        body.write(folder / "flat" / f"clip_{frame}.dng", 100, 40000.0, 0.6, frame)
    notes = problems(by_iso(read_frames(raw_files([folder]))))[1]
    assert any("flicker_0.dng" in note and "flicker_1.dng" in note and "means differ by" in note for note in notes)
    assert any("clip_0.dng" in note and "clip_1.dng" in note for note in notes)


def test_flickering_light_does_not_spoil_the_gain(tmp_path):
    body = NumpyBody(prnu=0.02)
    folder = body.shoot(tmp_path, [100], levels=())
    for index, level in enumerate((1500.0, 4000.0, 8000.0)):
        for frame, change in enumerate((1.0, 1.03)):
            body.write(folder / "flat" / f"f{index}_{frame}.dng", 100, change * level, 0.01 * (index + 1), frame)
    found, _ = calibration(folder)
    assert found.isos[0].gain_dn_per_e.covers(body.k(100))


def test_an_iso_that_cannot_be_measured_is_left_out_and_says_why(tmp_path):
    body = NumpyBody(shape=(60, 80))
    folder = body.shoot(tmp_path, [100], darks=2)
    body.write(folder / "dark" / "iso800_0.dng", 800)
    groups, notes = problems(by_iso(read_frames(raw_files([folder]))))
    assert [group.iso for group in groups] == [100]
    assert any("ISO 800 is left out" in note and "iso800_0.dng" in note and "two dark frames" in note for note in notes)
    assert any("ISO 800 is left out: no usable pair of flats" in note for note in notes)
    for file in (folder / "flat").iterdir():
        file.unlink()
    with pytest.raises(PhotositeError, match="no ISO can be measured"):
        problems(by_iso(read_frames(raw_files([folder]))))


def test_files_of_two_cameras_are_refused(tmp_path):
    NumpyBody(shape=(60, 80)).write(tmp_path / "a.dng", 100)
    NumpyBody(shape=(60, 90)).write(tmp_path / "b.dng", 100)
    with pytest.raises(PhotositeError, match=r"b\.dng: is 90 x 60 RGGB, but .*a\.dng is 80 x 60"):
        read_frames(raw_files([tmp_path]))


def test_planes_with_gains_of_their_own_are_told(tmp_path):
    """As Nikon's D3 scales red and blue at its base ISO."""

    class Scaled(NumpyBody):
        def codes(self, *arguments):
            codes = super().codes(*arguments).astype(float)
            codes[0::2, 0::2] = np.rint(self.black + 1.11 * (codes[0::2, 0::2] - self.black))
            return codes.astype(np.uint16)

    body = Scaled(bias=(0.0,) * 4)
    found, notes = calibration(body.shoot(tmp_path, [100]))
    assert any("the colour planes have different gains" in note for note in notes)
    assert found.isos[0].gain_by_plane["R"].covers(1.11 * body.k(100))


def run(capsys, *arguments) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(list(map(str, arguments)))
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def test_the_command_writes_camera_and_plots_and_tables(capsys, tmp_path):
    folder = NumpyBody(shape=(120, 160)).shoot(tmp_path / "raw", [100, 400], darks=4)
    out = tmp_path / "out" / "camera.yaml"
    code, text, err = run(capsys, "calibrate", folder, "--out", out, "--name", "Numpy Body")
    assert code == 0 and not err
    assert text.splitlines()[-1] == str(out) and out.with_suffix(".png").read_bytes()[:4] == b"\x89PNG"
    assert "PRNU:" in text and "sigma_pre" in text


def test_without_matplotlib_the_numbers_are_written_all_the_same(capsys, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    folder = NumpyBody(shape=(60, 80)).shoot(tmp_path / "raw", [100], darks=2)
    code, _, err = run(capsys, "calibrate", folder, "--out", tmp_path / "camera.yaml")
    assert code == 0 and "photosite[report]" in err and (tmp_path / "camera.yaml").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "no such file or folder"),
        (["raw", "--pixel-pitch", "4.3"], "--pixel-pitch 4.3: has no unit"),
        (["raw", "--base", "sony_a7s3"], "sony_a7s2"),
        (["raw", "--response", "sony_a7s3"], "sony_a7s2"),
        (["raw/dark"], "no ISO can be measured"),
    ],
)
def test_wrong_options_are_one_message_and_write_nothing(capsys, tmp_path, monkeypatch, arguments, words):
    NumpyBody(shape=(60, 80)).shoot(tmp_path / "raw", [100], darks=2)
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, "calibrate", *arguments)
    assert code == 1 and words in err and "Traceback" not in err
    assert not (tmp_path / "camera.yaml").exists()
