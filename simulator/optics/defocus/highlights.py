"""Highlights: samples so bright that their blur spots would show each aperture sample as a separate dot."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import LAMP_PEAK, Accuracy
from simulator.optics.defocus.aperture_kernel import clipped_weights, photosite_weights
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.defocus.photosite_area import WHOLE, PhotositeArea
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.bands import most_of_bands
from simulator.scene.sample_places import sample_places
from simulator.scene.scene import Scene

BRIGHT = 8.0  # threshold in units of the scene's mean radiance
LAMP = 1e4  # the same, above which a sample leaves rounding errors in the running sums of its columns
SMALLEST_PX = 1.0  # blur radius from which dots would be visible [photosites], of lamps at any radius
CAPPED = 0.99  # quantile of the radiance at which the brightest samples count for the mean, so that no lamp hides another
_SAMPLES = 400  # places per axis at which that mean is taken
STEEPEST = 0.9  # largest change of the radius between photosites of one surface
CELL_PX = 32  # side of the sensor's cells in which the brightest highlights are selected [photosites]
MOST_PER_CELL = 16
STEPS_PER_PX = 32  # resolution of radii [1 / photosite]; equal rounded radii share weights
MOST_STEPS_PER_PX = 1024  # the same for the brightest lamps
PAIRS_TOGETHER = 2**20  # of highlights and blocks that are looked at together


def highlight_threshold(scene: Scene, weights: np.ndarray, times: float = BRIGHT) -> np.ndarray | None:
    """Electron radiance of each channel above which a sample is a highlight, (channels,) float32, or None.

    None: no sample of the scene is one. Unit: e- s^-1 um^-2 sr^-1. weights: (bands, channels) [e- s^-1 um^-2 sr^-1].
    times: threshold in units of the scene's mean radiance, in which the brightest CAPPED count as much as their least.
    """
    means = np.stack([_capped_mean(layer.planes, weights) for layer in scene.layers]).max(axis=0)
    most = np.stack([most_of_bands(layer.planes) @ weights for layer in scene.layers]).max(axis=0)
    limit = times * means
    return limit.astype(np.float32) if (most > limit).any() else None


def _capped_mean(planes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Mean radiance of each channel, of samples all over the planes, each at most the quantile CAPPED."""
    places = np.ix_(*(sample_places(size, _SAMPLES) for size in planes.shape[:2]))
    light = planes[places].reshape(-1, planes.shape[2]) @ weights
    return np.minimum(light, np.quantile(light, CAPPED, axis=0)).mean(axis=0)


@dataclass(frozen=True)
class Highlights:
    """Highlights of a row band.

    rows, columns: (highlights,) position of the sample in the band. layers: (highlights,) layer of the scene.
    radii_px: (highlights,) signed blur radius [photosites]. slopes: (2, highlights) its change to the right and down
        [photosites per photosite].
    exact: (highlights,) whether the radius is that of the whole layer, so that it need not be rounded to share weights.
    excess: (channels, highlights) float32, radiance that is taken out and blurred separately [e- s^-1 um^-2 sr^-1].
    """

    rows: np.ndarray
    columns: np.ndarray
    layers: np.ndarray
    radii_px: np.ndarray
    slopes: np.ndarray
    exact: np.ndarray
    excess: np.ndarray

    def select(self, kept: np.ndarray) -> "Highlights":
        """Select highlights by index or mask."""
        return Highlights(*(values[..., kept] for values in vars(self).values()))


def no_highlights(channels: int) -> Highlights:
    """Return none, of light of so many channels."""
    none = np.zeros(0, int)
    return Highlights(
        none, none, none, np.zeros(0, np.float32), np.zeros((2, 0)), none > 0, np.zeros((channels, 0), np.float32)
    )


def shows_dots(highlights: Highlights, accuracy: Accuracy) -> np.ndarray:
    """Whether each highlight would show as separate dots: those of large circles, and all lamps (LAMP_PEAK), in focus or not.

    A slab is read up to half of its width aside of the circle of its light, and a point of the aperture that meets a lamp is
    seen beside a spot as small as the photosite, too.
    """
    lamp = highlights.excess.max(axis=0) > LAMP_PEAK * accuracy.brightest
    return (np.abs(highlights.radii_px) > SMALLEST_PX) | (lamp & (accuracy.brightest > 0.0))


def select_brightest(highlights: Highlights, samples_per_axis: int, first_row: int) -> Highlights:
    """Select the brightest highlights, at most MOST_PER_CELL in each cell of the sensor, and as many of those in small circles.

    samples_per_axis: samples per photosite. first_row: row of the sensor at the band's first row;
        the band's first column lies on a cell's border.
    """
    cell = samples_per_axis * CELL_PX
    cells = (highlights.rows + samples_per_axis * first_row) // cell * (1 << 20) + highlights.columns // cell
    cells = 2 * cells + (np.abs(highlights.radii_px) > SMALLEST_PX)
    order = np.lexsort((-highlights.excess.sum(axis=0), cells))
    _, first, index = np.unique(cells[order], return_index=True, return_inverse=True)
    return highlights.select(order[np.arange(len(order)) - first[index.reshape(-1)] < MOST_PER_CELL])


def radius_slopes(radius_px: np.ndarray, rows: np.ndarray, columns: np.ndarray, samples_per_axis: int) -> np.ndarray:
    """Change of the radius to the right and down at samples [photosites per photosite], (2, samples).

    The smaller of the differences to both neighbours, because the other may reach over an edge; 0 beside edges on both sides.
    radius_px: (rows, columns) of samples.
    """
    own, slopes = radius_px[rows, columns].astype(float), []
    for down, right in ((0, 1), (1, 0)):
        before = radius_px[np.maximum(rows - down, 0), np.maximum(columns - right, 0)]
        after = radius_px[np.minimum(rows + down, len(radius_px) - 1), np.minimum(columns + right, radius_px.shape[1] - 1)]
        near, far = own - before, after - own
        slope = np.where(np.abs(near) < np.abs(far), near, far)
        close = np.abs(near - far) < 0.1 / samples_per_axis  # one surface on both sides: their mean
        slope = samples_per_axis * np.where(close, 0.5 * (near + far), slope)
        slopes.append(np.where(np.abs(slope) < STEEPEST, slope, 0.0))
    return np.stack(slopes)


def lamp_steps(highlights: Highlights, samples_per_axis: int, accuracy: Accuracy) -> np.ndarray:
    """Resolution of the radii of lamps, (highlights,), powers of two from STEPS_PER_PX to MOST_STEPS_PER_PX [1 / photosite].

    Half a step moves the rim, where a photosite gains or loses as much of the spot's light per photosite, pi R^2 of which share
    it. It counts in the noise of a tenth of that light.
    """
    area = samples_per_axis**2 * np.pi * np.maximum(np.abs(highlights.radii_px), 0.5) ** 2
    spot_e = accuracy.electrons_per_radiance * highlights.excess.max(axis=0).astype(np.float64) / area
    noise_e = np.sqrt(np.maximum(0.1 * spot_e + accuracy.read_noise_e**2, 1.0))
    needed = 0.5 * spot_e / (max(accuracy.tolerance, 1e-6) * noise_e)
    return np.clip(2.0 ** np.ceil(np.log2(np.maximum(needed, 1.0))), STEPS_PER_PX, MOST_STEPS_PER_PX)


def find_reaching(
    highlights: Highlights, pupil: Pupil, samples_per_axis: int, block_rows: np.ndarray, block_columns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Find the highlights whose spots reach each block: their indices, block after block, and how many each has, (blocks,).

    block_rows, block_columns: (blocks,) first photosite of each block in the band.
    """
    reach = np.abs(highlights.radii_px) * pupil.corner_radius + 1.5
    places = tuple((place + 0.5) / samples_per_axis for place in (highlights.rows, highlights.columns))
    sides = (BLOCK_ROWS, BLOCK_COLUMNS)
    rows, columns = (np.unique(begins, return_inverse=True) for begins in (block_rows, block_columns))
    numbers = np.full((len(rows[0]), len(columns[0])), -1)
    numbers[rows[1].reshape(-1), columns[1].reshape(-1)] = np.arange(len(block_rows))
    spans = [
        (np.searchsorted(begins, place - reach - side), np.searchsorted(begins, place + reach, side="right"))
        for (begins, _), place, side in zip((rows, columns), places, sides, strict=True)
    ]
    first = [span[0] for span in spans]
    tall, wide = (np.maximum(after - before, 0) for before, after in spans)
    pairs = tall * wide  # of a highlight and a block near it
    found = []
    for own in np.split(np.arange(len(pairs)), np.flatnonzero(np.diff(np.cumsum(pairs) // PAIRS_TOGETHER)) + 1):
        every = np.repeat(own, pairs[own])
        place = np.arange(len(every)) - np.repeat(np.cumsum(pairs[own]) - pairs[own], pairs[own])
        cell = first[0][every] + place // wide[every], first[1][every] + place % wide[every]
        away = []
        for axis, (begins, _) in enumerate((rows, columns)):
            begin, at = begins[cell[axis]], places[axis][every]
            away.append(np.maximum(np.maximum(begin - at, at - (begin + sides[axis])), 0.0))
        kept = (numbers[cell] >= 0) & (np.hypot(*away) <= reach[every])
        found.append(np.stack([numbers[cell][kept], every[kept]]))
    blocks, reaching = np.concatenate(found, axis=1)
    return reaching[np.argsort(blocks, kind="stable")], np.bincount(blocks, minlength=len(block_rows))


def spot_weights(
    highlights: Highlights,
    pupil: Pupil,
    samples_per_axis: int,
    eyes: CatsEyes | None = None,
    origin_px: tuple[int, int] = (0, 0),
    area: PhotositeArea = WHOLE,
    steps_per_px: float | np.ndarray = STEPS_PER_PX,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights of all spots, concatenated, float32, and each highlight's first element and side among them.

    eyes: clips the spots; highlights in one square of the sensor share a shape. origin_px: (x, y) on the sensor of the band's
        first photosite. area: of a photosite on the samples. steps_per_px: resolution of the radii that are not `exact`, of all
        or (highlights,) [1 / photosite].
    """
    rounded = np.rint(highlights.radii_px * steps_per_px) / steps_per_px
    radius = np.where(highlights.exact, highlights.radii_px, rounded)
    fields = np.zeros((2, len(radius)))
    if eyes is not None:
        side = eyes.alike_px
        places = zip((highlights.columns, highlights.rows), origin_px, strict=True)
        at_squares = eyes.fields(*(side * ((place / samples_per_axis + origin) // side + 0.5) for place, origin in places))
        fields = np.where(eyes.clips(at_squares)[:, None], at_squares, 0.0).T
    kinds, index = np.unique(np.stack([radius, *fields]), axis=1, return_inverse=True)
    radii_px, clipped = kinds[0], np.logical_or.reduce(kinds[1:], axis=0)
    spots: dict[int, np.ndarray] = {}
    for number in np.flatnonzero(~clipped).tolist():
        spots[number] = photosite_weights(pupil, radii_px[number], samples_per_axis, area)
    if eyes is not None and clipped.any():
        images = clipped_weights(eyes.pupil, eyes.open_fields(kinds[1:, clipped].T), radii_px[clipped], samples_per_axis, area)
        spots |= zip(np.flatnonzero(clipped).tolist(), images, strict=True)
    shapes = [spots[number] for number in range(len(radii_px))]
    index = index.reshape(-1)
    first = np.cumsum([0, *(spot.size for spot in shapes)])[:-1]
    sides = np.array([len(spot) for spot in shapes])
    return np.concatenate([spot.ravel() for spot in shapes]).astype(np.float32), first[index], sides[index]
