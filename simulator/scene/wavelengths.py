"""Wavelengths of a spectral cube: from channel names or a file, cut to those that scenes may have."""

import re
from pathlib import Path

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM
from simulator.errors import PhotositeError, check_file, reading, require
from simulator.scene.pixel_file import PixelFile, load_array

FIRST_NM, LAST_NM = WAVELENGTHS_NM[0], WAVELENGTHS_NM[-1]
# "450nm", "w450", "450", and the layout "S0.450,5nm", "T.450nm" with SI prefixes of metre or hertz (Fichet, Pacanowski and
# Wilkie 2021, JCGT 10(3), section 3), written by ART, pbrt-v4 and colour-science.
_NUMBER = r"\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?"
_CHANNEL = re.compile(
    rf"(?:(?P<group>[A-Za-z_].*?)\.)??(?:[wW]?(?P<bare>\d{{3,4}}(?:[.,]\d+)?)|[wW]?(?P<number>{_NUMBER})\s*"
    r"(?P<prefix>da|[YZEPTGMkhdcmunp])?(?P<unit>m|Hz))"
)
_BIN = re.compile(rf"(?P<low>{_NUMBER})-(?P<high>{_NUMBER})\s*nm")  # "400.00-410.00nm" of Mitsuba 0.6
_RERADIATION = re.compile(rf"T\.{_NUMBER}[A-Za-z]*")  # of a bispectral image: light of one wavelength for that of another
_POLARISED = re.compile(r"S[123]")  # Stokes components beside the radiance S0
_EXPONENTS = dict(zip("YZEPTGMkhdcmunp", (24, 21, 18, 15, 12, 9, 6, 3, 2, -1, -2, -3, -6, -9, -12), strict=True)) | {"da": 1}
SPEED_OF_LIGHT_NM_PER_S = 2.99792458e17  # SI, exact
QUANTITY_GROUPS = {"radiance": "S0", "reflectance": "T"}  # Fichet et al.: Stokes component S0, and reflectance


def named_wavelengths(file: PixelFile, quantity: str = "radiance") -> list[tuple[float, int]]:
    """(wavelength [nm], channel index) of the channels whose names state one.

    quantity: "radiance" or "reflectance", which tells S0 from T where a file has both. Raises PhotositeError for a file without
    such names or with several groups of them, and for reflectances that are to be radiance.
    """
    found: dict[str, list[tuple[float, int]]] = {}
    for index, name in enumerate(file.channels):
        group, wavelength_nm = parse_channel(name)
        if (
            index not in file.bad
            and wavelength_nm is not None
            and not _POLARISED.fullmatch(group)
            and not _RERADIATION.fullmatch(group)
        ):
            found.setdefault(group, []).append((wavelength_nm, index))
    if quantity == "radiance" and set(found) == {"T"}:
        rule = f"{file.path} holds reflectances (channels T); write quantity: reflectance, with the luminance of white"
        raise PhotositeError(rule, key="scene.quantity", value=quantity)
    if set(found) == {"S0", "T"}:
        return found[QUANTITY_GROUPS[quantity]]
    if len(found) == 1:
        return next(iter(found.values()))
    problem = "names no wavelengths" if not found else f"names wavelengths in {len(found)} groups ({', '.join(found)})"
    shown = ", ".join(file.channels[:8])
    raise PhotositeError(
        f"{problem} in its channels ({shown}); "
        "name them 450nm, w450 or S0.450nm, or give wavelengths: a file with one number in nm per channel",
        key="scene.spectral_cube",
        value=file.path,
    )


def parse_channel(name: str) -> tuple[str, float | None]:
    """Return the group of a channel, "" for none, and the wavelength that its name states [nm], None for none."""
    if (match := _BIN.fullmatch(name)) is not None:
        return "", 0.5 * (_number(match["low"]) + _number(match["high"]))
    if (match := _CHANNEL.fullmatch(name)) is None:
        return "", None
    group = match["group"] or ""
    if match["bare"] is not None:
        return group, _number(match["bare"])
    value = _number(match["number"]) * 10.0 ** _EXPONENTS.get(match["prefix"] or "", 0)
    if value <= 0:
        return group, None
    # Nanometres as they are written, without a way through powers of ten.
    in_nm = _number(match["number"]) if match["prefix"] == "n" else 1e9 * value
    return group, in_nm if match["unit"] == "m" else SPEED_OF_LIGHT_NM_PER_S / value


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def read_wavelengths(path: Path) -> np.ndarray:
    """Wavelengths [nm] from .npy, or from text with numbers between commas, blanks or line ends; one header line may lead."""
    check_file(path, "scene.wavelengths")
    if Path(path).suffix.lower() == ".npy":
        return load_array(path, "scene.wavelengths").astype(np.float64).ravel()
    with reading(path, "write one number in nm per line", key="scene.wavelengths"):
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        if lines and re.search(r"[A-Za-z_]{2,}", lines[0]):
            del lines[0]
        return np.array([float(word) for line in lines for word in re.split(r"[,;\s]+", line) if word])


def common_grid(own_nm: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Which bands to keep, the scene's wavelengths [nm], each band's spectrum on them, and notes.

    A band's spectrum is a triangle: 1 at its own wavelength and 0 at the neighbours', so that the sum of all is linear between
    samples. It is cut at 380 and 780 nm. Raises PhotositeError for less than two wavelengths there.
    """
    inside = (own_nm >= FIRST_NM) & (own_nm <= LAST_NM)
    if not inside.any() or (inside.sum() < 2 and np.ptp(own_nm) < 1):
        raise PhotositeError(
            f"nothing between {FIRST_NM:g} and {LAST_NM:g} nm; give wavelengths in nm",
            key="scene.wavelengths",
            value=f"{own_nm[0]:g} to {own_nm[-1]:g} nm ({name})",
        )
    grid_nm = np.unique(np.clip(own_nm, FIRST_NM, LAST_NM))
    only = f"has only {grid_nm[0]:g} nm from {FIRST_NM:g} to {LAST_NM:g} nm; give two wavelengths or more there"
    require(len(grid_nm) > 1, "scene.wavelengths", f"{own_nm[0]:g} to {own_nm[-1]:g} nm ({name})", only)
    notes = []
    if own_nm[0] > FIRST_NM or own_nm[-1] < LAST_NM:
        low, high = max(own_nm[0], FIRST_NM), min(own_nm[-1], LAST_NM)
        notes.append(f"{name}: taken as dark outside {low:g} to {high:g} nm")
    if not inside.all():
        notes.append(f"{name}: wavelengths outside {FIRST_NM:g} to {LAST_NM:g} nm left out")
    triangles = resample(np.eye(len(own_nm)), own_nm, grid_nm)
    keep = np.flatnonzero(triangles.any(axis=1))
    return keep, grid_nm, triangles[keep], tuple(notes)


def resample(spectra: np.ndarray, own_nm: np.ndarray, grid_nm: np.ndarray) -> np.ndarray:
    """Spectra (bands, wavelengths) on other wavelengths, (bands, grid): linear between samples, zero outside them."""
    return np.stack([np.interp(grid_nm, own_nm, row, left=0.0, right=0.0) for row in spectra])
