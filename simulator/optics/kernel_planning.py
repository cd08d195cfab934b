"""Plans the point spread function of a lens and a camera: its kernels, and what they leave of the light."""

import math
from collections.abc import Hashable
from dataclasses import replace
from functools import partial

from simulator.optics.blur_planning import electrons_per_radiance
from simulator.optics.defocus.scene_light import BRIGHT, scene_bends, scene_detail
from simulator.optics.geometry.end_spacing import LIT_SHARE
from simulator.optics.geometry.footprint import Footprint
from simulator.optics.lens.lens import Lens
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.psf.far_circles import far_circle_error
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.filtered_layers import filtered_layers_error, spread_layers_error
from simulator.optics.psf.kernel_split import gather_table
from simulator.optics.psf.lamps import Lamps
from simulator.optics.psf.left_out_blur import left_out_error
from simulator.optics.psf.psf_errors import focus_error, undrawn_error
from simulator.optics.psf.psf_planning import contrast_sigma, dark_light, plan_visible_psf
from simulator.optics.psf.sampled_light import kernel_bend_error, kernel_square_error
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wings import plan_wings
from simulator.scene.content_keys import freeze
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan


def with_psf(planned: OpticsPlan, lens: Lens, sensor: SensorPlan, floor: NoiseFloor | None, is_at_rest: bool) -> OpticsPlan:
    """Return the plan with the point spread function, unless its effect is invisible at every ISO.

    Kernels by distance hold a low-pass filter. Where its spots see layers apart by more than is allowed, and on the reference
    path, each spot has an image of its own instead.
    """
    projection, camera = planned.projection, sensor.camera
    if projection.open_side < 1.0 or projection.low_pass_px > 0.0 or projection.footprints:
        return _without_kernels(planned, lens, sensor)  # the scene is integrated over the open area of each photosite
    found = _with_kernels(planned, lens, sensor, camera, floor, is_at_rest)
    if not camera.low_pass_um or found.defocus is None or found.psf is None or not found.psf.by_distance:
        return found
    apart_px = camera.low_pass_um / camera.pixel_pitch_um
    to_share = electrons_per_radiance(lens, sensor) / planned.accuracy.electrons * planned.weights
    error = filtered_layers_error(planned.scene, to_share, found.defocus, apart_px) if planned.scene.behind else 0.0
    if error > (planned.accuracy.allowed if planned.accuracy.tolerance else 0.0):
        at_spots = replace(planned, projection=replace(projection, low_pass_px=apart_px))
        apart = _with_kernels(at_spots, lens, sensor, replace(camera, low_pass_um=0.0), floor, is_at_rest)
        if apart.psf is not None:
            return apart
    return replace(found, spots_error=error)


def with_wings(planned: OpticsPlan, seen: Scene) -> OpticsPlan:
    """Return the plan with the light that diffraction brings from beyond its kernels. seen: the scene as one surface."""
    if planned.psf is None:
        return planned
    wings, left = plan_wings(planned.psf, seen.planes, planned.weights, planned.projection, planned.accuracy)
    return replace(planned, wings=wings, wings_error=left)


def _with_kernels(
    planned: OpticsPlan, lens: Lens, sensor: SensorPlan, camera: Camera, floor: NoiseFloor | None, is_at_rest: bool
) -> OpticsPlan:
    """Return the plan with the point spread function of the lens and this camera."""
    exposure, irradiance = sensor.exposure, sensor.irradiance
    factor = exposure.time_s * exposure.collecting_area_um2 * irradiance.effective_solid_angle_sr
    contrast = contrast_sigma(planned.scene, factor * planned.weights, (floor or NoiseFloor(1.0, 1.0)).moments)
    if contrast > 0.0 and planned.accuracy.tolerance == 0.0:
        contrast = math.inf  # nothing is left out
    per_radiance = electrons_per_radiance(lens, sensor)
    psf, skipped, lamps = plan_visible_psf(
        lens,
        camera,
        planned.scene,
        planned.weights,
        planned.defocus,
        planned.projection,
        contrast,
        planned.accuracy,
        partial(_sampling_error, planned, lamps=None, per_radiance=per_radiance),
        partial(_far_error, planned, per_radiance=per_radiance),
        planned.tolerance,
        focus_px=planned.focus_px,
        is_at_rest=is_at_rest,
    )
    defocus = planned.defocus
    if defocus is not None and psf is not None and psf.corrected_px:
        defocus = replace(defocus, corrected_px=max(abs(radius) for radius in psf.corrected_px))
    sampled = 0.0 if psf is None else _sampling_error(planned, psf, lamps, per_radiance)
    undrawn = left_out = 0.0
    if psf is not None:
        left_out = _focus_error(planned, psf, lens, per_radiance)
        first = planned.defocus if not psf.by_distance else None
        smallest_px = None if first is None else min(least for least, _ in first.of_scene().ranges_px)
        dark = partial(dark_light, planned.scene, planned.weights)
        undrawn = undrawn_error(psf, lamps, planned.projection, planned.accuracy, dark, smallest_px)
    has_rays = is_at_rest and psf is not None and _sends_layer_rays(planned, psf)
    return replace(
        planned,
        psf=psf,
        psf_skipped=skipped,
        lamps=planned.lamps if psf is None else lamps,
        defocus=defocus,
        sampling_error=sampled,
        lamp_error=undrawn,
        focus_error=left_out,
        spread_error=0.0 if psf is None or has_rays else _spread_error(planned, psf, per_radiance),
        far_error=0.0 if psf is None else _far_error(planned, psf, per_radiance),
        layer_rays=has_rays,
        contrast=replace(planned.contrast, crossed=_crossed(planned, psf, per_radiance)),
    )


def _without_kernels(planned: OpticsPlan, lens: Lens, sensor: SensorPlan) -> OpticsPlan:
    """Return the plan of a scene that photosites average through the spots of a filter and over their open area alone."""
    crossed = _crossed(planned, None, electrons_per_radiance(lens, sensor))
    return replace(planned, contrast=replace(planned.contrast, crossed=crossed))


def _crossed(planned: OpticsPlan, psf: FieldPsf | None, per_radiance: float) -> float | None:
    """Return `SceneContrast.crossed`: of a fine scene whose light no plan of the blur measures pixel by pixel."""
    accuracy, defocus, radius_px = planned.accuracy, planned.defocus, planned.ignored_px
    if defocus is not None:
        own = defocus.of_scene()
        radius_px = max((min(most, own.copied_px) for least, most in own.ranges_px if least <= own.copied_px), default=0.0)
    if radius_px == 0.0 or not accuracy.tolerance or accuracy.detail or not planned.projection.is_fine:
        return None
    to_share = per_radiance / accuracy.electrons * planned.weights
    told, projection = (planned.scene, to_share, accuracy, planned.projection.scale, radius_px), planned.projection
    if psf is None:
        return left_out_error(*told, area=Footprint(projection.open_side, projection.low_pass_px))
    return left_out_error(*told, psf.lens_psf, psf.sampling.footprint(psf.pitch_um), psf.pupil.corner_radius)


def _focus_error(planned: OpticsPlan, psf: FieldPsf, lens: Lens, per_radiance: float) -> float:
    """Error of the kernels of a lens with aberrations at `OpticsPlan.focus_px`, where the scene has other distances, too."""
    if planned.defocus is not None or lens.aberrations is None or planned.ignored_px == 0.0:
        return 0.0
    accuracy = planned.accuracy
    dark_e = min(per_radiance * dark_light(planned.scene, planned.weights), accuracy.electrons)
    light = accuracy.electrons, dark_e, accuracy.read_noise_e
    seen = Visibility(accuracy.allowed, planned.projection.scale, accuracy.peak, *light)
    return focus_error(psf, planned.ignored_px, planned.channels, seen)


def _spreads_layers(planned: OpticsPlan, psf: FieldPsf) -> bool:
    """Whether kernels by distance spread layers one by one that hide each other."""
    return psf.by_distance and planned.defocus is not None and bool(planned.scene.behind) and planned.has_coverage


def _sends_layer_rays(planned: OpticsPlan, psf: FieldPsf) -> bool:
    """Whether rays add what kernels lack that spread each layer of a scene at rest: without lamps, and steps within a layer."""
    if planned.accuracy.tolerance or planned.accuracy.has_lamps or not _spreads_layers(planned, psf):
        return False
    return psf.nodes == (1, 1) and not psf.footprints and not planned.contrast.has_steps


def _spread_error(planned: OpticsPlan, psf: FieldPsf, per_radiance: float) -> float:
    """Error of kernels by distance that spread each layer by itself, as a share of the brightest light."""
    if planned.defocus is None or not _spreads_layers(planned, psf):
        return 0.0
    in_focus = psf.of_one_radius(0.0)
    kernel = in_focus.kernel(0, planned.channels // 2, False, *(count // 2 for count in psf.nodes))
    accuracy, scene, defocus, table = planned.accuracy, planned.scene, planned.defocus, gather_table(kernel)
    to_share = per_radiance / accuracy.electrons * planned.weights
    light = freeze(to_share), accuracy.electrons, accuracy.read_noise_e
    key = "spread layers", light, freeze(table), psf.over, tuple(freeze(radius) for radius in defocus.radii_px)
    return scene.remember(key, lambda: spread_layers_error(scene, to_share, defocus, table, psf.over))


def _far_error(planned: OpticsPlan, psf: FieldPsf, per_radiance: float) -> float:
    """Error of circles far larger than the Airy disk, as a share of the brightest light."""
    scene, defocus, accuracy = planned.scene, planned.defocus, planned.accuracy
    if defocus is None:
        return 0.0
    to_share = per_radiance / accuracy.electrons * planned.weights
    kernels = psf.key[:3], psf.pitch_um, psf.by_distance, psf.radii_px, psf.corrected_px
    key = "far circles", kernels, freeze(to_share), defocus.of_scene().ranges_px, accuracy.electrons, accuracy.read_noise_e
    return scene.remember(key, lambda: far_circle_error(psf, scene, to_share, defocus, accuracy))


def _sampling_error(planned: OpticsPlan, psf: FieldPsf, lamps: Lamps | None, per_radiance: float) -> float:
    """Error of the samples of a scene that kernels by distance are applied to, as a share of the brightest light.

    Kernels end within samples that mix even squares of the scene, as photosites and circles of confusion do, or in which light
    between its pixels bends; those of a lens spread what samples do not tell of it.
    """
    projection = planned.projection
    if psf.by_distance and projection.is_bilinear:
        return kernel_bend_error(psf, projection.scale, planned.channels) * _bends(planned, per_radiance)
    are_whole = not psf.footprints and projection.whole_pixels((psf.over,)) > 0
    if not psf.by_distance or not projection.has_square_pixels or are_whole:
        return 0.0
    scene = planned.scene if lamps is None else lamps.without(planned.scene, planned.weights)
    return mixing_error(planned, psf, scene, per_radiance)


def mixing_error(planned: OpticsPlan, psf: FieldPsf, scene: Scene, per_radiance: float) -> float:
    """Error of samples that mix the even squares of a scene, as a share of the brightest light. per_radiance: as elsewhere."""
    seen = planned.weights, per_radiance, planned.accuracy
    detail = scene.remember(("detail of samples", *_light_key(planned, per_radiance)), lambda: scene_detail(scene, *seen))
    return detail * kernel_square_error(psf, planned.projection.scale, planned.channels)


def _bends(planned: OpticsPlan, per_radiance: float) -> float:
    """Bend of the scene's light at its pixels, but for lamps, which have an error of their own (`scene_bends`)."""
    seen = planned.weights, per_radiance, planned.accuracy, BRIGHT, LIT_SHARE
    key = "bends of samples", *_light_key(planned, per_radiance)
    return planned.scene.remember(key, lambda: scene_bends(planned.scene, *seen, has_lamps=False))


def _light_key(planned: OpticsPlan, per_radiance: float) -> tuple[Hashable, ...]:
    """What differences of a scene's light depend on beside the scene: its electrons and their noise, whatever is allowed."""
    accuracy = planned.accuracy
    return freeze(planned.weights), per_radiance, accuracy.electrons, accuracy.read_noise_e, accuracy.has_lamps
