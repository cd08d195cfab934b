"""Multispectral scenes of ISETCam in .mat files: a linear model of basis functions, or photons (vcReadImage.m)."""

from pathlib import Path

import numpy as np

from simulator.color.reproducible import ordered_product
from simulator.errors import reading, require
from simulator.progress import counted_as
from simulator.scene.pixel_file import PixelFile

FIX = "save it in MATLAB with save -v7, or take a file that ISETCam's sceneFromFile reads"
HC_J_NM = 6.62607015e-34 * 2.99792458e8 * 1e9  # energy of a photon times its wavelength [J nm] (SI, exact)


@counted_as("files")
def read_isetcam(path: Path, key: str) -> PixelFile:
    """Read radiance [W m^-2 sr^-1 nm^-1], (height, width, wavelengths) float32, channels named by wavelength.

    The file holds photons [s^-1 m^-2 sr^-1 nm^-1]: `mcCOEF` (height, width, n) times `basis.basis` (wavelengths, n), plus
    `imgMean`, at `basis.wave` [nm]; or `photons` or `data` at `wave` or `wavelength`. Negative values become 0, as in
    ISETCam. Raises PhotositeError for a file that is no such .mat.
    """
    import scipy.io

    with reading(path, FIX, key=key):
        found = scipy.io.loadmat(path, simplify_cells=True)
        model = "mcCOEF" in found
        basis = found.get("basis", {})
        own_nm = basis.get("wave") if model else found.get("wave", found.get("wavelength"))
        photons = found.get("mcCOEF") if model else found.get("photons", found.get("data"))
        names = ", ".join(name for name in found if not name.startswith("__")) or "nothing"
        rule = f"holds {names}; needs mcCOEF with basis.basis and basis.wave, or photons with wave: {FIX}"
        require(own_nm is not None and photons is not None, key, path, rule)
        own_nm = np.atleast_1d(np.asarray(own_nm, np.float64)).ravel()
        photons = np.asarray(photons, np.float64)
        if model:
            photons = ordered_product(photons, np.atleast_2d(np.asarray(basis["basis"], np.float64)).T)
            photons = photons + np.asarray(found.get("imgMean", 0.0), np.float64)
    fits = photons.ndim == 3 and photons.shape[2] == len(own_nm) and photons.size > 0 and own_nm.min() > 0
    require(fits, key, path, f"has photons of shape {photons.shape} at {len(own_nm)} wavelengths; {FIX}")
    negative, notes = photons < 0, []
    if negative.any():
        share = 100.0 * float(negative.mean())
        notes.append(f"{path.name}: {share:.2g} % of its values were negative, from the linear model; set to 0")
    for name, where in (("fov", "field_of_view"), ("dist", "depth")):
        if isinstance(found.get(name), int | float):
            unit = "deg" if name == "fov" else "m"
            notes.append(
                f"{path.name}: states {name} = {found[name]:g} {unit}; write {where}: {found[name]:g} {unit} to use it"
            )
    radiance = np.maximum(photons, 0.0) * (HC_J_NM / own_nm)
    channels = tuple(f"{nm:.9g}nm" for nm in own_nm)
    return PixelFile(path, radiance.astype(np.float32), channels, notes=tuple(notes))
