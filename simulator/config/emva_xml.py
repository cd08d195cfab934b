"""EMVA 1288 data sheets in XML (`simulator/measurement/emva1288/xml_sheet.py`) as lines of a sheet in CSV."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from simulator.errors import PhotositeError, reading, require

FIX = "write it again, with `photosite sheet` or another implementation of EMVA 1288"
TEXTS = {"vendor": "vendor", "model": "model", "cfa": "cfa", "iso": "iso"}  # attribute -> quantity
# Name of an element -> quantity and unit of a sheet in CSV. What follows from the others has no line.
NUMBERS = {
    "width": ("width", "px"),
    "height": ("height", "px"),
    "pixel_size": ("pixel size", "um"),
    "bit_depth": ("bit depth", "bit"),
    "u_y_dark": ("dark signal", "DN"),
    "K": ("overall system gain", "DN/e-"),
    "sigma_d": ("temporal dark noise", "e-"),
    "u_e_sat": ("saturation capacity", "e-"),
    "u_I_mean": ("dark current", "e-/s"),
    "DSNU1288": ("dsnu", "e-"),
    "PRNU1288": ("prnu", "%"),
}
UNKNOWN = ("", "none", "nan")  # values of what was not measured
Entry = tuple[int, dict[str, str]]


@dataclass
class _Elements:
    """Texts of the elements of a file by their names below the section, such as `K/value`, each with its line."""

    root: str = ""
    attributes: dict[str, str] = field(default_factory=dict)
    line: int = 1
    texts: dict[str, tuple[int, str]] = field(default_factory=dict)
    curves: dict[str, tuple[int, str]] = field(default_factory=dict)


def read_xml_entries(path: Path) -> list[Entry]:
    """Return line and columns (quantity, value, unit, wavelength) of each number and text of a sheet that makes a camera.

    Raises PhotositeError for a file that is no XML, and for one with another root than `results`.
    """
    found = _read_elements(path)
    entries = [
        (found.line, {"quantity": TEXTS[name], "value": text}) for name, text in found.attributes.items() if name in TEXTS
    ]
    for name, (quantity, unit) in NUMBERS.items():
        line, value = found.texts.get(f"{name}/value", (0, ""))
        if value.lower() not in UNKNOWN:
            entries.append((line, {"quantity": quantity, "value": value, "unit": unit}))
    return [*entries, *_efficiencies(found, path)]


def _efficiencies(found: _Elements, path: Path) -> Iterator[Entry]:
    """Yield lines of quantum efficiency: those of the curves; where there is none, that at the light's wavelength."""
    if "wavelength" not in found.curves:
        line, value = found.texts.get("QE/value", (0, ""))
        wavelength = found.texts.get("wavelength/value", (0, ""))[1]
        if value.lower() not in UNKNOWN:
            yield line, {"quantity": "quantum efficiency", "value": value, "unit": "%", "wavelength": wavelength}
        return
    first, grid = found.curves["wavelength"]
    for name, (line, numbers) in found.curves.items():
        if name == "wavelength":
            continue
        values = numbers.split()
        if len(values) != len(grid.split()):
            rule = f"has {len(values)} numbers, but the wavelengths in line {first} are {len(grid.split())}; give as many"
            raise PhotositeError(rule, file=path, line=line, key=f"QE_spectral.{name}")
        quantity = "quantum efficiency" if name == "mono" else f"quantum efficiency {name}"
        for wavelength, value in zip(grid.split(), values, strict=True):
            yield line, {"quantity": quantity, "value": value, "unit": "%", "wavelength": wavelength}


def _read_elements(path: Path) -> _Elements:
    """Read all elements; names of columns are taken in any case, as the reference implementation does."""
    found, open_tags, texts = _Elements(), list[str](), list[str]()
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        if not open_tags:
            found.root, found.attributes, found.line = tag, attributes, parser.CurrentLineNumber
        open_tags.append(tag)
        texts.clear()

    def end(tag: str) -> None:
        text = parser.CurrentLineNumber, "".join(texts).strip()
        if len(open_tags) == 4:  # results, section, quantity, column
            found.texts[f"{open_tags[2]}/{tag.lower()}"] = text
        if len(open_tags) == 5 and open_tags[2] == "QE_spectral":
            found.curves[tag.lower()] = text
        open_tags.pop()
        texts.clear()

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, texts.append
    with reading(path, FIX):
        parser.Parse(path.read_bytes(), True)
    require(found.root == "results", "root element", found.root, f"a data sheet begins with <results>; {FIX}", file=path)
    return found
