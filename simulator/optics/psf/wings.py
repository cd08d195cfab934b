"""Wings of diffraction: light that the edge of the pupil scatters farther than kernels reach.

Kernels end some tens of lambda N beyond the rays and have the sum 1, as if they held all light. What lies beyond falls slowly,
as lambda N / (pi^3 r^3) of a photosite's light on average over the rings (the asymptote of the Airy pattern; Born and Wolf,
Principles of Optics, 8.5.2, give the light within a radius), and is smooth: means over wide cells of the sensor tell it all.
Of a polygon it is as much more as its edge is longer; its spikes end with the kernels, and their light counts as even.
"""

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.geometry.projection import Projection
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.fraunhofer import Opening
from simulator.optics.psf.wavefront_psf import WavefrontPsf

FARTHEST = 32.0  # reach of the wings, in that of kernels
LEAST_CELL_PX = 4  # photosites across a cell
PARTS = 4  # of a cell, along an axis, at which the pattern is summed
SKIPPED_SHARE = 0.25  # of the tolerance: effect below which wings are left out
LEFT_PX = 0.05  # share of their effect that is left, times lambda N [photosites]
LEAST_LEFT, MOST_LEFT = 0.05, 0.15  # ends of that share
LEAST_SIGMA = 1e-4  # effect that is rounding
SEEN = 0.999  # quantile of the cells by which the effect counts
BESIDE_EDGES = 1.1  # times that of the ends of a cell, of photosites beside an edge


@dataclass(frozen=True)
class Wings:
    """Light that comes from beyond the kernels.

    light: (rows, columns, bands) float64, means of the scene's planes over cells of the sensor and `margin` cells around it.
    cell_px: photosites across a cell. pattern: (2 margin - 1, ...) float64, what cells around one get of its light, over
    lambda N. lambda_n_px: (channels,) mean lambda N [photosites]. effect_sigma: what they change [standard deviations].
    """

    light: np.ndarray
    cell_px: int
    pattern: np.ndarray
    lambda_n_px: np.ndarray
    effect_sigma: float
    _veils: dict[bytes, np.ndarray] = field(default_factory=dict, compare=False, repr=False)

    @property
    def margin(self) -> int:
        """Cells around the sensor whose light comes onto it."""
        return len(self.pattern) // 2 + 1

    @property
    def image_share(self) -> np.ndarray:
        """Share of the light of each channel that stays within the kernels, (channels,) float64."""
        return np.asarray(1.0 - self.lambda_n_px * self.pattern.sum())

    def veil(self, weights: np.ndarray) -> np.ndarray:
        """Electron radiance that comes from beyond, (channels, rows + 2, columns + 2) float32, of cells around each other.

        The first cell lies above and to the left of the sensor. weights: (bands, channels), of `OpticsPlan`.
        """
        key = np.ascontiguousarray(weights).tobytes()
        if key not in self._veils:
            self._veils[key] = self._spread(np.moveaxis(self.light @ weights.astype(np.float64), -1, 0))
        return self._veils[key]

    def _spread(self, light: np.ndarray) -> np.ndarray:
        from scipy import fft

        first, shape = len(self.pattern) - 1, light.shape[1:]  # what lies before it is mixed with the other end
        whole = [fft.next_fast_len(side, real=True) for side in shape]
        spectra = [np.asarray(fft.rfft2(one, whole, workers=-1)) for one in (light, self.pattern)]
        spread = np.asarray(fft.irfft2(spectra[0] * spectra[1], whole, workers=-1))[:, first : shape[0], first : shape[1]]
        return np.maximum(self.lambda_n_px[:, None, None] * spread, 0.0).astype(np.float32)


def plan_wings(
    psf: FieldPsf, planes: np.ndarray, weights: np.ndarray, projection: Projection, accuracy: Accuracy
) -> tuple[Wings | None, float]:
    """Wings of the kernels of a wavefront, None where none show, and the error that is left [standard deviations].

    planes: (height, width, bands) light of the scene as a pinhole sees it: blur, motion and distortion move light by less than
    wings are wide. weights: (bands, channels) [e- s^-1 um^-2 sr^-1].
    """
    if not isinstance(psf.lens_psf, WavefrontPsf):
        return None, 0.0
    lens, half_px = psf.lens_psf, psf.held_px
    lambda_n_px = 1e-3 * np.mean(lens.wavelengths_nm, axis=1) * lens.f_number / lens.pitch_um * _edge_length(lens.opening)
    cell_px = max(2 ** int(math.log2(0.5 * half_px)), LEAST_CELL_PX)
    pattern = _pattern(half_px, math.ceil(FARTHEST * half_px / cell_px), cell_px)
    margin = len(pattern) // 2 + 1
    sides = zip(psf.sensor_px[::-1], (projection.offset_y, projection.offset_x), planes.shape[:2], strict=True)
    rows, columns = (_starts(side, offset, projection.scale, pixels, cell_px, margin) for side, offset, pixels in sides)
    found = Wings(_means(planes, rows, columns), cell_px, pattern, lambda_n_px, 0.0)
    least, most = (_joined(join, planes, rows, columns) for join in (np.minimum, np.maximum))
    effect = _effect(found, (least, most), weights, accuracy)
    if accuracy.tolerance and effect <= SKIPPED_SHARE * accuracy.tolerance:
        return None, effect
    left = min(max(LEFT_PX / float(lambda_n_px.min()), LEAST_LEFT), MOST_LEFT) * effect
    return (replace(found, effect_sigma=effect), left) if effect > 0.0 else (None, 0.0)


def _effect(wings: Wings, ends: tuple[np.ndarray, np.ndarray], weights: np.ndarray, accuracy: Accuracy) -> float:
    """What wings change of the darkest and of the brightest pixel of each cell, in its noise [standard deviations].

    ends: least and most of the planes, by cell.
    """
    inner, per_light = slice(wings.margin - 1, 1 - wings.margin), accuracy.electrons_per_radiance
    dark, bright = (np.moveaxis(one[inner, inner] @ weights.astype(np.float64), -1, 0) for one in ends)
    veil, lost = wings.veil(weights), (1.0 - wings.image_share)[:, None, None]
    found = []
    for light, brought in ((dark, veil - lost * dark), (bright, lost * bright - veil)):
        noise_e2 = per_light * (light + np.maximum(brought, 0.0)) + accuracy.read_noise_e**2
        found.append(per_light * brought / np.sqrt(np.maximum(noise_e2, 1.0)))
    sigma = float(np.quantile(np.maximum(*found), SEEN))
    return BESIDE_EDGES * sigma if sigma > LEAST_SIGMA else 0.0


def _edge_length(opening: Opening) -> float:
    """Length of the edge of a pupil over that of a disk of its area."""
    blades = opening.blades
    return math.sqrt(blades * math.tan(math.pi / blades) / math.pi) if blades else 1.0


@lru_cache(maxsize=8)
def _pattern(half_px: float, reach: int, cell_px: int) -> np.ndarray:
    """Share of a cell's light on the cells around it, over lambda N in photosites: (2 reach + 1, 2 reach + 1) float64.

    Beyond the square of a kernel, which reaches half_px photosites to either side.
    """
    count = PARTS * (2 * reach + 1)
    away = np.abs((np.arange(count) + 0.5) / PARTS - (reach + 0.5)) * cell_px
    beyond = np.maximum(away[:, None], away[None, :]) > half_px
    density = np.where(beyond, np.hypot(away[:, None], away[None, :]) ** -3.0, 0.0)
    cells = density.reshape(2 * reach + 1, PARTS, 2 * reach + 1, PARTS).sum(axis=(1, 3))
    light = 8.0 * math.sin(0.25 * math.pi) / math.pi**3 * (1.0 / half_px - 1.0 / ((reach + 0.5) * cell_px))
    return np.asarray(cells * (light / cells.sum()))


def _starts(photosites: int, offset: float, scale: float, pixels: int, cell_px: int, margin: int) -> np.ndarray:
    """First scene pixel of each cell along an axis of the sensor, with cells around it, which the scene's border continues."""
    cells = np.arange(-margin, -(-photosites // cell_px) + margin)
    return np.clip(np.rint(offset + scale * cell_px * cells), 0, pixels - 1).astype(np.intp)


def _means(planes: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Means of planes over cells that begin at these pixels; one pixel each where several begin at the same."""
    sums = _joined(np.add, planes, rows, columns)
    tall, wide = (
        np.maximum(np.diff(starts, append=size), 1) for starts, size in zip((rows, columns), planes.shape[:2], strict=True)
    )
    return np.asarray(sums / (tall[:, None, None] * wide[None, :, None]))


def _joined(join: np.ufunc, planes: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Join planes over cells that begin at these pixels, (rows, columns, bands) float64."""
    ends = np.maximum(np.append(rows[1:], len(planes)), rows + 1)
    # `reduceat` over rows takes 25 times as long as `reduce` of each.
    lines = (join.reduce(planes[first:end], axis=0, dtype=np.float64) for first, end in zip(rows, ends, strict=True))
    return np.stack([join.reduceat(line, columns, axis=0) for line in lines])
