"""How well a camera's fitted and published colour matrix reproduce the ColorChecker."""

import numpy as np

from simulator.color.camera_matrices import camera_response, chart_reflectances, color_matrix
from simulator.color.colour_science import colour_science
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, tristimulus
from simulator.sensor.camera.camera import Camera


def matrix_errors(camera: Camera) -> tuple[float, float]:
    """Mean Delta E 2000 of the 24 patches under D65, developed with the fitted and with the published matrix.

    A raw converter divides by the camera's white and multiplies by the inverse of the matrix, whose rows are
    scaled so that the camera's white becomes the white of D65 (DNG 1.4, LibRaw).
    """
    response = camera.response
    light, curves = illuminant("D65"), (response.wavelengths_nm, response.quantum_efficiency)
    lit = chart_reflectances(WAVELENGTHS_NM) * light
    true_xyz, white_xyz = (tristimulus(each) / tristimulus(light)[1] for each in (lit, light))
    signal = camera_response(lit, WAVELENGTHS_NM, *curves) / camera_response(light, WAVELENGTHS_NM, *curves)
    matrices = color_matrix(response.wavelengths_nm, response.quantum_efficiency), camera.color_matrix.xyz_to_camera
    return tuple(_mean_error(np.array(matrix), signal, true_xyz, white_xyz) for matrix in matrices)


def _mean_error(xyz_to_camera: np.ndarray, signal: np.ndarray, true_xyz: np.ndarray, white_xyz: np.ndarray) -> float:
    colour = colour_science()
    balanced = xyz_to_camera / (xyz_to_camera @ white_xyz)[:, None]  # the white of D65 becomes (1, 1, 1)
    found_xyz = signal @ np.linalg.inv(balanced).T
    chromaticity = colour.XYZ_to_xy(white_xyz)
    true_lab, found_lab = (colour.XYZ_to_Lab(xyz, chromaticity) for xyz in (true_xyz, found_xyz))
    return float(np.mean(colour.delta_E(true_lab, found_lab, method="CIE 2000")))
