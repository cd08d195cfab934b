"""EMVA 1288 data sheets in XML: the results file of the standard's reference implementation (github.com/EMVA1288/emva1288).

The standard defines no schema of its own. The reference implementation has one, and asks of every implementation that is to be
certified that it writes its results so: `<results>`, sections, one element for each quantity by its name there, and in it
`<Short>`, `<Symbol>`, `<Value>` and `<Unit>`, or `<Data>` with arrays, whose numbers are separated by blanks. A file holds one
colour plane at one setting.

What the schema has no name for stands where its reader does not stumble: texts are attributes of `<results>`; numbers of the
camera are in the section `info`; the curves of quantum efficiency are the data of `QE_spectral`.
"""

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np

from simulator.atomic_files import atomic_write
from simulator.raw.software import software

STANDARD = "EMVA 1288 Release 4.0 Linear"
CURVES = "QE_spectral"
# Section -> name -> (words, symbol, unit). Names and sections are those of the reference implementation, but for `info`.
QUANTITIES: dict[str, dict[str, tuple[str, str, str]]] = {
    "info": {
        "width": ("Width", "", "px"),
        "height": ("Height", "", "px"),
        "pixel_size": ("Pixel size", "", "um"),
        "bit_depth": ("Bit depth", "", "bit"),
        "wavelength": ("Wavelength", "lambda", "nm"),
        "u_y_dark": ("Dark signal", "mu_y.dark", "DN"),
    },
    "sensitivity": {
        "K": ("Overall system gain", "K", "DN/e-"),
        "inverse_K": ("Inverse of overall system gain", "1/K", "e-/DN"),
        "R": ("Responsivity", "R", "DN/p"),
        "QE": ("Quantum efficiency", "eta", "%"),
        "sigma_y_dark": ("Temporal dark noise", "sigma_y.dark", "DN"),
        "sigma_d": ("Temporal dark noise", "sigma_d", "e-"),
        "u_p_min": ("Absolute sensitivity threshold", "mu_p.min", "p"),
        "u_p_min_area": ("Absolute sensitivity threshold per area", "mu_p.min.area", "p/um2"),
        "u_e_min": ("Absolute sensitivity threshold", "mu_e.min", "e-"),
        "u_e_min_area": ("Absolute sensitivity threshold per area", "mu_e.min.area", "e-/um2"),
        "u_p_sat": ("Saturation capacity", "mu_p.sat", "p"),
        "u_p_sat_area": ("Saturation capacity per area", "mu_p.sat.area", "p/um2"),
        "u_e_sat": ("Saturation capacity", "mu_e.sat", "e-"),
        "u_e_sat_area": ("Saturation capacity per area", "mu_e.sat.area", "e-/um2"),
        "SNR_max": ("Maximum signal-to-noise ratio", "SNR_max", ""),
        "SNR_max_dB": ("Maximum signal-to-noise ratio", "SNR_max.dB", "dB"),
        "SNR_max_bit": ("Maximum signal-to-noise ratio", "SNR_max.bit", "bit"),
        "inverse_SNR_max": ("Inverse of maximum signal-to-noise ratio", "1/SNR_max", "%"),
        "DR": ("Dynamic range", "DR", ""),
        "DR_dB": ("Dynamic range", "DR_dB", "dB"),
        CURVES: ("Quantum efficiency by wavelength [nm]", "eta(lambda)", "%"),
    },
    "linearity": {
        "LE_min": ("Least linearity error", "LE_min", "%"),
        "LE_max": ("Greatest linearity error", "LE_max", "%"),
    },
    "dark_current": {
        "u_I_mean_DN": ("Dark current from the mean", "mu_I.mean.DN", "DN/s"),
        "u_I_mean": ("Dark current from the mean", "mu_I.mean", "e-/s"),
        "u_I_var_DN": ("Dark current from the variance", "mu_I.var.DN", "DN/s"),
        "u_I_var": ("Dark current from the variance", "mu_I.var", "e-/s"),
    },
    "spatial": {
        "sigma_2_y_stack": ("Temporal variance of the light stack", "sigma2_y.stack", "DN2"),
        "sigma_2_y_stack_dark": ("Temporal variance of the dark stack", "sigma2_y.stack.dark", "DN2"),
        "s_2_y": ("Spatial variance, light", "s2_y", "DN2"),
        "s_2_y_row": ("Spatial variance of rows, light", "s2_y.row", "DN2"),
        "s_2_y_col": ("Spatial variance of columns, light", "s2_y.col", "DN2"),
        "s_2_y_pixel": ("Spatial variance of photosites, light", "s2_y.pixel", "DN2"),
        "s_2_y_dark": ("Spatial variance, dark", "s2_y.dark", "DN2"),
        "s_2_y_row_dark": ("Spatial variance of rows, dark", "s2_y.row.dark", "DN2"),
        "s_2_y_col_dark": ("Spatial variance of columns, dark", "s2_y.col.dark", "DN2"),
        "s_2_y_pixel_dark": ("Spatial variance of photosites, dark", "s2_y.pixel.dark", "DN2"),
        "DSNU1288": ("DSNU", "DSNU_1288", "e-"),
        "DSNU1288_DN": ("DSNU", "DSNU_1288.DN", "DN"),
        "DSNU1288_row": ("DSNU of rows", "DSNU_1288.row", "e-"),
        "DSNU1288_col": ("DSNU of columns", "DSNU_1288.col", "e-"),
        "DSNU1288_pixel": ("DSNU of photosites", "DSNU_1288.pixel", "e-"),
        "PRNU1288": ("PRNU", "PRNU_1288", "%"),
        "PRNU1288_row": ("PRNU of rows", "PRNU_1288.row", "%"),
        "PRNU1288_col": ("PRNU of columns", "PRNU_1288.col", "%"),
        "PRNU1288_pixel": ("PRNU of photosites", "PRNU_1288.pixel", "%"),
    },
}


@dataclass(frozen=True)
class DataSheet:
    """One colour plane at one setting.

    texts: attributes, such as vendor, model, plane, iso. values: by the names of QUANTITIES, in their units; what is not
    known is left out. efficiency: wavelength [nm] and curves of quantum efficiency [%] by colour.
    """

    texts: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    efficiency: Mapping[str, np.ndarray] = field(default_factory=dict)


def derived_values(values: Mapping[str, float]) -> dict[str, float]:
    """Return the finite values, with those that follow from K, QE, sigma_y_dark, u_e_sat and pixel_size.

    u_p_min is (sigma_y.dark / K + 1/2) / eta, DR u_p.sat / u_p.min, SNR_max the root of u_e.sat (EMVA 1288 R4.0 Linear).
    """
    gain, saturation_e = values["K"], values["u_e_sat"]
    threshold_e = values["sigma_y_dark"] / gain + 0.5
    efficiency = 0.01 * values.get("QE", math.nan)
    snr = math.sqrt(saturation_e)
    found = {
        "inverse_K": 1.0 / gain,
        "R": gain * efficiency,
        "u_e_min": threshold_e,
        "u_p_min": threshold_e / efficiency,
        "u_p_sat": saturation_e / efficiency,
        "SNR_max": snr,
        "SNR_max_dB": 20.0 * math.log10(snr),
        "SNR_max_bit": math.log2(snr),
        "inverse_SNR_max": 100.0 / snr,
        "DR": saturation_e / threshold_e,
        "DR_dB": 20.0 * math.log10(saturation_e / threshold_e),
        "DSNU1288_DN": gain * values.get("DSNU1288", math.nan),
        "u_I_mean_DN": gain * values.get("u_I_mean", math.nan),
        "u_I_var_DN": gain * values.get("u_I_var", math.nan),
    }
    area_um2 = values.get("pixel_size", math.nan) ** 2
    found |= {f"{name}_area": found.get(name, saturation_e) / area_um2 for name in ("u_p_min", "u_e_min", "u_p_sat", "u_e_sat")}
    return {name: value for name, value in {**found, **values}.items() if math.isfinite(value)}


def sheet_rows(sheet: DataSheet) -> Iterator[tuple[str, str, str, str, float]]:
    """Yield section, name, words, unit and value of each number that is known, in the order of QUANTITIES."""
    for section, quantities in QUANTITIES.items():
        for name, (words, _, unit) in quantities.items():
            if name in sheet.values:
                yield section, name, words, unit, sheet.values[name]


def write_xml_sheet(sheet: DataSheet, path: str | os.PathLike) -> None:
    """Write a data sheet. Raises PhotositeError when it cannot be written."""
    root = ElementTree.Element("results", {"standard": STANDARD, "software": software(), **sheet.texts})
    for section, quantities in QUANTITIES.items():
        part = ElementTree.Element(section)
        for name, (words, symbol, unit) in quantities.items():
            curves = sheet.efficiency if name == CURVES else {}
            if name not in sheet.values and not curves:
                continue
            element = ElementTree.SubElement(part, name)
            ElementTree.SubElement(element, "Short").text = words
            ElementTree.SubElement(element, "Symbol").text = symbol
            if curves:
                data = ElementTree.SubElement(element, "Data")
                for curve, numbers in curves.items():
                    ElementTree.SubElement(data, curve).text = " ".join(repr(float(number)) for number in numbers)
            else:
                ElementTree.SubElement(element, "Value").text = repr(sheet.values[name])
            ElementTree.SubElement(element, "Unit").text = unit
        if len(part):
            root.append(part)
    ElementTree.indent(root)
    with atomic_write(path) as temporary:
        temporary.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
