"""Clean frames of a data set are pictures of another one: the signal that they were made from, noise drawn anew."""

import numpy as np
import pytest
from helpers.dataset_folders import TEXT, small_config
from helpers.randomness import accept, correlation_p

from data_gen.generate import Generator
from data_gen.run import run
from data_gen.sources.data_set import DataSetSamples
from data_gen.storage.reading import read_samples
from simulator.errors import PhotositeError

AGAIN = """\
count: 40
crop: [16, 24]
pictures: {{stored: {{data_set: {folder}}}}}
noise: {{cameras: {{sony_a7s2: {{iso: 1600}}}}}}
augment: false
seed: 5
"""


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored")
    config = small_config(folder, TEXT.replace("sony_a7s2: {}, imx385: {}", "sony_a7s2: {}"))
    run(config, folder / "pairs")
    return folder / "pairs"


def test_a_clean_frame_is_the_signal_between_black_and_white(stored):
    source = DataSetSamples(stored)
    samples = list(read_samples(stored))
    assert source.names() == tuple(f"{index:09d}" for index in range(22))
    for sample, name in zip(samples, source.names(), strict=True):
        picture = source.read(name, np.random.default_rng(0))
        span_dn = sample.white_level_dn - sample.black_level_dn
        assert np.abs(picture.signal * span_dn + sample.black_level_dn - sample.clean_dn[0]).max() < 2e-3
        assert (picture.cfa, picture.white_balance) == (sample.cfa, sample.white_balance)
        assert picture.signal.min() >= 0 and picture.color_matrix == sample.color_matrix


def test_samples_of_stored_pictures_have_their_clean_frame_and_other_noise(stored, tmp_path, device):
    before = {f"stored/{sample.index:09d}": sample for sample in read_samples(stored)}
    config = small_config(tmp_path, AGAIN.format(folder=stored))
    samples = list(Generator(config, device).samples(range(40)))
    assert len({sample.source for sample in samples}) > 10
    residuals = []
    for sample in samples:
        old = before[sample.source]
        spans_dn = [one.white_level_dn - one.black_level_dn for one in (sample, old)]
        signal, known = ((one.clean_dn - one.black_level_dn) / span for one, span in zip((sample, old), spans_dn, strict=True))
        assert np.abs(signal - known).max() < 1e-6 and sample.color_matrix == old.color_matrix
        residuals.append([one.noisy_dn - one.clean_dn / one.exposure_ratios[0] for one in (sample, old)])
    new, old = (np.stack([(pair[side] - pair[side].mean()) / pair[side].std() for pair in residuals]) for side in (0, 1))
    new, old = (one - one.mean(axis=0) for one in (new, old))
    accept({"noise is drawn anew": correlation_p(new, old)})


def test_stored_patches_of_the_wanted_size_are_all_used_in_the_ways_they_can_be_turned(stored, tmp_path, device):
    """A flipped Bayer mosaic needs a row or a column more to begin with red, a transposed one does not."""
    text = AGAIN.format(folder=stored).replace("augment: false", "augment: true")
    config = small_config(tmp_path, text, "count=60", "crop=[16, 24]")
    made = Generator(config, device)
    samples = list(made.samples(range(60)))
    assert made.problems == {} and {sample.augmentation for sample in samples} == {"none"}  # 16 x 24 stays so when not square
    square = small_config(tmp_path / "square", text, "count=60", "crop=[16, 16]")
    made = Generator(square, device)
    assert len({sample.augmentation for sample in made.samples(range(60))}) > 2 and made.problems == {}


def test_a_data_set_that_was_made_anew_is_told(stored, tmp_path):
    run(small_config(tmp_path, TEXT, "seed=6"), tmp_path / "pairs")
    found, other = (list(DataSetSamples(folder).fingerprints()) for folder in (stored, tmp_path / "pairs"))
    assert len(found) == len(other) and not set(found) & set(other)


def test_a_folder_without_a_data_set_is_told_with_the_key(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(PhotositeError, match=r"data_set = .*empty: holds no data set.*photosite dataset --out"):
        DataSetSamples(tmp_path / "empty").names()


def test_a_name_that_no_sample_has_is_refused(stored):
    source = DataSetSamples(stored)
    with pytest.raises(PhotositeError, match="has samples by number, such as 000000000"):
        source.read("leaves", np.random.default_rng(0))
    with pytest.raises(PhotositeError, match="has no sample 22"):
        source.read("000000022", np.random.default_rng(0))
