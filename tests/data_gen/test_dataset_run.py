"""`photosite dataset`: the same bytes for any number of workers and restarts, and bad pictures are counted, not hidden."""

import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from helpers.dataset_folders import TEXT, content, small_config
from helpers.picture_files import put, random_codes, write

from data_gen.command_line import main
from data_gen.report.estimate import estimate, expected_decodings
from data_gen.run import fingerprint, run
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.storage.reading import read_samples
from simulator.command_line import amounts
from simulator.device import open_device
from simulator.errors import PhotositeError

# Every kind of picture that is computed from numbers of the camera or of files, for one camera each.
OF_ALL_KINDS = """\
count: 24
crop: [16, 24]
pictures:
  drawn: {procedural: [dead_leaves, gradients, point_lights, text], count: 12, width: 48, height: 40, illuminants: [D65, A]}
  photos: {photographs: files, extensions: [.png]}
  unprocessed: {photographs: files, extensions: [.png], inverse_isp: brooks2019}
  linear: {linear_images: files, extensions: [.exr], negative: clip}
  cubes: {spectral_cubes: files, extensions: [.npy], wavelengths: files/wavelengths.csv}
  shots: {shot: shot.yaml}
noise: {cameras: {sony_a7s2: {}, canon_550d: {}}}
writer: {format: webdataset, samples_per_shard: 24}
"""
PHOTOS = TEXT.replace("{procedural: [dead_leaves, text], count: 12, width: 48, height: 40}", "{photographs: photos}")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A data set made in one go: its configuration and folder."""
    folder = tmp_path_factory.mktemp("whole")
    config = small_config(folder)
    run(config, folder / "out")
    return config, folder / "out"


def test_a_run_makes_all_samples_and_a_second_one_nothing(whole):
    config, folder = whole
    samples = list(read_samples(folder))
    assert [sample.index for sample in samples] == list(range(22))
    assert {sample.camera for sample in samples} == {"sony_a7s2", "imx385"}
    before, calls = content(folder), []
    outcome = run(config, folder, progress=lambda what, share: calls.append((what, share)))
    assert (outcome.made, outcome.kept, calls) == (0, 8, [("samples, 22 of 22", 1.0)])
    assert content(folder) == before


@pytest.mark.parametrize("after", [1, 3, 13])
def test_a_run_interrupted_anywhere_is_continued_to_the_same_bytes(whole, tmp_path, after):
    config, folder = whole
    seen = 0

    def interrupt(what, share):
        nonlocal seen
        seen = round(share * config.count)
        if seen >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(config, tmp_path, progress=interrupt)
    assert not (tmp_path / "manifest.json").exists()
    assert run(config, tmp_path).kept == (after - 1) // 3
    assert content(tmp_path) == content(folder)


def test_another_configuration_is_not_mixed_in(whole, tmp_path):
    config, folder = whole
    shutil.copytree(folder, tmp_path / "out")
    with pytest.raises(PhotositeError, match="made from another configuration"):
        run(small_config(tmp_path, TEXT, "seed=5"), tmp_path / "out")


def photographs(folder, bad: bool):
    for number in range(4):
        put(folder / "photos" / f"{number}.png", random_codes(40, 56, seed=number))
    if bad:
        (folder / "photos" / "1.png").write_bytes((folder / "photos" / "1.png").read_bytes()[:300])
        put(folder / "photos" / "2.png", random_codes(12, 12))
    return folder


SHOT = """\
scene: {image: wall.png, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: f/4}
exposure: {time: 1/100 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 48, height: 40}}
"""
SHOTS = TEXT.replace("{procedural: [dead_leaves, text], count: 12, width: 48, height: 40}", "{shot: wall.yaml}")


def config_of_shot(folder, text=SHOT, seed=0):
    """A data set of a shot that lies beside it with its picture."""
    put(folder / "wall.png", random_codes(40, 48, seed=seed))
    (folder / "wall.yaml").write_text(text, encoding="utf-8")
    return small_config(folder, SHOTS)


@pytest.mark.parametrize("change", [{"text": SHOT.replace("1/100 s", "1/25 s")}, {"seed": 1}], ids=["time", "picture"])
def test_a_shot_that_changed_is_not_mixed_in(tmp_path, change):
    run(config_of_shot(tmp_path), tmp_path / "out")
    assert run(config_of_shot(tmp_path), tmp_path / "out").made == 0
    with pytest.raises(PhotositeError, match="made from another configuration"):
        run(config_of_shot(tmp_path, **change), tmp_path / "out")


def test_points_of_a_sweep_tell_their_hash(tmp_path):
    swept = [SHOT + f"sweep: {{vary: {{exposure.time: [1/100 s, {last}]}}}}\n" for last in ("1/25 s", "1/50 s", "1/25 s")]
    first, other, again = (fingerprint(config_of_shot(tmp_path, text)) for text in swept)
    assert first == again != other


def test_a_picture_of_another_size_in_a_folder_is_not_mixed_in(tmp_path):
    folder = photographs(tmp_path, False)
    run(small_config(folder, PHOTOS), folder / "out")
    put(folder / "photos" / "1.png", random_codes(41, 56, seed=1))
    with pytest.raises(PhotositeError, match="made from another configuration"):
        run(small_config(folder, PHOTOS), folder / "out")


def test_a_shot_whose_picture_is_missing_is_told_before_the_work(tmp_path):
    config = config_of_shot(tmp_path)
    (tmp_path / "wall.png").unlink()
    with pytest.raises(PhotositeError, match=r"wall\.yaml: wall: names .*wall\.png: No such file .*; check the path"):
        run(config, tmp_path / "out")


def test_bad_pictures_are_counted_and_change_no_other_sample(tmp_path):
    good, bad = photographs(tmp_path / "good", False), photographs(tmp_path / "bad", True)
    run(small_config(good, PHOTOS), good / "out")
    outcome = run(small_config(bad, PHOTOS), bad / "out")
    broken = [message for message in outcome.problems if "1.png" in message]
    small = [message for message in outcome.problems if "2.png" in message]
    assert len(broken) == 1 and len(small) >= 1 and len(outcome.problems) == len(broken) + len(small)
    manifest = json.loads((bad / "out" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["problem_count"] == len(outcome.problems)
    for one, other in zip(read_samples(good / "out"), read_samples(bad / "out"), strict=True):
        replaced = one.source in ("leaves/1.png", "leaves/2.png")
        assert np.array_equal(one.noisy_dn, other.noisy_dn) != replaced
        assert other.source in ("leaves/0.png", "leaves/3.png")
    assert run(small_config(bad, PHOTOS), bad / "out").problems == outcome.problems


def test_a_dry_run_says_of_what_its_problems_are_and_names_no_file(tmp_path, capsys):
    found = estimate(small_config(photographs(tmp_path, True), PHOTOS))
    assert 0 < max(found.problems.values()) <= found.made
    file, out = tmp_path / "small.yaml", tmp_path / "out"
    assert command("dataset", file, "--out", out, "--dry-run") == 0
    told = capsys.readouterr().err
    assert re.search(r"problems, drawn \d+ times for the \d+ samples made for this estimate; ", told)
    assert "manifest.json" not in told and not out.exists()
    assert command("dataset", file, "--out", out) == 0
    assert re.search(r"problems?, drawn \d+ times?; manifest\.json lists all", capsys.readouterr().err)


def test_bad_pictures_are_refused_all_at_once(tmp_path):
    config = small_config(photographs(tmp_path, True), PHOTOS, "on_problem=refuse")
    with pytest.raises(PhotositeError, match="4 pictures, of which cannot be used: 1 unreadable, 1 too small") as caught:
        run(config, tmp_path / "out")
    assert "1.png" in str(caught.value) and "2.png" in str(caught.value)
    assert not list((tmp_path / "out").glob("shard-*"))


@pytest.mark.slow
def test_the_estimate_agrees_with_the_run(tmp_path):
    config = small_config(tmp_path, TEXT, "count=60", "crop=[32, 40]", "writer.samples_per_shard=40")
    run(config, tmp_path)
    found = estimate(config)
    real = sum(path.stat().st_size for path in tmp_path.glob("shard-*.tar"))
    assert found.bytes_per_sample * config.count == pytest.approx(real, rel=0.05)
    assert found.shards == 2 and found.pictures == {"leaves": 12} and found.ratios == (1.0, 100.0)
    assert found.seconds_per_sample > 0 and found.cpu_seconds_per_sample > 0


def test_decodings_are_foreseen(tmp_path):
    """Ten photographs: with room for all, each drawn one is decoded once; without, as often as a walk over the draws says."""
    draws = np.random.default_rng(4).integers(10, size=(300, 25))  # of 25 groups, 300 times over
    config = small_config(photographs(tmp_path, False), PHOTOS, "count=100", "crops_per_picture=4")
    different, decodings = expected_decodings(config, {"leaves": 10}, 10)
    counts = np.array([len(set(row)) for row in draws.tolist()])
    assert decodings == different == pytest.approx(counts.mean(), abs=4 * counts.std() / np.sqrt(300))
    assert expected_decodings(config, {"leaves": 10}, 0)[1] == 25
    walked = np.zeros(300)
    for place, row in enumerate(draws.tolist()):
        kept: list[int] = []
        for picture in row:
            walked[place] += picture not in kept
            kept = [picture, *(one for one in kept if one != picture)][:4]
    z = (expected_decodings(config, {"leaves": 10}, 4)[1] - walked.mean()) / (walked.std() / np.sqrt(300))
    assert abs(z) < 4
    assert expected_decodings(config, {}, 4) == (0, 0)


def test_the_estimate_of_photographs_counts_their_decoding(tmp_path, capsys):
    config = small_config(photographs(tmp_path, False), PHOTOS, "count=40", "crop=[32, 40]")
    cache = DecodedPictures(10**6, tmp_path / "cache")
    found = estimate(config, decoded=cache)
    run(config, tmp_path / "out", decoded=cache)
    assert cache.cost.pictures == 4 == round(found.decodings)
    assert found.decoded_bytes == pytest.approx(cache.cost.decoded_bytes, rel=0.01)
    assert found.seconds == 40 * found.seconds_per_sample + found.decodings * found.seconds_per_decoding
    assert found.seconds_per_decoding > 0
    dry = ("--dry-run", "--cache-gb", "0.5", "--cache-folder", tmp_path / "other")
    assert command("dataset", tmp_path / "small.yaml", "--out", tmp_path / "pairs", *dry) == 0
    shown = capsys.readouterr().out
    assert "500 MB are kept" in shown and "photographs of" in shown and not (tmp_path / "other").exists()


@pytest.mark.slow
def test_the_cache_and_its_size_change_no_byte(tmp_path):
    config, found = small_config(photographs(tmp_path, False), PHOTOS, "crops_per_picture=2"), []
    for number, cache in enumerate((DecodedPictures(0), DecodedPictures(20_000, tmp_path / "cache"), DecodedPictures())):
        run(config, tmp_path / f"out-{number}", decoded=cache)
        found.append(content(tmp_path / f"out-{number}"))
    assert found[0] == found[1] == found[2]


def test_another_processors_blas_changes_no_byte(tmp_path):
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]["name"]
    if "openblas" not in blas:
        pytest.skip(f"NumPy calls {blas}, and OpenBLAS alone can be told to calculate as another processor does")
    light, nm = np.random.default_rng(3).random((40, 60, 31), np.float32), range(400, 701, 10)
    put(tmp_path / "files" / "photo.png", random_codes(40, 60))
    primaries = ("float[8]", (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767))  # of ACEScg
    write(tmp_path / "files" / "linear.exr", light[..., :3], ["R", "G", "B"], chromaticities=primaries)
    put(tmp_path / "files" / "cube.npy", light)
    (tmp_path / "files" / "wavelengths.csv").write_text("\n".join(map(str, nm)), encoding="utf-8")
    put(tmp_path / "wall.png", random_codes(40, 48))
    (tmp_path / "shot.yaml").write_text(SHOT, encoding="utf-8")
    config = small_config(tmp_path, OF_ALL_KINDS)
    run(config, tmp_path / "here")
    used = {sample.source.split("/")[0] for sample in read_samples(tmp_path / "here")}
    assert used == set(config.pictures), used
    environment = os.environ | {"OPENBLAS_CORETYPE": "Prescott"}  # multiplies and adds in two steps, two numbers at once
    call = "import sys; from data_gen.command_line import main; main(sys.argv[1:])"
    there = ["dataset", str(tmp_path / "small.yaml"), "--out", str(tmp_path / "there")]
    subprocess.run([sys.executable, "-c", call, *there], env=environment, check=True)
    assert content(tmp_path / "there") == content(tmp_path / "here")


@pytest.mark.parametrize("on_problem", ["skip", "refuse"])
def test_the_device_of_the_run_computes_shots(tmp_path, on_problem):
    """A new process, whose default device is one that is not there."""
    config_of_shot(tmp_path)
    environment = os.environ | {"PHOTOSITE_DEVICE": "no such device"}
    call = "import sys; from data_gen.command_line import main; main(sys.argv[1:])"
    there = ["dataset", str(tmp_path / "small.yaml"), "--out", str(tmp_path / "out"), "--set", "count=1"]
    more = ["--set", f"on_problem={on_problem}", "--device", open_device().info.label]
    subprocess.run([sys.executable, "-c", call, *there, *more], env=environment, check=True)
    assert len(list(read_samples(tmp_path / "out"))) == 1


def command(*arguments) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return ended.value.code


def test_the_command_makes_estimates_and_verifies(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(TEXT, encoding="utf-8")
    file, out = tmp_path / "small.yaml", tmp_path / "out"
    assert command("dataset", file, "--out", out, "--dry-run") == 0
    shown = capsys.readouterr().out
    assert "22 of 1 x 16 x 24" in shown and "noise: imx385" in shown and not out.exists()
    assert command("dataset", file, "--out", out, "--set", "count=4") == 0
    assert capsys.readouterr().out.strip() == str(out / "manifest.json")
    assert command("dataset", file, "--out", out, "--verify") == 0
    shard = next(out.glob("shard-*.tar"))
    shard.write_bytes(shard.read_bytes()[:-1] + b"x")
    assert command("dataset", file, "--out", out, "--verify") == 1
    assert "SHA-256" in capsys.readouterr().out
    assert command("dataset", tmp_path / "none.yaml", "--out", out) == 1
    assert "none.yaml" in capsys.readouterr().err


def test_cameras_whose_black_ends_at_zero_are_told_in_plan_run_and_card(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(TEXT.replace("imx385: {}", "nikon_d3: {}"), encoding="utf-8")
    file, out = tmp_path / "small.yaml", tmp_path / "out"
    told = "nikon_d3: codes of black end at 0 at ISO 200"
    for extra in (["--dry-run"], ["--set", "count=2"]):
        assert command("dataset", file, "--out", out, *extra) == 0
        shown = " ".join(capsys.readouterr().err.split())
        assert f"warning: {told}" in shown and "sony_a7s2:" not in shown
    assert told in (out / "card.md").read_text(encoding="utf-8")
    assert [line[: len(told)] for line in json.loads((out / "card.json").read_text())["warnings"]] == [told]


@pytest.mark.parametrize("count, text", [(999.0, "999 B"), (1.58e9, "1.58 GB"), (2e15, "2 PB")])
def test_sizes_are_told_in_words(count, text):
    assert amounts.format_bytes(count) == text


@pytest.mark.parametrize("seconds, text", [(3.0, "3.0 s"), (600.0, "10.0 min"), (86400 * 12, "12.0 days")])
def test_times_are_told_in_words(seconds, text):
    assert amounts.format_duration(seconds) == text
