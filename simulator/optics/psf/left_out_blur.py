"""What a blur circle that is left out behind a point spread function brings over the borders of photosites.

Leaving out a circle of radius r is wrong by g(x) for each step of light at the distance x of a border, of the step's height. Of
an ideal lens its transform is that of the lens with defocus less that in focus, over (2 pi nu)^2. A frequency nu is what points
of the pupil add that lie nu lambda N diameters apart, and defocus shifts their waves: for small r it loses (2 pi nu r)^2 / 2
times the integral of p^2 over the part that the pupil and its shifted copy share, over the pupil's area, p [radii] along the
shift from the part's middle (Hopkins, 1955, Proc. R. Soc. A 231, 91): less than the 1/4 of the whole pupil, as of rays.
Over all nu, g(0) = r^2 / 8 times 64 / (45 pi lambda N). Larger circles lose less, since 1 - cos a < a^2 / 2, and so do
aberrations, whose waves partly cancel. Of a circle alone g(0) is the mean of |x| over half of it, 2 r / (3 pi), and before a
spread with a given line spread function at most r^2 / 8 times its peak.

A tent as high as g with the same integral is r^2 / (8 g(0)) wide on either side: the mean of the light over this width on one
side of a border less that on the other, times g(0), is what crosses it. It is taken at least as wide as the circle reaches.
"""

import math

import numpy as np

from simulator.optics.defocus.accuracy import WAVE_CURVATURE, Accuracy
from simulator.optics.defocus.strip_contrast import border_contrast
from simulator.optics.geometry.footprint import Footprint
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.scene.scene import Scene

PEAK = 64.0 / (45.0 * math.pi)  # of the line that defocus takes light from, over 1 / (lambda N)
FARTHEST_PX = 1.0  # border from the middle of a photosite, of spots of a low-pass filter, at which steps are looked at
STEP = 2.0 / (3.0 * math.pi)  # mean of |x| over half a disk [radii]
OF_STEPS = 0.5 * (2.0 * math.pi / 9.0) ** 2 / WAVE_CURVATURE  # bend of a wave of 9 photosites, over its second difference

WHOLE = Footprint()  # of a photosite

LensPsf = WavefrontPsf | PsfTable | None


def left_out_error(
    scene: Scene,
    to_share: np.ndarray,
    accuracy: Accuracy,
    scale: float,
    radius_px: float,
    lens: LensPsf = None,
    area: Footprint = WHOLE,
    corner_radius: float = 1.0,
) -> float:
    """Error of leaving out blur circles of up to a radius, as a share of the brightest light.

    It bounds 99.9 % of the photosites of edges, upright and slanted, and of random pixels in float64: 2, 4 and 8 to a
    photosite, lambda N of 0.1 to 2 photosites or none, spots of a low-pass filter and open areas, and radii of 0.1 to 0.4.

    to_share: (bands, channels) shares of the brightest light per unit of the scene's planes. scale: scene pixels per photosite,
    above 1. lens: None: an ideal one. area: open squares of a photosite behind its filter. corner_radius: of the pupil [radii].
    """
    corner_px = radius_px * corner_radius
    share, beside_px = crossing_share(radius_px, sharpness(lens))
    width, spots = area.side_px, np.array([-0.5, 0.5]) * area.low_pass_px
    borders_px = np.minimum(np.abs(0.5 * width + np.unique(spots)), FARTHEST_PX)
    steps = [border_contrast(layer, to_share, accuracy, scale, borders_px, max(beside_px, corner_px)) for layer in scene.layers]
    return OF_STEPS * share * kept_share(lens) * max(steps) / width


def sharpness(lens: LensPsf) -> float:
    """Peak of the line from which light crosses borders [1 / photosite]; inf where optics spread nothing within photosites."""
    if isinstance(lens, WavefrontPsf):
        inverse_nm = max(float(np.mean(1.0 / np.array(row))) for row in lens.wavelengths_nm)
        return PEAK * 1e3 * inverse_nm * lens.pitch_um / lens.f_number
    if isinstance(lens, PsfTable) and lens.cells > 1:
        return lens.cells * _brightest_line(lens)
    return math.inf


def kept_share(lens: LensPsf) -> float:
    """Share that kernels of whole photosites leave of what crosses, whose signs differ on either side of a border."""
    return _brightest_line(lens) if isinstance(lens, PsfTable) and lens.cells == 1 else 1.0


def _brightest_line(table: PsfTable) -> float:
    """Largest share of a kernel's light in a row or column."""
    return max(float(table.kernels.sum(axis=axis).max()) for axis in (-1, -2)) / table.light


def crossing_share(radius_px: float, sharpness: float) -> tuple[float, float]:
    """Share of a step of light that crosses a border without a blur circle, and the width beside it that counts [photosites].

    Light that crosses from farther than a photosite counts as from within it.
    """
    share = min(radius_px**2 / 8.0 * max(sharpness, 1.0), STEP * radius_px)
    return share, radius_px**2 / (8.0 * share)
