"""Predicts the error of the planned lens blur from its measured laws, before the frame is computed."""

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy, points_error, slope_error
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
    if least <= defocus.copied_px:
        shares[f"no blur up to a radius of {defocus.copied_px:.2g}"] = accuracy.ignoring_error(defocus.copied_px)
    finest, smallest = int(defocus.samples_per_axis(np.array(least), np.array(least))), max(least, defocus.copied_px)
    if defocus.gathers_scene(np.array([smallest]), np.array([smallest])).any() and not several:
        shares["means over the scene's pixels"] = accuracy.gathering_error()
    else:
        shares[f"means on {finest} x {finest} points per photosite"] = float(
            accuracy.sampling_error(np.array(smallest), finest, defocus.scale)
        )
    if sloped:
        shares[f"slopes in steps of {accuracy.slope_step:.2g}"] = slope_error(accuracy.slope_step)
    if several:
        points = int(sample_count(np.array(defocus.largest_px), defocus))
        shares[f"{points} points of the aperture"] = points_error(points, finest)
    return {method: accuracy.in_sigma(share) for method, share in shares.items()}


def describe_ignored(accuracy: Accuracy, radius_px: float) -> str:
    """Describe why no blur is computed where the largest blur circle has this radius [photosites], with the predicted error."""
    told = f"no blur circle has a radius above {accuracy.sharp_px:.2g} photosites"
    if radius_px == 0.0:
        return told
    error = accuracy.in_sigma(accuracy.ignoring_error(radius_px))
    return f"{told}; without that of radius {radius_px:.2g} the light is off by up to {error:.2g} sigma"


def describe_errors(defocus: Defocus) -> str:
    """Describe the light that the errors refer to, and the predicted errors, for the printed plan."""
    accuracy = defocus.accuracy
    light = f"brightest light {accuracy.electrons:.3g} e-, noise {accuracy.sigma * accuracy.electrons:.3g} e-"
    if accuracy.tolerance == 0.0:
        return f"{light}; every photosite by rays, until their standard error is {accuracy.ray_error:g} sigma of its own light"
    errors = ", ".join(f"{method} {error:.2g}" for method, error in predicted_errors(defocus).items())
    guessed = "; what lies behind edges is not in the scene" if defocus.guessed and np.ndim(defocus.radii_px[0]) else ""
    return f"{light}; predicted errors up to, in sigma: {errors}{guessed}"
