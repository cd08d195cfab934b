"""The crop factors that are published for the formats of sensors."""

import pytest

from simulator.optics.lens.sensor_formats import SENSOR_FORMATS

# D. Carr, "Common Digital Sensor Sizes and Crop Factors", shuttermuse.com
PUBLISHED = {
    "medium_format": "0.64",
    "medium_format_cropped": "0.79",
    "full_frame": "1",
    "aps_h": "1.3",
    "aps_c": "1.5",
    "aps_c_canon": "1.6",
    "type_1.5": "1.9",
    "four_thirds": "2",
    "type_1": "2.7",
    "type_2_3": "3.9",
    "type_1_2.3": "5.6",
}


@pytest.mark.parametrize("name", SENSOR_FORMATS)
def test_crop_factors_are_the_published_ones(name):
    decimals = len(PUBLISHED[name].partition(".")[2])
    assert f"{SENSOR_FORMATS[name].crop_factor:.{decimals}f}" == PUBLISHED[name]


def test_no_published_format_is_left_out():
    assert PUBLISHED.keys() == SENSOR_FORMATS.keys()
