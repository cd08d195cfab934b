"""The XMP packet is well-formed XML, whatever the shot is called."""

import json
from xml.etree import ElementTree

import pytest
from helpers.raw_frame import random_frame

from simulator import load_shot, simulate
from simulator.raw.dng.xmp import NAMESPACE, xmp_packet
from simulator.raw.raw_image import Raw


@pytest.mark.parametrize("name", ["plain", "R & D", "<b>", "o'clock", "'", "Zürich \u2028 \U0001f4f7", "&quot;"])
def test_any_text_stands_in_the_packet_and_is_read_from_it(name):
    resolved = {"shot": {"name": name}, "inputs": []}
    packet = xmp_packet(random_frame(8, 8, resolved=resolved))
    (found,) = ElementTree.fromstring(packet).iter("{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description")
    assert json.loads(found.attrib[f"{{{NAMESPACE}}}Shot"]) == resolved["shot"]


def test_the_packet_says_when_each_row_was_open():
    """As the JSON file does, in the sensor's rows; where all rows are open at once the exposure time says all."""
    window = {"x": 20, "y": 30, "width": 16, "height": 10}
    shot = load_shot("flat_field", {"camera.window": window, "exposure.shutter": {"readout_time": "28.32 ms"}})
    (times,) = json.loads(packet_values(simulate(shot))["Times"])
    assert times["lines"] == "rows" and times["first_line"] == 30 and times["duration_s"] == pytest.approx(1 / 60)
    assert times["step_s"] == pytest.approx(1e-5) and times["start_s"] == pytest.approx(30e-5)
    assert "Times" not in packet_values(simulate(load_shot("flat_field", {"camera.window": window})))


def packet_values(raw: Raw) -> dict[str, str]:
    """Return Photosite's properties of a frame's packet."""
    (found,) = ElementTree.fromstring(xmp_packet(raw)).iter("{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description")
    return {name.removeprefix(f"{{{NAMESPACE}}}"): value for name, value in found.attrib.items()}
