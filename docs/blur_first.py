"""How wrong it is to blur geometrically first and let light diffract as in focus afterwards: a table of lens_aberrations.md."""

import math

import numpy as np
from scipy.signal import fftconvolve

from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.lens.perspective import AIRY_ZERO
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil

F_NUMBER, WAVELENGTH_UM = 8.0, 0.55
CELLS = 6  # per Airy radius, which is the pitch of the photosites
READ_NOISE_E, EXPOSURE_E = 2.0, 2000.0


def kernels(radius_airy: float) -> tuple[np.ndarray, np.ndarray]:
    """Light of a point in cells by wave optics, and by the two steps."""
    size = 2 * CELLS * math.ceil(radius_airy + 20.0) + 1
    cell_um = AIRY_ZERO * WAVELENGTH_UM * F_NUMBER / CELLS
    lens = WavefrontPsf(Aberrations(), F_NUMBER, cell_um, ((1e3 * WAVELENGTH_UM,),), size, cells=1)
    together, focus = lens.kernel(0, radius_airy * CELLS, (0.0, 0.0)), lens.kernel(0, 0.0, (0.0, 0.0))
    steps = fftconvolve(focus, aperture_weights(Pupil(), radius_airy * CELLS), mode="same")
    return together, steps / steps.sum()


def deviations(picture: np.ndarray, together: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """|z| of the second kernel's photosites against the first's."""
    seen = [fftconvolve(picture, kernel, mode="valid") for kernel in (together, steps)]
    side = len(seen[0]) // CELLS * CELLS
    truth, found = (one[:side, :side].reshape(side // CELLS, CELLS, -1, CELLS).mean(axis=(1, 3)) for one in seen)
    return np.abs(EXPOSURE_E * (found - truth) / np.sqrt(EXPOSURE_E * truth + READ_NOISE_E**2))


def main() -> None:
    """Print the table."""
    for radius_airy in (0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 8.0, 16.0):
        together, steps = kernels(radius_airy)
        lines = [np.fft.fft(np.fft.ifftshift(kernel.sum(axis=0))) for kernel in (together, steps)]
        side = len(together) // CELLS * CELLS + 50 * CELLS
        edge = np.where(np.arange(side) < side // 2, 0.2, 1.0)[None, :].repeat(side, 0)
        noise = np.random.default_rng(0).gamma(4.0, 0.25, (side // CELLS, side // CELLS)).repeat(CELLS, 0).repeat(CELLS, 1)
        at_edge, in_noise = (deviations(picture, together, steps) for picture in (edge, noise))
        transfer = np.abs(lines[0] - lines[1]).max()
        print(f"| {radius_airy:g} | {transfer:.2f} | {at_edge.max():.1f} | {np.quantile(in_noise, 0.99):.1f} |")


if __name__ == "__main__":
    main()
