"""Four planes of a mosaic, by hand for every CFA phase."""

import numpy as np
import pytest

from data_gen.samples.packing import pack, unpack
from simulator.errors import PhotositeError

# Codes of a 2x4 mosaic: 0 1 2 3 / 4 5 6 7. Planes in the order R, G in red's row, G in blue's row, B.
BY_HAND = {
    "RGGB": ([0, 2], [1, 3], [4, 6], [5, 7]),
    "BGGR": ([5, 7], [4, 6], [1, 3], [0, 2]),
    "GRBG": ([1, 3], [0, 2], [5, 7], [4, 6]),
    "GBRG": ([4, 6], [5, 7], [0, 2], [1, 3]),
}
MOSAIC = np.arange(8, dtype=np.uint16).reshape(1, 2, 4)


@pytest.mark.parametrize("cfa", BY_HAND)
def test_planes_are_those_found_by_hand(cfa):
    red, green_red, green_blue, blue = BY_HAND[cfa]
    np.testing.assert_array_equal(pack(MOSAIC, cfa, "rggb")[0, :, 0], [red, green_red, green_blue, blue])
    np.testing.assert_array_equal(pack(MOSAIC, cfa, "rgbg")[0, :, 0], [red, green_red, blue, green_blue])
    assert pack(MOSAIC, cfa, "mosaic") is MOSAIC


@pytest.mark.parametrize("cfa", BY_HAND)
@pytest.mark.parametrize("channels", ["mosaic", "rggb", "rgbg"])
def test_unpacking_gives_the_mosaic_back(cfa, channels):
    mosaic = np.random.default_rng(3).normal(size=(3, 6, 10)).astype(np.float32)
    planes = pack(mosaic, cfa, channels)
    assert planes.dtype == mosaic.dtype
    np.testing.assert_array_equal(unpack(planes, cfa, channels), mosaic)


def test_rgbg_is_the_order_rawpy_numbers_colours_in(tmp_path):
    """Colours 0 to 3 of LibRaw are R, G, B, G2, and ELD and LED stack them in that order."""
    import rawpy
    from helpers.raw_frame import random_frame

    from simulator.raw.dng.writer import write_dng

    for cfa in BY_HAND:
        write_dng(random_frame(48, 64, cfa), tmp_path / f"{cfa}.dng")
        with rawpy.imread(str(tmp_path / f"{cfa}.dng")) as frame:
            mosaic, pattern = frame.raw_image_visible.copy(), frame.raw_pattern.copy()
        first = [np.argwhere(pattern == colour)[0] for colour in range(4)]
        wanted = np.stack([mosaic[row::2, column::2] for row, column in first])
        np.testing.assert_array_equal(pack(mosaic, cfa, "rgbg"), wanted, cfa)


def test_what_cannot_be_packed_is_refused():
    with pytest.raises(PhotositeError, match="MONO sensor has no colours.*use mosaic"):
        pack(MOSAIC, "MONO", "rggb")
    with pytest.raises(PhotositeError, match="3 x 2 px.*even"):
        pack(np.zeros((2, 3), np.uint16), "RGGB", "rgbg")
    with pytest.raises(PhotositeError, match="writer.channels = grbg.*mosaic, rggb, rgbg"):
        pack(MOSAIC, "RGGB", "grbg")
