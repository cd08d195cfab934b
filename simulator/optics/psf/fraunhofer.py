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
LINES = 32  # that are transformed together

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
) -> np.ndarray:
    """Fraction of a point's light in each of size x size square cells around the image point, (size, size) float64.

    |Fourier transform of pupil exp(-2 pi i W / lambda)|^2 (Goodman, Introduction to Fourier Optics, 6.4), summed
    directly at the wanted points (Soummer et al. 2007, Opt. Express 15, 15935), on a grid of half of lambda N or finer,
    and integrated over the cells. The sum is below 1 by the light outside the cells.
    wavefront_error_um: wavefront error W at pupil points (x, y) of the unit disk [um], any shape.
    cell_um: side of a cell. size: odd. opening: edge of the pupil.
    Raises PhotositeError for a wavefront too steep to be sampled.
    """
    finer = odd(cell_um / (0.5 * wavelength_um * f_number))
    count = (size + 2) * finer
    step_um = cell_um / finer
    pupil = _pupil(wavefront_error_um, wavelength_um, count * step_um / (wavelength_um * f_number), opening)
    places_um = (np.arange(count) - count // 2) * step_um
    across = np.arange(-(len(pupil) - 1) / 2, len(pupil) / 2) * (2.0 * opening.reach / len(pupil))
    turns = 1.0 / (2.0 * wavelength_um * f_number)
    amplitude = _image(pupil, across, places_um * turns)
    # Parseval: the light of the whole image plane, from the pupil's area in samples, pi / (2 reach / count)^2.
    power = math.pi * ((0.5 * len(pupil) / opening.reach) ** 2 * 2.0 * wavelength_um * f_number) ** 2
    cells = _cell_means(np.abs(amplitude) ** 2, finer)[1:-1, 1:-1]
    # Truncation at the window leaves ripples along the border, which may be negative.
    return np.maximum(cells, 0.0) * (cell_um**2 / power)


def _image(pupil: np.ndarray, across: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Fourier transform of a pupil at places that are symmetric about 0, of half of each axis along which it is even.

    A lens that is symmetric about its axis has a pupil that is even across the field.
    """
    is_even = [np.array_equal(pupil, np.flip(pupil, axis)) for axis in (0, 1)]
    down, right = (places[len(places) // 2 :] if even else places for even in is_even)
    half = _chirp_transform(_chirp_transform(pupil, across, down).T, across, right).T
    below = np.concatenate([half[:0:-1], half]) if is_even[0] else half
    return np.concatenate([below[:, :0:-1], below], axis=1) if is_even[1] else below


def _cell_means(density: np.ndarray, finer: int) -> np.ndarray:
    """Means of a periodic band-limited density over cells of finer x finer samples."""
    return _line_means(_line_means(density, finer).T, finer).T


def _line_means(lines: np.ndarray, finer: int) -> np.ndarray:
    """Means along the last axis, (lines, samples / finer): frequencies that its cells cannot tell apart are added."""
    from scipy import fft

    response = _mean_response(lines.shape[-1], finer)
    spectrum = np.asarray(fft.fft(lines)) * response
    folded = spectrum.reshape(len(lines), finer, -1).sum(axis=1)
    return np.asarray(np.real(np.asarray(fft.ifft(folded)))) / finer


def _chirp_transform(lines: np.ndarray, across: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Fourier transform along the first axis between even steps, (places, lines), as a convolution with a chirp.

    Rabiner, Schafer and Rader 1969, Bell System Technical Journal 48, 1249. A few lines at a time, which the cache holds.
    """
    from scipy.signal import CZT

    step, first = across[1] - across[0], across[0]
    ratio = np.exp(-2j * math.pi * step * (places[1] - places[0]))
    transform = CZT(len(across), len(places), ratio, np.exp(2j * math.pi * step * places[0]))
    found = np.empty((lines.shape[1], len(places)), np.complex128)
    for start in range(0, len(found), LINES):
        found[start : start + LINES] = transform(lines[:, start : start + LINES].T)
    found *= np.exp(-2j * math.pi * first * places)
    return found.T


@lru_cache(maxsize=8)
def _mean_response(count: int, finer: int) -> np.ndarray:
    """Transfer from samples of a band-limited function to its means over cells around every finer-th, (count,) complex."""
    frequency = np.fft.fftfreq(count)
    return np.asarray(np.sinc(frequency * finer) * np.exp(2j * math.pi * frequency * (finer // 2)))


def _pupil(wavefront_error_um: WavefrontError, wavelength_um: float, periods: float, opening: Opening) -> np.ndarray:
    """Complex amplitude on a square grid around the opening, fine enough for W and for an image `periods` lambda N wide."""
    rim = opening.reach * np.linspace(0.0, 1.0, 33)[:, None] * np.exp(2j * math.pi * np.arange(32) / 32)[None, :]
    step = 1e-4
    along_x = wavefront_error_um(rim.real + step, rim.imag) - wavefront_error_um(rim.real - step, rim.imag)
    along_y = wavefront_error_um(rim.real, rim.imag + step) - wavefront_error_um(rim.real, rim.imag - step)
    waves_per_radius = float(np.max(np.hypot(along_x, along_y))) / (2.0 * step * wavelength_um)
    # The image of a sampled pupil is periodic: its period must exceed the image, or light aliases to the other side.
    wanted = 2.0 * waves_per_radius + max(1.25 * periods, 0.5 * periods + 2.0 * waves_per_radius)
    rule = f"needs more than {LARGEST_PUPIL} samples across the pupil; lessen the aberrations or defocus, or stop down"
    require(wanted <= LARGEST_PUPIL, "lens.aberrations", f"{waves_per_radius:.0f} waves per pupil radius", rule)
    count = max(FEWEST_PUPIL, math.ceil(opening.reach * wanted))
    sample = 2.0 * opening.reach / count
    axis = np.arange(-(count - 1) / 2, count / 2) * sample
    ahead, mirrored = wavefront_error_um(rim.real, rim.imag), wavefront_error_um(rim.real, -rim.imag)
    is_even = opening is ROUND and np.array_equal(ahead, mirrored)
    x, y = axis[None, :], axis[count // 2 if is_even else 0 :, None]  # of an even pupil the half from the middle on
    inside = np.clip(opening.depth(x, y) / sample + 0.5, 0.0, 1.0)  # fraction of a sample inside the edge
    found = inside * np.exp((-2j * math.pi / wavelength_um) * wavefront_error_um(x + 0.0 * y, y + 0.0 * x))
    return np.concatenate([found[::-1][: count // 2], found]) if is_even else found
