"""Names and numbers of tags against the registry of another library."""

import pytest
import tifffile

from simulator.raw.dng.tags import Tag

# tifffile has older names: of Exif 2.2 before PhotographicSensitivity, and of the directory's pointer.
OTHER_NAMES = {Tag.PHOTOGRAPHIC_SENSITIVITY: "ISOSpeedRatings", Tag.EXIF_IFD: "ExifTag"}


@pytest.mark.parametrize("tag", Tag, ids=lambda tag: tag.name)
def test_a_tag_has_the_number_of_its_name(tag):
    name = OTHER_NAMES.get(tag, tag.name.replace("_", ""))
    assert tifffile.TIFF.TAGS[tag.value].lower() == name.lower()
