"""The XMP packet is well-formed XML, whatever the shot is called."""

import json
from xml.etree import ElementTree

import pytest
from helpers.raw_frame import random_frame

from simulator.raw.dng.xmp import NAMESPACE, xmp_packet


@pytest.mark.parametrize("name", ["plain", "R & D", "<b>", "o'clock", "'", "Zürich \u2028 \U0001f4f7", "&quot;"])
def test_any_text_stands_in_the_packet_and_is_read_from_it(name):
    resolved = {"shot": {"name": name}, "inputs": []}
    packet = xmp_packet(random_frame(8, 8, resolved=resolved))
    (found,) = ElementTree.fromstring(packet).iter("{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description")
    assert json.loads(found.attrib[f"{{{NAMESPACE}}}Shot"]) == resolved["shot"]
