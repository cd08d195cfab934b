"""Photometry by colour-science."""

import colour
import numpy as np

from simulator.scene.scene import Scene


def luminance_of_pixels(scene: Scene) -> np.ndarray:
    """Luminance of every pixel by colour-science's photometry, 683 lm/W and CIE 1924 V(lambda) by 1 nm."""
    radiance = scene.planes.astype(np.float64) @ scene.spectra_w_m2_sr_nm
    spectra = (colour.SpectralDistribution(values, scene.wavelengths_nm) for values in radiance.reshape(-1, 81))
    return np.reshape([colour.luminous_flux(spectrum) for spectrum in spectra], radiance.shape[:2])
