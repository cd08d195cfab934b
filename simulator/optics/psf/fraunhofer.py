"""Point spread function of a pupil with a given wavefront error, by Fraunhofer diffraction."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np

from simulator.errors import require

LARGEST_PUPIL = 4096  # samples across
FEWEST_PUPIL = 192
EDGE_SAMPLES, EDGE_BETA = 3.0, 4.0  # to either side of an edge that samples hold, and the Kaiser window of that
TOGETHER = 1 << 16  # samples that are transformed in one go, which the cache holds

WavefrontError = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Opening:
    """Shape of a pupil with the area of the unit disk.

    depth: distance of pupil points (x, y) from the edge, negative outside. reach: radius of the farthest corner.
    blades: number of equal sides. corner_rad: angle of a corner, which lies on an axis of symmetry, from x towards y.
    """

    depth: Callable[[np.ndarray, np.ndarray], np.ndarray]
    reach: float = 1.0
    blades: int = 0
    corner_rad: float = 0.0

    def with_corner(self, corner_rad: float) -> Self:
        """Return the shape turned so that the corner lies at this angle."""
        cosine, sine = math.cos(corner_rad - self.corner_rad), math.sin(corner_rad - self.corner_rad)

        def depth(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            return self.depth(cosine * x + sine * y, cosine * y - sine * x)

        return replace(self, depth=depth, corner_rad=corner_rad)


ROUND = Opening(lambda x, y: 1.0 - np.hypot(x, y))


def odd(number: float) -> int:
    """Round up to an odd integer."""
    return 2 * math.ceil((number - 1.0) / 2.0) + 1


def compute_psf(
    wavefront_error_um: WavefrontError,
    wavelength_um: float,
    f_number: float,
    cell_um: float,
    size: int,
    opening: Opening = ROUND,
    kept: tuple[float, float] | None = None,
) -> np.ndarray:
    """Fraction of a point's light in each of size x size square cells around the image point, (size, size) float64.

    |Fourier transform of pupil exp(-2 pi i W / lambda)|^2 (Goodman, Introduction to Fourier Optics, 6.4), integrated over the
    cells. The image of a sampled pupil is periodic, and its period a whole number of cells. The sum is below 1 by the light
    outside the cells. The amplitude is computed in single precision: the light of a cell is wrong by 1e-6 of the brightest.
    wavefront_error_um: wavefront error W at pupil points (x, y) of the unit disk [um], any shape.
    cell_um: side of a cell. size: odd. opening: edge of the pupil. kept: None: of means over cells; else of light at their
        middles which has all detail up to the first of these frequencies and none from the second on [cycles per cell, up to
        a half], and is negative where that rings.
    Raises PhotositeError for a wavefront too steep to be sampled.
    """
    from scipy import fft

    cell = cell_um / (2.0 * wavelength_um * f_number)  # its side, in turns of phase between pupil points a radius apart
    pupil, period = sample_pupil(wavefront_error_um, wavelength_um, cell, size, opening)
    band = len(pupil)  # frequencies of the light
    count = _fast_length(band + len(_response(band, period, kept)))  # samples that do not mix those that count with others
    lines = np.asarray(fft.fft(pupil, count, axis=0))
    is_even = np.array_equal(pupil, pupil[::-1])  # of a lens that is symmetric about its axis, across the field
    if is_even:
        lines = lines[: count // 2 + 1]
    means = np.empty((size, len(lines)))
    step = max(TOGETHER // count, 1)
    for start in range(0, len(lines), step):
        amplitude = np.asarray(fft.fft(lines[start : start + step], count))
        density = np.real(amplitude) ** 2 + np.imag(amplitude) ** 2
        means[:, start : start + step] = _line_means(density, size, period, band, kept).T
    if is_even:
        means = np.concatenate([means, means[:, (count - 1) // 2 : 0 : -1]], axis=1)
    cells = _line_means(means, size, period, band, kept).T
    # Parseval: the light of the whole image plane, from the pupil's area in samples, pi / sample^2.
    power = math.pi * ((period * cell) ** 2 * 2.0 * wavelength_um * f_number) ** 2
    # The light beyond the period lies within it, and rounding leaves means below 0.
    return (np.maximum(cells, 0.0) if kept is None else cells) * (cell_um**2 / power)


def _line_means(lines: np.ndarray, size: int, period: int, band: int, kept: tuple[float, float] | None) -> np.ndarray:
    """Means of periodic band-limited densities (lines, samples) over cells about their first sample, (lines, size).

    period: cells. band: frequencies from 0 on that the densities have. kept: as of `compute_psf`.
    """
    from scipy import fft

    spectrum, response = np.asarray(fft.rfft(lines)), _response(band, period, kept)
    band = len(response)
    folded = np.zeros((len(lines), period), spectrum.dtype)
    for first in range(0, band, period):  # frequencies that cells cannot tell apart are added
        here = slice(first, min(first + period, band))
        folded[:, : here.stop - first] += spectrum[:, here] * response[here]
    found = np.real(np.asarray(fft.ifft(folded))) * (period / lines.shape[1])
    return np.asarray(found[:, np.arange(-(size // 2), size // 2 + 1)])


def _fast_length(least: int) -> int:
    """Samples from `least` on that are transformed fast."""
    from scipy import fft

    found = fft.next_fast_len(least)
    assert found is not None  # which its annotation allows
    return found


@lru_cache(maxsize=32)
def _response(band: int, period: int, kept: tuple[float, float] | None) -> np.ndarray:
    """Share of each frequency in the light of the cells of a period, for it and its negative, float32, up to where it is 0.

    Arguments are those of `_line_means`.
    """
    frequency = np.arange(band) / period
    if kept is None:
        found = 2.0 * np.sinc(frequency)
    else:
        passed, stopped = kept
        frequency = frequency[frequency < stopped]
        found = 1.0 + np.cos(math.pi * np.clip((frequency - passed) / (stopped - passed), 0.0, 1.0))
    found[0] = 1.0
    return found.astype(np.float32)


def sample_pupil(
    wavefront_error_um: WavefrontError, wavelength_um: float, cell: float, size: int, opening: Opening
) -> tuple[np.ndarray, int]:
    """Complex amplitude on a square grid around the opening, complex64, and the period of its image [cells].

    The grid is fine enough for W and for an image of size + 2 cells. cell: as in `compute_psf`.
    """
    rim = opening.reach * np.linspace(0.0, 1.0, 33)[:, None] * np.exp(2j * math.pi * np.arange(32) / 32)[None, :]
    step = 1e-4
    along_x = wavefront_error_um(rim.real + step, rim.imag) - wavefront_error_um(rim.real - step, rim.imag)
    along_y = wavefront_error_um(rim.real, rim.imag + step) - wavefront_error_um(rim.real, rim.imag - step)
    waves_per_radius = float(np.max(np.hypot(along_x, along_y))) / (2.0 * step * wavelength_um)
    # The image of a sampled pupil is periodic: its period must exceed the image, or light aliases to the other side.
    periods = 2.0 * (size + 2) * cell  # lambda N
    wanted = 2.0 * waves_per_radius + max(1.25 * periods, 0.5 * periods + 2.0 * waves_per_radius)
    rule = f"needs more than {LARGEST_PUPIL} samples across the pupil; lessen the aberrations or defocus, or stop down"
    require(wanted <= LARGEST_PUPIL, "lens.aberrations", f"{waves_per_radius:.0f} waves per pupil radius", rule)
    fewest = max(FEWEST_PUPIL, opening.reach * wanted)
    period = _fast_length(math.ceil(fewest / (2.0 * opening.reach * cell)))
    sample = 1.0 / (period * cell)
    count = math.ceil(2.0 * opening.reach / sample)
    axis = np.arange(-(count - 1) / 2, count / 2) * sample
    ahead, mirrored = wavefront_error_um(rim.real, rim.imag), wavefront_error_um(rim.real, -rim.imag)
    is_even = opening is ROUND and np.array_equal(ahead, mirrored)
    x, y = axis[None, :], axis[count // 2 if is_even else 0 :, None]  # of an even pupil the half from the middle on
    inside = _inside(opening.depth(x, y) / sample)
    waves = wavefront_error_um(x + 0.0 * y, y + 0.0 * x) / wavelength_um
    phase = ((2.0 * math.pi) * (np.rint(waves) - waves)).astype(np.float32)
    found = np.empty(phase.shape, np.complex64)
    found.real, found.imag = inside * np.cos(phase), inside * np.sin(phase)
    return (np.concatenate([found[::-1][: count // 2], found]) if is_even else found), period


def _inside(depth: np.ndarray) -> np.ndarray:
    """Amplitude of samples at depths inside an edge [samples], float32.

    That of an edge whose detail ends at half a cycle per sample. The mean over a sample would dim the light that the edge
    scatters by up to a half where the image ends.
    """
    found = (depth > 0.0).astype(np.float32)
    beside = np.abs(depth) < EDGE_SAMPLES
    found[beside] = np.interp(depth[beside], *_edge_profile())
    return found


@lru_cache(maxsize=1)
def _edge_profile() -> tuple[np.ndarray, np.ndarray]:
    """Depths [samples], and the amplitude there: the integral of a windowed sinc, from 0 to 1."""
    count = 601
    depth = np.linspace(-EDGE_SAMPLES, EDGE_SAMPLES, count)
    rises = np.cumsum(np.sinc(depth) * np.kaiser(count, EDGE_BETA))
    return depth, (rises - 0.5 * np.diff(rises, prepend=0.0)) / rises[-1]
