"""Predicts the error of the planned lens blur from its measured laws, before the frame is computed."""

import numpy as np

from simulator.optics.defocus.accuracy import copy_error, grid_error, points_error, slope_error
from simulator.optics.defocus.aperture_samples import sample_count
from simulator.optics.defocus.defocus import Defocus


def predicted_errors(defocus: Defocus) -> dict[str, float]:
    """Predict the largest error of each method that the scene may need, in standard deviations at its brightest light.

    The laws assume detail that varies between zero and the brightest light (`simulator.optics.defocus.accuracy`).
    """
    accuracy, radii = defocus.accuracy, [np.abs(radius) for radius in defocus.radii_px]
    least = min(float(np.min(radius)) for radius in radii)
    sloped, several = any(np.ndim(radius) > 0 for radius in radii), len(radii) > 1
    shares = {}
    if least <= accuracy.sharp_px:
        shares[f"no blur up to a radius of {accuracy.sharp_px:.2g}"] = copy_error(accuracy.sharp_px)
    finest = int(accuracy.samples_per_axis(np.array(least), np.array(least), defocus.scale))
    shares[f"means on {finest} x {finest} points per photosite"] = grid_error(
        max(least, accuracy.sharp_px), finest, defocus.scale
    )
    if sloped:
        shares[f"slopes in steps of {accuracy.slope_step:.2g}"] = slope_error(accuracy.slope_step)
    if several:
        points = int(sample_count(np.array(defocus.largest_px), defocus))
        shares[f"{points} points of the aperture"] = points_error(points, finest)
    return {method: accuracy.in_sigma(share) for method, share in shares.items()}


def describe_errors(defocus: Defocus) -> str:
    """Describe the light that the errors refer to, and the predicted errors, for the printed plan."""
    accuracy = defocus.accuracy
    light = f"brightest light {accuracy.electrons:.3g} e-, noise {accuracy.sigma * accuracy.electrons:.3g} e-"
    if accuracy.tolerance == 0.0:
        return f"{light}; every photosite by rays, until their standard error is {accuracy.ray_error:g} sigma of its own light"
    errors = ", ".join(f"{method} {error:.2g}" for method, error in predicted_errors(defocus).items())
    guessed = "; what lies behind edges is not in the scene" if defocus.guessed and np.ndim(defocus.radii_px[0]) else ""
    return f"{light}; predicted errors up to, in sigma: {errors}{guessed}"
