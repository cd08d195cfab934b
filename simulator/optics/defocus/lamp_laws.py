"""Errors beside lamps: single pixels so bright that they count in no quantile of the scene's light.

Each is a share of the brightest light, in the noise of what is there, with noise below 1 e- as 1 e-.
"""

import math
from dataclasses import replace

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy

RIM_SHARE = 0.15  # of a lamp's spot that may fall beside it
SLANTED, SLANTED_SEEN = 2.95, 0.13  # times what an upright rim leaves, and share of the spot that is seen there
SPOT = 4400.0  # brightest spot of those that bound `spot_error`, in the light around it: 20,000 over pi 1.2^2
RIM_MOVED, RIM_SEEN = 3e-3, 5e-2  # of a lamp that eight rectangles gather: its light, and the root of it in its own noise


def lamp_crossing_error(radius_px: float, scale: float, accuracy: Accuracy, few: float = 0.0) -> float:
    """Error of ignoring a small blur circle around a lamp of one scene pixel in the dark, as a share of the brightest light.

    It is that of even squares, in the noise of what crosses or of what is left. 0: no pixel is a lamp (LAMP_PEAK).

    scale: scene pixels per photosite. few: `SceneContrast.few`.
    """
    accuracy = replace(accuracy, peak=max(accuracy.peak if accuracy.has_lamps else 0.0, few))
    if accuracy.peak == 0.0:
        return 0.0
    noise_e2 = max(accuracy.read_noise_e**2, 1.0)
    own_e = min(scale, 1.0 / scale) ** 2 * accuracy.peak * accuracy.electrons  # of the lamp, in its photosite
    crossing_e = min(_crossing_e(radius_px, scale, accuracy), 0.5 * own_e)
    lost_e = min(_borders(scale) * crossing_e, 0.5 * own_e)
    sigmas = crossing_e / math.sqrt(crossing_e + noise_e2), lost_e / math.sqrt(own_e - lost_e + noise_e2)
    return accuracy.sigma * max(sigmas)


def gathered_lamp_error(radius_px: np.ndarray, rectangles: np.ndarray, scale: float, accuracy: Accuracy) -> np.ndarray:
    """Error of gathering a lamp of one pixel by so many rectangles of the aperture, as a share of the brightest light.

    At the rim of its spot, where it ends in the dark, in the noise of what is there. It bounds lamps at any place of a
    photosite, 1.25 and 2.5 pixels to a photosite, radii of 0.1 to 1.5 photosites and 8 to 64 rectangles.
    """
    if not accuracy.has_lamps:
        return np.zeros(np.shape(radius_px))
    own_e = accuracy.peak * accuracy.electrons / scale**2
    left = (0.8 * scale * radius_px) ** 1.3 * (8.0 / rectangles) ** 2
    noise_e = max(accuracy.read_noise_e, 1.0)
    return accuracy.sigma * np.minimum(RIM_MOVED * left * own_e / noise_e, RIM_SEEN * left * math.sqrt(own_e))


def lamp_sharp_px(scale: float, accuracy: Accuracy) -> float:
    """Largest blur radius for which `lamp_crossing_error` stays within what is allowed [photosites]; inf: there is no lamp."""
    if not accuracy.has_lamps:
        return math.inf
    noise_e = max(accuracy.read_noise_e, 1.0)
    return accuracy.tolerance * noise_e / (_borders(scale) * _crossing_e(1.0, scale, accuracy))


def _crossing_e(radius_px: float, scale: float, accuracy: Accuracy) -> float:
    """Electrons of a lamp of one scene pixel that cross one border of a photosite: 2 / (3 pi) radii of the pixel's side."""
    return 2.0 / (3.0 * math.pi) * radius_px * min(scale, 1.0 / scale) * accuracy.peak * accuracy.electrons


def _borders(scale: float) -> int:
    """Borders of a photosite that a scene pixel may touch."""
    return 4 if scale <= 1.0 else 2


def spot_error(lamp: float, dark: float = 1.0) -> float:
    """Error at the edge of a lamp's spot, which is so much brighter than the brightest light, in their noise.

    Half of the spot's light, over the growth of the noise by it. It bounds lamps of one scene pixel, for radii of 1.2 to 12
    photosites, 1 to 4 scene pixels per photosite and axis, and lamps of 200 to 20,000 times the light around them.

    dark: light around the spot, as a share of the brightest light.
    """
    return 0.5 * lamp / math.sqrt(dark + lamp)


def _noise_e2(light: float, accuracy: Accuracy) -> float:
    """Squared noise at this share of the brightest light, below 1 e- as 1 e- [e-^2]."""
    return max(light * accuracy.electrons + accuracy.read_noise_e**2, 1.0)


def rim_share(scale: float, samples_per_axis: int, lamp: float, accuracy: Accuracy, dark: float) -> float:
    """Share of a lamp's spot that falls beside it where samples mix the pixels of a scene, and all else is even.

    A sample that a pixel of the side w covers by o has o / w of its light, and spreads it as a point or a square of 1 / n. At
    a straight rim along the border of a photosite o n (1/n - o)^2 / 2w of the spot is beyond it, most where o is a third of the
    sample, or a pixel that is smaller; of a point 1 / (16 w n^2). A bent rim leaves less. A slanted rim past a pixel in the
    corner of a sample leaves up to SLANTED times as much, but where SLANTED_SEEN of the spot is seen, too, whose noise counts.

    lamp, dark: light of the spot and around it, as shares of the brightest light.
    """
    noise_e2 = _noise_e2(dark, accuracy)
    pixel, sample = 1.0 / max(scale, 1.0), 1.0 / samples_per_axis
    covered = min(pixel, sample / 3.0)
    upright = 0.5 * covered / pixel * (sample - covered) ** 2 / sample
    slanted = SLANTED / math.sqrt(1.0 + SLANTED_SEEN * lamp * accuracy.electrons / noise_e2)
    return upright * max(1.0, slanted)


def shadow_share(near_px: float, far_px: float, scale: float, open_side: float, samples_per_axis: int) -> float:
    """Share of a lamp's spot that is seen past the edge of a nearer layer which hides it.

    A photosite at x sees a lamp at q, of the signed radius s, through the place x (1 - r) + q r of a layer of the radius r s.
    So an edge there shadows photosites that are |1 - r| open sides and |r| pixels of the scene away from it, half of both. Its
    coverage is read between means over samples: a samples beyond an edge that leaves the part p of one open, p (1.5 - p - a),
    at most (1.5 - a)^2 / 4.
    """
    if far_px == 0.0:
        return 0.0
    ratio = near_px / far_px
    away = 0.5 * (abs(1.0 - ratio) * open_side + abs(ratio) / scale) * samples_per_axis
    return 0.25 * max(1.5 - away, 0.0) ** 2


def moved_rim_error(lamp: float, accuracy: Accuracy, dark: float, scale: float, samples_per_axis: int) -> float:
    """Error of rays at the rim of a lamp's spot whose pixel samples mix, in the noise of what is around it.

    A pixel of the side w that covers a sample of the side 1 / n by o at one end has o / w of its light there, whose middle
    lies (1/n - o) / 2 beside that of the part. Where a rim goes through the pixel's image in a photosite, one end counts: at
    most 1 / (8 w n^2) of the spot. Rims that are not along the photosites leave less of the dark, where these are lit less.

    lamp, dark: light of the spot and around it, as shares of the brightest light. scale: scene pixels per photosite.
    """
    share = min(max(scale, 1.0) / (8.0 * samples_per_axis**2), RIM_SHARE)
    own_e2, dark_e2 = (light * accuracy.electrons + accuracy.read_noise_e**2 for light in (1.0, dark))
    return share * lamp * math.sqrt(own_e2 / max(dark_e2, 1.0))


def mixed_lamp_share(scale: float, samples_per_axis: int, radius_px: float) -> float:
    """Share of a lamp's light beside it where a photosite's border lies anywhere in samples that mix its pixel.

    A pixel of the side w = 1 / scale covers the part o of a sample of the side 1 / n, which spreads o / w of the light evenly.
    What moves is read anywhere: a border that lies b >= o within the sample has o n (1/n - b) / w beyond it, at most
    1 / (4 w n); light between samples, and points inside the photosite, leave no more. A circle reads it at many places, no
    more than 1 / radius of them to a photosite (a disc 2 / pi, a triangle 0.86), which leaves at most
    o n (1/n - o)^2 / (2 w radius), 2 / (27 w n^2 radius). A path along the border takes nothing from that.

    scale: even squares of the scene per photosite and axis. radius_px: of the lamp's blur circle.
    """
    standing = scale / (4.0 * samples_per_axis)
    spread = 2.0 / 27.0 * scale / (samples_per_axis**2 * max(radius_px, 1e-9))
    return min(standing, spread, 1.0)


def mixed_lamp_error(share: float, scale: float, open_side: float, accuracy: Accuracy, dark: float) -> float:
    """Error of such a share of the light of a lamp of one scene pixel beside it, as a share of the brightest light.

    share: of `mixed_lamp_share`. open_side: of the photosites. dark: light there, as a share of the brightest light, in whose
    noise it counts.
    """
    noise_e2 = _noise_e2(dark, accuracy)
    return accuracy.sigma * share * accuracy.peak * accuracy.electrons / (scale * open_side) ** 2 / math.sqrt(noise_e2)


def rim_error(
    lamp: float,
    accuracy: Accuracy,
    dark: float = 1.0,
    share: float = RIM_SHARE,
    beyond: float = 0.0,
    held: float = math.inf,
) -> float:
    """Error at the rim of a lamp's spot, in the noise of what is around it.

    A share of the spot's light falls beside it. RIM_SHARE bounds depth maps with steps and lamps of 100 to 10^7 e- over black.
    Where the surroundings have more noise than the read-out, `spot_error` holds spots that are up to `held` times as bright.

    dark: light around the spot, as a share of the brightest light. share: of the spot, as `rim_share`. beyond: least share,
    that is seen whatever is around the spot.
    """
    own_e2, dark_e2 = (light * accuracy.electrons + accuracy.read_noise_e**2 for light in (1.0, dark))
    is_held = dark * accuracy.electrons > max(accuracy.read_noise_e**2, 1.0) and lamp <= held * dark
    return (beyond if is_held else max(share, beyond)) * lamp * math.sqrt(own_e2 / max(dark_e2, 1.0))
