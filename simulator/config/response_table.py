"""Quantum efficiency from a CSV file, as data sheets and spectrometers give it, into the form that a camera file has."""

import csv
import re
from pathlib import Path

import numpy as np

from simulator.config.document import Document, Place
from simulator.config.response_curves import even_grid, response_text
from simulator.errors import PhotositeError, reading
from simulator.sensor.camera.camera import SpectralResponse

_HEAD = re.compile(r"(?P<name>[a-z_]+?)[_ ]*(?:[\[(]? *(?P<unit>nm|um|%|percent) *[\])]?)?")
_NAMES = {
    **dict.fromkeys(("wavelength", "lambda", "wavelengths"), "wavelength"),
    **dict.fromkeys(("red", "r"), "red"),
    **dict.fromkeys(("green", "g"), "green"),
    **dict.fromkeys(("blue", "b"), "blue"),
    **dict.fromkeys(("mono", "qe", "grey", "gray", "quantum_efficiency"), "mono"),
}
_FIX = "its first line names the columns, such as wavelength_nm,red,green,blue or wavelength_nm,qe"


def read_response_table(path: Path) -> Document:
    """Return the curves of a CSV file as the section `response` of a camera file.

    The first line names the columns: wavelength, and red, green and blue, or qe of a sensor without colour filters. A unit may
    stand behind a name: nm or um, and % where the numbers are percent, else they are electrons per photon, 0 to 1. Columns are
    parted by commas, semicolons or tabulators; lines that begin with # are left out. Lines in any order; between them the curve
    is straight, and the table is written on the coarsest even grid that holds all of them.
    Raises PhotositeError for a file that is missing or damaged, for other columns, and for numbers that are no efficiency.
    """
    names, units, rows = _read_lines(path)
    columns = {name: rows[:, index] * units[index] for index, name in enumerate(names)}
    order = np.argsort(columns["wavelength"])
    nodes_nm = columns["wavelength"][order]
    curves = np.stack([columns[name][order] for name in ("red", "green", "blue", "mono") if name in columns], axis=1)
    _check(path, nodes_nm, curves)
    grid_nm, nodes_nm = even_grid(nodes_nm, path)
    even = np.stack([np.interp(grid_nm, nodes_nm, curve) for curve in curves.T], axis=1)
    return Document(response_text(SpectralResponse(grid_nm, even)), {(): Place(str(path), path.parent)})


def _read_lines(path: Path) -> tuple[list[str], list[float], np.ndarray]:
    """Return the names of the columns, the factor of each to nm or electrons per photon, and the numbers (lines, columns)."""
    with reading(path, "export it again as CSV"):
        text = path.read_text(encoding="utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    head = lines[0] if lines else ""
    separator = next((mark for mark in "\t;" if mark in head), ",")
    first, *rest = list(csv.reader(lines, delimiter=separator)) or [[]]
    found = [_HEAD.fullmatch(cell.strip().lower()) for cell in first]
    names = [_NAMES.get(match["name"], "") if match else "" for match in found]
    good = sorted(names) in (["blue", "green", "red", "wavelength"], ["mono", "wavelength"])
    rule = f"its columns are {','.join(first)[:80] or 'none'}; {_FIX}"
    if not good:
        raise PhotositeError(rule, file=path)
    units = [_factor(name, match["unit"] if match else None, path) for name, match in zip(names, found, strict=True)]
    if len(rest) < 2:
        raise PhotositeError(f"holds {len(rest)} lines of numbers; a curve needs two or more", file=path)
    return names, units, np.array([_numbers(row, len(names), path, number) for number, row in enumerate(rest, 1)])


def _factor(name: str, unit: str | None, path: Path) -> float:
    units = {None: 1.0, "nm": 1.0, "um": 1e3} if name == "wavelength" else {None: 1.0, "%": 0.01, "percent": 0.01}
    if unit not in units:
        raise PhotositeError(f"{name} has the unit {unit}; give {' or '.join(str(one) for one in units if one)}", file=path)
    return units[unit]


def _numbers(row: list[str], count: int, path: Path, number: int) -> list[float]:
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        rule = f"line {number} of its numbers is {','.join(row)[:80]}; give {count} finite numbers in each, with decimal points"
        raise PhotositeError(rule, file=path)
    return values


def _check(path: Path, nodes_nm: np.ndarray, curves: np.ndarray) -> None:
    if not (nodes_nm[0] >= 100 and nodes_nm[-1] <= 10_000):
        raise PhotositeError(
            f"wavelengths run from {nodes_nm[0]:g} nm to {nodes_nm[-1]:g} nm; give nm, or name the column wavelength_um",
            file=path,
        )
    if not (curves.min() >= 0 and 0 < curves.max() <= 1):
        rule = (
            f"efficiencies run from {curves.min():g} to {curves.max():g} electrons per photon, which lie between 0 and 1; "
            "write % behind a column's name for percent; where only the shape is known, divide by the largest and set "
            "response.peak_quantum_efficiency"
        )
        raise PhotositeError(rule, file=path)
