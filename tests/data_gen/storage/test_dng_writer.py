"""DNG pairs: the codes as LibRaw reads them, and metadata that are true of the frame."""

import re

import numpy as np
import pytest
import tifffile
from helpers.toy_samples import toy_sample

from data_gen.storage.writers.dng import WRITER
from data_gen.storage.writers.writer import WriterOptions
from simulator.errors import PhotositeError
from simulator.raw.dng.tags import Tag
from simulator.raw.raw_reader import read_raw_file


def noise_profile(path):
    with tifffile.TiffFile(path) as file:
        return np.reshape(file.pages[0].pages[0].tags[Tag.NOISE_PROFILE].value, (-1, 2))


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG", "MONO"])
def test_pairs_read_back_with_their_levels_and_ratio(tmp_path, cfa):
    wanted = [toy_sample(index, cfa=cfa, frames=2) for index in (5, 6)]
    WRITER.write(tmp_path / "shard", wanted, WriterOptions())
    pairs = [line.split() for line in (tmp_path / "shard" / "pairs.txt").read_text().splitlines()]
    assert len(pairs) == 4
    for (noisy, clean), (sample, frame) in zip(pairs, [(s, f) for s in wanted for f in (0, 1)], strict=True):
        noisy_file, clean_file = (read_raw_file(tmp_path / "shard" / name) for name in (noisy, clean))
        np.testing.assert_array_equal(noisy_file.mosaic, sample.noisy_dn[frame])
        np.testing.assert_array_equal(clean_file.mosaic, np.rint(sample.clean_dn[frame]))
        assert (noisy_file.cfa, noisy_file.iso, noisy_file.white_level_dn) == (cfa, sample.iso, 16383)
        assert np.all(noisy_file.black_level_dn == 512)
        ratio = clean_file.exposure_time_s / noisy_file.exposure_time_s
        assert ratio == pytest.approx(sample.exposure_ratios[frame], rel=1e-6)
        seconds = [float(re.search(r"_(\d+(\.\d+)?)s.", name).group(1)) for name in (noisy, clean)]
        assert seconds == [1.0, sample.exposure_ratios[frame]]


def test_the_noise_profile_is_the_variance_of_the_signal(tmp_path):
    sample = toy_sample(1)
    WRITER.write(tmp_path / "shard", [sample], WriterOptions())
    noisy, clean = sorted((tmp_path / "shard").glob("*_1s.noisy.dng")) + sorted((tmp_path / "shard").glob("*.clean.dng"))
    span = 16383 - 512
    slope, offset = noise_profile(noisy)[0]
    # Variance [DN^2] of a photosite with 1000 DN above black: K times the signal, and the read noise.
    assert (slope * 1000 / span + offset) * span**2 == pytest.approx(sample.gain_dn_per_e * 1000 + 3.0**2, rel=1e-9)
    slope, offset = noise_profile(clean)[0]
    assert offset * span**2 == pytest.approx(1 / 12, rel=1e-9) and slope * span**2 < 1e-3


def test_neutral_is_the_light_of_the_sample(tmp_path):
    import rawpy

    sample = toy_sample(0)
    WRITER.write(tmp_path / "shard", [sample], WriterOptions())
    with rawpy.imread(str(next((tmp_path / "shard").glob("*noisy.dng")))) as frame:
        red, green, blue, _ = frame.camera_whitebalance
    assert (red / green, blue / green) == pytest.approx((2.1, 1.57), rel=1e-4)


def test_what_a_dng_cannot_hold_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match="writer.channels = rgbg: a DNG holds the mosaic; set mosaic"):
        WRITER.write(tmp_path / "a", [toy_sample(0)], WriterOptions("rgbg"))
    with pytest.raises(PhotositeError, match="sample 0 .ramp/0000.png.: its colour matrix is not known.*another format"):
        WRITER.write(tmp_path / "b", [toy_sample(0, color_matrix=None)], WriterOptions())


def test_samples_read_back_but_for_the_rounding_of_the_clean_codes(tmp_path):
    wanted = toy_sample(2)
    WRITER.write(tmp_path / "shard", [toy_sample(1), wanted], WriterOptions())
    back = next(WRITER.read(tmp_path / "shard", [1]))
    np.testing.assert_array_equal(back.noisy_dn, wanted.noisy_dn)
    np.testing.assert_allclose(back.clean_dn, wanted.clean_dn, rtol=0, atol=0.5)
    assert back.variance_dn2 is None and back.white_balance == wanted.white_balance
