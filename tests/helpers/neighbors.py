"""What neighbouring photosites share, in float64 NumPy: binning and crosstalk by their definitions."""

import numpy as np


def binned(mosaic: np.ndarray, factor: int, step: int) -> np.ndarray:
    """Sums by the definition: photosite (X, Y) of the result collects factor x factor places of its colour."""
    height, width = (side // (factor * step) * step for side in mosaic.shape)
    result = np.zeros((height, width))
    for row in range(height):
        for column in range(width):
            y, x = (place // step * factor * step + place % step for place in (row, column))
            result[row, column] = mosaic[y : y + factor * step : step, x : x + factor * step : step].sum()
    return result


def crosstalk_stencil(side: float, corner: float) -> np.ndarray:
    """Shares that a photosite gets of its own light and of its neighbours'."""
    return np.array([[corner, side, corner], [side, 1 - 4 * side - 4 * corner, side], [corner, side, corner]])


def stencil_sum(mosaic: np.ndarray, stencil: np.ndarray) -> np.ndarray:
    """Sum of the 3 x 3 photosites around each, weighted; beyond the edge the nearest is repeated.

    SciPy's `correlate` leaves out weights below 2.2e-16, which count where lights stand over black.
    """
    height, width = mosaic.shape
    padded = np.pad(mosaic, 1, mode="edge")
    return sum(stencil[y, x] * padded[y : y + height, x : x + width] for y in range(3) for x in range(3))


def binned_variance(variance: np.ndarray, stencil: np.ndarray, factor: int, step: int) -> np.ndarray:
    """Variance of the binned `stencil_sum` of independent numbers; shares add before they are squared."""
    height, width = variance.shape
    places = np.pad(np.arange(variance.size).reshape(height, width), 1, mode="edge")
    rows, columns = (side // (factor * step) * step for side in (height, width))
    result = np.zeros((rows, columns))
    for row in range(rows):
        for column in range(columns):
            y, x = (place // step * factor * step + place % step for place in (row, column))
            shares = np.zeros(variance.size)
            for down in range(0, factor * step, step):
                for right in range(0, factor * step, step):
                    np.add.at(shares, places[y + down : y + down + 3, x + right : x + right + 3], stencil)
            used = shares > 0.0
            result[row, column] = shares[used] ** 2 @ variance.ravel()[used]
    return result


def bloomed(charge: np.ndarray, capacity_e: float, sides: int, reach: int) -> tuple[np.ndarray, float]:
    """Charge after blooming into 2 or 4 sides, packet by packet, and what is drained."""
    ways, held = [(-1, 0), (1, 0), (0, -1), (0, 1)][:sides], np.minimum(charge, capacity_e)
    packets, (height, width) = np.stack([(charge - held) / sides] * sides), charge.shape
    drained = 0.0
    for _ in range(reach):
        arriving = np.zeros_like(packets)
        for packet, into, (down, right) in zip(packets, arriving, ways, strict=True):
            padded = np.pad(packet, 1)[1 - down : 1 - down + height, 1 - right : 1 - right + width]
            into += padded
            drained += packet.sum() - padded.sum()
        total, room = arriving.sum(axis=0), capacity_e - held
        held = held + np.minimum(total, room)
        packets = arriving * np.where(total > room, (total - room) / np.maximum(total, 1e-300), 0.0)
    return held, drained + packets.sum()
