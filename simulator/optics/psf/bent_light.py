"""Error of kernels over samples of light that is linear between the pixels of a coarse scene.

Light is bilinear between the centres of pixels that are wider than photosites, and bends there only. Samples are its means over
photosites, or parts of them, which do not tell where in them a bend lies: a kernel between samples has what lens, filter and
aperture do up to half a cycle per sample, and light beyond it, which bends have, is taken as what it aliases to.

A sample that has light from squares beside it, too (`Footprint`), has less of the frequencies beyond half a cycle than of those
that they alias to, as a lens has, whose transfer function falls nearly in proportion to the frequency: of
1 - w (1 - cos(2 pi a nu)), which is that of the share w at the distance a, the difference between nu and 1 - nu is nearly in
proportion to 2 nu - 1 for the distance BESIDE_PX. What it takes from frequencies up to half a cycle the kernels give back.
"""

import functools
import math
from dataclasses import dataclass, field, replace

import numpy as np

from simulator.optics.geometry.footprint import Footprint
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

WAVES = 8  # frequencies of waves from pixel to pixel that are looked at, up to half a cycle per pixel
IMAGES = 8  # repetitions of the spectrum of pixels on either side, whose share falls as the square of their number
PLACES = 8  # of a photosite between pixels, along an axis
POINT_CELLS = 99  # per photosite and axis, of which one is a point
NEAR_LIGHT = 4.0  # beside the rays [lambda N]
BESIDE_PX = 0.28  # distance of squares beside a sample [photosites]
MOST_SHARE = 1.0  # of them: no square has less than no light
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
        return 0.0 if plain else wave_error(psf, scale, np.ones((1, 1)), POINT_CELLS)
    return _largest(_Keyed(psf.key, psf), scale, channels)


@functools.lru_cache(maxsize=32)
def _largest(of: _Keyed, scale: float, channels: int) -> float:
    psf = of.psf
    sizes = np.abs(psf.radii_px)
    slabs = {int(np.argmin(sizes))}
    if sizes.min() < WIDEST_PX:
        slabs.add(int(np.argmin(np.abs(sizes - 1.0))))
    own = _unsampled(psf)
    kernels = (_middle_kernel(own, psf.radii_px[slab], channel) for slab in slabs for channel in range(channels))
    return max(wave_error(psf, scale, *kernel) for kernel in kernels)


def _unsampled(psf: FieldPsf) -> _Keyed:
    """What kernels in any samples are made of."""
    one = replace(psf, over=1, seen=None, even_squares=False, highlight_limits=(), footprint=None)
    return _Keyed(one.key, one)


def fit_footprint(psf: FieldPsf, channels: int) -> Footprint:
    """Footprint of samples, one per photosite, that hold filter and open area, with squares beside them in place of the lens.

    Their share is that of the least squares, over frequencies up to 1.5 cycles per photosite: both take as much more from
    one than from that which it aliases to, in the light that photosites see. It is the same for all channels.
    """
    cycles, lens = np.linspace(0.5, 1.5, 64), np.zeros((2, 64))
    folded = np.abs(cycles - np.round(cycles))
    for channel in range(channels):
        cells, per_photosite = _middle_kernel(_unsampled(psf), psf.radii_px[0], channel)
        for axis in (0, 1):
            line = cells.sum(axis=axis) / (cells.sum() * channels * 2)
            lens = lens + np.stack([_line_transfer(line, per_photosite, one) for one in (cycles, folded)])
    seen = np.sinc(cycles)
    wanted = seen * (lens[1] - lens[0])
    taken = seen * lens[1] * (np.cos(2.0 * math.pi * BESIDE_PX * folded) - np.cos(2.0 * math.pi * BESIDE_PX * cycles))
    share = float(wanted @ taken / (taken @ taken))
    return replace(psf.sampling.footprint(psf.pitch_um), beside_px=BESIDE_PX, share=min(max(share, 0.0), MOST_SHARE))


def _line_transfer(line: np.ndarray, per_photosite: int, cycles: np.ndarray) -> np.ndarray:
    """Real part of the transfer function of the light of cells along an axis [cycles per photosite]."""
    inside = (np.arange(len(line)) - len(line) // 2) / per_photosite
    return np.asarray(np.cos(2.0 * math.pi * np.outer(cycles, inside)) @ line / np.sinc(cycles / per_photosite))


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


def wave_error(psf: FieldPsf, scale: float, cells: np.ndarray, per_photosite: int) -> float:
    """Largest error of one kernel, as `kernel_bend_error`; cells as of `Sampling.phases`.

    Pixels that are a wave of f cycles per pixel are light of frequencies (f + n) scale, with the shares sinc^2(f + n), for all
    whole n. Each goes through the transfer function T of lens, filter and aperture. In samples of width h it has the share
    sinc(h nu), is taken as the frequency m within half a cycle per sample, and goes through T(m) / sinc(h m). The wave bends by
    2 - 2 cos(2 pi f) along an axis. In samples of a footprint it has the share of that, which kernels give back at m.
    """
    sampling, pitch_um, over, footprint = psf.sampling, psf.pitch_um, psf.over, psf.footprint
    waves = np.arange(-WAVES, WAVES + 1) / (2.0 * WAVES)
    cycles = waves[:, None] + np.arange(-IMAGES, IMAGES + 1)  # per pixel
    along = (scale * cycles).ravel()
    turned = np.round(along / over)
    taken = along - over * turned
    half = slice(WAVES * cycles.shape[1], None)  # the others are the same, conjugate
    open_area = sampling.transfer(along / pitch_um, pitch_um)
    if footprint is None:
        share = np.sinc(along / over) / np.sinc(taken / over) * np.exp(1j * math.pi * (1 - over) * turned)
        undone = sampling.transfer(taken / pitch_um, pitch_um)
    else:
        share, undone = open_area * footprint.beside_transfer(along), 1.0 / footprint.beside_transfer(taken)
    exact = _transfer(open_area, cells, per_photosite, along, half)
    through = _transfer(undone, cells, per_photosite, taken, half)
    wrong = share[half, None] * share * through - exact
    wrong = wrong.reshape(WAVES + 1, cycles.shape[1], len(waves), cycles.shape[1])
    turns = np.exp(2j * math.pi * cycles[..., None] * np.arange(PLACES) / PLACES) * (np.sinc(cycles) ** 2)[..., None]
    found = np.abs(np.einsum("ambn,amp,bnq->abpq", wrong, turns[WAVES:], turns, optimize=True))
    bends = 2.0 - 2.0 * np.cos(2.0 * math.pi * waves)
    bent = np.hypot(bends[WAVES:, None], bends)
    bent[0, WAVES] = math.inf
    return float((found.max(axis=(2, 3)) / bent).max())


def _transfer(line: np.ndarray, cells: np.ndarray, per_photosite: int, along: np.ndarray, half: slice) -> np.ndarray:
    """Transfer function at frequencies along both axes [cycles per photosite], (frequencies of `half`, frequencies).

    line: that of what else light goes through, along an axis at these frequencies.
    """
    line = line / np.sinc(along / per_photosite)
    line = np.where(np.abs(along) <= 0.5 * per_photosite, line, 0.0)
    inside = (np.arange(len(cells)) - len(cells) // 2) / per_photosite
    each = line[:, None] * np.exp(-2j * math.pi * np.outer(along, inside))
    return np.asarray(each[half] @ (cells / cells.sum()) @ each.T)
