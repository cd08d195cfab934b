"""Plans the motion of the image behind a planned lens."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from simulator.errors import PhotositeError
from simulator.optics.blur_planning import blur_per_dioptre, contrast_of, electrons_per_radiance, ignored_terms, plan_blur
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.joint_errors import EDGE_STEP_PX, joint_error
from simulator.optics.defocus.joint_motion import JointMotion, plan_joint_motion
from simulator.optics.defocus.lamp_laws import rim_error, rim_share, spot_error
from simulator.optics.defocus.predicted_error import squares_left
from simulator.optics.defocus.scene_contrast import scene_edges
from simulator.optics.defocus.scene_light import (
    BRIGHT,
    SceneDetail,
    peak_electrons,
    scene_bends,
    scene_detail,
    sharpest_detail,
)
from simulator.optics.error_term import Skipped, together
from simulator.optics.geometry.end_spacing import LIT_SHARE
from simulator.optics.geometry.fixed_blur import DISK_SPREAD, FixedBlur
from simulator.optics.geometry.instants import TimedPath
from simulator.optics.geometry.motion_plan import MotionNeed, MotionPlan, Timing, moving_path, plan_motion
from simulator.optics.geometry.pixel_vectors import PixelVectors
from simulator.optics.lens.lens import Lens
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.path_planning import SAME_SCALE, with_path_weights
from simulator.optics.psf.field_psf import FieldPsf
from simulator.scene.compositing import flatten_layers
from simulator.scene.occluded_background import extend_background
from simulator.scene.scene import Layer, Scene
from simulator.sensor.sensor_plan import SensorPlan

UPRIGHT_PX = 0.15  # spread by which skewed spots are wrong, since photosites and samples of light stay upright [photosites]
PATH_SAMPLES = 1.5  # of a path, up to which it leaves what samples mix of a fine scene
OF_WHOLE = 1.2  # times that error, where samples are whole squares at rest
TYPICAL = 0.68  # quantile of differences that stands for their standard deviation


def with_motion(
    planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, timing: Timing, beside_sigma: float = 0.0
) -> OpticsPlan:
    """Return the plan with the motion of the image, unless it is invisible.

    beside_sigma: error that instants may have at which the optics run, where that is more than is allowed [standard deviations
    of the noise].
    """
    if not lens.forms_image:
        return replace(planned, motion_skipped=Skipped("without a lens there is no image that could move"))
    per_radiance = electrons_per_radiance(lens, sensor)
    found: list[MotionPlan | None] = []
    joins = can_join(planned, timing)
    is_layered, skipped = False, None
    for number, component in enumerate(timing.components):
        share = _seen_share(planned, number, len(timing.components), per_radiance)
        path, vectors = moving_path(loaded, lens, sensor.camera, planned.projection, timing.motion, component)

        seen = _seen_scenes(planned, loaded, path)
        slopes = _slopes(planned, seen, per_radiance, path.length.longest_px)

        def plan_for(
            detail: SceneDetail,
            path: TimedPath = path,
            vectors: PixelVectors | None = vectors,
            share: float = share,
            seen: list[Scene] = seen,
            slopes: tuple[float, float] = slopes,
            least_allowed: float = 0.0,
        ) -> MotionPlan | Skipped:
            need = _need(planned, seen, per_radiance, detail)
            need = replace(need, allowed=max(need.allowed, least_allowed))
            own = need.behind(_steepest_edge(planned.defocus), *slopes).of_share(share)
            is_kept = _averages_what_moves(planned) and vectors is None and (joins or len(loaded.layers) == 1)
            return plan_motion(path, vectors, timing.motion, own, _fixed_blur(planned, need), joins, is_kept=is_kept)

        detail = _usual_detail(planned, seen, per_radiance, path.length.longest_px)
        motion = plan_for(detail)
        if beside_sigma and isinstance(motion, MotionPlan) and motion.method == "instants":
            fewer = plan_for(detail, least_allowed=beside_sigma * planned.accuracy.sigma)
            motion = motion if isinstance(fewer, Skipped) else fewer
        if isinstance(motion, Skipped) and motion.sigma > 0.0:  # seen in fewer pixels than that counts, it is still seen
            motion = plan_for(sharpest_detail(loaded, planned.weights, per_radiance, planned.accuracy, LIT_SHARE))
        if isinstance(motion, Skipped):
            found.append(None)
            skipped = skipped or motion
            continue
        found.append(motion)
        is_layered |= planned.defocus is None and not motion.moves_alike
    if all(motion is None for motion in found):
        return replace(planned, motion_skipped=skipped)
    if planned.deep_blur is not None:
        rule = "no motion of a deep picture is followed by rays; give a tolerance above 0, such as 0.1"
        raise PhotositeError(rule, key="tolerance", value=0)
    scene = loaded if is_layered else planned.scene
    if any(motion is not None and motion.method == "joint" for motion in found):
        found, planned = with_joint_motion(planned, loaded, found, lens, sensor)
        scene = planned.scene
    flash = found[1] if len(found) > 1 else None
    planned = replace(planned, scene=scene, motion=found[0], flash_motion=flash, has_flash=len(found) > 1)
    own = planned.motion
    if own is not None and own.method != "instants" and planned.sweeps_shift(planned.light_samples):
        if own.path.straight_shift() is not None:
            planned = replace(planned, motion=own.with_exact_means())
    planned = with_path_weights(planned, per_radiance)
    planned = replace(planned, sampling_error=_moved_sampling_error(planned, per_radiance))
    return planned.with_moved_pixels() if planned.moves_pixels else planned


def _moved_sampling_error(planned: OpticsPlan, per_radiance: float) -> float:
    """Error of samples that were even squares of the scene at rest, and mix them while they move; else what was known.

    Along either axis a path takes away what samples mix where it is longer than PATH_SAMPLES of them: random squares, 2 and 4
    pixels per photosite, behind f/2.8 and f/8, that move by 0.5 and 8 photosites along a row and aslant.
    """
    motion, psf, projection = planned.motion, planned.psf, planned.projection
    if motion is None or psf is None or not psf.by_distance or not projection.has_square_pixels:
        return planned.sampling_error
    if planned.sampling_error or projection.whole_pixels((psf.over,)) == 0:
        return planned.sampling_error
    from simulator.optics.kernel_planning import mixing_error  # few lenses have kernels

    width, height = planned.sensor_px
    seen = motion.seen_at(np.array([(x * width, y * height) for x in (0.0, 0.5, 1.0) for y in (0.0, 0.5, 1.0)]))
    ways_px = np.column_stack([seen[:, 1] - seen[:, 0], seen[:, 3] - seen[:, 2]])
    of_line = min(1.0, motion.path.length.longest_px / max(float(np.hypot(*ways_px.T).max()), 1e-9))  # a shutter may roll
    shortest_px = of_line * float(ways_px.min())
    left = OF_WHOLE * min(1.0, PATH_SAMPLES / max(psf.over * shortest_px, 1e-9))
    return left * mixing_error(planned, psf, planned.scene, per_radiance)


def _averages_what_moves(planned: OpticsPlan) -> bool:
    """Whether a blur reads single pixels of what rests, but averages what moves over the photosites.

    Edges differ by more than the noise then, so that a motion too small to be seen is computed nevertheless: frames of a clip
    are alike however little the camera moves in some. A blur by circles inside a photosite, which is left out at rest, counts
    where it would be seen in what moves.
    """
    if planned.defocus is not None or not planned.reads_pixels:
        return planned.reads_pixels
    left_out = together(term.sigma for term in ignored_terms(planned, moves=True) if term.limit == "method")
    return left_out > planned.accuracy.in_sigma(planned.accuracy.allowed)


def _usual_detail(planned: OpticsPlan, seen: list[Scene], per_radiance: float, length_px: float) -> SceneDetail:
    """Return the detail that all but so few of the scene's pixels stay below that they pass a thousandth of the photosites.

    seen: `_seen_scenes`. Lamps, which have instants of their own, count where they are more than that share of the pixels.
    length_px: of the path: each pixel passes one photosite more than that.
    """
    edges, dark = _usual(planned, seen, per_radiance, length_px, scene_detail)
    if not planned.projection.has_pixel_per_photosite:
        return SceneDetail(edges, dark, 0.0, 0.0)
    return SceneDetail(edges, dark, *_usual(planned, seen, per_radiance, length_px, scene_bends))


def _usual(
    planned: OpticsPlan, seen: list[Scene], per_radiance: float, length_px: float, measure: Callable[..., float]
) -> tuple[float, float]:
    """Return what `measure` finds in scenes, as of `_usual_detail`, in the noise of a share of the difference and of none."""
    few = 1.0 - (1.0 - BRIGHT) / (1.0 + length_px)

    def usual(lit: float) -> float:
        every = [partial(measure, scene, planned.weights, per_radiance, planned.accuracy, lit=lit) for scene in seen]
        return max(every[0](quantile=BRIGHT), *(own(quantile=few, has_lamps=False) for own in every))

    return usual(LIT_SHARE), usual(0.0)


def _slopes(planned: OpticsPlan, seen: list[Scene], per_radiance: float, length_px: float) -> tuple[float, float]:
    """Return contrasts of light that rises on over the smallest blur circle (`MotionNeed.behind`); 0: it is a pixel or less.

    Arguments are those of `_usual_detail`.
    """
    if planned.defocus is None:
        return 0.0, 0.0
    apart = round(2.0 * min(least for least, _ in planned.defocus.ranges_px) * planned.projection.scale)
    if apart < 2:
        return 0.0, 0.0
    slope, dark = _usual(planned, seen, per_radiance, length_px, partial(scene_detail, apart=apart))
    contrast = _contrast_per_photosite(planned, slope)
    return contrast, contrast * dark / slope


def _contrast_per_photosite(planned: OpticsPlan, edges: float) -> float:
    """Return the contrast over one photosite of differences between pixels, which do not all have the same sign."""
    return min(edges * max(planned.projection.scale, _steepness(planned)), max(edges, 1.0))


def _steepness(planned: OpticsPlan) -> float:
    """Share of a pixel's difference by which light rises over a photosite; a coarse pixel read as it is ends in a step."""
    return 1.0 if planned.projection.nearest else min(planned.projection.scale, 1.0)


def _seen_scenes(planned: OpticsPlan, loaded: Scene, path: TimedPath) -> list[Scene]:
    """Return the scenes whose detail moving photosites see: the layers, and what is seen where one ends before another.

    The edge of a dark layer before a bright one is a step in the noise of the dark, which neither layer has by itself. It is
    seen at rest and at the end of the path, where layers that moved apart show what they hid.
    """
    if len(planned.scene.layers) == len(loaded.layers):
        return [loaded]
    ways_px = [path.shift_at(path.times_s[-1:], number)[0] for number in range(len(loaded.layers))]
    steps = np.rint(planned.projection.scale * np.array(ways_px)).astype(np.intp)
    if (steps == steps[0]).all():
        return [loaded, planned.scene]
    moved = [_moved(layer, *step) for layer, step in zip(loaded.layers, steps, strict=True)]
    return [loaded, planned.scene, flatten_layers(loaded.with_layers(moved))]


def _moved(layer: Layer, right: int, down: int) -> Layer:
    """Return a layer of one distance read so many pixels to the right and down, its edge continued."""
    rows, columns = (
        np.clip(np.arange(size) + step, 0, size - 1) for size, step in zip(layer.planes.shape[:2], (down, right), strict=True)
    )
    coverage = None if layer.coverage is None else layer.coverage[rows][:, columns]
    return replace(layer, planes=layer.planes[rows][:, columns], coverage=coverage, depth_m=float(np.min(layer.depth_m)))


def _need(planned: OpticsPlan, seen: list[Scene], per_radiance: float, detail: SceneDetail) -> MotionNeed:
    """Return what a scene of this detail asks of the instants of a motion before the lens blurs it. seen: `_seen_scenes`."""
    accuracy, scale, edges = planned.accuracy, planned.projection.scale, detail.edges
    texture = max(scene_detail(scene, planned.weights, per_radiance, accuracy, TYPICAL, LIT_SHARE) for scene in seen)
    steepness, contrast = _steepness(planned), _contrast_per_photosite(planned, edges)
    bends = planned.projection.has_pixel_per_photosite
    return MotionNeed(
        contrast=contrast,
        dark=contrast * detail.dark / edges,
        bend=bends * detail.bend,
        dark_bend=bends * detail.dark_bend,
        texture=texture * steepness,
        allowed=accuracy.allowed or accuracy.ray_error * accuracy.sigma,
        cut_off=0.5 * max(scale, steepness),
        border=max(edges, accuracy.lamp_contrast),
        sigma=accuracy.sigma,
        lamps=steepness * accuracy.lamp_contrast,
        dark_lamps=steepness * accuracy.dark_lamp_contrast,
        has_corners=planned.projection.nearest or scale >= 1.0 - SAME_SCALE,
    )


def _fixed_blur(planned: OpticsPlan, need: MotionNeed) -> FixedBlur | str | None:
    """Return what blurs the light of a moving scene alike at each instant; None: nothing blurs; a reason where it is not fixed.

    need: of the scene, before the blur.
    """
    defocus, psf, accuracy, contrast = planned.defocus, planned.psf, planned.accuracy, need.largest
    if defocus is None and psf is None:
        return None
    if accuracy.tolerance == 0.0:
        return "the reference runs the optics at each instant"
    if psf is not None and psf.by_distance and len(psf.radii_px) > 1:
        return "the point spread function depends on the distance"
    if defocus is None:
        assert psf is not None  # one of both blurs
        return _behind_psf(psf, contrast, planned.channels)
    if len(planned.scene.layers) > 1:
        return "surfaces behind one another are blurred each by its own radius"
    radius = defocus.radii_px[0]
    scale, slope = planned.projection.scale, 0.0
    if isinstance(radius, np.ndarray):
        steps = [float(np.abs(np.diff(radius, axis=axis)).max(initial=0.0)) for axis in (0, 1)]
        slope = scale * math.hypot(*steps)
        if planned.projection.is_fine or max(steps) > EDGE_STEP_PX:
            return "the blur radius differs from place to place"
    if psf is not None and psf.by_distance:
        return _behind_psf(psf, contrast, planned.channels)
    grid = replace(accuracy, whole_pixels=0)  # what moves does not stay on the borders of pixels
    (least_px, largest_px), size = defocus.ranges_px[0], np.array(defocus.ranges_px[0][0])
    over = int(grid.samples_per_axis(size, size, scale))
    sampling, common, lamps = _sampling_left(planned, defocus, over, max(need.dark / need.contrast, 1.0))
    spread_px = DISK_SPREAD * largest_px + (0.0 if psf is None else _spread_px(psf, planned.channels))
    own_px = UPRIGHT_PX if over > 1 else 0.0  # one sample is the photosite, which sees all of its light at one time
    if psf is not None:
        own_px = _upright_px(psf)
    return FixedBlur(over, contrast, spread_px, sampling, common, lamps, slope, least_px, own_px, defocus.eyes is None)


def _sampling_left(planned: OpticsPlan, defocus: Defocus, over: int, darker: float) -> tuple[float, float, float]:
    """Return the errors of samples of a fine scene before a blur: sampling, common and lamp error of `FixedBlur`.

    What moves is gathered from the scene's pixels at each instant where no grid of samples is exact enough, else from as many
    samples. over: samples per photosite and axis. darker: contrast of squares in the noise of the dark, as a share of that in
    their own.
    """
    if not planned.accuracy.detail:
        return 0.0, 0.0, 0.0
    moved, contrast = planned.with_moved_pixels(), planned.contrast
    own, accuracy, (least_px, largest_px) = moved.defocus, moved.accuracy, defocus.ranges_px[0]
    assert own is not None  # of `defocus`
    squares, lamps = darker * squares_left(accuracy, least_px, over, defocus.scale), 0.0
    if contrast.lamp > 0.0:
        dark = contrast.around_lamps
        share = rim_share(defocus.scale, over, contrast.lamp, accuracy, dark)
        lamps = max(spot_error(contrast.lamp, dark), rim_error(contrast.lamp, accuracy, dark, share, own.area.beyond(over)))
    if own.gathers_scene(np.array([least_px]), np.array([largest_px])).any():
        return max(squares, lamps), 0.0, 0.0
    return 0.0, squares, lamps


def _behind_psf(psf: FieldPsf, contrast: float, channels: int) -> FixedBlur:
    """Return the blur of kernels of one blur radius. contrast: as of `FixedBlur`."""
    return FixedBlur(psf.over, contrast, _spread_px(psf, channels), own_spread_px=_upright_px(psf), can_skew=True)


def _upright_px(psf: FieldPsf) -> float:
    """Return the spread of what is not skewed with the spot [photosites]: `UPRIGHT_PX`, and a low-pass filter."""
    return UPRIGHT_PX + 0.5 * psf.sampling.low_pass_um / psf.pitch_um


def _spread_px(psf: FieldPsf, channels: int) -> float:
    """Return the mean distance of a kernel's light from a line through its middle, of the widest channel [photosites]."""
    found = []
    for channel in range(channels):
        kernel = np.abs(psf.kernel(0, channel, False, psf.nodes[0] // 2, psf.nodes[1] // 2).sum(axis=0))
        away = np.abs(np.arange(len(kernel)) - len(kernel) // 2)
        found += [float((kernel.sum(axis=axis) * away).sum() / kernel.sum()) for axis in (0, 1)]
    return max(found)


def _steepest_edge(defocus: Defocus | None) -> float:
    """Return the largest share of an edge that the light rises by over one photosite behind the blur, up to 1.

    That is the longest chord of the pupil over its area.
    """
    if defocus is None:
        return 1.0
    least_px, area = min(least for least, _ in defocus.ranges_px), math.pi
    if defocus.eyes is not None:
        corner = defocus.eyes.open_fields(defocus.eyes.fields(0.0, 0.0)[None])[0]
        area = defocus.eyes.pupil.area(corner)
    return min(2.0 * defocus.pupil.corner_radius / (area * max(least_px, 1e-6)), 1.0)


def _seen_share(planned: OpticsPlan, number: int, components: int, per_radiance: float) -> float:
    """Return how strong the edges of a component of the light can be, up to 1, relative to the scene's brightest light.

    An edge counts as much as one that is seen at the brightest light as clearly as it is seen at its own.
    """
    if components == 1:
        return 1.0
    own = len(planned.weights) // components  # bands of a component
    accuracy, lit = planned.accuracy, planned.lit_by(slice(number * own, (number + 1) * own))
    brightest_e = peak_electrons(planned.scene, lit.weights, per_radiance)
    noise_e2 = max(0.1 * brightest_e + accuracy.read_noise_e**2, 1.0)
    noise_at_brightest_e2 = accuracy.electrons + accuracy.read_noise_e**2
    return min(brightest_e * math.sqrt(noise_at_brightest_e2 / noise_e2) / accuracy.electrons, 1.0)


def can_join(planned: OpticsPlan, timing: Timing) -> bool:
    """Whether points of the aperture may carry instants: places of the picture are those of the scene, lines are rows."""
    psf = planned.psf
    if planned.sees_spots or planned.projection.warp is not None or (psf is not None and (psf.by_distance or psf.corrected_px)):
        return False
    return timing.components[0].openings[0].axis != "columns"


def with_joint_motion(
    planned: OpticsPlan, loaded: Scene, motions: list[MotionPlan | None], lens: Lens, sensor: SensorPlan
) -> tuple[list[MotionPlan | None], OpticsPlan]:
    """Return motions whose instants points of the aperture carry, and the plan of their blur, however small that is.

    motions: of each component of the light; None where all is at rest.
    """
    camera, defocus = sensor.camera, planned.defocus
    if defocus is None:
        defocus = plan_blur(planned, loaded, lens, camera, keeps_sharp=True)
        contrast = contrast_of(planned, loaded, lens, sensor, defocus)
        planned = replace(planned, scene=loaded, contrast=contrast)
    per_share = electrons_per_radiance(lens, sensor) / planned.accuracy.electrons
    edges = scene_edges(loaded, planned.weights, per_share, defocus)
    planned = replace(planned, contrast=replace(planned.contrast, edges=edges))
    moving = [motion for motion in motions if motion is not None]

    def join(radii_px: tuple[float | np.ndarray, ...]) -> JointMotion:
        return plan_joint_motion(moving[0].path, lens, camera.pixel_pitch_um, radii_px)

    joint = join(defocus.radii_px)
    per_dioptre = blur_per_dioptre(lens, camera.pixel_pitch_um, planned.projection.scale)
    is_extended = planned.scene is not loaded and joint.largest_aperture == 0.0
    reach = (1.0 + joint.largest_aperture) * per_dioptre  # so far do rays see behind edges
    scene = extend_background(loaded, reach) if planned.accuracy.tolerance and not is_extended else loaded
    if scene is not loaded:
        extended = plan_blur(planned, scene, lens, camera, keeps_sharp=True)
        defocus, planned = replace(extended, guessed=True), replace(planned, scene=scene)
        joint = join(defocus.radii_px)
    found: list[MotionPlan | None] = []
    for motion in motions:
        if motion is None:
            found.append(None)
            continue
        blur = replace(defocus, motion=replace(joint, path=motion.path))
        error = joint_error(blur, planned.contrast) if planned.accuracy.tolerance else 0.0
        found.append(replace(motion, method="joint", error=error))
    return found, replace(planned, defocus=defocus, joint=joint)
