"""Predicts the error of the point spread function as it is planned."""

import itertools
import math
from collections.abc import Callable
from functools import partial

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.error_term import PSF, ErrorTerm, Skipped
from simulator.optics.geometry.projection import Projection
from simulator.optics.psf.field_psf import FieldPsf, airy_radius_px
from simulator.optics.psf.kernel_split import Core, gather_table, split_kernel
from simulator.optics.psf.lamp_spots import LampSpots
from simulator.optics.psf.lamps import LAMP_TIMES, Lamps
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.square_light import shared_length
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wavefront_psf import WavefrontPsf

PLACES = (0.0, 0.25, 0.5, 0.75)  # of lamps in a photosite, along an axis, at which their error is asked
BESIDE = 1.5  # times the error of one lamp, where several lie beside each other
TIGHTER = "give a smaller tolerance"
DIVIDED = "give a scene of 1, 2 or 4 pixels per photosite that begin at its border"
DRAWN = "lamps are drawn by themselves in one picture that is in focus and at rest, without distortion; give fewer of them"
IN_FOCUS = "it is gone where surfaces have one distance, or circles of more than a photosite"
FAR_CIRCLES = "circles far larger than the Airy disk, as those of an ideal lens behind its kernel in focus"  # cause of a term
SMALLER = "it is gone where circles are smaller, or without lens.diffraction"
TOGETHER = "give layers whose edges lie before even light, or one picture with depth"
BLURRED = "it is gone without camera.low_pass and camera.fill_factor, or where nothing is in focus"


def psf_errors(
    psf: FieldPsf | None,
    skipped: Skipped | None,
    accuracy: Accuracy,
    smallest_px: float | None = None,
    contrast: float = 1.0,
    sampling_error: float = 0.0,
    lamp_error: float = 0.0,
    *,
    left_out: float = 0.0,
    spots_error: float = 0.0,
    spread_error: float = 0.0,
    far_error: float = 0.0,
    is_fine: bool = False,
) -> list[ErrorTerm]:
    """Return the errors of a kernel, of the light that it is applied to, or of leaving it out.

    skipped: why there is none; None: there is one. smallest_px: radius of the smallest blur circle, of a geometric blur that
    comes first; None: none does. contrast: second difference of the light between photosites, as a share of the brightest.
    sampling_error: of the light that kernels by distance are applied to, the same. lamp_error: of `undrawn_error`.
    left_out: of `focus_error`. spots_error: of `filtered_layers_error`. spread_error: of `spread_layers_error`.
    far_error: of `far_circle_error`.
    is_fine: whether the scene has more than a pixel per photosite.
    """
    if skipped is not None:
        return [ErrorTerm(PSF, "none, since its effect is small", skipped.sigma, TIGHTER, falls=True)]
    if psf is None:
        return []
    found = []
    if left_out > 0.0:
        found.append(ErrorTerm(PSF, "kernels of one distance for all", accuracy.in_sigma(left_out), TIGHTER, falls=True))
    if psf.core is not None:
        found.append(ErrorTerm(PSF, "a core and a tail on cells", accuracy.in_sigma(psf.core.error), TIGHTER, falls=True))
    if psf.field_error > 0.0:
        cause = f"kernels of {psf.nodes[0]} x {psf.nodes[1]} places, between which spots move"
        found.append(ErrorTerm(PSF, cause, accuracy.in_sigma(psf.field_error), TIGHTER, falls=True))
    if smallest_px is not None and not psf.by_distance and psf.over == 1 and psf.sampling != Sampling():
        error = accuracy.in_sigma(contrast * photosite_light_error(smallest_px))
        found.append(
            ErrorTerm(PSF, "light of whole photosites behind a blur, which a low-pass or open area divides", error, BLURRED)
        )
    if smallest_px is not None and is_fine and not psf.by_distance and isinstance(psf.lens_psf, WavefrontPsf):
        left = max(diffracted_light_error(smallest_px, spread_share(psf)), _corrected_error(psf, psf.lens_psf, smallest_px))
        error = accuracy.in_sigma(contrast * left)
        found.append(
            ErrorTerm(PSF, "light of whole photosites behind a blur, which diffraction spreads", error, IN_FOCUS, is_rare=True)
        )
    if sampling_error > 0.0:
        cause = f"{psf.over} x {psf.over} samples of light per photosite, which mix pixels of the scene"
        if not is_fine:
            cause = f"{psf.over} x {psf.over} samples of light per photosite, within which it bends"
        found.append(ErrorTerm(PSF, cause, accuracy.in_sigma(sampling_error), DIVIDED))
    if spots_error > 0.0:
        cause = "means of layers over the spots of a low-pass filter"
        found.append(ErrorTerm(PSF, cause, accuracy.in_sigma(spots_error), TIGHTER, falls=True))
    if spread_error > 0.0:
        found.append(ErrorTerm(PSF, "kernels that spread each layer by itself", accuracy.in_sigma(spread_error), TOGETHER))
    if far_error > 0.0:
        found.append(ErrorTerm(PSF, FAR_CIRCLES, accuracy.in_sigma(far_error), SMALLER))
    if lamp_error > 0.0:
        found.append(
            ErrorTerm(PSF, "lamps that go through samples of light with the rest", accuracy.in_sigma(lamp_error), DRAWN)
        )
    return found


def core_error(psf: FieldPsf, core: Core, channels: int, seen: Visibility) -> float:
    """Error of a core, arms and tail, as `Visibility.own_error` counts it, by the kernels in the middle and a corner."""
    if core.reach_px >= psf.reach_px:
        return 0.0
    found = 0.0
    for node in {(psf.nodes[0] // 2, psf.nodes[1] // 2), (0, 0)}:
        for channel in range(channels):
            table, over, spread = gather_table(psf.kernel(0, channel, False, *node)), psf.over, psf.sample_spread(channel)
            kernel = table.reshape(len(table) // over, over, -1, over).sum(axis=(1, 3))
            own = partial(seen.own_error, kernel=kernel)
            found = max(found, split_kernel(table, over, core.reach_px, core.arm_px, core.cell_px, own, spread).error)
    return found


def focus_error(psf: FieldPsf, away_px: float, channels: int, seen: Visibility) -> float:
    """Error of kernels of one blur radius for surfaces up to so far from it, as `core_error`.

    away_px: difference of the signed blur radii [photosites]. Defocus and aberrations shift the same rays, so that the light of
    a point spreads by their covariance, too: by the first power of the difference, that of an ideal lens by its square.
    """
    if away_px == 0.0 or not psf.by_distance or not isinstance(psf.lens_psf, WavefrontPsf):
        return 0.0
    middle, found = psf.radii_px[0], 0.0
    others = [psf.of_one_radius(middle + way) for way in (-away_px, away_px)]
    for node in {(psf.nodes[0] // 2, psf.nodes[1] // 2), (0, 0)}:
        for channel in range(channels):
            own = psf.kernel(0, channel, False, *node).sum(axis=0)
            for other in others:
                there = other.kernel(0, channel, False, *node).sum(axis=0)
                wide = max(len(own), len(there))
                here, away = (np.pad(one, (wide - len(one)) // 2) for one in (own, there))
                found = max(found, seen.own_error(away - here, here))
    return found


def undrawn_error(
    psf: FieldPsf,
    lamps: Lamps | None,
    projection: Projection,
    accuracy: Accuracy,
    dark: Callable[[], float],
    smallest_px: float | None,
) -> float:
    """Error of lamps that are not drawn by themselves, as `core_error`: what samples of their light have for their images.

    dark: returns the electron radiance beside them. smallest_px: radius of the smallest blur circle of a geometric blur that
    comes first; None: none does. 0 where light samples are the squares of the scene, whose kernels have no negative values.
    """
    light = accuracy.peak * accuracy.brightest if lamps is None else lamps.rest
    if psf.even_squares or not psf.highlight_limits or light <= LAMP_TIMES * min(psf.highlight_limits):
        return 0.0
    spot = max(1.0, math.pi * smallest_px**2) if smallest_px is not None else 1.0
    lamp_e, dark_e = (accuracy.electrons_per_radiance * one for one in (light / spot, dark()))
    spots = LampSpots(psf, 1.0 / projection.scale, np.array(PLACES), is_tent=projection.is_bilinear)
    worst = 0.0
    for place in itertools.product(PLACES, PLACES):
        image = spots.image(0, (psf.nodes[0] // 2, psf.nodes[1] // 2), place)
        noise_e = np.sqrt(np.maximum(dark_e + lamp_e * image + accuracy.read_noise_e**2, 1.0))
        worst = max(worst, float((lamp_e * np.abs(_sampled_image(psf, spots, place) - image) / noise_e).max()))
    return BESIDE * worst * accuracy.sigma


def _sampled_image(psf: FieldPsf, spots: LampSpots, place: tuple[float, float]) -> np.ndarray:
    """What samples of light make of a pixel of light 1, as `LampSpots.image`."""
    over, node, reach = psf.over, (psf.nodes[0] // 2, psf.nodes[1] // 2), psf.reach_px
    kernels = psf.kernel(0, 0, psf.has_ringing(0, 0), *node)
    kernels = np.pad(kernels, ((0, 0), *2 * [2 * [2 * spots.reach_px]]))  # spots may reach farther than twice a small kernel
    middle, found = len(kernels[0]) // 2, np.zeros(2 * [2 * spots.reach_px + 1])
    samples = np.arange(-over * (spots.reach_px - reach), over * (spots.reach_px - reach + 1))
    down, across = (_pixel_in_samples(psf, samples + 0.5 - over * one, over * spots.width_px, spots.is_tent) for one in place)
    for (y, in_y), (x, in_x) in itertools.product(zip(samples, down, strict=True), zip(samples, across, strict=True)):
        if in_y * in_x > 0.0:
            rows, columns = (
                slice(middle - spots.reach_px - one // over, middle + spots.reach_px + 1 - one // over) for one in (y, x)
            )
            found += in_y * in_x * kernels[over * (y % over) + x % over, rows, columns]
    return found


def _pixel_in_samples(psf: FieldPsf, away: np.ndarray, width: float, is_tent: bool) -> np.ndarray:
    """Mean light of samples so far from the middle of a pixel of light 1 along an axis, same shape [samples]."""
    if psf.footprints:
        return psf.footprints[0].of_pixel(away / psf.over, width / psf.over, is_tent=is_tent)
    return shared_length(Sampling(), 1.0, away, width, is_tent=is_tent)


def photosite_light_error(radius_px: float) -> float:
    """Error of a low-pass filter or a fill factor that is applied to means over whole photosites behind a blur circle.

    A share of the contrast. It bounds 99.9 % of the photosites of random squares of 1.5 and 0.75 photosites, for spots half a
    photosite and more apart and fill factors from 0.44 on: what is finer than the photosites cannot be told from their means.
    """
    return min(0.21, 0.025 * max(radius_px, 1e-3) ** -1.45)


def spread_share(psf: FieldPsf) -> float:
    """Largest share of a photosite's light that the kernel in the middle of the field brings to others."""
    middle = psf.nodes[0] // 2, psf.nodes[1] // 2
    channels = len(psf.lens_psf.wavelengths_nm) if isinstance(psf.lens_psf, WavefrontPsf) else 1
    return max(1.0 - float(psf.kernel(0, channel, False, *middle).max()) for channel in range(channels))


def diffracted_light_error(radius_px: float, spread: float) -> float:
    """Error of kernels of diffraction that are applied to means over whole photosites of a fine scene behind a blur circle.

    A share of the contrast. spread: of `spread_share`. Light spreads from where it is in a photosite, which their means do not
    tell: as with open areas (`photosite_light_error`), for the share that leaves. It bounds 99.9 % of the photosites of random
    squares of 1.5 to 8 to a photosite, and of 2.4 photosites, for Airy disks whose radius is 0.1 to 1 photosites. Where kernels
    end is not counted here.
    """
    return min(0.12, spread * min(0.95, 0.036 * max(radius_px, 1e-3) ** -1.4))


def _corrected_error(psf: FieldPsf, lens_psf: WavefrontPsf, smallest_px: float) -> float:
    """Largest `corrected_light_error` of the blur radii of a PSF that are corrected; smallest_px: of the scene."""
    longest = airy_radius_px(lens_psf) * float(np.max(lens_psf.wavelengths_nm) / np.min(lens_psf.wavelengths_nm))
    airy_px = airy_radius_px(lens_psf), longest
    radii_px = {max(abs(radius), smallest_px) for radius in psf.corrected_px}
    return max((corrected_light_error(radius, airy) for radius in radii_px for airy in airy_px), default=0.0)


def corrected_light_error(radius_px: float, airy_px: float) -> float:
    """Error of a correction of a blur circle to wave optics that is applied to means over whole photosites of a fine scene.

    A share of the contrast. airy_px: radius of the Airy disk. A correction changes waves by up to `moved`, of which the means
    tell the less the larger the circle is: what lies in a photosite goes to its rim. It bounds 99.9 % of the photosites of
    random squares, 2 to 8 to a photosite and of 1.5 and 2.5 photosites, and of waves of 1.5 to 12 photosites, for radii of
    0.5 to 6 photosites and Airy disks of 0.1 to 1.
    """
    of_airy = radius_px / airy_px
    moved = min(0.75 * of_airy**2, 0.255, 0.375 * max(of_airy, 1e-3) ** -0.8)
    return moved * min(0.65, 0.2 + 0.55 * max(radius_px - 1.0, 0.0))
