"""EMVA 1288 data sheets as cameras: `camera: sheet.csv`, one line for each number of the summary data sheet, or `sheet.xml`.

The names are those of EMVA Standard 1288, Release 4.0, of the summary data sheet and its symbols, in any case and punctuation.
`emva_xml.py` has those of XML.
"""

import csv
import io
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from simulator.config.document import Document, Keys, Place
from simulator.config.emva_xml import Entry, read_xml_entries
from simulator.config.quantity import NUMBER
from simulator.config.response_curves import even_grid
from simulator.errors import PhotositeError, reading, require

SUFFIXES = (".csv", ".xml")
ISO = 100  # the sheet is of one gain setting, which gets this ISO where the sheet tells none
COLUMNS = ("quantity", "value", "unit", "wavelength")
MOST_EFFICIENCY = 1.02  # of a sheet: noise of the measurement lifts an efficiency near 1 above it
LONGEST_NM = 10_000.0
FLAT_NM = (400.0, 700.0)  # a single quantum efficiency is taken over this range
ROUNDING_DN2 = 1.0 / 12.0  # variance of the ADC's rounding, part of the noise in a raw frame (EMVA 1288, equation 8)
COLOURS = ("red", "green", "blue")
TEXTS = {"vendor": "make", "manufacturer": "make", "make": "make", "model": "model", "colour filter": "cfa", "cfa": "cfa"}
WHOLE = {"width": "width", "height": "height", "bit depth": "bit_depth", "number of bits": "bit_depth", "iso": "iso"}
# Name -> (key of this module, factor by unit). Units are written without blanks.
NUMBERS: dict[str, tuple[str, dict[str, float]]] = {
    "pixel size": ("pitch_um", {"um": 1.0, "µm": 1.0, "mm": 1e3}),
    "pixel pitch": ("pitch_um", {"um": 1.0, "µm": 1.0, "mm": 1e3}),
    "quantum efficiency": ("eta", {"%": 0.01, "": 1.0, "e-/p": 1.0}),
    "overall system gain": ("gain", {"dn/e-": 1.0}),
    "system gain": ("gain", {"dn/e-": 1.0}),
    "inverse of overall system gain": ("inverse_gain", {"e-/dn": 1.0}),
    "temporal dark noise": ("dark_noise", {"e-": 1.0, "dn": -1.0}),
    "saturation capacity": ("saturation_e", {"e-": 1.0, "ke-": 1e3}),
    "dsnu1288": ("dsnu", {"e-": 1.0, "dn": -1.0}),
    "dsnu": ("dsnu", {"e-": 1.0, "dn": -1.0}),
    "prnu1288": ("prnu", {"%": 0.01, "": 1.0}),
    "prnu": ("prnu", {"%": 0.01, "": 1.0}),
    "dark current": ("dark_current", {"e-/s": 1.0}),
    "dark signal": ("black_dn", {"dn": 1.0}),
    "black level": ("black_dn", {"dn": 1.0}),
}
LEFT_OUT = (  # follow from the others
    "snrmax", "maximum snr", "dynamic range", "absolute sensitivity threshold", "linearity error", "le", "non whiteness factor",
)  # fmt: skip


@dataclass
class _Sheet:
    """Numbers of a sheet and the line of each. In DN where `dark_noise_dn`, `dsnu_dn` say so."""

    texts: dict[str, str | int] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    efficiencies: dict[str, dict[float, float]] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)


def read_emva_sheet(path: Path, stated: Mapping[str, Any]) -> Document:
    """Return the camera section that a sheet states, with its places. Columns of CSV: quantity, value, unit, wavelength [nm].

    stated: keys of the camera that stand beside `base`, which the sheet need not have.
    Raises PhotositeError with the line for a sheet with an unknown quantity or unit, a number that is none, and one that lacks
    what a camera needs.
    """
    sheet = _Sheet()
    for line, entry in read_xml_entries(path) if path.suffix.lower() == ".xml" else _read_csv_entries(path):
        _read_entry(entry, sheet, path, line)
    return _camera(sheet, path, stated)


def _read_csv_entries(path: Path) -> list[Entry]:
    """Return line and columns of each line that is no comment. Raises PhotositeError."""
    with reading(path, "write a CSV file with the columns quantity, value, unit"):
        rows = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"))))
    header = [name.strip().lower() for name in rows[0]] if rows else []
    rule = f"give the columns {', '.join(COLUMNS)}, of which wavelength may be left out"
    good = set(header) <= set(COLUMNS) and {"quantity", "value"} <= set(header)
    require(good, "columns", ", ".join(header) or "none", rule, file=path)
    entries = [(line, dict(zip(header, (word.strip() for word in row), strict=False))) for line, row in enumerate(rows[1:], 2)]
    return [(line, entry) for line, entry in entries if entry.get("quantity") and not entry["quantity"].startswith("#")]


def _plain(name: str) -> str:
    """Return a name without symbol, punctuation and case: "Overall system gain (K)" is "overall system gain"."""
    return " ".join(re.sub(r"\(.*?\)|[^\w\s]|(?<=\w)_", " ", name.lower()).split())


def _read_entry(entry: dict[str, str], sheet: _Sheet, path: Path, line: int) -> None:
    name, text = _plain(entry["quantity"]), entry.get("value", "")
    unit = re.sub(r"\s", "", entry.get("unit", "")).lower().replace("electrons", "e-").replace("−", "-").replace("⁻", "-")

    def refused(rule: str) -> PhotositeError:
        return PhotositeError(rule, file=path, line=line, key=entry["quantity"], value=text)

    if name in LEFT_OUT:
        return
    colour = next((colour for colour in COLOURS if name == f"quantum efficiency {colour}"), "")
    name = "quantum efficiency" if colour else name
    if name in TEXTS:
        sheet.texts[TEXTS[name]], sheet.lines[TEXTS[name]] = text, line
        return
    number = float(text) if re.fullmatch(rf"[+-]?{NUMBER}", text) else math.nan
    if not 0 <= number < math.inf:
        raise refused("is no number of 0 or more; write it with a decimal point and its unit in the column unit")
    if name in WHOLE:
        if number != int(number):
            raise refused("is a whole number")
        sheet.texts[WHOLE[name]], sheet.lines[WHOLE[name]] = int(number), line
        return
    if name not in NUMBERS:
        raise refused(f"is no quantity that is known; known are {', '.join([*TEXTS, *WHOLE, *NUMBERS])}")
    key, factors = NUMBERS[name]
    if unit not in factors:
        raise refused(f"has the unit {unit or 'nothing'}; write one of {', '.join(each or 'nothing' for each in factors)}")
    key = f"{key}_dn" if factors[unit] < 0 else key
    value = number * abs(factors[unit])
    if key == "eta":
        wavelength = entry.get("wavelength", "").lower().removesuffix("nm").strip()
        if wavelength and not re.fullmatch(NUMBER, wavelength):
            raise refused(f"has a wavelength of {wavelength}; give a number in nm")
        sheet.efficiencies.setdefault(colour, {})[float(wavelength or 0.0)] = value
    elif key in sheet.numbers:
        raise refused("is stated twice; keep one line")
    sheet.numbers[key], sheet.lines[key] = value, line


def _check_complete(sheet: _Sheet, path: Path, stated: Mapping[str, Any]) -> None:
    """Raise PhotositeError for a sheet without what a camera needs and no key beside it states."""
    numbers = sheet.numbers
    needed: dict[str, Callable[[], bool]] = {
        "width": lambda: "width" in sheet.texts or "width" in stated,
        "height": lambda: "height" in sheet.texts or "height" in stated,
        "bit depth": lambda: "bit_depth" in sheet.texts or isinstance(stated.get("bit_depth"), int),
        "pixel size": lambda: "pitch_um" in numbers or "pixel_pitch" in stated,
        "quantum efficiency": lambda: "eta" in numbers or "response" in stated,
        "overall system gain": lambda: "gain" in numbers or "inverse_gain" in numbers,
        "temporal dark noise": lambda: "dark_noise" in numbers or "dark_noise_dn" in numbers,
    }
    missing = [name for name, is_there in needed.items() if not is_there()]
    rule = "is missing; add a line for it, or state it beside the sheet: {base: SHEET, bit_depth: 12}"
    require(not missing, "quantity", ", ".join(missing), rule, file=path)


def _camera(sheet: _Sheet, path: Path, stated: Mapping[str, Any]) -> Document:
    """Return the camera as plain data, and where each section was written."""
    _check_complete(sheet, path, stated)
    numbers, lines = sheet.numbers, sheet.lines
    gain = numbers["gain"] if "gain" in numbers else 1.0 / max(numbers["inverse_gain"], 1e-12)
    noise_dn = gain * numbers.get("dark_noise", 0.0)
    if "dark_noise" not in numbers:
        noise_dn = math.sqrt(max(numbers["dark_noise_dn"] ** 2 - ROUNDING_DN2, 0.0))
    stages: dict[str, Any] = {"photon_shot_noise": {}}
    bits = sheet.texts["bit_depth"] if "bit_depth" in sheet.texts else stated["bit_depth"]
    black_dn, white_dn = numbers.get("black_dn", 0.0), 2.0 ** int(bits) - 1.0
    well_e = numbers.get("saturation_e")
    if well_e is not None and black_dn + gain * well_e < white_dn:  # else the ADC saturates first
        stages["full_well"] = {"capacity": f"{well_e!r} e-"}
    if (rate := numbers.get("dark_current", 0.0)) > 0:
        stages["dark_current"] = {"rate": f"{rate!r} e-/s"}
    dsnu_e = numbers.get("dsnu", numbers.get("dsnu_dn", 0.0) / gain)
    for stem, sigma, unit in (("dsnu", dsnu_e, " e-"), ("prnu", numbers.get("prnu", 0.0), "")):
        if sigma > 0:
            stages[stem] = {"sigma": f"{sigma!r}{unit}" if unit else sigma}
    response, note = _response(sheet.efficiencies, path) if sheet.efficiencies else ({}, "")
    iso = sheet.texts.pop("iso", ISO)
    data: dict[str, Any] = {
        "source": f"measured, EMVA 1288 data sheet {path.name}{note}",
        "make": "unknown",
        "model": path.stem,
        "cfa": "RGGB" if set(sheet.efficiencies) == set(COLOURS) else "MONO",
        **sheet.texts,
        "black_level": f"{black_dn!r} DN",
        "iso_table": {iso: {"gain": f"{gain!r} DN/e-", "read_noise": f"{noise_dn!r} DN"}},
        "stages": stages,
    }
    if "pitch_um" in numbers:
        data["pixel_pitch"] = f"{numbers['pitch_um']!r} um"
    if response:
        data["response"] = response
    places: dict[Keys, Place] = {(): Place(str(path), path.parent)}
    written = {"pixel_pitch": "pitch_um", "black_level": "black_dn", "iso_table": "gain", "response": "eta"}
    for key in data:
        line = lines.get(key, lines.get(written.get(key, ""), None))
        places[(key,)] = Place(str(path), path.parent, line)
    return Document(data, places)


def _response(efficiencies: dict[str, dict[float, float]], path: Path) -> tuple[dict[str, Any], str]:
    """Return the response section and what of it is assumed."""
    colours = [""] if set(efficiencies) == {""} else list(COLOURS)
    rule = "give one for all, or one or more of each of red, green and blue"
    require(set(efficiencies) == set(colours), "quantum efficiency", ", ".join(efficiencies), rule, file=path)
    curves = [efficiencies[colour] for colour in colours]
    sampled = sorted({nm for curve in curves for nm in curve})
    note = ""
    if len(sampled) == 1:
        grid, note = (
            np.array(FLAT_NM),
            f"; its quantum efficiency is assumed to be the same from {FLAT_NM[0]:g} to {FLAT_NM[1]:g} nm",
        )
    else:
        rule = "give each with its wavelength in nm, in the column wavelength"
        require(sampled[0] > 0, "quantum efficiency", "without a wavelength", rule, file=path)
        longest = f"{sampled[-1]:g} nm"
        require(sampled[-1] <= LONGEST_NM, "wavelength", longest, f"give nm, up to {LONGEST_NM:g}", file=path)
        grid, nodes_nm = even_grid(np.array(sampled), path)
        placed = dict(zip(sampled, nodes_nm.tolist(), strict=True))
        curves = [{placed[nm]: efficiency for nm, efficiency in curve.items()} for curve in curves]
    table = np.stack([np.interp(grid, sorted(curve), [curve[nm] for nm in sorted(curve)]) for curve in curves], axis=1)
    peak = float(table.max())
    rule = "give shares above 0 and up to 1, or up to 100 %"
    require(0 < peak <= MOST_EFFICIENCY, "quantum efficiency", peak, rule, file=path)
    if peak > 1.0:
        note += f"; its quantum efficiency of {100.0 * peak:.2f} % is taken as 100 %, the most there is"
        table, peak = np.minimum(table, 1.0), 1.0
    wavelengths = {"start": f"{float(grid[0])!r} nm", "step": f"{float(grid[1] - grid[0])!r} nm"}
    return {"wavelengths": wavelengths, "peak_quantum_efficiency": peak, "relative": (table / peak).tolist()}, note
