"""Colour matrices of a camera (DNG 1.4: ColorMatrix, ForwardMatrix)."""

import numpy as np

from simulator.color.camera_matrices import CALIBRATION_LIGHTS, color_matrix, forward_matrix
from simulator.sensor.camera.camera import Camera


def matrix_under_d65(camera: Camera) -> np.ndarray | None:
    """Return the matrix (colours, 3) from XYZ to camera under D65: the published one if in_dng, else fitted to the response.

    None for MONO.
    """
    if camera.channels == 1:
        return None
    if camera.color_matrix is not None and camera.color_matrix.in_dng:
        return np.array(camera.color_matrix.xyz_to_camera)
    return color_matrix(camera.response.wavelengths_nm, camera.response.quantum_efficiency)


def matrices_under_two_lights(camera: Camera) -> dict[str, np.ndarray]:
    """Return the matrices other than that under D65, by field of `Raw`: color_matrix_a, forward_matrix_d65, forward_matrix_a.

    None of them without a colour filter or with a published matrix, which is for D65 alone. Of other filters than R, G, B
    only the first: readers then invert it.
    """
    response = camera.response
    if camera.channels == 1 or (camera.color_matrix is not None and camera.color_matrix.in_dng):
        return {}
    curves = response.wavelengths_nm, response.quantum_efficiency
    if camera.filter.letters != "RGB":
        return {"color_matrix_a": color_matrix(*curves, "A")}
    forward = {f"forward_matrix_{light.lower()}": forward_matrix(*curves, light) for light in CALIBRATION_LIGHTS}
    return {"color_matrix_a": color_matrix(*curves, "A"), **forward}
