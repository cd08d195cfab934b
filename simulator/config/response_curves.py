"""Colour response in YAML: relative curves on an even grid of wavelengths, and the scale that makes them absolute."""

import math
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from simulator.errors import require
from simulator.sensor.camera.camera import SpectralResponse
from simulator.units import Nanometres

GRID_PER_NM = 100  # wavelengths of measured curves are read to a hundredth of a nanometre
MOST_LINES = 20_000  # of a grid


@dataclass(frozen=True)
class WavelengthGrid:
    """Evenly spaced wavelengths of a table's lines.

    start_nm: of the first line.
    step_nm: from line to line, above 0 nm.
    """

    start_nm: Nanometres
    step_nm: Nanometres

    def __post_init__(self) -> None:
        require(self.start_nm > 0, "wavelengths.start", f"{self.start_nm:g} nm", "give a wavelength above 0 nm")
        require(self.step_nm > 0, "wavelengths.step", f"{self.step_nm:g} nm", "wavelengths ascend; give a step above 0 nm")


@dataclass(frozen=True)
class ResponseCurves:
    """Quantum efficiency by wavelength and colour.

    wavelengths: grid of the lines of `relative`.
    peak_quantum_efficiency: electrons per photon where `relative` is 1; above 0 and up to 1.
    relative: one line per wavelength, [red, green, blue], [red, clear, blue], [red, green, blue, white] or [mono], largest
        entry 1.
    """

    wavelengths: WavelengthGrid
    peak_quantum_efficiency: float
    relative: tuple[tuple[float, ...], ...]


def spectral_response(
    wavelengths: WavelengthGrid, peak_quantum_efficiency: float, relative: tuple[tuple[float, ...], ...], **_texts: object
) -> SpectralResponse:
    """Absolute quantum efficiency = peak * relative. Raises PhotositeError for a table that cannot be one."""
    peak = peak_quantum_efficiency
    require(0 < peak <= 1, "response.peak_quantum_efficiency", peak, "give electrons per photon, above 0 and up to 1")
    widths = sorted({len(line) for line in relative})
    rule = "every line needs the same number of values: 3 (red, green, blue), 4 with white, or 1 without a colour filter"
    require(widths in ([1], [3], [4]) and len(relative) > 1, "response.relative", f"lines of {widths} values", rule)
    table = np.array(relative, dtype=np.float64)
    require(table.min() >= 0, "response.relative", table.min(), "a response is not negative")
    largest = table.max()
    rule = "the largest entry is 1; the scale belongs in peak_quantum_efficiency"
    require(math.isclose(largest, 1.0, abs_tol=1e-3), "response.relative", f"largest {largest:g}", rule)
    return SpectralResponse(wavelengths.start_nm + wavelengths.step_nm * np.arange(len(table)), peak * table)


def even_grid(nodes_nm: np.ndarray, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the coarsest even grid that holds all wavelengths of a file (lines,), and these as they lie on it (nodes,) [nm].

    nodes_nm: two or more, ascending. Raises PhotositeError, which names the file, where two are the same to 0.01 nm, and for a
    grid of more than MOST_LINES lines.
    """
    places = np.rint(nodes_nm * GRID_PER_NM).astype(int).tolist()
    require(len(set(places)) == len(places), "wavelength", path, "names a wavelength twice; keep one line of each")
    step = reduce(math.gcd, (after - before for before, after in pairwise(places)))
    count = (places[-1] - places[0]) // step + 1
    rule = f"has no even grid of less than {MOST_LINES} lines; round its wavelengths to whole nanometres"
    require(count <= MOST_LINES, "wavelength", path, rule)
    return (places[0] + step * np.arange(count)) / GRID_PER_NM, np.array(places) / GRID_PER_NM


def response_text(response: SpectralResponse) -> dict[str, Any]:
    """Return plain data from which `spectral_response` makes this response, bit for bit where it was made of such data."""
    grid_nm, table = (np.asarray(values, dtype=np.float64) for values in (response.wavelengths_nm, response.quantum_efficiency))
    peak = float(table.max())
    relative = table / peak if peak > 0 else table
    for candidate in (np.nextafter(relative, 0.0), np.nextafter(relative, 2.0)):
        relative = np.where(peak * relative == table, relative, candidate)
    start_nm, step_nm = float(grid_nm[0]), float(grid_nm[1] - grid_nm[0])
    wavelengths = {"start": f"{start_nm!r} nm", "step": f"{step_nm!r} nm"}
    return {"wavelengths": wavelengths, "peak_quantum_efficiency": peak, "relative": relative.tolist()}
