"""Photometry by colour-science."""

import colour
import numpy as np

from simulator.scene.scene import Scene


def luminance_of_pixels(scene: Scene) -> np.ndarray:
    """Luminance of every pixel, 683 lm/W times the integral with colour-science's V(lambda), by trapezoids of 0.01 nm.

    Spectra are linear between their samples, V(lambda) between its entries of 1 nm.
    """
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    fine_nm = np.linspace(scene.wavelengths_nm[0], scene.wavelengths_nm[-1], 40001)
    visible = np.interp(fine_nm, observer.wavelengths, observer.values[:, 1])
    bands = [np.trapezoid(np.interp(fine_nm, scene.wavelengths_nm, row) * visible, fine_nm) for row in scene.spectra_w_m2_sr_nm]
    return 683.0 * (scene.planes.astype(np.float64) @ np.array(bands))
