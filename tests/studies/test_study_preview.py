"""Previews are means of linear light, and no larger than asked for."""

import numpy as np
import pytest
from helpers.raw_frame import random_frame

from simulator.raw.development import develop
from simulator.raw.image_files import read_parts
from simulator.studies.study_preview import LONG_SIDE_PX, resized, write_preview


def test_a_smaller_picture_has_the_mean_of_what_it_covers():
    pixels = np.random.default_rng(1).random((10, 7, 3))
    assert np.allclose(resized(pixels, 5, 0), pixels.reshape(5, 2, 7, 3).mean(axis=1), atol=1e-12)
    small = resized(pixels, 3, 1)
    first = (pixels[:, 0] + pixels[:, 1] + pixels[:, 2] / 3) / (7 / 3)
    assert np.allclose(small[:, 0], first, atol=1e-12) and np.allclose(small.mean(axis=1), pixels.mean(axis=1), atol=1e-12)
    assert resized(pixels, 7, 1) is pixels


@pytest.mark.parametrize("height, width, shape", [(48, 64, (48, 64)), (1000, 700, (320, 224)), (400, 500, (256, 320))])
def test_a_preview_has_a_long_side_of_320_and_the_light_of_the_frame(tmp_path, height, width, shape):
    frame = random_frame(height, width)
    assert write_preview(frame, tmp_path / "a.png")
    (part,) = read_parts(tmp_path / "a.png")
    assert part.pixels.shape == (*shape, 3) and max(part.pixels.shape) <= LONG_SIDE_PX
    encoded = part.pixels / (255.0 if part.pixels.dtype == np.uint8 else 1.0)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    whole = develop(frame, output="linear_srgb", half_size=max(height, width) >= 2 * LONG_SIDE_PX) / 65535.0
    # A code of sRGB is within half a step of its value; the mean over thousands of pixels is within a tenth of a step.
    assert linear.mean(axis=(0, 1)) == pytest.approx(whole.mean(axis=(0, 1)), abs=1e-3)


def test_a_frame_that_no_reader_takes_has_no_preview(tmp_path):
    assert not write_preview(random_frame(20, 64), tmp_path / "a.png") and not (tmp_path / "a.png").exists()
