"""Wavelengths of a spectral cube: from channel names or a file, cut to those that scenes may have."""

import re
from pathlib import Path

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM
from simulator.errors import PhotositeError, reading, require
from simulator.scene.pixel_file import PixelFile, load_array

FIRST_NM, LAST_NM = WAVELENGTHS_NM[0], WAVELENGTHS_NM[-1]
# "450nm", "w450", "450", and the spectral EXR layout "S0.450,5nm" / "T.450nm" (Fichet et al. 2021, JCGT 10(3)).
_CHANNEL = re.compile(r"(?:(?P<group>[A-Za-z_].*?)\.)??[wW]?(?P<number>\d{3,4}(?:[.,]\d+)?)\s*(?:nm)?")
_POLARISED = re.compile(r"S[123]")  # Stokes components beside the radiance S0


def named_wavelengths(file: PixelFile) -> list[tuple[float, int]]:
    """(wavelength [nm], channel index) of the channels whose names state one."""
    found: dict[str, list[tuple[float, int]]] = {}
    for index, name in enumerate(file.channels):
        match = _CHANNEL.fullmatch(name)
        if match is None:
            continue
        group = match["group"] or ""
        if not _POLARISED.fullmatch(group):
            found.setdefault(group, []).append((float(match["number"].replace(",", ".")), index))
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


def read_wavelengths(path: Path) -> np.ndarray:
    """Wavelengths [nm] from .npy, or from text with numbers between commas, blanks or line ends; one header line may lead."""
    require(Path(path).is_file(), "scene.wavelengths", path, "no such file; check the path")
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
    samples. It is cut at 380 and 780 nm.
    """
    inside = (own_nm >= FIRST_NM) & (own_nm <= LAST_NM)
    if not inside.any() or (inside.sum() < 2 and np.ptp(own_nm) < 1):
        raise PhotositeError(
            f"nothing between {FIRST_NM:g} and {LAST_NM:g} nm; give wavelengths in nm",
            key="scene.wavelengths",
            value=f"{own_nm[0]:g} to {own_nm[-1]:g} nm ({name})",
        )
    notes = []
    if own_nm[0] > FIRST_NM or own_nm[-1] < LAST_NM:
        low, high = max(own_nm[0], FIRST_NM), min(own_nm[-1], LAST_NM)
        notes.append(f"{name}: taken as dark outside {low:g} to {high:g} nm")
    if not inside.all():
        notes.append(f"{name}: wavelengths outside {FIRST_NM:g} to {LAST_NM:g} nm left out")
    grid_nm = np.unique(np.clip(own_nm, FIRST_NM, LAST_NM))
    triangles = resample(np.eye(len(own_nm)), own_nm, grid_nm)
    keep = np.flatnonzero(triangles.any(axis=1))
    return keep, grid_nm, triangles[keep], tuple(notes)


def resample(spectra: np.ndarray, own_nm: np.ndarray, grid_nm: np.ndarray) -> np.ndarray:
    """Spectra (bands, wavelengths) on other wavelengths, (bands, grid): linear between samples, zero outside them."""
    return np.stack([np.interp(grid_nm, own_nm, row, left=0.0, right=0.0) for row in spectra])
