"""Tables of colorimetry in `configs/color`, which `docs/make_spectra.py` writes from colour-science.

Importing that package takes a second, longer than a small frame; the tables take milliseconds. Each file says its source.
"""

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

CONFIGS = next(  # in a wheel it lies inside the package
    (folder for parent in Path(__file__).resolve().parents[1:3] if (folder := parent / "configs").is_dir()),
    Path(__file__).resolve().parents[2] / "configs",
)
FOLDER = CONFIGS / "color"
OBSERVER, ILLUMINANTS, COLOR_CHECKER, BASIS = (
    f"{name}.csv" for name in ("observer_cie_1931", "illuminants", "color_checker", "reflectance_basis_mallett_2019")
)
FORWARD_MATRICES = "forward_matrices.csv"


@dataclass(frozen=True)
class SpectralTable:
    """Curves over wavelength.

    wavelengths_nm: (n,) ascending. curves: name to (n,) values; NaN where a curve has no entry.
    """

    wavelengths_nm: np.ndarray
    curves: dict[str, np.ndarray]

    def curve(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the wavelengths [nm] at which a curve has entries, and these."""
        there = ~np.isnan(self.curves[name])
        return self.wavelengths_nm[there], self.curves[name][there]

    def columns(self) -> np.ndarray:
        """Return all curves side by side, (n, curves)."""
        return np.stack(list(self.curves.values()), axis=-1)


def read_rows(file: str) -> list[list[str]]:
    """Return the cells of a table, row by row: first the names of columns. Lines that begin with # are left out."""
    with open(FOLDER / file, encoding="utf-8", newline="") as lines:
        return list(csv.reader(line for line in lines if not line.startswith("#")))


@cache
def read_spectra(file: str) -> SpectralTable:
    """Return a table whose first column is the wavelength [nm]; empty cells are NaN."""
    names, *rows = read_rows(file)
    values = np.array([[float(cell or "nan") for cell in row] for row in rows])
    values.setflags(write=False)
    return SpectralTable(values[:, 0], dict(zip(names[1:], values[:, 1:].T, strict=True)))


@cache
def read_forward_matrices() -> dict[tuple[str, str], tuple[tuple[float, ...], ...]]:
    """Return forward matrices by (hash of a response, light), as `camera_matrices` searches them."""
    _, *rows = read_rows(FORWARD_MATRICES)
    return {
        (key, light): tuple(tuple(map(float, cells[start : start + 3])) for start in (0, 3, 6))
        for key, light, _, *cells in rows
    }
