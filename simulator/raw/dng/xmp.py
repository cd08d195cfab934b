"""XMP packet of a DNG (tag 700): the resolved shot, so that the file alone can be simulated again.

XMP Specification Part 1 (ISO 16684-1:2012): RDF in XML between two processing instructions. The shot is ASCII JSON in one
property of Photosite's namespace. The packet depends on neither computer nor clock.
"""

import hashlib
import json
import os
from dataclasses import dataclass

from simulator import __version__
from simulator.errors import PhotositeError, reading
from simulator.raw.canonical_json import json_text
from simulator.raw.dng.tag_reader import read_tag
from simulator.raw.dng.tags import Tag
from simulator.raw.raw_image import Raw
from simulator.raw.software import software

NAMESPACE = "urn:x-photosite:xmp:1.0/"
_RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
_XMP = "http://ns.adobe.com/xap/1.0/"
_COMPACT = {"separators": (",", ":"), "ensure_ascii": True}


class SettingsChanged(PhotositeError):
    """The hash of the settings in a file differs from the hash stored with them."""


@dataclass(frozen=True)
class Provenance:
    """Inputs from which a raw frame was simulated.

    shot: the resolved configuration, plain data. config_sha256: SHA-256 of it as compact JSON in ASCII letters with sorted
        keys, 64 hexadecimal digits.
    inputs: key, path and sha256 of each file of the scene. version: of Photosite.
    """

    shot: dict[str, object]
    config_sha256: str
    inputs: tuple[dict[str, str], ...]
    version: str


def xmp_packet(raw: Raw) -> bytes | None:
    """Return the XMP packet, or None for a frame that was not simulated from a configuration.

    Raises PhotositeError for settings that are not plain data.
    """
    if not raw.resolved.get("shot"):
        return None
    shot, inputs = (json_text(raw.name, raw.resolved.get(key, []), **_COMPACT) for key in ("shot", "inputs"))
    values = {"ConfigSHA256": _sha256(shot), "Version": __version__, "Inputs": inputs, "Shot": shot}
    if "metered" in raw.resolved:
        values["Metered"] = json_text(raw.name, raw.resolved["metered"], **_COMPACT)
    if (times := _line_times(raw)) is not None:
        values["Times"] = json_text(raw.name, times, **_COMPACT)
    attributes = "".join(f"\n    photosite:{name}={_quoted(value)}" for name, value in values.items())
    text = (
        '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>\n'
        '<x:xmpmeta xmlns:x="adobe:ns:meta/">\n'
        f' <rdf:RDF xmlns:rdf="{_RDF}">\n'
        f'  <rdf:Description rdf:about="" xmlns:xmp="{_XMP}" xmlns:photosite="{NAMESPACE}"\n'
        f"    xmp:CreatorTool={_quoted(software())}{attributes}/>\n"
        " </rdf:RDF>\n"
        "</x:xmpmeta>\n"
        '<?xpacket end="r"?>'
    )
    return text.encode("utf-8")


def _line_times(raw: Raw) -> object | None:
    """Return when each row or column was open, of each exposure, as the JSON file has them; None where all were at once."""
    own, later = raw.resolved.get("times"), raw.resolved.get("later_times")
    if not isinstance(own, dict) or own.get("lines") == "all":
        return None
    return [own, *later] if isinstance(later, list) else [own]


def _quoted(text: str) -> str:
    """Return text as a value of an XML attribute in quotes (XML 1.0, 2.3); it has no line breaks and tabs."""
    # As xml.sax.saxutils.quoteattr does, whose import of all that opens URLs takes as long as a small frame.
    escaped = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    if '"' in escaped and "'" not in escaped:
        return f"'{escaped}'"
    return '"' + escaped.replace('"', "&quot;") + '"'


def read_provenance(path: str | os.PathLike) -> Provenance | None:
    """Return the inputs from which a DNG of Photosite was simulated; None for any other TIFF or DNG.

    Raises PhotositeError for a file that is missing, truncated, or not a TIFF or DNG; its subclass SettingsChanged for
    settings whose hash differs from the one stored with them.
    """
    packet = read_tag(path, Tag.XMP)
    with reading(path, "its XMP packet is damaged: use an untouched copy"):
        found = {} if packet is None else _properties(packet)
    if "Shot" not in found:
        return None
    try:
        shot, inputs = json.loads(found["Shot"]), tuple(map(dict, json.loads(found["Inputs"])))
    except (ValueError, TypeError, KeyError, RecursionError):
        shot, inputs = None, ()
    named = all(isinstance(each.get(name), str) for each in inputs for name in ("key", "path", "sha256"))
    if not isinstance(shot, dict) or not named or _sha256(found["Shot"]) != found.get("ConfigSHA256"):
        raise SettingsChanged("the shot in its XMP packet was changed after it was written; use an untouched copy", file=path)
    return Provenance(shot, found["ConfigSHA256"], inputs, found.get("Version", "an unknown version"))


def _properties(packet: bytes) -> dict[str, str]:
    """Return Photosite's properties of a packet by name, stored as attributes or, by other software, as elements."""
    from xml.etree import ElementTree

    try:
        tree = ElementTree.fromstring(packet.strip(b"\0"))
    except ElementTree.ParseError:
        return {}
    found: dict[str, str] = {}
    prefix = f"{{{NAMESPACE}}}"
    for description in tree.iter(f"{{{_RDF}}}Description"):
        named = [*description.attrib.items(), *((child.tag, child.text or "") for child in description)]
        found |= {name.removeprefix(prefix): value for name, value in named if name.startswith(prefix)}
    return found


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()
