"""`photosite inspect`: levels, exposure, histogram and noise of any raw file, against numbers known beforehand."""

import dataclasses
import hashlib
import json

import numpy as np
import pytest
from helpers.dng_edits import STRIPES, with_tags
from helpers.randomness import accept
from helpers.raw_frame import random_frame
from scipy import ndimage, stats

from simulator.command_line.inspection import sparkline
from simulator.command_line.main import main
from simulator.errors import PhotositeError
from simulator.measurement.statistics.inspection import BINS, inspect_raw
from simulator.measurement.statistics.single_frame_noise import BLOCK_PX, single_frame_noise
from simulator.raw.dng import tiff, writer
from simulator.raw.software import software

WHITE = 16383


def test_levels_counts_and_histogram_are_those_of_the_codes(tmp_path):
    raw = random_frame(97, 131, "GBRG")
    writer.write_dng(raw, tmp_path / "a.dng")
    found = inspect_raw(tmp_path / "a.dng")
    assert (found.width_px, found.height_px, found.pattern, found.white_level_dn) == (131, 97, "GBRG", WHITE)
    assert [channel.name for channel in found.channels] == ["R", "Gr", "Gb", "B"]
    for channel, (y, x) in zip(found.channels, ((1, 0), (1, 1), (0, 0), (0, 1)), strict=True):
        codes = raw.dn[y::2, x::2]
        assert channel.photosites == codes.size
        assert (channel.least_dn, channel.largest_dn, channel.black_level_dn) == (codes.min(), codes.max(), 511)
        assert channel.mean_dn == pytest.approx(codes.mean(), rel=1e-12)
        assert channel.median_dn == np.quantile(codes, 0.5, method="inverted_cdf")
        assert (channel.at_black, channel.at_white) == ((codes <= 511).sum(), (codes >= WHITE).sum())
        assert list(channel.histogram) == np.histogram(codes, BINS, (0, WHITE + 1))[0].tolist()


def test_what_the_file_says_is_told_and_what_it_does_not_say_is_none(tmp_path):
    writer.write_dng(random_frame(date_time="2020-02-29 12:34:56"), tmp_path / "a.dng")
    found = inspect_raw(tmp_path / "a.dng")
    assert (found.ours, found.make, found.model, found.lens) == (True, "Photosite", "Test Body", "50mm f/1.8 thin lens")
    assert (found.iso, found.focal_length_mm, found.taken) == (400, 50, "2020-02-29 12:34:56")
    assert (found.exposure_time_s, found.f_number) == (pytest.approx(1 / 125), pytest.approx(2.8))
    writer.write_dng(random_frame(exposure_time_s=0.0, f_number=np.inf, make="", lens_model=""), tmp_path / "b.dng")
    found = inspect_raw(tmp_path / "b.dng")
    assert (found.exposure_time_s, found.f_number, found.make, found.lens, found.taken) == (None,) * 5


FOREIGN = {305: tiff.text("Camera firmware 1.0")}  # Software


def test_a_file_of_another_program_is_not_ours(tmp_path):
    content = writer.dng_bytes(random_frame(make="Photosite"))
    (tmp_path / "a.dng").write_bytes(with_tags(content, FOREIGN, raw_directory=False))
    found = inspect_raw(tmp_path / "a.dng")
    assert (found.ours, found.software) == (False, "Camera firmware 1.0")


def test_the_shot_in_its_packet_makes_a_file_ours_whatever_its_software_tag_says(tmp_path):
    resolved = {"shot": {"exposure": {"iso": 400}}, "inputs": []}
    text = json.dumps(resolved["shot"], separators=(",", ":"))
    foreign = software().replace("Photosite", "Camera 99")  # of the same length
    whole = writer.dng_bytes(random_frame(resolved=resolved)).replace(software().encode(), foreign.encode())
    (tmp_path / "a.dng").write_bytes(whole)
    found = inspect_raw(tmp_path / "a.dng")
    assert (found.ours, found.config_changed, found.software) == (True, False, foreign)
    assert found.config_sha256 == hashlib.sha256(text.encode()).hexdigest()
    edited = whole.replace(b'"iso":400', b'"iso":800')
    assert edited != whole
    (tmp_path / "b.dng").write_bytes(edited)
    found = inspect_raw(tmp_path / "b.dng")
    assert (found.ours, found.config_changed, found.config_sha256) == (True, True, None)


def test_a_file_without_settings_has_no_hash(tmp_path):
    writer.write_dng(random_frame(), tmp_path / "a.dng")
    found = inspect_raw(tmp_path / "a.dng")
    assert (found.ours, found.config_changed, found.config_sha256) == (True, False, None)


def test_black_levels_go_to_the_channel_of_their_place(tmp_path):
    raw = random_frame(cfa="GRBG", black_level_dn=0.0, black_offsets_dn=(10.0, 20.0, 30.0, 40.0))
    writer.write_dng(raw, tmp_path / "a.dng")
    found = inspect_raw(tmp_path / "a.dng")
    assert {channel.name: channel.black_level_dn for channel in found.channels} == {"Gr": 10, "R": 20, "B": 30, "Gb": 40}


def test_a_monochrome_file_is_one_channel(tmp_path):
    raw = random_frame(97, 131, "MONO")
    writer.write_dng(raw, tmp_path / "a.dng")
    found = inspect_raw(tmp_path / "a.dng")
    assert found.pattern == "MONO" and [channel.photosites for channel in found.channels] == [raw.dn.size]


def test_another_pattern_than_bayers_is_inspected_colour_by_colour(tmp_path):
    raw = random_frame(96, 128)
    (tmp_path / "a.dng").write_bytes(with_tags(writer.dng_bytes(raw), STRIPES))
    found = {channel.name: channel for channel in inspect_raw(tmp_path / "a.dng").channels}
    assert set(found) == {"R", "G", "B"}
    assert found["G"].mean_dn == pytest.approx(raw.dn[:, 1::2].mean()) and found["G"].photosites == 96 * 64
    assert found["B"].mean_dn == pytest.approx(raw.dn[1::2, ::2].mean())


X_TRANS = (1, 1, 0, 1, 1, 2, 1, 1, 2, 1, 1, 0, 2, 0, 1, 0, 2, 1, 1, 1, 2, 1, 1, 0, 1, 1, 0, 1, 1, 2, 0, 2, 1, 2, 0, 1)


def test_a_pattern_of_six_by_six_is_inspected_colour_by_colour(tmp_path):
    tags = {33421: tiff.short(6, 6), 33422: tiff.byte(*X_TRANS)}
    raw = random_frame(96, 126)
    (tmp_path / "a.dng").write_bytes(with_tags(writer.dng_bytes(raw), tags))
    found = inspect_raw(tmp_path / "a.dng")
    assert found.pattern == "GGRGGB/GGBGGR/BRGRBG/GGBGGR/GGRGGB/RBGBRG"
    colours = np.tile(np.reshape(X_TRANS, (6, 6)), (16, 21))
    assert [channel.name for channel in found.channels] == ["R", "G", "B"]
    for index, channel in enumerate(found.channels):
        assert channel.photosites == (colours == index).sum() and channel.noise
        assert channel.mean_dn == pytest.approx(raw.dn[colours == index].mean(), rel=1e-12)


def test_a_file_of_full_colour_pixels_is_inspected_colour_by_colour(tmp_path):
    """LinearRaw with three samples a pixel, as converters write it."""
    tags = {256: tiff.long(42), 258: tiff.short(16, 16, 16), 262: tiff.short(34892), 277: tiff.short(3)}
    tags |= {50713: tiff.short(1, 1), 50714: tiff.short(5, 6, 7)}
    mosaic_only = {33421, 33422, 50710, 50711}
    raw = random_frame(96, 126)
    (tmp_path / "a.dng").write_bytes(with_tags(writer.dng_bytes(raw), tags, without=mosaic_only))
    found = inspect_raw(tmp_path / "a.dng")
    assert (found.pattern, found.width_px, found.height_px) == ("full colour", 42, 96)
    assert [(channel.name, channel.black_level_dn) for channel in found.channels] == [("R", 5), ("G", 6), ("B", 7)]
    means = raw.dn.reshape(96, 42, 3).mean(axis=(0, 1))
    assert [channel.mean_dn for channel in found.channels] == pytest.approx(means.tolist(), rel=1e-12)


def flat(mean, sigma, size=(384, 512), seed=1) -> np.ndarray:
    return np.rint(np.random.default_rng(seed).normal(mean, sigma, size)).astype(np.uint16)


@pytest.mark.parametrize("sigma", [0.0, 0.4, 2.0, 40.0])
def test_the_noise_of_a_flat_field_is_its_standard_deviation(sigma):
    """z-test of log sigma. A block's variance comes from n second differences as good as n / 1.94; medians cost pi / 2."""
    found = single_frame_noise([flat(2000, sigma, seed=seed) for seed in range(4)], WHITE)
    blocks = sum(level.blocks for level in found)
    assert blocks == 4 * 384 * 512 // BLOCK_PX**2
    truth = np.std(flat(2000, sigma, (2000, 2000), 9), dtype=np.float64)  # rounding included
    mean = np.sqrt(sum(level.blocks * level.sigma_dn**2 for level in found) / blocks)
    if sigma == 0.0:
        assert mean == 0.0
        return
    degrees = BLOCK_PX * (BLOCK_PX - 2) / 1.944
    error = 0.5 * np.sqrt(2 / degrees * np.pi / 2 / blocks)
    accept({sigma: 2 * stats.norm.sf(abs(np.log(mean / truth)) / error)})


def test_slopes_edges_rows_and_hot_pixels_do_not_count_as_noise():
    y, x = np.mgrid[:384, :512]
    rng = np.random.default_rng(3)
    scene = 500 + 3.0 * x + 5.0 * y + 2000 * ((x // 150 + y // 150) % 2) + 50 * rng.standard_normal((384, 1))
    plane = scene + rng.normal(0, 8, scene.shape)
    plane[rng.random(scene.shape) < 1e-3] = 12000
    for level in single_frame_noise([np.rint(plane).astype(np.uint16)], WHITE):
        assert level.sigma_dn == pytest.approx(8.0, rel=0.06)


def test_detail_in_less_than_half_of_the_blocks_does_not_count_as_noise():
    rng = np.random.default_rng(4)
    texture = 300 * ndimage.gaussian_filter(rng.standard_normal((384, 512)), 1) * (np.arange(512) % 128 < 12)
    levels = single_frame_noise([np.rint(2000 + texture + rng.normal(0, 8, texture.shape)).astype(np.uint16)], WHITE)
    assert [level.sigma_dn for level in levels] == pytest.approx([8] * 4, rel=0.08)


def test_noise_is_told_level_by_level_and_not_where_codes_are_cut_off():
    dark, light, white = flat(100, 3), flat(5000, 30), flat(WHITE - 5, 30).clip(0, WHITE)
    found = single_frame_noise([dark, light, white], WHITE)
    assert [level.level_dn for level in found] == pytest.approx([100, 100, 5000, 5000], rel=0.01)
    assert [level.sigma_dn for level in found] == pytest.approx([3, 3, 30, 30], rel=0.03)
    assert single_frame_noise([white, flat(0, 5).clip(0, 9)], WHITE) == ()


def test_the_smallest_frame_has_a_noise():
    rng = np.random.default_rng(5)
    frame = dataclasses.replace(random_frame(22, 23), dn=rng.integers(2000, 2100, (22, 23), dtype=np.uint16))
    (level,) = single_frame_noise([frame.dn[::2, ::2]], WHITE)
    assert level.sigma_dn == pytest.approx(100 / np.sqrt(12), rel=0.3)


def test_the_command_prints_tables_or_json(tmp_path, capsys):
    writer.write_dng(random_frame(), tmp_path / "a.dng")

    def inspect(*options):
        with pytest.raises(SystemExit) as ended:
            main(["inspect", str(tmp_path / "a.dng"), *options])
        assert ended.value.code == 0
        return capsys.readouterr().out

    shown = inspect()
    for words in ("1/125 s", "f/2.8", "Test Body", "128 x 96", "RGGB", "16383 DN", "written by Photosite │ yes"):
        assert words in shown
    told = json.loads(inspect("--json"))
    assert told["ours"] is True and told["iso"] == 400 and len(told["channels"]) == 4
    assert sum(told["channels"][0]["histogram"]) == told["channels"][0]["photosites"]


def test_a_file_that_is_no_raw_is_one_message(tmp_path, capsys):
    (tmp_path / "a.dng").write_text("no raw file\n" * 1000)
    with pytest.raises(PhotositeError, match=r"a\.dng: .*give a DNG"):
        inspect_raw(tmp_path / "a.dng")
    with pytest.raises(SystemExit) as ended:
        main(["inspect", str(tmp_path / "none.dng")])
    assert ended.value.code == 1 and capsys.readouterr().err.count("error:") == 1


def test_a_sparkline_is_blank_for_nothing_and_full_for_the_most():
    assert sparkline((0, 1, 10, 1000)) == " ▁▃█"
    assert sparkline((0, 0)) == "  "
