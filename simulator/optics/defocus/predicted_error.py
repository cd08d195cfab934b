"""The error of the planned lens blur, as its measured laws predict it before anything is computed."""

import numpy as np

from simulator.optics.defocus.aperture_samples import points_wanted
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.error_laws import copy_error, grid_error, points_error, slope_error


def predicted_errors(defocus: Defocus) -> dict[str, float]:
    """Largest error of each method that the scene may need, in standard deviations at its brightest light.

    Of light that varies by its whole range from one end of the scene's detail to the other
    (`simulator.optics.defocus.error_laws`).
    """
    accuracy, radii = defocus.accuracy, [np.abs(radius) for radius in defocus.radii_px]
    least = min(float(np.min(radius)) for radius in radii)
    sloped, several = any(np.ndim(radius) > 0 for radius in radii), len(radii) > 1
    shares = {}
    if least <= accuracy.sharp_px:
        shares[f"no blur up to a radius of {accuracy.sharp_px:.2g}"] = copy_error(accuracy.sharp_px)
    finest = int(accuracy.over(np.array(least), np.array(least), defocus.scale))
    shares[f"means on {finest} x {finest} points per photosite"] = grid_error(
        max(least, accuracy.sharp_px), finest, defocus.scale
    )
    if sloped:
        shares[f"slopes in steps of {accuracy.slope_step:.2g}"] = slope_error(accuracy.slope_step)
    if several:
        points = int(points_wanted(np.array(defocus.largest_px), defocus))
        shares[f"{points} points of the aperture"] = points_error(points, finest)
    return {method: accuracy.in_sigma(share) for method, share in shares.items()}


def told(defocus: Defocus) -> str:
    """Light that is looked at, and the predicted errors, for a plan's reader."""
    accuracy = defocus.accuracy
    light = f"brightest light {accuracy.electrons:.3g} e-, noise {accuracy.sigma * accuracy.electrons:.3g} e-"
    if accuracy.tolerance == 0.0:
        return f"{light}; every photosite by rays"
    errors = ", ".join(f"{method} {error:.2g}" for method, error in predicted_errors(defocus).items())
    guessed = "; what lies behind edges is not in the scene" if defocus.guessed and np.ndim(defocus.radii_px[0]) else ""
    return f"{light}; predicted errors up to, in sigma: {errors}{guessed}"
