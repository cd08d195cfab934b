"""Depth of field by slabs of constant blur circle, each convolved by FFT, as NumPy and SciPy users write it.

"add" blurs every slab's light and adds it, as ISETCam's oiDepthCompute does; "over" blurs colour and coverage and lays the
slabs over one another from the back, divided by the coverage in the end.
"""

from typing import Literal

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

from simulator.optics.defocus.aperture_kernel import disk_weights


def slab_blur(
    planes: np.ndarray, radius_px: np.ndarray, step_px: float, how: Literal["add", "over"], workers: int = 2
) -> np.ndarray:
    """Blurred planes (channels, height, width) float32; radius_px (height, width) signed, > 0 behind the focus."""
    height, width = radius_px.shape
    reach = int(np.ceil(np.abs(radius_px).max())) + 1
    size = next_fast_len(height + 2 * reach, real=True), next_fast_len(width + 2 * reach, real=True)
    slabs = np.rint(radius_px / step_px).astype(int)
    light, seen = np.zeros_like(planes), np.zeros(radius_px.shape, np.float32)
    for slab in range(slabs.max(), slabs.min() - 1, -1):
        held = (slabs == slab).astype(np.float32)
        if not held.any():
            continue
        spectrum = rfft2(disk_weights(slab * step_px).astype(np.float32), size, workers=workers)
        middle = int(np.ceil(abs(slab * step_px) - 0.5)) if abs(slab * step_px) > 0.5 else 0
        window = slice(middle, middle + height), slice(middle, middle + width)

        def blurred(plane: np.ndarray, spectrum: np.ndarray = spectrum, window: tuple[slice, slice] = window) -> np.ndarray:
            return irfft2(rfft2(plane, size, workers=workers) * spectrum, size, workers=workers)[window]

        covered = blurred(held)
        light = light * (1.0 - covered if how == "over" else 1.0) + np.stack([blurred(plane * held) for plane in planes])
        seen = seen * (1.0 - covered) + covered if how == "over" else seen + covered
    return light / np.maximum(seen, 1e-3) if how == "over" else light
