"""Predicts the error of the planned lens blur from its measured laws, before the frame is computed.

The prediction is the sum of named terms, one for each cause. It shall not lie below what 99.9 % of the photosites have. Laws
that bound 99 % of them, by which methods are chosen, are stated with the factor between the two that was measured.
"""

import math
from dataclasses import replace

import numpy as np

from simulator.optics.defocus.accuracy import (
    MOST_COVARIANCE,
    WAVE_CURVATURE,
    WIDE_PX,
    Accuracy,
    copy_error,
    crossing_error,
    grid_error,
    occlusion_error,
    points_error,
    relaxed_error,
    slab_error,
    slope_error,
    small_circles_error,
    square_error,
    twice_blurred_share,
    wide_error,
)
from simulator.optics.defocus.aperture_samples import MOST_OF_ALL, correction_count, has_relaxed, sample_count
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, Defocus
from simulator.optics.defocus.edge_laws import inside_px, nodes_error, nodes_of_squares
from simulator.optics.defocus.field_pupil import ZONES_PX, middle_error, zone_error
from simulator.optics.defocus.joint_errors import LAYERS, TIGHTER, WORST, at_finest, joint_terms, most_samples_per_axis
from simulator.optics.defocus.lamp_laws import (
    RIM_SHARE,
    SPOT,
    gathered_lamp_error,
    lamp_crossing_error,
    moved_rim_error,
    rim_error,
    rim_share,
    shadow_share,
    spot_error,
)
from simulator.optics.defocus.scene_contrast import SceneContrast
from simulator.optics.error_term import ErrorTerm, Limit, together

FINER_SCENE = "give a scene of more pixels, or tolerance: 0 for rays"
RAYS = "give tolerance: 0 for rays"
OF_BOTH = 1.3  # second difference of random light along both axes, over the larger of them: 99.9 % of the photosites
FALLS = 1.01  # times what the finest samples leave, above which an error becomes smaller with the tolerance
WHOLE_SCENE = "give a scene of a pixel per photosite, or a tolerance above 0"
EVEN_SCENE = "give a lens without distortion and a scene of 1, 2, 4 or 8 pixels per photosite, or a tolerance above 0"
LAYERED = "give even layers, farther apart in depth, or a lens without aberrations"
INSIDE_PX = 0.32  # blur radius up to which the image of any aperture stays inside a photosite: a triangle reaches 1.56 radii
# From what laws bound to p99.9. Squares: black and white ones (`mixed_squares` of benchmarks/stress).
# Crossing: random squares in greys (`python benchmarks/audit --laws`).
# Occlusion: docs/lens_accuracy.md, `motorcycle_wide_open`, p99 0.41 and p99.9 0.87.
OF_SQUARES, OF_CROSSING, OF_OCCLUSION = 3.0, 1.3, 2.1
# Light between pixels as large as photosites bends at their middles, and even squares end at their borders: of either a circle
# leaves 2 / (3 pi) of its radius times the second difference along an axis, the mean of |x| over half the disk.
HALF_DISK = 2.0 / (3.0 * math.pi)
OF_BENDS = 2.0 * HALF_DISK
LONG_EDGES = 2.0 / (8.0 * math.pi)  # of `SceneContrast.along` (`layer_contrast`)
OF_CELL = 0.103  # of a second difference and the square of samples' sides: what they leave of circles of about their size
OF_CUT = 1.3  # of the variance that the open side adds where it cuts samples, as found on tilted walls of patches
BLUR, MOVING = "lens blur", "blur of lens and motion"  # effects of the terms


def error_terms(
    defocus: Defocus, contrast: SceneContrast = WORST, *, reads_pixels: bool = False, is_aside: bool = False
) -> list[ErrorTerm]:
    """Predict the error of each method that the scene may need. Without tolerance, rays have none of them.

    defocus: blur of the scene's layers, with a background that is assumed. contrast: of the scene (`scene_contrast`).
    reads_pixels: whether each photosite reads one pixel of the scene (`Projection.reads_pixels`), so that weights of pixels are
        exact, and circles inside a photosite do not blur. is_aside: whether it reads anywhere between the pixels.
    """
    accuracy = defocus.accuracy
    if accuracy.tolerance == 0.0:
        return []
    if defocus.motion is not None:
        joint = joint_terms(defocus, contrast)
        return [ErrorTerm(MOVING, one.cause, accuracy.in_sigma(one.share), one.fix, one.limit, one.falls) for one in joint]
    own = defocus.of_scene()
    radii, ranges = own.radii_px, own.ranges_px
    ignored = [min(most, own.copied_px) for least, most in ranges if least <= own.copied_px]
    blurred = [max(least, own.copied_px) for least, most in ranges if most > own.copied_px]
    detail = contrast.curvature / WAVE_CURVATURE
    terms: list[ErrorTerm] = []
    means, alone_left = 0, 0.0  # term of samples, and what they leave where nothing else is wrong

    def add(cause: str, share: float, fix: str, limit: Limit = "method", *, falls: bool = False) -> None:
        terms.append(ErrorTerm(BLUR, cause, accuracy.in_sigma(share), fix, limit, falls))

    if max(ignored, default=0.0) > 0.0 and not (reads_pixels and max(ignored) * own.pupil.corner_radius <= 0.5):
        smooth = detail * copy_error(max(ignored)) if contrast.crossed is None else contrast.crossed
        left_out = max(smooth, OF_CROSSING * crossing_error(max(ignored), accuracy.detail)) + max(ignored) * contrast.shifted
        add(f"no blur up to a radius of {max(ignored):.2g}", left_out, TIGHTER, falls=True)
    if not blurred:
        return terms
    smallest, is_sloped = np.array([min(blurred)]), any(np.ndim(radius) > 0 for radius in radii)
    finest = int(own.samples_per_axis(smallest, smallest)[0])
    is_gathered = len(defocus.radii_px) == 1 and bool(own.gathers_scene(smallest, smallest).any())
    holds_lamps = is_gathered or divides_squares(own, smallest)
    may_gather = len(defocus.radii_px) == 1 and bool(at_finest(own).gathers_scene(smallest, smallest).any())
    is_finest = is_gathered or (finest == most_samples_per_axis(own, smallest) and not may_gather)
    if is_gathered:
        widest = np.array(own.largest_px)
        lamps = gathered_lamp_error(widest, own.gathered_rectangles(widest), defocus.scale, accuracy)
        add("means over the scene's pixels", max(accuracy.gathering_error(), float(lamps)), TIGHTER)
    else:
        # A parabola in both directions, against its values at the points.
        smooth = contrast.curvature * twice_blurred_share(min(blurred), defocus.scale) / (12.0 * finest**2)
        steepest = max(grid_error(min(blurred), finest, defocus.scale), contrast.ends / (12.0 * finest**2))
        if accuracy.detail:  # samples that the open side cuts are seen over all of their width
            spread = 1.0 + OF_CUT * max(12.0 * finest**2 * defocus.area.spread_by(finest) - 1.0, 0.0)
            smooth, steepest = spread * smooth, spread * steepest
        grid = 0.0 if reads_pixels else min(smooth, steepest)
        if contrast.ends > 0.0 and defocus.scale < 1.0 + 1e-6 and not reads_pixels:
            grid = (max(contrast.ends_aside, contrast.ends) if is_aside else contrast.ends) / (
                12.0 * finest**2
            )  # it is what is left
        if accuracy.detail:  # even squares, whose weights are exact where nothing hides any of them
            alone = len(defocus.radii_px) == 1 and not is_sloped  # else the sum of several terms is above p99.9 of their sum
            if len(defocus.radii_px) > 1 and not is_sloped:
                alone_left = squares_left(accuracy, float(smallest[0]), finest, defocus.scale, 0.0)
            squares = float(accuracy.sampling_error(smallest, finest, defocus.scale)[0])
            if squares > 0.0 and len(defocus.radii_px) == 1:  # else edges of layers count, whatever their light is
                squares = float(square_error(smallest, finest, defocus.scale, accuracy.detail)[0])
            waves = grid if contrast.bends is None else contrast.bends * defocus.area.spread_by(finest)
            grid = squares_left(accuracy, float(smallest[0]), finest, defocus.scale, waves) if alone else max(squares, grid)
        means = len(terms)
        add(f"means on {finest} x {finest} points per photosite", grid, FINER_SCENE, falls=not is_finest)
    within_px = inside_px(own.pupil.corner_radius) if reads_pixels else 0.0
    if contrast.bent > 0.0 and own.largest_px > within_px:
        add("surfaces that bend within blur circles", contrast.bent, RAYS)
    widest = np.array([own.largest_px])
    sloped = [pair for pair, radius in zip(ranges, radii, strict=True) if np.ndim(radius) > 0]
    is_alone = len(defocus.radii_px) == 1
    is_blurred = max((most for _, most in sloped), default=0.0) > within_px
    if is_blurred and not (is_alone and own.gathers_scene(widest, widest).any()):  # which take each radius
        add(
            f"slopes in steps of {accuracy.slope_step:.2g}",
            max(contrast.around) * slope_error(accuracy.slope_step),
            TIGHTER,
            falls=True,
        )
        falls = False
        if accuracy.detail:
            in_focus = contrast.in_focus if own.area.has_squares(finest) else 0.0
            seen = contrast.around, contrast.curvature
            left, least = (max(nodes_of_squares(one, *seen, is_alone=is_alone), in_focus) for one in (own, at_finest(own)))
            falls = left > FALLS * least  # larger circles may have fewer samples than the smallest
        else:
            copied_px = own.copied_px if is_alone else 0.0  # before or behind others that are blurred nothing is
            least_px = max(min(least for least, _ in sloped), within_px, copied_px)
            left = nodes_error(least_px, max(most for _, most in sloped), contrast.around, contrast.curvature)
        add("images of the aperture between radii that are tabulated", left, RAYS, falls=falls)
    if contrast.lamp > 0.0 and (is_sloped or len(defocus.radii_px) > 1 or not holds_lamps):
        is_mixed, dark = not is_sloped and defocus.scale >= 1.0 - 1e-6, contrast.around_lamps
        shares = _spot_shares(own, contrast, reads_pixels=reads_pixels) if is_mixed else (RIM_SHARE, 0.0)
        spots = max(spot_error(contrast.lamp, dark), rim_error(contrast.lamp, accuracy, dark, *shares, SPOT))
        add("edges of the spots of lamps", spots, FINER_SCENE)
    wide_or_not = np.array([own.largest_px, min(own.largest_px, 0.999 * WIDE_PX)])
    points = int(sample_count(wide_or_not, defocus).min())
    if contrast.has_steps:
        # Of the light beside the steps: a circle inside a sample brings little of another.
        range_ = contrast.beside / WORST.beside * min(finest * own.largest_px, 1.0)
        fix = LAYERS if defocus.guessed else TIGHTER  # more points are not taken where what they see is assumed
        more = not defocus.guessed and points < MOST_OF_ALL
        add(
            f"{points} points of the aperture beside steps in depth",
            range_ * OF_OCCLUSION * occlusion_error(points),
            fix,
            falls=more,
        )
        slabs = range_ * OF_OCCLUSION * slab_error(defocus.classes_per_unit)
        add(f"{defocus.classes_per_unit:.2g} slabs of radius", slabs, fix, falls=accuracy.coarser > 1.0)
        if own.largest_px >= defocus.wide_px:
            add("wider photosites", range_ * wide_error(defocus.wide_px), TIGHTER, falls=not defocus.guessed)
    elif len(radii) > 1:
        falls, points = points < MOST_OF_ALL, int(correction_count(np.array(points), finest, defocus))
        points_left = contrast.mixed * points_left_of(own, points, finest)
        add(f"{points} points of the aperture", points_left, TIGHTER, falls=falls)
    if len(radii) > 1:
        small = small_circles(own)
        left = max(contrast.within * small, LONG_EDGES / finest * contrast.along)
        add("layers with circles as small as the samples", left, RAYS)
        hidden = contrast.lamps_mixed * points_left_of(own, points, finest) + contrast.lamps_within * small
        if hidden > 0.0:
            add("lamps that layers hide", hidden, RAYS)
    if own.eyes is not None:
        side_px = own.eyes.zone_px
        moved = zone_error(own.eyes.movement(side_px))
        add(f"zones of {side_px} photosites that share a pupil", moved, TIGHTER, falls=side_px > ZONES_PX[-1])
        if contrast.has_steps:
            add("one pupil for a block beside steps in depth", middle_error(own.eyes.movement(BLOCK_COLUMNS)), RAYS)
    if contrast.hidden > 0.0:
        add(
            "background behind edges, which the scene does not show",
            contrast.hidden,
            LAYERS,
            "input",
        )
    alone_sigma = accuracy.in_sigma(alone_left)
    if alone_sigma > together(term.sigma for term in terms if term.limit == "method"):  # layers hardly hide others' squares
        others = [term.sigma for number, term in enumerate(terms) if number != means and term.limit == "method"]
        terms[means] = replace(terms[means], sigma=alone_sigma - max(others, default=0.0))
    return terms


def divides_squares(defocus: Defocus, radius_px: np.ndarray) -> bool:
    """Whether samples divide the even squares of a scene, which have exact weights then, lamps as well.

    radius_px: of the blur circle, (1,) [photosites].
    """
    accuracy, samples = defocus.accuracy, int(defocus.samples_per_axis(radius_px, radius_px)[0])
    return accuracy.detail > 0.0 and not accuracy.sampling_error(radius_px, samples, defocus.scale).any()


def _spot_shares(defocus: Defocus, contrast: SceneContrast, *, reads_pixels: bool) -> tuple[float, float]:
    """Shares of a lamp's spot that samples bring to where it is dark: those that mix its pixel, and what is seen of any.

    These lie beyond the open area, or behind a nearer layer. reads_pixels: of `error_terms`; photosites are their middles then.
    """
    ends = np.array([end for pair in defocus.ranges_px for end in pair if end > defocus.copied_px])
    samples, area = int(defocus.samples_per_axis(ends, ends).min()), defocus.area
    radii_px = [float(np.max(radius)) for radius in defocus.radii_px]  # of surfaces at one distance each
    shadows = [
        shadow_share(near, far, defocus.scale, 0.0 if reads_pixels else area.open_side, samples)
        for number, far in enumerate(radii_px)
        for near in radii_px[:number]
    ]
    if reads_pixels or area.has_squares(samples):
        return 0.0, max(shadows, default=0.0)
    mixed = rim_share(defocus.scale, samples, contrast.lamp, defocus.accuracy, contrast.around_lamps)
    return mixed, max([area.beyond(samples), *shadows])


def ray_terms(defocus: Defocus, contrast: SceneContrast = WORST, *, is_smooth: bool = False) -> list[ErrorTerm]:
    """Predict what rays leave whose samples, `ray_samples` per axis of a photosite, mix parts of a fine scene's pixels.

    is_smooth: whether the scene is no finer than the photosites, whose light is bilinear between its pixels. Samples are even
        squares, too, in which it bends: by 1 / 24 n^2 of its second difference where circles or a filter end within them. Of
        circles inside a photosite its borders count, over which steps between samples differ by 1 / n of it.
    """
    accuracy, ranges = defocus.accuracy, defocus.of_scene().ranges_px
    smallest_px, samples = min(least for least, _ in ranges), accuracy.ray_samples
    if is_smooth:
        largest_px = max(most for _, most in ranges)
        left = contrast.curvature * min(HALF_DISK * largest_px / samples, OF_CELL / samples**2)
        if smallest_px >= 1.0:
            left = min(contrast.curvature, 2.0 * contrast.ends or math.inf) / (24.0 * samples**2)
        cause = f"rays that meet {samples} x {samples} samples of a photosite, in which light bends"
        return [ErrorTerm(BLUR, cause, accuracy.in_sigma(OF_BOTH * left), WHOLE_SCENE)]
    if not accuracy.detail:
        return []
    left = OF_SQUARES * float(square_error(np.array(smallest_px), accuracy.ray_samples, defocus.scale, accuracy.detail))
    cause = f"rays that meet means over {accuracy.ray_samples} x {accuracy.ray_samples} parts of a photosite"
    found = [ErrorTerm(BLUR, cause, accuracy.in_sigma(left), EVEN_SCENE)]
    if contrast.lamp > 0.0:
        left = moved_rim_error(contrast.lamp, accuracy, contrast.around_lamps, defocus.scale, accuracy.ray_samples)
        found.append(ErrorTerm(BLUR, f"edges of the spots of lamps, by {cause}", accuracy.in_sigma(left), EVEN_SCENE))
    return found


def squares_left(accuracy: Accuracy, radius_px: float, samples_per_axis: int, scale: float, waves: float = math.inf) -> float:
    """Error of samples of a fine scene that 99.9 % of the photosites keep below, as a share of the brightest light.

    It is what random squares leave, of which the law states what 99 % keep, and what waves of the scene do beside them, whose
    light bends; or inf: at least `grid_error`. Of circles that lie inside a sample it is at least that of no blur.
    """
    radius = np.array(radius_px)
    if float(accuracy.sampling_error(radius, samples_per_axis, scale)) == 0.0:
        return 0.0
    squares = OF_SQUARES * float(square_error(radius, samples_per_axis, scale, accuracy.detail))
    own = max(squares, grid_error(radius_px, samples_per_axis, scale)) if waves == math.inf else squares + waves
    if radius_px * samples_per_axis > 0.5:
        return own
    return max(own, OF_CROSSING * crossing_error(radius_px, accuracy.detail))


def terms_by_distance(defocus: Defocus, contrast: SceneContrast = WORST, *, has_coverage: bool = True) -> list[ErrorTerm]:
    """Predict what kernels by distance leave of surfaces that hide each other, beside the errors of the kernels.

    The means of layers are composited. What they lack is the covariance of layers over the aperture, which is added from points
    (`Method.CORRECTED`). A surface with steps in depth hides parts of itself by their means alone.
    has_coverage: whether any layer lets others be seen; else only the first one counts.
    """
    accuracy, own, terms = defocus.accuracy, defocus.of_scene(), list[ErrorTerm]()

    def add(cause: str, share: float, fix: str, limit: Limit = "method", *, falls: bool = False) -> None:
        terms.append(ErrorTerm(BLUR, cause, accuracy.in_sigma(share), fix, limit, falls))

    if has_coverage and own.has_covariance:
        radius_px = np.array([own.largest_px])
        finest = int(own.samples_per_axis(radius_px, radius_px)[0])
        every = int(sample_count(radius_px, defocus)[0])
        # No error of means beside them hides that of fewer points.
        points = int(correction_count(np.array(every), finest, defocus))
        left = contrast.mixed * points_left_of(own, points, finest)
        add(f"{points} points of the aperture", left, TIGHTER, falls=every < MOST_OF_ALL)
        small = small_circles(own)
        add("layers with circles as small as the samples", contrast.within * small, LAYERED)
        add(
            "lamps that layers hide",
            contrast.lamps_mixed * points_left_of(own, points, finest) + contrast.lamps_within * small,
            LAYERED,
        )
    if contrast.has_steps and not defocus.guessed:
        range_ = contrast.beside / WORST.beside  # of the light beside the steps
        add("means of slabs of radius that hide each other", range_ * MOST_COVARIANCE, LAYERED)
    if contrast.hidden > 0.0:
        add(
            "background behind edges, which the scene does not show",
            contrast.hidden,
            LAYERS,
            "input",
        )
    return terms


def points_left_of(defocus: Defocus, points: int, samples_per_axis: int) -> float:
    """`points_error` of a blur's corrections, or `relaxed_error` where their points are relaxed."""
    if has_relaxed(samples_per_axis, defocus):
        return relaxed_error(points, defocus.largest_px)
    return points_error(points, samples_per_axis, defocus.largest_px)


def small_circles(defocus: Defocus) -> float:
    """Largest `small_circles_error` of two layers, one of them out of focus; a layer of many radii has its extremes."""
    ends = [{float(np.min(radius)), float(np.max(radius))} for radius in defocus.radii_px]
    found = [0.0]
    for number, nearer in enumerate(ends):
        for one in nearer:
            for other in set().union(*ends[number + 1 :]):
                if max(abs(one), abs(other)) <= defocus.copied_px:
                    continue
                smaller = min(abs(one), abs(other))
                over = int(defocus.samples_per_axis(np.array([smaller]), np.array([max(abs(one), abs(other))]))[0])
                is_even = defocus.area.has_squares(over) and defocus.area.open_side == 1.0
                error = small_circles_error(smaller, abs(one - other), max(over, 1), defocus.scale, has_squares=is_even)
                found.append(error)
    return max(found)


def ignored_error(
    accuracy: Accuracy,
    radius_px: float,
    contrast: SceneContrast = WORST,
    *,
    scale: float = 1.0,
    reads_pixels: bool = False,
    is_bilinear: bool = False,
    open_side: float = 1.0,
    gap_px: float = 0.0,
) -> list[ErrorTerm]:
    """Predict the error of leaving out all blur, whose largest radius is this [photosites].

    contrast: of the scene. scale: its pixels per photosite. With one it does not show where in its pixel a lamp is; of fewer,
        light is bilinear between their centres, whose second difference counts: it bends there, all in the open side of a
        photosite [photosites]. reads_pixels: as of `error_terms`. is_bilinear: whether photosites are means of light between
        pixels, which bends nowhere, however many pixels there are (`Projection`). gap_px: distance between the borders of
        the open areas and those of even pixels as wide as photosites, over which light goes.
    """
    if radius_px == 0.0:
        return []
    is_unknown, is_fine = abs(scale - 1.0) < 1e-3, scale > 1.0
    is_smooth = scale < 1.0 or is_bilinear
    lamp = lamp_crossing_error(radius_px, scale, accuracy, contrast.few if is_unknown else 0.0)
    smooth = contrast.curvature / WAVE_CURVATURE * copy_error(radius_px) if contrast.crossed is None else contrast.crossed
    smooth /= open_side if is_smooth and contrast.crossed is None else 1.0
    left_out = max(
        smooth,
        crossing_error(radius_px, accuracy.detail),
        radius_px * contrast.crossings,
        lamp if is_fine else 0.0,
        OF_BENDS * radius_px * contrast.curvature if is_unknown and not (reads_pixels or is_smooth) else 0.0,
    )
    if gap_px:
        left_out *= crossed_share(gap_px / radius_px) / open_side
    left_out += radius_px * contrast.shifted
    if reads_pixels and radius_px <= INSIDE_PX:
        left_out = 0.0
    cause = f"no blur up to a radius of {radius_px:.2g}"
    falls = radius_px <= accuracy.sharp_px  # else what comes after the blur leaves more (`allot`)
    found = [ErrorTerm(BLUR, cause, accuracy.in_sigma(left_out), TIGHTER if falls else RAYS, falls=falls)]
    if lamp > 0.0 and is_unknown:
        found.append(ErrorTerm(BLUR, "lamps smaller than photosites", accuracy.in_sigma(lamp), FINER_SCENE, "input"))
    if contrast.flattened > 0.0:
        cause = "layers that are composited before the light between their pixels is"
        found.append(ErrorTerm(BLUR, cause, accuracy.in_sigma(contrast.flattened), FINER_SCENE))
    return found


def crossed_share(gap: float) -> float:
    """Share of the light of a disk, over an edge past its middle, that goes farther than this [radii].

    The mean of x beyond the gap over half the disk, divided by that without one, 2 / (3 pi).
    """
    if gap >= 1.0:
        return 0.0
    rest = math.sqrt(1.0 - gap**2)
    return rest**3 - 1.5 * gap * (math.acos(gap) - gap * rest)


def predicted_error(defocus: Defocus, contrast: SceneContrast = WORST) -> float:
    """All terms together, with what the scene does not hold [standard deviations at the brightest light]."""
    return together(term.sigma for term in error_terms(defocus, contrast))


def describe_ignored(accuracy: Accuracy, radius_px: float, left: list[ErrorTerm]) -> str:
    """Describe why no blur is computed where the largest blur circle has this radius [photosites], with the predicted error.

    left: terms of `ignored_error`.
    """
    told = f"no blur circle has a radius above {accuracy.sharp_px:.2g} photosites"
    if radius_px > accuracy.sharp_px:
        told = f"what follows a blur of at most {radius_px:.2g} photosites would leave more than the blur does"
    error = left[0].sigma if left else 0.0
    if error == 0.0:
        return told
    return f"{told}; without that of radius {radius_px:.2g} the light is off by up to {error:.2g} sigma"


def describe_noise(accuracy: Accuracy) -> str:
    """Describe the light and the noise that the errors of the blur refer to, for the printed plan."""
    light = f"brightest light {accuracy.electrons:.3g} e-, noise {accuracy.sigma * accuracy.electrons:.3g} e-"
    if accuracy.tolerance == 0.0:
        return f"{light}; every photosite by rays, until their standard error is {accuracy.ray_error:g} sigma of its own light"
    return light
