"""The sheet: the mosaic in its colours, the difference that is noise alone, and clear errors."""

import builtins
import dataclasses

import numpy as np
import pytest
from helpers.raw_frame import random_frame

from simulator.command_line.development import develop_sheet
from simulator.command_line.development_sheet import draw_sheet, mosaic_picture
from simulator.errors import PhotositeError
from simulator.raw.raw_reader import read_raw_file
from simulator.raw.save import save

SETTINGS = {"output": "metric", "demosaic": "linear", "half_size": False, "exposure_ev": 0.0, "white_balance": "camera"}


def frame_with_twin(folder, shift_dn=0, cfa="RGGB", **changes):
    """A frame whose codes lie `shift_dn` above the truth."""
    truth = np.random.default_rng(2).integers(2000, 9000, (120, 160))
    raw = random_frame(
        120, 160, cfa, dn=(truth + shift_dn).astype(np.uint16), noise_free_dn=truth.astype(np.float32), **changes
    )
    return save(dataclasses.replace(raw, name="a"), folder).dng


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG", "MONO"])
def test_every_photosite_shows_in_its_own_colour(tmp_path, cfa):
    path = frame_with_twin(tmp_path, cfa=cfa)
    raw = read_raw_file(path)
    signal = (raw.mosaic.astype(float) - 511) / (16383 - 511)
    picture = mosaic_picture(raw)
    for y in range(2):
        for x in range(2):
            channels = [letter == cfa[2 * y + x] for letter in "RGB"] if cfa != "MONO" else [True] * 3
            np.testing.assert_allclose(picture[y::2, x::2], signal[y::2, x::2, None] * channels, rtol=1e-6)


def test_a_frame_that_is_its_truth_has_no_difference_and_another_has_what_was_added(tmp_path):
    for shift_dn, rms in ((0, "rms 0"), (159, "rms 0.01")):  # 159 of 16383 - 511 DN
        figure = draw_sheet(frame_with_twin(tmp_path, shift_dn), SETTINGS)
        titles = [axes.get_title() for axes in figure.axes]
        assert len(titles) == 8 and titles[3].endswith(rms), titles[3]
        shown = figure.axes[3].images[0].get_array()
        assert np.allclose(shown, 0.5 if shift_dn == 0 else 0.85, atol=0.01)


def test_a_frame_with_optical_black_is_compared_where_it_sees_light(tmp_path):
    """The twin covers the edge, too; the development shows the active area."""
    figure = draw_sheet(frame_with_twin(tmp_path, active_area=(2, 2, 120, 158)), SETTINGS)
    shown = figure.axes[3].images[0].get_array()
    assert shown.shape == (118, 156, 3) and (shown == 0.5).all()


def test_the_sheet_is_a_picture_beside_the_raw_file(tmp_path):
    path = frame_with_twin(tmp_path, 10)
    settings = {name: value for name, value in SETTINGS.items() if name != "white_balance"}
    assert develop_sheet(path, None, settings | {"output": "srgb"}, "camera") == tmp_path / "a.sheet.png"
    assert (tmp_path / "a.sheet.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(PhotositeError, match=r"--out .*a\.exr: end the name with \.svg"):
        develop_sheet(path, tmp_path / "a.exr", settings, "camera")


def test_without_twin_or_matplotlib_the_sheet_says_what_to_do(tmp_path, monkeypatch):
    path = frame_with_twin(tmp_path)
    real = builtins.__import__

    def without_matplotlib(name, *rest):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *rest)

    with monkeypatch.context() as patch, pytest.raises(PhotositeError, match=r"pip install 'photosite\[report\]'"):
        patch.setattr(builtins, "__import__", without_matplotlib)
        draw_sheet(path, SETTINGS)
    (tmp_path / "a.truth.exr").unlink()
    with pytest.raises(PhotositeError, match=r"a\.dng: --sheet compares with the truth, but .*a\.truth\.exr is missing"):
        draw_sheet(path, SETTINGS)
