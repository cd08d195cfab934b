"""Points of light: samples so bright that the few points of the aperture would make dots of their spots."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.aperture_kernel import clipped_weights, photosite_weights
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.scene import Scene

BRIGHT = 8.0  # times the mean of the scene
SMALLEST_PX = 1.0  # radius of spots from which dots could be seen
CELL_PX = 32  # of the sensor, on which the brightest lights are chosen
MOST_PER_CELL = 16
STEPS_PER_PX = 32  # radii that lie closer share their weights


def bright_limit(scene: Scene, weights: np.ndarray) -> np.ndarray | None:
    """Electron radiance of each channel above which a sample is a light, (channels,) [e- s^-1 um^-2 sr^-1]; None: no sample is.

    weights: (bands, channels) [e- s^-1 um^-2 sr^-1].
    """
    means, most = (np.stack([ends(layer.planes) @ weights for layer in scene.layers]).max(axis=0) for ends in (_mean, _most))
    limit = BRIGHT * means
    return limit.astype(np.float32) if (most > limit).any() else None


def _mean(planes: np.ndarray) -> np.ndarray:
    """Mean of each band, down the columns first, which is quick."""
    rows, columns, bands = planes.shape
    return planes.reshape(rows, -1).sum(axis=0).reshape(columns, bands).mean(axis=0, dtype=np.float64) / rows


def _most(planes: np.ndarray) -> np.ndarray:
    """Greatest value of each band."""
    rows, columns, bands = planes.shape
    return planes.reshape(rows, -1).max(axis=0).reshape(columns, bands).max(axis=0)


@dataclass(frozen=True)
class Lights:
    """Lights of a strip.

    rows, columns: (lights,) place of the sample in the strip. layers: (lights,) of the scene.
    radii_px: (lights,) signed radius [photosites]. excess: (channels, lights) float32, what is taken of each colour.
    """

    rows: np.ndarray
    columns: np.ndarray
    layers: np.ndarray
    radii_px: np.ndarray
    excess: np.ndarray

    def of(self, kept: np.ndarray) -> "Lights":
        """Some of them, by index or mask."""
        return Lights(*(values[..., kept] for values in vars(self).values()))


def brightest(lights: Lights, over: int, first_row: int) -> Lights:
    """Return at most MOST_PER_CELL of each cell of the sensor, the brightest.

    over: samples per photosite. first_row: row of the sensor at the strip's first; its first column lies on a cell's border.
    """
    cell = over * CELL_PX
    cells = (lights.rows + over * first_row) // cell * (1 << 20) + lights.columns // cell
    order = np.lexsort((-lights.excess.sum(axis=0), cells))
    _, first, index = np.unique(cells[order], return_index=True, return_inverse=True)
    return lights.of(order[np.arange(len(order)) - first[index.reshape(-1)] < MOST_PER_CELL])


def reaching(lights: Lights, pupil: Pupil, over: int, block_rows: np.ndarray, block_columns: np.ndarray) -> list[np.ndarray]:
    """Return, for each block, which lights reach it: indices.

    block_rows, block_columns: (blocks,) photosite of the strip at a block's corner.
    """
    reach = np.abs(lights.radii_px) * pupil.corner_radius + 1.5
    rows, columns = (lights.rows + 0.5) / over, (lights.columns + 0.5) / over
    found = []
    for top, left in zip(block_rows, block_columns, strict=True):
        down = np.maximum(np.maximum(top - rows, rows - (top + BLOCK_ROWS)), 0.0)
        across = np.maximum(np.maximum(left - columns, columns - (left + BLOCK_COLUMNS)), 0.0)
        found.append(np.flatnonzero(np.hypot(down, across) <= reach))
    return found


def spot_weights(
    lights: Lights, pupil: Pupil, over: int, eyes: CatsEyes | None = None, origin_px: tuple[int, int] = (0, 0)
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights of all spots in a row, float32, and each light's first element and side.

    eyes: rims cut each spot, those of near lights alike. origin_px: (x, y) on the sensor of the strip's first photosite.
    """
    steps = np.rint(lights.radii_px * STEPS_PER_PX).astype(int)
    fields = np.zeros((2, len(steps)))
    if eyes is not None:
        side = eyes.alike_px
        places = zip((lights.columns, lights.rows), origin_px, strict=True)
        found = eyes.fields(*(side * ((place / over + origin) // side + 0.5) for place, origin in places))
        fields = np.where(eyes.clips(found)[:, None], found, 0.0).T
    kinds, index = np.unique(np.stack([steps, *fields]), axis=1, return_inverse=True)
    radii_px, clipped = kinds[0] / STEPS_PER_PX, kinds[1:].any(axis=0)
    spots = [None if is_cut else photosite_weights(pupil, px, over) for px, is_cut in zip(radii_px, clipped, strict=True)]
    if clipped.any():
        images = clipped_weights(eyes.pupil, eyes.open_fields(kinds[1:, clipped].T), radii_px[clipped], over)
        for number, image in zip(np.flatnonzero(clipped), images, strict=True):
            spots[number] = image
    index = index.reshape(-1)
    first = np.cumsum([0, *(spot.size for spot in spots)])[:-1]
    sides = np.array([len(spot) for spot in spots])
    return np.concatenate([spot.ravel() for spot in spots]).astype(np.float32), first[index], sides[index]
