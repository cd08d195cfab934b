"""Light behind the transfer function of a round pupil, in float64."""

import math

import numpy as np
from scipy import fft

from simulator.optics.psf.field_psf import FieldPsf


def pupil_transfer(s: np.ndarray, waves: float) -> np.ndarray:
    """Transfer of a round pupil at shares of its cutoff, of any shape, with so many waves of defocus at its rim.

    The integral over the area that two pupils share, 2 s apart, of cos(8 pi waves s x) (Goodman, Introduction to Fourier
    Optics, 6.4.4), by the midpoint rule; without defocus its closed form.
    """
    s = np.clip(s, 0.0, 1.0)
    if waves == 0.0:
        return 2.0 / math.pi * (np.arccos(s) - s * np.sqrt(1.0 - s * s))
    apart, along = np.linspace(0.0, 1.0, 2001)[:, None], (np.arange(1000) + 0.5) / 1000
    x = (1.0 - apart) * along
    half = np.sqrt(np.maximum(1.0 - (x + apart) ** 2, 0.0)) * np.cos(8.0 * math.pi * waves * apart * x)
    return np.interp(s, apart[:, 0], 4.0 / math.pi * (1.0 - apart[:, 0]) * half.mean(axis=1))


def through_pupil(planes: np.ndarray, psf: FieldPsf, beyond: int, parts: int = 0, radius_px: float = 0.0) -> np.ndarray:
    """Light of photosites in a channel behind the transfer function of a round pupil, low-pass filter and open area, float64.

    planes: light that goes on as its edge for `beyond` photosites. parts: 0: it is what photosites see of smooth light; else it
    has even squares, so many to a photosite and axis, of which the pupil passes no detail that they do not hold. radius_px: of
    the blur circle [photosites].
    """
    per_photosite = max(parts, 1)
    around = np.pad(planes.astype(np.float64), beyond * per_photosite, mode="edge")
    shape = [fft.next_fast_len(side, real=True) for side in around.shape]
    down, across = fft.fftfreq(shape[0], 1.0 / per_photosite)[:, None], fft.rfftfreq(shape[1], 1.0 / per_photosite)[None, :]
    transfer, wavelengths_nm = 0.0, psf.lens_psf.wavelengths_nm[0]
    for wavelength_nm in wavelengths_nm:
        lambda_n_px = 1e-3 * wavelength_nm * psf.lens_psf.f_number / psf.pitch_um
        own = pupil_transfer(np.hypot(down, across) * lambda_n_px, radius_px / (4.0 * lambda_n_px))
        transfer = transfer + own / len(wavelengths_nm)
    if parts:
        side, apart = math.sqrt(psf.sampling.fill_factor), psf.sampling.low_pass_um / psf.pitch_um
        for along in (down, across):
            middle = np.exp(-1j * math.pi * along * (1.0 - 1.0 / parts))  # of a photosite, from that of its first square
            transfer = transfer * np.sinc(side * along) * np.cos(math.pi * apart * along)
            transfer = transfer * np.sinc(along / parts) * np.conj(middle)
    found = fft.irfft2(fft.rfft2(around, shape) * transfer, shape)
    first = beyond * per_photosite
    return found[first : first + len(planes) : per_photosite, first : first + planes.shape[1] : per_photosite]
