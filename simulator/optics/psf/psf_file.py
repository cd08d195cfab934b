"""Point spread functions from files: NumPy arrays, and text grids as optical design programs export them."""

import os
import re
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError, check_file, reading, require
from simulator.optics.lens.psf_list import DAMAGED, decode_text
from simulator.optics.psf.fraunhofer import odd
from simulator.optics.psf.psf_listing import read_listing
from simulator.optics.psf.psf_table import PsfTable

# Lengths in listings [um]. A micro sign in an 8-bit code page is decoded as the replacement character.
UNITS_UM = {"um": 1.0, "µm": 1.0, "μm": 1.0, "\ufffdm": 1.0, "micron": 1.0, "microns": 1.0, "mm": 1e3, "nm": 1e-3}
CELLS = 3  # per photosite and axis, of a kernel from a text file


def read_psf(path: str | os.PathLike[str], pitch_um: float) -> PsfTable:
    """Read a table of kernels.

    .npz: `kernels` (blur radii, fields, channels, size, size), and where they are more than one, `blur_radii_px` [photosites]
        and `fields`; `cells` per photosite and axis (default 1), `light` (default 1). See PsfTable.
    .npy: one kernel (size, size), or one per channel (channels, size, size), in photosites.
    .txt: a grid of numbers with a line `Data spacing is 0.250 um`, also in mm or nm, such as Zemax's listing of a Huygens or
        FFT PSF; its middle is the `Center point is: 41, 21` (column, row, from 1) or `row 21, column 41`, else that of the
        grid, and it is divided by its sum.
    .csv: a list of .txt or .npy files over blur radius, field and colour, see `read_listing`.
    pitch_um: photosite pitch of the camera [um].
    Raises PhotositeError for a file that is missing, damaged, or holds no such kernels.
    """
    label = os.fspath(path)
    check_file(label)
    readers = {".npz": _read_npz, ".npy": _read_npy, ".txt": _read_text, ".csv": _read_csv}
    reader = readers.get(Path(label).suffix.lower())
    if reader is None:
        raise PhotositeError("no known kind of PSF file; give .npz, .npy, .txt or .csv", file=label)
    with reading(label, DAMAGED):
        return reader(label, pitch_um)


def read_light(path: str | os.PathLike[str], pitch_um: float) -> float:
    """Read the fraction of a point's light that the kernels of a file hold, 1 of all files but .npz. See `read_psf`."""
    return read_psf(path, pitch_um).light if Path(path).suffix.lower() == ".npz" else 1.0


def _read_npz(label: str, pitch_um: float) -> PsfTable:
    with np.load(label, allow_pickle=False) as file:
        known = {"kernels", "blur_radii_px", "fields", "cells", "light"}
        strange = sorted(set(file.files) - known)
        require(not strange, "keys", ", ".join(strange), f"unknown; give {', '.join(sorted(known))}", file=label)
        require("kernels" in file.files, "keys", ", ".join(file.files), "`kernels` is missing", file=label)
        found = {name: file[name] for name in file.files}
    cells, light = (_one_number(found.get(name, np.ones(())), name, label) for name in ("cells", "light"))
    require(cells.is_integer(), "cells", f"{cells:g}", "give an odd integer of 1 or more", file=label)
    radii_px, fields = (np.atleast_1d(np.asarray(found.get(name, 0.0), np.float64)) for name in ("blur_radii_px", "fields"))
    return PsfTable(_numbers(found["kernels"], label), radii_px, fields, int(cells), pitch_um, light, label)


def _read_npy(label: str, pitch_um: float) -> PsfTable:
    kernels = _numbers(np.load(label, allow_pickle=False), label)
    rule = "give one kernel (size, size) or one per channel (channels, size, size)"
    require(kernels.ndim in (2, 3), "shape", kernels.shape, rule, file=label)
    kernels = kernels.reshape(1, 1, -1, *kernels.shape[-2:])
    return PsfTable(kernels, np.zeros(1), np.zeros(1), 1, pitch_um, source=label)


def _one_number(array: np.ndarray, name: str, label: str) -> float:
    require(array.size == 1 and array.dtype.kind in "fiu", name, array.tolist(), "give one real number", file=label)
    return float(array.item())


def _numbers(array: np.ndarray, label: str) -> np.ndarray:
    require(array.dtype.kind in "fiu", "type of kernels", array.dtype, "give real numbers", file=label)
    return array.astype(np.float64)


def _read_text(label: str, pitch_um: float) -> PsfTable:
    text = decode_text(Path(label).read_bytes())
    step_um, grid = _spacing_um(text, label), _grid(text, label)
    row, column = _centre(text, grid.shape, label)
    total = float(grid.sum())
    require(np.isfinite(total) and total > 0, "sum of the grid", total, "give numbers of light, 0 and above", file=label)
    cell_um = pitch_um / CELLS
    reach_um = step_um * (0.5 + max(column, row, grid.shape[1] - 1 - column, grid.shape[0] - 1 - row))
    size = odd(2.0 * reach_um / pitch_um) * CELLS
    down = _overlaps(grid.shape[0], row, step_um, size, cell_um)
    across = _overlaps(grid.shape[1], column, step_um, size, cell_um)
    kernel = down @ grid @ across.T / total
    return PsfTable(kernel[None, None, None], np.zeros(1), np.zeros(1), CELLS, pitch_um, source=label)


def _read_csv(label: str, pitch_um: float) -> PsfTable:
    def read_one(name: str, pitch_um: float) -> PsfTable:
        rule = "list .txt or .npy files"
        require(Path(name).suffix.lower() in (".txt", ".npy"), "file", Path(name).name or "nothing", rule, file=label)
        return read_psf(name, pitch_um)

    return read_listing(Path(label), pitch_um, read_one)


def _spacing_um(text: str, label: str) -> float:
    """Distance between the points of a listing [um]."""
    spacing = re.search(r"Data spacing is:?\s*([0-9.eE+-]+)[ \t]*([^\s.]*)", text)
    if spacing is None:
        raise PhotositeError("says no distance between its points; add a line such as `Data spacing is 0.250 um`", file=label)
    unit, wanted = spacing[2], "give a distance above 0 in um, mm or nm, such as 0.250 um"
    told = f"{spacing[1]} {unit}".rstrip()
    require(unit.lower() in UNITS_UM, "Data spacing", told, wanted, file=label)
    step_um = float(spacing[1]) * UNITS_UM[unit.lower()]
    require(0 < step_um < 1e4, "Data spacing", told, wanted, file=label)
    return step_um


def _centre(text: str, shape: tuple[int, ...], label: str) -> tuple[float, float]:
    """Row and column of the image point from 0: of the line `Center point is`, or the middle of the grid without one."""
    stated = re.search(r"Center point is:?[ \t]*(.*)", text)
    if stated is None:
        return (shape[0] - 1) / 2, (shape[1] - 1) / 2
    told = stated[1].strip()
    pair = re.fullmatch(r"(?P<column>\d+)\s*[,;\s]\s*(?P<row>\d+)\s*(\(column, row\))?\.?", told, re.IGNORECASE)
    named = re.fullmatch(r"row\D*(?P<row>\d+)\D+column\D*(?P<column>\d+)\.?", told, re.IGNORECASE)
    found = pair or named
    rule = "give column and row from 1 of a point of the grid, such as `41, 21` or `row 21, column 41`"
    if found is None:
        raise PhotositeError(rule, file=label, key="Center point", value=told or "nothing")
    row, column = int(found["row"]) - 1, int(found["column"]) - 1
    require(0 <= row < shape[0] and 0 <= column < shape[1], "Center point", told, rule, file=label)
    return row, column


def _grid(text: str, label: str) -> np.ndarray:
    """Parse the last block of lines that hold numbers only, (rows, columns) float64."""
    rows: list[list[float]] = []
    for line in reversed(text.rstrip().splitlines()):
        try:
            numbers = [float(word) for word in line.replace(",", " ").split()]
        except ValueError:
            break
        if rows and len(numbers) != len(rows[0]):
            break
        rows.append(numbers)
    if len(rows) < 3 or len(rows[0]) < 3:
        raise PhotositeError("holds no grid of numbers at its end; give three or more rows of equal length", file=label)
    return np.array(rows[::-1])


def _overlaps(count: int, middle: float, step_um: float, cells: int, cell_um: float) -> np.ndarray:
    """Fraction of each sample's width that lies in each cell, (cells, count); sums over the cells are 1."""
    centres, edges = (np.arange(count) - middle) * step_um, (np.arange(cells + 1) - cells / 2) * cell_um
    inside = np.clip(edges[:, None], centres - 0.5 * step_um, centres + 0.5 * step_um)
    return np.diff(inside, axis=0) / step_um
