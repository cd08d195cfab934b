"""Light of photosites behind a blur circle and a four-spot low-pass filter, counted on a fine grid in float64."""

import numpy as np
from scipy.signal import fftconvolve

FINE = 60  # points per photosite and axis


def through_filter(
    pixels: np.ndarray, shape: tuple[int, int], spots_px: float, open_side: float, radius_px: float = 0.0
) -> np.ndarray:
    """Mean over each photosite's open square of a scene of even squares that covers the sensor, (rows, columns) float64.

    spots_px: distance of the filter's spots; spots_px and open_side are whole numbers of points, half of which fall to a side.
    Beyond its edge the scene goes around, so that photosites beside it do not count.
    """
    every = FINE * shape[0] // pixels.shape[0]
    light = np.kron(pixels, np.ones((every, every)))
    if radius_px:
        coarse = 5  # points of the disk are as dense as it needs
        light = light.reshape(light.shape[0] // coarse, coarse, -1, coarse).mean(axis=(1, 3))
        points = np.arange(-int(radius_px * FINE / coarse) - 1, int(radius_px * FINE / coarse) + 2) * coarse / FINE
        disk = (np.hypot(*np.meshgrid(points, points)) <= radius_px).astype(float)
        light = np.kron(fftconvolve(light, disk / disk.sum(), mode="same"), np.ones((coarse, coarse)))
    apart, beside = round(0.5 * spots_px * FINE), round(0.5 * (1.0 - open_side) * FINE)
    spots = [np.roll(light, (down * apart, across * apart), (0, 1)) for down in (-1, 1) for across in (-1, 1)]
    cells = (sum(spots) / 4.0).reshape(shape[0], FINE, shape[1], FINE)
    return cells[:, beside : FINE - beside, :, beside : FINE - beside].mean(axis=(1, 3))
