"""Plans the lens blur of a scene on a sensor, with the accuracy that it needs."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, overload

import numpy as np

from simulator.device.threads import both
from simulator.optics.defocus.accuracy import SAMPLES_PER_AXIS, Accuracy
from simulator.optics.defocus.defocus import Defocus, plan_defocus, radius_range_px
from simulator.optics.defocus.lamp_laws import lamp_sharp_px
from simulator.optics.defocus.photosite_area import PhotositeArea
from simulator.optics.defocus.predicted_error import ignored_error
from simulator.optics.defocus.scene_contrast import SceneContrast, scene_contrast, sharp_contrast
from simulator.optics.defocus.scene_light import brightest_electrons, peak_electrons, scene_detail
from simulator.optics.error_term import ErrorTerm
from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.scene_part import ScenePart, find_scene_part
from simulator.optics.lens.lens import Lens
from simulator.optics.optics_plan import OpticsPlan
from simulator.scene.compositing import deep_pixels_of
from simulator.scene.occluded_background import disoccluded_share, extend_background
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan

if TYPE_CHECKING:
    from simulator.optics.ray_reference.deep_rays import DeepBlur


def blur_per_dioptre(lens: Lens, pixel_pitch_um: float, scale: float) -> float:
    """Growth of the signed blur radius [scene pixels] per 1/m of inverse distance; scale: scene pixels per photosite."""
    growth_um = float(lens.blur_radius_um(math.inf) - lens.blur_radius_um(1.0))
    return growth_um * scale / pixel_pitch_um


def plan_accuracy(
    optics: OpticsPlan,
    loaded: Scene,
    lens: Lens,
    sensor: SensorPlan,
    floor: NoiseFloor,
    tolerance: float,
    *,
    is_at_rest: bool,
) -> Accuracy:
    """Tolerance of the blur, relative to the least noise that the exposure has at any ISO of the camera (`NoiseFloor`).

    It is the noise at the scene's brightest light or, if that is less, at the ISO that saturates last. So a blur is as exact as
    the shot with the least noise needs it, and shots that differ in their ISO have the same light, bit for bit.
    loaded: the scene with all layers: a lens sees lamps behind the edges of others that hide them from a pinhole.
    is_at_rest: whether nothing moves.
    """
    per_radiance = electrons_per_radiance(lens, sensor)
    electrons = max(min(brightest_electrons(optics.scene, optics.weights, per_radiance), floor.most_electrons), 1.0)
    scenes = (loaded,) if optics.scene is loaded else (optics.scene, loaded)
    peak_e = max(peak_electrons(one, optics.weights, per_radiance) for one in scenes)
    accuracy = Accuracy(
        tolerance,
        electrons,
        floor.read_noise_e,
        max(peak_e / electrons, 1.0),
        electrons_per_radiance=per_radiance,
        brightest=electrons / per_radiance,
    )
    is_shared = optics.projection.reads_pixels and any(np.ndim(layer.depth_m) for layer in optics.scene.layers)
    is_crossed = tolerance > 0.0 and _crosses_borders(optics, loaded, lens, is_at_rest=is_at_rest)
    if is_shared or is_crossed:
        detail = scene_detail(optics.scene, optics.weights, per_radiance, accuracy)
        return replace(accuracy, pixel_detail=detail if is_shared else 0.0, crossed_detail=detail if is_crossed else 0.0)
    if not optics.is_direct:
        return accuracy
    detail = scene_detail(optics.scene, optics.weights, per_radiance, accuracy)
    detail /= sensor.camera.fill_factor  # a smaller square averages fewer pixels
    return replace(
        accuracy,
        detail=detail,
        whole_pixels=_whole_pixels(optics.projection, sensor.camera if tolerance else None),
        lamp_sharp_px=lamp_sharp_px(optics.projection.scale, accuracy),
    )


def _crosses_borders(optics: OpticsPlan, loaded: Scene, lens: Lens, *, is_at_rest: bool) -> bool:
    """Whether circles inside a photosite that is one pixel of a wall bring its light over its borders.

    At rest behind an ideal lens each photosite reads its own pixel, kernels of aberrations hold the distance, and what is
    gathered counts by `Accuracy.detail`. Behind a distortion areas of circles in photosites tell nothing of what lies between
    pixels. What moves by its distance or its own vectors, or before other layers, has methods of its own where it is sharp.
    """
    projection, is_wall = optics.projection, len(loaded.layers) == 1 and np.ndim(loaded.depth_m) == 0
    if not is_wall or not projection.has_pixel_per_photosite or projection.warp is not None or optics.is_direct:
        return False
    is_spread = not (projection.reads_pixels and is_at_rest) or lens.psf is not None or lens.has_diffraction
    return is_spread and lens.aberrations is None


def _whole_pixels(projection: Projection, camera: Camera | None) -> int:
    """`Projection.whole_pixels` of photosites at all spots of a camera's filter; None: of the photosites themselves."""
    apart_px = 0.0 if camera is None else camera.low_pass_um / camera.pixel_pitch_um
    spots = replace(projection, low_pass_px=apart_px).spots
    found = {projection.at_spot(*spot).whole_pixels(SAMPLES_PER_AXIS) for spot in spots}
    return found.pop() if len(found) == 1 else 0


def gathers_squares(
    scene: Scene, projection: Projection, lens: Lens, camera: Camera, tolerance: float, *, is_at_rest: bool
) -> bool:
    """Whether photosites gather the even squares of a fine scene directly, over their open area.

    Behind a lens with a point spread function its kernels hold the aperture of the photosites, and behind a filter where
    something moves. What rests is seen through each spot of a filter by itself. Rays (tolerance 0) start where a filter lets
    them, but for those of deep pictures. A scene coarser than the photosites shows nothing inside them.
    """
    has_filter = camera.low_pass_um > 0.0 and ((tolerance > 0.0 and not is_at_rest) or scene.deep is not None)
    return projection.is_fine and not (has_filter or lens.psf is not None or lens.has_diffraction)


def _has_kernels_of_radii(lens: Lens, pitch_um: float) -> bool:
    """Whether a lens has a file of kernels that differ by blur radius: its circles are no measure of what they change."""
    if lens.psf is None:
        return False
    from simulator.optics.psf.psf_file import read_psf  # few lenses have a file

    return len(read_psf(lens.psf, pitch_um).blur_radii_px) > 1


def electrons_per_radiance(lens: Lens, sensor: SensorPlan) -> float:
    """Electrons of a photosite on the axis per electron radiance [e- / (e- s^-1 um^-2 sr^-1)]."""
    exposure, camera = sensor.exposure, sensor.camera
    return lens.irradiance_per_radiance_sr() * exposure.time_s * camera.pixel_pitch_um**2 * camera.fill_factor


def with_defocus(
    planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, *, is_sharp: bool = False, is_at_rest: bool = True
) -> OpticsPlan:
    """Return the plan with the blur of the scene's surfaces, and with the background that shows beside blurred edges.

    is_sharp: whether blur is left out, however large it is. is_at_rest: whether nothing moves.
    """
    camera, scale, accuracy = sensor.camera, planned.projection.scale, planned.accuracy
    pitch_um = camera.pixel_pitch_um
    defocus = None if is_sharp else _plan_seen_blur(planned, loaded, lens, camera)
    if defocus is None:
        least_px, greatest_px = radius_range_px(lens, pitch_um, loaded)
        if accuracy.tolerance and (lens.aberrations is not None or _has_kernels_of_radii(lens, pitch_um)):
            planned = replace(planned, focus_px=0.5 * (least_px + greatest_px))
        ignored_px = max(abs(least_px - planned.focus_px), abs(greatest_px - planned.focus_px))
        if ignored_px == 0.0:
            return planned
        left_out = plan_blur(planned, loaded, lens, camera, keeps_sharp=True)
        per_share = electrons_per_radiance(lens, sensor) / accuracy.electrons
        how = {"is_at_rest": is_at_rest, "is_bilinear": planned.projection.is_bilinear}
        contrast = sharp_contrast(loaded, planned.weights, per_share, left_out, **how)
        return replace(planned, ignored_px=ignored_px, contrast=contrast)
    per_dioptre, share = blur_per_dioptre(lens, pitch_um, scale), None
    if not loaded.behind and isinstance(loaded.depth_m, np.ndarray):
        share = disoccluded_share(loaded.depth_m, per_dioptre, lens.focus_distance_m)
    of_loaded = defocus
    contrast, scene = both(
        lambda: contrast_of(planned, loaded, lens, sensor, of_loaded, is_at_rest=is_at_rest),
        lambda: extend_background(loaded, per_dioptre) if accuracy.tolerance else loaded,
    )
    if scene is not loaded:
        extended = plan_blur(planned, scene, lens, camera)
        assert extended is not None  # an extended background keeps the foreground that is blurred
        defocus = replace(extended, guessed=defocus.guessed)
    if accuracy.tolerance == 0.0 and scene.deep is None and scene.behind and _is_steep(defocus, scale):
        scene = replace(scene, deep=deep_pixels_of(scene.layers))
    deep_blur = None if accuracy.tolerance else _blur_deep(scene, lens, pitch_um)
    return replace(planned, scene=scene, defocus=defocus, disoccluded_share=share, deep_blur=deep_blur, contrast=contrast)


@overload
def plan_blur(planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera, *, keeps_sharp: Literal[True]) -> Defocus: ...
@overload
def plan_blur(
    planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera, *, keeps_sharp: bool = False
) -> Defocus | None: ...
def plan_blur(planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera, *, keeps_sharp: bool = False) -> Defocus | None:
    """Return the blur of a scene's surfaces, as `plan_defocus`; never None where a sharp one is kept."""
    accuracy, projection = planned.accuracy, planned.projection
    area = PhotositeArea(planned.is_direct, accuracy.whole_pixels, projection.open_side)
    return plan_defocus(
        lens, camera.pixel_pitch_um, scene, projection.scale, accuracy, planned.sensor_px, area, keeps_sharp=keeps_sharp
    )


def _plan_seen_blur(planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera) -> Defocus | None:
    """Return `plan_blur`, with all that is sharp where kernels of a file tell distances apart that an ideal lens does not."""
    defocus = plan_blur(planned, scene, lens, camera)
    if defocus is None and planned.accuracy.tolerance and _has_kernels_of_radii(lens, camera.pixel_pitch_um):
        least_px, greatest_px = radius_range_px(lens, camera.pixel_pitch_um, scene)
        if least_px < greatest_px:
            return plan_blur(planned, scene, lens, camera, keeps_sharp=True)
    return defocus


def contrast_of(
    planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, defocus: Defocus, *, is_at_rest: bool = False
) -> SceneContrast:
    """Return the contrasts of a scene on which the error of its blur depends. is_at_rest: whether nothing moves."""
    per_share = electrons_per_radiance(lens, sensor) / planned.accuracy.electrons
    return scene_contrast(loaded, planned.weights, per_share, defocus, part_of_sensor(planned), is_at_rest=is_at_rest)


def part_of_sensor(planned: OpticsPlan) -> ScenePart:
    """Return the part of the scene that the whole sensor sees."""
    return find_scene_part([(planned.projection, Window(0, 0, *planned.sensor_px))])


def ignored_terms(planned: OpticsPlan, *, moves: bool = False) -> list[ErrorTerm]:
    """Return what the blur that a plan leaves out leaves. moves: whether the scene moves, which may not be planned yet."""
    projection = planned.projection
    return ignored_error(
        planned.accuracy,
        planned.ignored_px,
        planned.contrast,
        scale=projection.scale,
        reads_pixels=planned.reads_pixels and not moves,
        is_bilinear=projection.is_bilinear,
        open_side=projection.footprints[0].side_px if projection.footprints else projection.open_side,
        gap_px=0.0 if moves else _gap_px(projection),
    )


def _gap_px(projection: Projection) -> float:
    """Distance of the borders of open areas, behind the spots of a filter, from those of even pixels as wide as photosites."""
    if not projection.has_squares or projection.scale != 1.0 or not projection.whole_pixels((1,)):
        return 0.0
    borders_px = (abs(projection.low_pass_px + way * projection.open_side) / 2.0 for way in (-1, 1))
    return min(abs(border_px % 1.0 - 0.5) for border_px in borders_px)


def _is_steep(defocus: Defocus, scale: float) -> bool:
    """Whether a ray may meet one of the layers several times, so that no iteration finds where (`needed_iterations`)."""
    from simulator.optics.ray_reference.deep_rays import STEEPEST  # only reference rays need it

    steps = [
        math.hypot(*(float(np.abs(np.diff(radius, axis=axis)).max(initial=0.0)) for axis in (0, 1)))
        for radius in defocus.radii_px
        if isinstance(radius, np.ndarray)
    ]
    return scale * max(steps, default=0.0) > STEEPEST


def _blur_deep(scene: Scene, lens: Lens, pixel_pitch_um: float) -> "DeepBlur | None":
    """Blur of the samples of a deep picture; None where the scene is none."""
    if scene.deep is None:
        return None
    from simulator.optics.ray_reference.deep_rays import DeepBlur  # only reference rays need it

    near, far = (np.asarray(lens.blur_radius_um(depth_m)) / pixel_pitch_um for depth_m in (scene.deep.near_m, scene.deep.far_m))
    return DeepBlur(near, far, float(lens.blur_radius_um(math.inf)) / pixel_pitch_um)
