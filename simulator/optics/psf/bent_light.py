"""Error of kernels over samples of light that is linear between the pixels of a coarse scene.

Light is bilinear between the centres of pixels that are wider than photosites, and bends there only. Samples are its means over
photosites, or parts of them, which do not tell where in them a bend lies: a kernel between samples has what lens, filter and
aperture do up to half a cycle per sample, and light beyond it, which bends have, is taken as what it aliases to.
"""

import functools
import math
from dataclasses import dataclass, field, replace

import numpy as np

from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

WAVES = 8  # frequencies of waves from pixel to pixel that are looked at, up to half a cycle per pixel
IMAGES = 8  # repetitions of the spectrum of pixels on either side, whose share falls as the square of their number
PLACES = 8  # of a photosite between pixels, along an axis
POINT_CELLS = 99  # per photosite and axis, of which one is a point
NEAR_LIGHT = 4.0  # beside the rays [lambda N]
WIDEST_PX = 1.5  # blur radius from which on kernels hide more of the bends the larger they are [photosites]


@dataclass(frozen=True)
class _Keyed:
    """A PSF that is equal to another where all numbers are."""

    key: tuple[object, ...]
    psf: FieldPsf = field(compare=False)


def kernel_bend_error(psf: FieldPsf, scale: float, channels: int) -> float:
    """Largest error of kernels by distance over samples of bilinear light, in units of its bend (`scene_bends`).

    scale: pixels of the scene per photosite, below 1. It is that of the wave of pixels and of the place of a photosite between
    them where it is largest, in any channel, in the middle of the field. The blur radii are the smallest one and that nearest
    to one photosite: a circle lets through least of what aliases where it hides what it aliases to.
    Where the kernels of a file are known for whole photosites only, which are their truth, that of filter and open area alone.
    """
    if psf.lens_psf is None or (isinstance(psf.lens_psf, PsfTable) and psf.lens_psf.cells == 1):
        plain = psf.lens_psf is None or psf.sampling == Sampling()
        return 0.0 if plain else wave_error(psf.sampling, psf.pitch_um, psf.over, scale, np.ones((1, 1)), POINT_CELLS)
    return _largest(_Keyed(psf.key, psf), scale, channels)


@functools.lru_cache(maxsize=32)
def _largest(of: _Keyed, scale: float, channels: int) -> float:
    psf = of.psf
    sizes = np.abs(psf.radii_px)
    slabs = {int(np.argmin(sizes))}
    if sizes.min() < WIDEST_PX:
        slabs.add(int(np.argmin(np.abs(sizes - 1.0))))
    one = replace(psf, over=1, seen=None, even_squares=False, highlight_limits=())  # what kernels in any samples are made of
    own = _Keyed(one.key, one)
    kernels = (_middle_kernel(own, psf.radii_px[slab], channel) for slab in slabs for channel in range(channels))
    return max(wave_error(psf.sampling, psf.pitch_um, psf.over, scale, *kernel) for kernel in kernels)


@functools.lru_cache(maxsize=32)
def _middle_kernel(of: _Keyed, radius_px: float, channel: int) -> tuple[np.ndarray, int]:
    """Light of a point in each cell in the middle of the field, and cells per photosite and axis.

    Of a wavefront it ends NEAR_LIGHT from the rays: what lies farther out is the same in samples.
    """
    psf, lens = of.psf, of.psf.lens_psf
    if not isinstance(lens, WavefrontPsf):
        return psf.point_cells(channel, psf.nodes[0] // 2, psf.nodes[1] // 2)
    numbers = lens.aberrations, lens.f_number, lens.pitch_um, lens.wavelengths_nm
    size_px = kernel_size_px(*numbers, (radius_px * lens.opening.reach,), airy_margin=NEAR_LIGHT)
    near = replace(psf.fit_kernel(radius_px), size_px=size_px)
    return near.cell_kernel(channel, radius_px, (0.0, 0.0)), near.cells


def wave_error(sampling: Sampling, pitch_um: float, over: int, scale: float, cells: np.ndarray, per_photosite: int) -> float:
    """Largest error of one kernel, as `kernel_bend_error`; cells as of `Sampling.phases`.

    Pixels that are a wave of f cycles per pixel are light of frequencies (f + n) scale, with the shares sinc^2(f + n), for all
    whole n. Each goes through the transfer function T of lens, filter and aperture. In samples of width h it has the share
    sinc(h nu), is taken as the frequency m within half a cycle per sample, and goes through T(m) / sinc(h m). The wave bends by
    2 - 2 cos(2 pi f) along an axis.
    """
    waves = np.arange(-WAVES, WAVES + 1) / (2.0 * WAVES)
    cycles = waves[:, None] + np.arange(-IMAGES, IMAGES + 1)  # per pixel
    along = (scale * cycles).ravel()
    turned = np.round(along / over)
    taken = along - over * turned
    share = np.sinc(along / over) / np.sinc(taken / over) * np.exp(1j * math.pi * (1 - over) * turned)
    half = slice(WAVES * cycles.shape[1], None)  # the others are the same, conjugate
    exact, through = (_transfer(sampling, pitch_um, cells, per_photosite, one, half) for one in (along, taken))
    wrong = share[half, None] * share * through - exact
    wrong = wrong.reshape(WAVES + 1, cycles.shape[1], len(waves), cycles.shape[1])
    turns = np.exp(2j * math.pi * cycles[..., None] * np.arange(PLACES) / PLACES) * (np.sinc(cycles) ** 2)[..., None]
    found = np.abs(np.einsum("ambn,amp,bnq->abpq", wrong, turns[WAVES:], turns, optimize=True))
    bends = 2.0 - 2.0 * np.cos(2.0 * math.pi * waves)
    bent = np.hypot(bends[WAVES:, None], bends)
    bent[0, WAVES] = math.inf
    return float((found.max(axis=(2, 3)) / bent).max())


def _transfer(
    sampling: Sampling, pitch_um: float, cells: np.ndarray, per_photosite: int, along: np.ndarray, half: slice
) -> np.ndarray:
    """Transfer function at frequencies along both axes [cycles per photosite], (frequencies of `half`, frequencies)."""
    line = sampling.transfer(along / pitch_um, pitch_um) / np.sinc(along / per_photosite)
    line = np.where(np.abs(along) <= 0.5 * per_photosite, line, 0.0)
    inside = (np.arange(len(cells)) - len(cells) // 2) / per_photosite
    each = line[:, None] * np.exp(-2j * math.pi * np.outer(along, inside))
    return np.asarray(each[half] @ (cells / cells.sum()) @ each.T)
