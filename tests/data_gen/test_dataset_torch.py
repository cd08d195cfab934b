"""Live pairs are a function of configuration, epoch and index, of no worker, batch or method. Their noise is the model's."""

import json
import os
import subprocess
import sys
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from helpers.dataset_folders import TEXT, small_config
from helpers.picture_files import put, random_codes
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from helpers.toy_dataset import BLACK_DN, GAIN, READ_DN, WHITE_DN, ToyPictures, at_iso, toy_config

from data_gen.recipe.dataset_config import Burst, NoiseOnly
from data_gen.run import run
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.photographs import Photographs
from simulator.errors import PhotositeError

torch = pytest.importorskip("torch", reason="PyTorch is missing; pip install 'photosite[torch]'")
from helpers.live_in_workers import EPOCHS, checksums  # noqa: E402 (after PyTorch was found)

from data_gen.torch import DataLoader, LivePairs, StoredPairs, loader  # noqa: E402

SCRIPT = Path(__file__).parent.parent / "helpers" / "live_in_workers.py"


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    return folder / "small.yaml", small_config(folder, TEXT + "variance: true\n")


@pytest.fixture(scope="module")
def expected(config):
    """Checksums of every epoch, each sample asked for alone in this process."""
    pairs, found = LivePairs(config[1]), []
    for epoch in range(EPOCHS):
        pairs.set_epoch(epoch)
        found.append({})
        for place in range(len(pairs)):
            found[-1] |= checksums(torch.utils.data.default_collate([pairs[place]]))
    return found


def same(one: dict, other: dict) -> bool:
    """Whether two samples agree in every bit."""
    equal = (v == other[k] if isinstance(v, str) else np.array_equal(v.numpy(), other[k].numpy()) for k, v in one.items())
    return one.keys() == other.keys() and all(equal)


@pytest.mark.parametrize(
    ("method", "workers", "persistent", "before"),
    [
        ("fork", 2, True, False),
        ("spawn", 1, True, True),
        pytest.param("fork", 1, False, False, marks=pytest.mark.slow),
        pytest.param("forkserver", 2, False, True, marks=pytest.mark.slow),
    ],
)
def test_workers_draw_the_pairs_of_one_process(config, expected, method, workers, persistent, before):
    paths = os.pathsep.join([str(SCRIPT.parents[2]), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, str(SCRIPT), str(config[0]), method, *(str(int(one)) for one in (workers, persistent, before))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, env=os.environ | {"PYTHONPATH": paths})
    assert done.returncode == 0, done.stderr
    assert [{int(index): code for index, code in epoch.items()} for epoch in json.loads(done.stdout)] == expected


def test_the_loader_gives_the_same_batches_for_any_number_of_workers_and_every_sample_once(config, expected):
    found = {}
    for workers in (0, 2):
        pairs = LivePairs(config[1])
        batches = loader(pairs, 5, num_workers=workers, seed=3)
        for epoch in range(2):
            pairs.set_epoch(epoch)
            found[workers, epoch] = [checksums(batch) for batch in batches]
    for epoch in range(2):
        assert [list(batch.items()) for batch in found[0, epoch]] == [list(batch.items()) for batch in found[2, epoch]]
        assert {index: code for batch in found[0, epoch] for index, code in batch.items()} == expected[epoch]
    orders = [[index % 22 for batch in found[0, epoch] for index in batch] for epoch in range(2)]
    assert orders[0] != orders[1] != sorted(orders[1])


def test_a_worker_forked_after_opencl_was_used_says_what_to_do(device):
    pairs = LivePairs(toy_config())
    pairs[0]
    with pytest.raises(PhotositeError, match="multiprocessing_context='forkserver'"):
        next(iter(DataLoader(pairs, 2, num_workers=1, multiprocessing_context="fork")))


def test_epoch_0_is_the_stored_data_set_and_the_batch_does_not_matter(config, tmp_path):
    run(config[1], tmp_path / "pairs")
    stored, live = StoredPairs(tmp_path / "pairs"), LivePairs(config[0])
    assert len(stored) == len(live) == 22
    places = [7, 21, 0, 8, 7, -1]
    alone = [live[place] for place in places]
    for one, together, kept in zip(alone, live.__getitems__(places), stored.__getitems__(places), strict=True):
        assert same(one, together) and same(one, kept)
    assert alone[0]["noisy"].shape == (4, 8, 12) and alone[0]["noisy"].dtype == torch.float32


def test_a_folder_with_a_shard_missing_gives_the_samples_that_are_there(config, tmp_path):
    folder = tmp_path / "pairs"
    run(config[1], folder)
    (folder / "manifest.json").unlink()
    (folder / "shard-00001-of-00008.tar").unlink()  # samples 3, 4, 5
    pairs = StoredPairs(folder)
    assert [int(sample["index"]) for sample in pairs] == [0, 1, 2, *range(6, 22)]


@pytest.mark.parametrize("amplify", [False, True])
def test_live_noise_has_the_mean_and_variance_of_the_camera(device, amplify):
    """K = 0.5 DN/e-, read noise 3 DN, rounding; half of saturation at a fourth of the light: 239.75 e-."""
    settings = {"mode": "noise_only", "noise_only": NoiseOnly(0.5), "exposure_ratio": 4.0, "crop_px": (64, 64)}
    pairs = LivePairs(at_iso(toy_config(count=30, **settings), 100), channels="rggb", amplify=amplify)
    samples = pairs.__getitems__(range(30))
    noisy = np.stack([one["noisy"].numpy() for one in samples])
    electrons, unit_dn = 0.5 * (WHITE_DN - BLACK_DN) / GAIN / 4.0, (WHITE_DN - BLACK_DN) / (4.0 if amplify else 1.0)
    mean, variance = GAIN * electrons / unit_dn, (GAIN**2 * electrons + READ_DN**2 + 1.0 / 12.0) / unit_dn**2
    z = (noisy - mean) / np.sqrt(variance)
    accept({"mean": mean_p(z, 0.0, 1.0), "variance": variance_p(z, 1.0, 1.0 / electrons)})
    one = samples[0]
    assert float(one["gain"]) * mean + float(one["read_noise"]) ** 2 == pytest.approx(variance, rel=1e-5)
    assert float(one["clean"].mean()) == pytest.approx(0.5, rel=1e-6)


def test_epochs_have_other_noise_and_pictures(device):
    pairs = LivePairs(toy_config(crop_px=(32, 32), mode="noise_only", noise_only=NoiseOnly(0.3)))
    residuals = []
    for epoch in (0, 1):
        pairs.set_epoch(epoch)
        samples = pairs.__getitems__(range(20))
        assert [int(one["index"]) for one in samples] == list(range(20 * epoch, 20 * epoch + 20))
        residuals.append(np.stack([(one["noisy"] - one["noisy"].mean()) / one["noisy"].std() for one in samples]))
    accept({"uncorrelated": correlation_p(*residuals)})


def test_pytorch_makes_batches_of_bursts_and_words(device):
    pairs = LivePairs(toy_config(mode="burst", burst=Burst(3, 1.0)), channels="rgbg")
    batch = next(iter(DataLoader(pairs, 2)))
    assert batch["noisy"].shape == (2, 3, 4, 8, 12) and batch["offsets_px"].shape == (2, 3, 2)
    assert batch["camera"] == ["toy", "toy"] and batch["noisy_unit_dn"].shape == (2, 3)


def test_a_picture_that_cannot_be_used_is_told_once(device):
    config = replace(toy_config(), pictures={"ramps": lambda camera: ToyPictures(bad=("003", "005"))})
    pairs = LivePairs(config)
    with pytest.warns(UserWarning, match="another picture is taken .* 00[35]: is broken"):
        pairs.__getitems__(range(20))
    with warnings.catch_warnings(action="error"):
        pairs.__getitems__(range(20))


def test_indices_and_epochs_that_cannot_be_are_refused(device):
    pairs = LivePairs(toy_config())
    with pytest.raises(IndexError, match="sample 20 of 20"):
        pairs[20]
    for epoch in (-1, 2**62):
        with pytest.raises(PhotositeError, match="epoch = .*give a whole number from 0 to"):
            pairs.set_epoch(epoch)
    assert pairs.epoch == 0


def test_crops_of_a_photograph_are_shuffled_and_it_is_decoded_once(tmp_path, device):
    for number in range(6):
        put(tmp_path / "in" / f"{number}.png", random_codes(40, 50, seed=number))
    config = toy_config(
        pictures={"photos": partial(Photographs, tmp_path / "in", inverse_isp="brooks2019")}, count=96, crops_per_picture=8
    )
    cache = DecodedPictures(10**9, tmp_path / "cache")
    pairs = LivePairs(config, decoded=cache)
    batches = list(loader(pairs, 8, seed=1))
    order = [int(index) for batch in batches for index in batch["index"]]
    assert sorted(order) == list(range(96)) and cache.cost.pictures <= 6
    assert any(len(set(batch["source"])) > 1 for batch in batches)
    alone = LivePairs(config, decoded=DecodedPictures(0))
    assert all(same(alone[place], pairs[place]) for place in (0, 17, 95))
