"""Writes configs/color: tables of colorimetry from colour-science, and the forward matrices of the cameras in configs/cameras.

python docs/make_spectra.py
"""

import csv
from collections.abc import Iterable, Sequence

import numpy as np

from simulator import load_camera
from simulator.color import color_tables
from simulator.color.camera_matrices import CALIBRATION_LIGHTS, TRAINING_REFLECTANCES, response_key, search_forward_matrix
from simulator.color.colour_science import colour_science
from simulator.color.spectra import ILLUMINANTS
from simulator.config.document_merge import CONFIGS

FIRST_LINE = "Written by docs/make_spectra.py; changes made by hand are lost."


def write(file: str, source: str, names: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write one table; numbers with all their digits, NaN as an empty cell."""
    with open(color_tables.FOLDER / file, "w", encoding="utf-8", newline="") as out:
        out.write(f"# {FIRST_LINE}\n# Source: {source}\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(names)
        for row in rows:
            writer.writerow("" if cell != cell else repr(float(cell)) if isinstance(cell, float) else cell for cell in row)


def write_spectra(file: str, source: str, curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """Write curves (wavelengths, values) side by side, on all wavelengths [nm] that any of them has."""
    tables = {
        name: dict(zip(wavelengths.tolist(), values.tolist(), strict=True)) for name, (wavelengths, values) in curves.items()
    }
    grid = sorted({wavelength for table in tables.values() for wavelength in table})
    rows = ([wavelength, *(table.get(wavelength, float("nan")) for table in tables.values())] for wavelength in grid)
    write(file, source, ["wavelength_nm", *tables], rows)


def main() -> None:
    """Write all tables."""
    colour = colour_science()
    color_tables.FOLDER.mkdir(exist_ok=True)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    curves = {name: (observer.wavelengths, observer.values[:, i]) for i, name in enumerate(("x_bar", "y_bar", "z_bar"))}
    write_spectra(color_tables.OBSERVER, "CIE 018:2019, CIE 1931 2 degree observer, as colour-science has it", curves)
    lights = {name: colour.SDS_ILLUMINANTS[name] for name in ILLUMINANTS}
    curves = {name: (light.wavelengths, light.values) for name, light in lights.items()}
    write_spectra(color_tables.ILLUMINANTS, "CIE 015:2018 relative spectral powers, as colour-science has them", curves)
    patches = colour.SDS_COLOURCHECKERS[TRAINING_REFLECTANCES]
    curves = {name: (patch.wavelengths, patch.values) for name, patch in patches.items()}
    write_spectra(
        color_tables.COLOR_CHECKER, f"{TRAINING_REFLECTANCES} (Ohta 1997), reflectances, as colour-science has them", curves
    )
    basis = colour.recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019
    curves = {name: (basis.wavelengths, basis.values[:, i]) for i, name in enumerate(("red", "green", "blue"))}
    source = (
        "Mallett and Yuksel 2019, Spectral Primary Decomposition for Rendering with sRGB Reflectance, as colour-science has it"
    )
    write_spectra(color_tables.BASIS, source, curves)
    write_forward_matrices()


def write_forward_matrices() -> None:
    """Write the matrices that a search would find for each response of configs/cameras."""
    found = {}
    for path in sorted((CONFIGS / "cameras").glob("*.yaml")):
        response = load_camera(path.stem).response
        if response.quantum_efficiency.shape[1] != 3:
            continue
        curves = response.wavelengths_nm, response.quantum_efficiency
        for light in CALIBRATION_LIGHTS:
            matrix = search_forward_matrix(*curves, light)
            cameras = [*found.get((response_key(*curves), light), ("",))[0].split(), path.stem]
            found[response_key(*curves), light] = (" ".join(cameras), *(float(cell) for row in matrix for cell in row))
    names = ["response", "light", "cameras", *(f"{row}{column}" for row in "XYZ" for column in "RGB")]
    source = "camera_matrices.search_forward_matrix, for the responses of configs/cameras"
    write(color_tables.FORWARD_MATRICES, source, names, ([*key, *row] for key, row in found.items()))


if __name__ == "__main__":
    main()
