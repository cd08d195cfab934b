"""EMVA 1288 data sheets of what was measured: an XML file for each colour plane."""

from collections.abc import Mapping
from pathlib import Path

from simulator.measurement.emva1288.files_to_planes import EmvaCamera
from simulator.measurement.emva1288.plane import Nonuniformity
from simulator.measurement.emva1288.xml_sheet import DataSheet, derived_values, write_xml_sheet
from simulator.measurement.statistics.spatial_variance import Stack, spatial_variance

PARTS = {"total": "", "row": "_row", "column": "_col", "pixel": "_pixel"}  # of ours, and ends of names in the file


def measured_sheet(
    found: EmvaCamera, plane: str, texts: Mapping[str, str] | None = None, about: Mapping[str, float] | None = None
) -> DataSheet:
    """Return the data sheet of a plane.

    texts, about: what the raw files do not tell, such as the vendor, and numbers of the section `info`.
    """
    one = found.planes[plane]
    values = {
        "K": one.gain.value,
        "sigma_y_dark": one.dark.variance_dn2**0.5,
        "sigma_d": one.read_noise.value,
        "u_y_dark": one.dark.mean_dn,
        "u_e_sat": one.saturation_e,
        "LE_min": 100.0 * one.linearity.least,
        "LE_max": 100.0 * one.linearity.greatest,
        **(about or {}),
        **_spatial(found.light_stacks[plane], ""),
        **_spatial(found.dark_stacks[plane], "_dark"),
        **_nonuniformity("DSNU1288", one.dsnu, 1.0),
        **_nonuniformity("PRNU1288", one.prnu, 100.0),
    }
    if found.counts_photons:
        values |= {"QE": 100.0 * one.quantum_efficiency.value, "wavelength": found.wavelengths_nm[plane]}
    if plane in found.dark_current_e_per_s:
        mean, variance = found.dark_current_e_per_s[plane]
        values |= {"u_I_mean": mean.value, "u_I_var": variance.value}
    return DataSheet({**(texts or {}), "plane": plane}, derived_values(values))


def write_measured_sheets(
    found: EmvaCamera, folder: Path, texts: Mapping[str, str] | None = None, about: Mapping[str, float] | None = None
) -> list[Path]:
    """Write the data sheet of each plane, emva_PLANE.xml; see `measured_sheet`. Raises PhotositeError."""
    paths = []
    for plane in found.planes:
        paths.append(folder / f"emva_{plane}.xml")
        write_xml_sheet(measured_sheet(found, plane, texts, about), paths[-1])
    return paths


def _spatial(stack: Stack, end: str) -> dict[str, float]:
    variance = spatial_variance(stack)
    parts = {f"s_2_y{name}{end}": getattr(variance, f"{part}_dn2") for part, name in PARTS.items()}
    return {f"sigma_2_y_stack{end}": stack.variance_dn2, **parts}


def _nonuniformity(name: str, pattern: Nonuniformity, scale: float) -> dict[str, float]:
    return {f"{name}{ending}": scale * getattr(pattern, part) for part, ending in PARTS.items()}
