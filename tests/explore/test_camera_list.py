"""The cameras of the library, by name, and the ISO that is nearest to one that a camera does not have."""

import pytest

from simulator.config import load_camera, shipped_names
from simulator.explore.camera_list import OWN, camera_labels, camera_names, nearest_iso


def test_all_cameras_of_the_library_are_offered_with_a_name_each():
    labels = camera_labels(load_camera("sony_a7s2"))
    assert list(labels) == [OWN, *camera_names()] and len(set(labels.values())) == len(labels)
    assert set(shipped_names("cameras")) < set(camera_names())
    assert labels["canon_550d"] == "Canon EOS 550D, 22.3 mm, 17.9 Mpx"


@pytest.mark.parametrize(("iso", "nearest"), [(100, 1600), (3000, 3000), (51200, 25600)])
def test_an_iso_is_brought_into_the_range_of_the_camera(iso, nearest):
    assert nearest_iso(load_camera("imx385"), iso) == nearest
