"""Electron radiance: a scene's radiance weighted by the camera's quantum efficiency."""

import numpy as np

from simulator.color.spectra import integral_weights
from simulator.scene.scene import Scene


def electron_radiance_weights(scene: Scene, response_wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray) -> np.ndarray:
    """Return the electron radiance of each plane at weight 1, (bands, channels) float64 [e- s^-1 um^-2 sr^-1].

    The integral of L(lambda) lambda/(hc) QE(lambda) dlambda (EMVA 1288 R4.0, eq. 3 and 4), by the rule for all spectra
    (`integral_weights`).
    Times E/L of the lens [sr], pixel area [um^2] and time [s] it is the mean number of electrons.
    quantum_efficiency: (response wavelengths, channels) electrons per photon.
    """
    grid_nm = scene.wavelengths_nm
    per_joule = integral_weights(grid_nm, response_wavelengths_nm, quantum_efficiency, of_photons=True)
    return scene.spectra_w_m2_sr_nm @ per_joule * 1e-12  # 1 m^2 = 1e12 um^2
