"""Error of kernels over samples of a scene's light: of what is finer than the samples, which they do not tell.

Light of a scene has even squares, or is bilinear between the centres of pixels that are wider than photosites. Samples are
its means over photosites, or parts of them, which do not tell where in them an edge or a bend lies: a kernel between samples
has what lens, filter and aperture do up to half a cycle per sample, and light beyond it is taken as what it aliases to.

A sample of a footprint (`Footprint`) holds filter and open area, and has less of the frequencies beyond half a cycle than of
those that they alias to, as the lens behind it has. What it takes from frequencies up to half a cycle the kernels give back,
so that it is exact where it falls as the transfer function of the lens does.
"""

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simulator.optics.geometry.footprint import Footprint, footprint_of
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

WAVES = 8  # frequencies of waves from pixel to pixel that are looked at, up to half a cycle per pixel
IMAGES = 8  # repetitions of the spectrum of pixels on either side, whose share falls as a power of their number
FAR_CYCLES = 8.0  # per photosite, up to which repetitions are looked at where pixels are finer
PLACES = 8  # of a photosite between pixels, along an axis
POINT_CELLS = 99  # per photosite and axis, of which one is a point
NEAR_LIGHT = 4.0  # beside the rays [lambda N]
WIDEST_PX = 1.5  # blur radius from which on kernels hide more of what samples mix the larger they are [photosites]
RANDOM = 0.5 * 3.3  # errors of one photosite in a thousand, for steps between two lights [their deviation over the step]
STRIPES = 0.5  # the same for a wave as high as a step
FITTED, ALIASED = 12, (-2, -1, 1, 2)  # frequencies along an axis that a footprint is fitted to, and images of each
ACROSS = (0.1, 0.3, 0.6, 0.9)  # frequencies along the other one, as shares of the largest
SIDE_PX, BESIDE_PX, SHARE = 0.4, 0.4, 0.5  # where a fit begins: the square more, those beside one sample, and their share
LEAST, MOST = 0.02, (1.4, 1.0, 1.0)  # of them as shares of the most, for one sample per photosite: more have a smaller square
STEPS = 24  # of a fit


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
    return _largest(_Keyed(psf.key, psf), scale, channels, True)


def kernel_square_error(psf: FieldPsf, scale: float, channels: int) -> float:
    """The same over samples that mix even squares of a scene, in units of the step between neighbours (`scene_detail`).

    It bounds 99.9 % of the photosites of random squares, and stripes of a step of any width.
    """
    return _largest(_Keyed(psf.key, psf), scale, channels, False)


@functools.lru_cache(maxsize=64)
def _largest(of: _Keyed, scale: float, channels: int, is_tent: bool) -> float:
    psf = of.psf
    if psf.lens_psf is None or (isinstance(psf.lens_psf, PsfTable) and psf.lens_psf.cells == 1):
        is_plain = psf.lens_psf is None or psf.sampling == Sampling()
        return 0.0 if is_plain else _seen(wave_errors(psf, scale, np.ones((1, 1)), POINT_CELLS, 0, is_tent=is_tent), is_tent)
    sizes = np.abs(psf.radii_px)
    slabs = {int(np.argmin(sizes))}
    if sizes.min() < WIDEST_PX:
        slabs.add(int(np.argmin(np.abs(sizes - 1.0))))
    own = _unsampled(psf)
    found = 0.0
    for slab, channel in itertools.product(slabs, range(channels)):
        kernel = _middle_kernel(own, psf.radii_px[slab], channel)
        found = max(found, _seen(wave_errors(psf, scale, *kernel, channel, is_tent=is_tent), is_tent))
    return found


def _unsampled(psf: FieldPsf) -> _Keyed:
    """What kernels in any samples are made of."""
    one = replace(psf, over=1, seen=None, even_squares=False, highlight_limits=(), footprints=())
    return _Keyed(one.key, one)


def fit_footprint(psf: FieldPsf, channels: Sequence[int], scale: float, *, is_tent: bool) -> Footprint:
    """Footprint of samples, `psf.over` per photosite and axis, that hold filter and open area, and squares as the lens has.

    These are those of least squares: of the light beyond half a cycle per sample, in the photosites that see it, that is taken
    as what it aliases to along an axis. One sample lies in the middle of the photosite, for an odd number of them: what aliases
    has its own sign there. They are the same for these channels. scale: pixels of the scene per photosite; is_tent: whether its
    light is bilinear.
    """
    return _fitted(_unsampled(psf), psf.over, tuple(channels), scale, is_tent)


@functools.lru_cache(maxsize=32)
def _fitted(of: _Keyed, over: int, channels: tuple[int, ...], scale: float, is_tent: bool) -> Footprint:
    psf = of.psf
    cycles = (np.arange(FITTED) + 0.5) / FITTED * 0.5 * over
    images, across = cycles[:, None] + over * np.array(ALIASED), np.array(ACROSS) * 0.5 * over

    def light(along: np.ndarray) -> np.ndarray:
        return psf.sampling.transfer(along / psf.pitch_um, psf.pitch_um) * np.sinc(along / scale) ** (1 + is_tent)

    found = []
    for channel in channels:
        cells, per_photosite = _middle_kernel(of, psf.radii_px[0], channel)
        along = np.concatenate([cycles, images.ravel()])
        found += [lens_transfer(turned, per_photosite, along, across) for turned in (cells, cells.T)]
    lens = np.array(found)
    own, aliased = lens[:, :FITTED, None], lens[:, FITTED:].reshape(-1, *images.shape, len(across))
    shares = light(images)[..., None] * light(across)

    def left(sides: np.ndarray) -> np.ndarray:
        taken = _footprint(psf, sides).beside_transfer
        ratio = (taken(images) / taken(cycles)[:, None])[..., None]
        return np.abs((ratio * own - aliased) * shares).ravel()

    most = np.array([MOST[0] / over, *MOST[1:]])
    sides = _least_squares(left, np.array([SIDE_PX, BESIDE_PX / over, SHARE]), LEAST * most, most)
    return _footprint(psf, sides.round(4))  # so that plans repeat on other machines


def _least_squares(
    left: Callable[[np.ndarray], np.ndarray], begin: np.ndarray, least: np.ndarray, most: np.ndarray
) -> np.ndarray:
    """Numbers between bounds that leave the least sum of squares, as begin, by steps of Levenberg and Marquardt.

    SciPy's has the same steps; to import it takes a process longer than all kernels of a lens.
    """
    best, found, damping = begin, left(begin), 1e-2
    for _ in range(STEPS):
        moves = np.diag(1e-4 * most)
        slopes = np.stack([left(best + move) - found for move in moves], axis=1) / 1e-4  # of shares of the most
        normal = slopes.T @ slopes
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), -slopes.T @ found)
        tried = np.clip(best + step * most, least, most)
        then = left(tried)
        if then @ then < found @ found:
            best, found, damping = tried, then, 0.3 * damping
        else:
            damping *= 4.0
    return best


def _footprint(psf: FieldPsf, sides: np.ndarray) -> Footprint:
    blur_px, beside_px, share = map(float, sides)
    return replace(psf.sampling.footprint(psf.pitch_um), blur_px=blur_px, beside_px=beside_px, share=share)


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


def wave_errors(
    psf: FieldPsf, scale: float, cells: np.ndarray, per_photosite: int, channel: int, *, is_tent: bool
) -> np.ndarray:
    """Errors of one kernel in waves of pixels, (WAVES + 1, 2 WAVES + 1, PLACES, PLACES); cells as of `Sampling.phases`.

    They are of waves down and across as high as 1, of `_waves` each, at places of the photosite between pixels.
    Pixels that are a wave of f cycles per pixel are light of frequencies (f + n) scale, with the shares sinc(f + n), squared
    where it is bilinear, for all whole n. Each goes through the transfer function T of lens, filter and aperture. In samples of
    width h it has the share sinc(h nu), is taken as the frequency m within half a cycle per sample, and goes through
    T(m) / sinc(h m). In samples of a footprint it has the share of that, which kernels give back at m.
    """
    sampling, pitch_um, over, footprint = psf.sampling, psf.pitch_um, psf.over, footprint_of(psf.footprints, channel)
    waves, most = _waves(), min(IMAGES, max(2, math.ceil(FAR_CYCLES / scale)))
    cycles = waves[:, None] + np.arange(-most, most + 1)  # per pixel
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
    share, exact = share * undone, lens_transfer(cells, per_photosite, along[half], along)
    through = lens_transfer(cells, per_photosite, taken[half], taken)
    wrong = share[half, None] * share * through - open_area[half, None] * open_area * exact
    wrong = wrong.reshape(WAVES + 1, cycles.shape[1], len(waves), cycles.shape[1])
    turns = np.exp(2j * math.pi * cycles[..., None] * np.arange(PLACES) / PLACES)
    turns *= (np.sinc(cycles) ** (1 + is_tent))[..., None]
    return np.abs(np.einsum("ambn,amp,bnq->abpq", wrong, turns[WAVES:], turns, optimize=True))


def _waves() -> np.ndarray:
    """Frequencies of waves across [cycles per pixel]; those down are the ones from 0 on."""
    return np.arange(-WAVES, WAVES + 1) / (2.0 * WAVES)


def _seen(errors: np.ndarray, is_tent: bool) -> float:
    """What errors of `wave_errors` make of a bend, or of a step between even squares."""
    if is_tent:  # a wave bends by 2 - 2 cos(2 pi f) along an axis
        bends = 2.0 - 2.0 * np.cos(2.0 * math.pi * _waves())
        bent = np.hypot(bends[WAVES:, None], bends)
        bent[0, WAVES] = math.inf
        return float((errors.max(axis=(2, 3)) / bent).max())
    ends = np.ones(2 * WAVES + 1)
    ends[[0, -1]] = 0.5
    even = 2.0 * np.outer(ends, ends)[WAVES:]
    even[0] *= 0.5
    random = np.tensordot(even / even.sum(), errors**2, axes=2).max()
    return max(RANDOM * math.sqrt(random), STRIPES * float(errors.max()))


def lens_transfer(cells: np.ndarray, per_photosite: int, down: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Transfer function of the light of cells at frequencies along both axes [cycles per photosite], (down, across) complex."""
    inside = (np.arange(len(cells)) - len(cells) // 2) / per_photosite

    def each(along: np.ndarray) -> np.ndarray:
        line = np.where(np.abs(along) <= 0.5 * per_photosite, 1.0 / np.sinc(along / per_photosite), 0.0)
        return line[:, None] * np.exp(-2j * math.pi * np.outer(along, inside))

    return np.asarray(each(down) @ (cells / cells.sum()) @ each(across).T)
