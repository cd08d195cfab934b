"""What circles far larger than the Airy disk leave, which are those of an ideal lens convolved with its kernel in focus."""

import math

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.scene_contrast import between
from simulator.optics.defocus.scene_light import MOST, composite, layer_at, seen_contrast
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.field_psf import FAR_AIRY, FieldPsf, airy_radius_px, farthest_correction_px
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.scene.sample_places import sample_places
from simulator.scene.scene import Scene

LARGEST_PX = 24.0  # blur radius whose kernels stand for those of larger circles, which leave less [photosites]
WORST_AIRY = (
    1.5  # blur radius at which wave optics differs most from circles behind the kernel in focus [radii of the Airy disk]
)
PARTS, PART_PX = 3, 48  # parts per axis of a large scene whose light is looked at, and their side [photosites]


def far_circle_error(psf: FieldPsf, scene: Scene, to_share: np.ndarray, defocus: Defocus, accuracy: Accuracy) -> float:
    """Error of the circles beyond those whose kernels are of wave optics, as a share of the brightest light.

    In parts of the scene, 99.9 % of whose photosites keep it, at the worst of such circles: the larger a circle is, the less is
    left, with the power -0.8 of its radius in radii of the Airy disk (docs/lens_aberrations.md, *With depth*). It is that of
    the middle channel. to_share: (bands, channels) of scene planes in shares of the brightest light.
    """
    lens = psf.lens_psf
    if not isinstance(lens, WavefrontPsf) or lens.aberrations != Aberrations():
        return 0.0
    worst_px = _worst_px(psf, lens, defocus)
    if worst_px is None:
        return 0.0
    exact, used = psf.far_kernels(min(worst_px, LARGEST_PX), len(lens.wavelengths_nm) // 2)
    return max(float(np.quantile(left, MOST)) for left in _left(scene, to_share, exact, used - exact, defocus.scale, accuracy))


def _worst_px(psf: FieldPsf, lens: WavefrontPsf, defocus: Defocus) -> float | None:
    """Blur radius of the scene's circles beyond those of wave optics that leave most [photosites]; None: there are none.

    The smallest, but for circles smaller than WORST_AIRY.
    """
    known_px, airy_px = 0.0, airy_radius_px(lens)
    if psf.by_distance and len(psf.radii_px) == 1:
        return None
    if psf.by_distance:
        known_px = FAR_AIRY * airy_px
    elif psf.corrected_px:
        known_px = farthest_correction_px(lens)
    ranges_px = defocus.of_scene().ranges_px
    beyond = [max(least, known_px, min(WORST_AIRY * airy_px, most)) for least, most in ranges_px if most > known_px]
    return min(beyond, default=None)


def _left(
    scene: Scene, to_share: np.ndarray, exact: np.ndarray, wrong: np.ndarray, scale: float, accuracy: Accuracy
) -> list[np.ndarray]:
    """What a difference of kernels leaves in parts of the scene, in the noise of their light."""
    from scipy.signal import fftconvolve

    beside, found = len(exact) // 2, []
    tops, lefts = (sample_places(max(round(size / scale) - PART_PX, 1), PARTS).tolist() for size in scene.planes.shape[:2])
    for top in tops:
        for left in lefts:
            light = _photosites(scene, to_share, (top, left), beside, scale)
            seen, error = (fftconvolve(light, kernel[..., None], mode="valid", axes=(0, 1)) for kernel in (exact, wrong))
            found.append(seen_contrast(error, seen, accuracy))
    return found


def _photosites(scene: Scene, to_share: np.ndarray, first: tuple[int, int], beside: int, scale: float) -> np.ndarray:
    """Light of PART_PX photosites from `first` on, and of so many beside them, (rows, columns, channels)."""
    parts = max(round(scale), 1)
    places = [(begin - beside + (np.arange(parts * (PART_PX + 2 * beside)) + 0.5) / parts) * scale - 0.5 for begin in first]
    ends = [
        np.clip([math.floor(own[0]), math.floor(own[-1]) + 2], 0, size)
        for own, size in zip(places, scene.planes.shape, strict=False)
    ]
    block = tuple(slice(min(low, high - 1), high) for low, high in ends)
    light = composite([layer_at(layer, block, to_share) for layer in scene.layers])
    for axis, (own, part) in enumerate(zip(places, block, strict=True)):
        light = between(light, own - part.start, axis)
    rows, columns, channels = light.shape
    return light.reshape(rows // parts, parts, columns // parts, parts, channels).mean(axis=(1, 3))
