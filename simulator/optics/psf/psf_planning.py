"""Plans the point spread function of a shot: where it comes from, how it is computed, and whether its effect is visible."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeGuard

import numpy as np

from simulator.color.spectra import efficiency_on, integral_weights
from simulator.errors import require
from simulator.optics.defocus.accuracy import RAY_ERROR, SHARP_PX, Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.scene_light import composite
from simulator.optics.error_term import Skipped
from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.field_nodes import choose_nodes
from simulator.optics.psf.field_psf import (
    FADE,
    FAR_AIRY,
    FieldPsf,
    airy_radius_px,
    farthest_correction_px,
    slab_radii_px,
)
from simulator.optics.psf.fraunhofer import ROUND, Opening
from simulator.optics.psf.gather_kernels import choose_core, fits_gather
from simulator.optics.psf.lamps import LIMIT_TIMES, Lamps, find_lamps
from simulator.optics.psf.light_samples import choose_over, has_squares, with_samples
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_errors import core_error
from simulator.optics.psf.psf_file import read_psf
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.slab_kernels import finer_radii, plan_slabs
from simulator.optics.psf.slab_tails import hidden_error
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wavefront_psf import LARGEST_KERNEL_PX, WavefrontPsf, channel_wavelengths
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.bands import least_of_bands, most_of_bands
from simulator.scene.sample_places import sample_places
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.stage import Moments

FIELD_NODES = (7, 9)  # rows and columns of kernels over the sensor, where they vary with the field, before `choose_nodes`
MOST_RADII = 16  # distinct blur radii of a depth map up to which each is a slab of its own
MOST_FINER = 4  # slabs in place of one, between whose kernels transforms share light
SHARED = (
    0.015  # of the light near the focus that they share wrongly, as the square of their distance; of slabs that are not finer
)
MOST_AIRY = 64.0  # blur radius [radii of the Airy disk] up to which kernels of a wavefront with aberrations include defocus
MOST_WALL_AIRY = 512.0  # the same of a single one without them: 4,096 samples of a pupil hold 620
SMOOTH_PX = 0.5  # blur radius from which light between photosites is smooth [photosites]
DARK = 0.1  # share of a scene that is the dark side of its edges
SKIPPED_SHARE = 0.5  # of the tolerance: change below which a PSF is left out
LARGE_CONTRAST = 1e3  # of a scene [standard deviations of the noise], above which no PSF is left out
CORRECTIONS_PX = ((0.125, 2.0), (0.25, 4.0), (0.5, math.inf))  # blur radius between corrections, and up to which radius
WAVELENGTHS = {1: 7, 3: 3, 4: 3}  # per channel, by the number of channels


def contrast_sigma(scene: Scene, electrons: np.ndarray, moments: Callable[[float], Moments]) -> float:
    """Upper bound of a scene's range of light, in standard deviations of the noise where it is darkest; inf for layers.

    electrons: (bands, channels) mean electrons on the axis per unit weight of a plane [e-].
    moments: of the code [DN], by mean electrons [e-].
    """
    if scene.behind or scene.coverage is not None:
        return math.inf
    low, high = (ends(scene.planes).astype(np.float64) for ends in (least_of_bands, most_of_bands))
    contrast_e = float(((high - low) @ electrons).max())
    if contrast_e == 0.0:
        return 0.0
    gain = moments(1.0).mean - moments(0.0).mean
    return contrast_e * gain / math.sqrt(moments(float((low @ electrons).min())).variance)


def highlight_thresholds(scene: Scene, weights: np.ndarray) -> tuple[float, ...]:
    """Electron radiance above which light is a highlight, by channel: LIMIT_TIMES times the mean of the darker nine tenths."""
    flat = (layer.planes.reshape(-1, layer.planes.shape[-1]) for layer in scene.layers)
    pixels = np.concatenate([one[sample_places(len(one), 65536)] for one in flat])
    light = np.sort(pixels.astype(np.float64) @ weights, axis=0)
    return tuple(float(mean) for mean in LIMIT_TIMES * light[: max(1, int(0.9 * len(light)))].mean(axis=0))


def _is_smooth(psf: FieldPsf, defocus: Defocus | None, accuracy: Accuracy) -> bool:
    """Whether no light has an edge that would ring: circles of SMOOTH_PX and more come first, and there are no lamps.

    Light above a limit would get other kernels than that below it, and each of them a bend that the other takes away.
    """
    if psf.by_distance or defocus is None or accuracy.has_lamps:
        return False
    return min(least for least, _ in defocus.of_scene().ranges_px) >= SMOOTH_PX


def dark_light(scene: Scene, weights: np.ndarray) -> float:
    """Electron radiance below which the share DARK of a scene lies, its layers over one another, where that is least."""
    layers = []
    for layer in scene.layers:
        places = sample_places(layer.planes[..., 0].size, 4096)
        cover = None if layer.coverage is None else layer.coverage.reshape(-1)[places]
        layers.append((layer.planes.reshape(-1, layer.planes.shape[-1])[places] @ weights, cover))
    light = np.sort(composite(layers), axis=0)
    return float(light[int(DARK * len(light))].min())


def plan_visible_psf(
    lens: Lens,
    camera: Camera,
    scene: Scene,
    weights: np.ndarray,
    defocus: Defocus | None,
    projection: Projection,
    contrast: float,
    accuracy: Accuracy,
    sampling_error: Callable[[FieldPsf], float],
    far_error: Callable[[FieldPsf], float],
    whole: float,
    *,
    focus_px: float = 0.0,
    is_at_rest: bool,
) -> tuple[FieldPsf | None, Skipped | None, Lamps | None]:
    """PSF of a shot, None where it has no visible effect, why it is left out, None where it is not, and lamps that are drawn.

    contrast: of `contrast_sigma`. weights: of `OpticsPlan`. sampling_error: returns that of the samples of light which a PSF is
    applied to, as a share of the brightest; far_error that of its circles far larger than the Airy disk: where it is more than
    is allowed, one kernel holds the blur of a scene at one distance, not finer than the photosites and without lamps.
    whole: tolerance of the photograph, of which `accuracy` has that of each approximation. focus_px: of `plan_psf`.
    is_at_rest: nothing moves, so that lamps may be drawn, samples may have a footprint, and those of squares stay squares.
    Raises PhotositeError as `plan_psf`.
    """
    if contrast == 0.0:
        return None, Skipped("the scene is the same everywhere"), None
    scale = projection.scale
    psf = plan_psf(lens, camera, scene, defocus, scale, accuracy.tolerance, focus_px)
    if psf is None:
        return None, None, None
    is_wall = defocus is not None and defocus.least_px == defocus.greatest_px and scale < 1.0 + 1e-6 and not accuracy.has_lamps
    if is_wall and not psf.by_distance and far_error(psf) > accuracy.allowed:
        psf = plan_psf(lens, camera, scene, defocus, scale, accuracy.tolerance, focus_px, most_airy=MOST_WALL_AIRY) or psf
    psf = _at_own_distances(psf, camera, scene, defocus, projection, accuracy)
    if psf.by_distance and len(psf.radii_px) == 1:  # the device has slabs of photosites only
        fits = is_at_rest and (projection.is_bilinear or _has_one_surface(scene))  # layers of squares keep to these
        part, is_alone = whole if fits else None, _has_one_surface(scene)
        psf = with_samples(psf, projection, accuracy, sampling_error, camera.channels, part, apart=is_alone)
    limits = () if _is_smooth(psf, defocus, accuracy) else highlight_thresholds(scene, weights)
    psf = replace(psf, highlight_limits=limits, even_squares=is_at_rest and has_squares(psf, projection))
    if contrast < LARGE_CONTRAST and (defocus is None or not psf.by_distance):
        least = SKIPPED_SHARE * accuracy.tolerance
        change = contrast * bound_change(psf, camera.channels, least / contrast)
        if change < least:
            return None, Skipped(f"changes nothing by more than {change:.2g} sigma", change), None
    lamps = _find_lamps(psf, scene, weights, projection, accuracy) if is_at_rest and defocus is None else None
    own = accuracy if lamps is None else _of_rest(accuracy, lamps)
    dark_e = min(accuracy.electrons_per_radiance * dark_light(scene, weights), own.electrons)
    light = own.peak / max(scale, 1.0) ** 2, own.electrons, dark_e, own.read_noise_e
    in_the_dark = Visibility(max(own.allowed, RAY_ERROR * own.sigma), _detail(scene, scale), *light)

    def with_nodes(psf: FieldPsf) -> FieldPsf:
        found = choose_nodes(psf, camera.channels, in_the_dark)
        return found if found is psf else replace(found, field_error=found.field_error * accuracy.sigma / own.sigma)

    if not (psf.by_distance and len(psf.radii_px) > 1 and accuracy.tolerance):  # slabs choose theirs
        psf = with_nodes(psf)
    gathered = _with_gather(psf, camera.channels, scene, defocus, own, scale)
    if not gathered.field_error and not gathered.is_gathered_by_distance:
        gathered = with_nodes(gathered)
    if gathered.over < psf.over and projection.is_bilinear:  # one sample of smooth light is cheap, and less exact
        left, finer = (accuracy.in_sigma(sampling_error(one)) for one in (gathered, psf))
        gathered = psf if finer <= whole < left else gathered
    core = gathered.core
    if core is None and psf.by_distance and defocus is not None and defocus.maps:
        return _with_finer_slabs(gathered, accuracy), None, lamps
    if core is not None and core.error and gathered.seen is not None:
        seen = replace(gathered.seen, electrons=own.electrons, dark_e=dark_e, read_noise_e=own.read_noise_e)
        if gathered.is_gathered_by_distance:
            error = core.error + (hidden_error(gathered, seen) if _has_layers(scene, defocus) else 0.0)
        else:
            error = core_error(gathered, core, camera.channels, seen) * accuracy.sigma / own.sigma
        gathered = gathered.with_core(replace(core, error=error), gathered.seen)
    return gathered, None, lamps


def _with_finer_slabs(psf: FieldPsf, accuracy: Accuracy) -> FieldPsf:
    """Return a PSF with slabs in between where its transforms would share more than half of what is allowed wrongly."""
    allowed = 0.5 * accuracy.tolerance or accuracy.ray_error
    finer = math.ceil(math.sqrt(accuracy.in_sigma(SHARED) / allowed))
    return replace(psf, radii_px=tuple(finer_radii(psf, min(max(finer, 1), MOST_FINER))))


def _at_own_distances(
    psf: FieldPsf, camera: Camera, scene: Scene, defocus: Defocus | None, projection: Projection, accuracy: Accuracy
) -> FieldPsf:
    """Return the PSF of layers of one distance each with kernels of each distance, where the device gathers these.

    A correction of a geometric blur to wave optics takes light of nearer and farther surfaces as the photosite's own:
    beside the borders of layers it is wrong by what it corrects.
    """
    if not psf.corrected_px or defocus is None or defocus.maps or defocus.eyes is not None or not scene.behind:
        return psf
    over = choose_over(psf.lens_psf, psf.sampling, projection.scale)
    radii_px = tuple(sorted({float(radius) for radius in defocus.radii_px}))
    if over > 1 or len(radii_px) < 2:
        return psf
    own = replace(psf, radii_px=radii_px, by_distance=True, corrected_px=())
    return own if _with_gather(own, camera.channels, scene, defocus, accuracy, projection.scale).core is not None else psf


def _of_rest(accuracy: Accuracy, lamps: Lamps) -> Accuracy:
    """Accuracy of a scene without its lamps."""
    peak_e = accuracy.electrons_per_radiance * max(lamps.rest, LIMIT_TIMES * max(lamps.most))
    electrons = max(min(accuracy.electrons, peak_e), 1.0)
    return replace(accuracy, electrons=electrons, peak=max(peak_e / electrons, 1.0), brightest=0.0)


def _find_lamps(psf: FieldPsf, scene: Scene, weights: np.ndarray, projection: Projection, accuracy: Accuracy) -> Lamps | None:
    """Lamps of one picture at rest behind kernels that hold detail finer than photosites; None: none are drawn."""
    is_coarse = isinstance(psf.lens_psf, PsfTable) and psf.lens_psf.cells == 1
    if not _has_one_surface(scene) or is_coarse or projection.is_displaced:
        return None
    return find_lamps(scene, weights, projection, psf.highlight_limits, accuracy.peak * accuracy.brightest)


def _has_one_surface(scene: Scene) -> bool:
    """Whether a scene is one opaque layer."""
    return len(scene.layers) == 1 and scene.coverage is None


def _has_layers(scene: Scene, defocus: Defocus | None) -> bool:
    """Whether surfaces hide light of others that is known."""
    return bool(scene.behind) and not (defocus is not None and defocus.guessed)


def _detail(scene: Scene, scale: float) -> float:
    """Scene pixels per photosite by whose edges errors are seen: even squares have edges, however wide they are."""
    return max(scale, 1.0) if scene.interpolation == "nearest" else scale


def _with_gather(
    psf: FieldPsf, channels: int, scene: Scene, defocus: Defocus | None, accuracy: Accuracy, scale: float
) -> FieldPsf:
    """Return a PSF of one kernel for all light with the core by which the device gathers it, where sums are cheaper."""
    detail = _detail(scene, scale)
    if accuracy.tolerance and psf.by_distance and len(psf.radii_px) > 1:
        seen = Visibility(accuracy.allowed, detail, accuracy.peak)
        found = plan_slabs(psf, replace(seen, has_layers=True)) if _has_layers(scene, defocus) else psf
        return found if found.core is not None else plan_slabs(psf, seen)
    is_alone = _has_one_surface(scene) or not psf.by_distance
    if not accuracy.tolerance or len(psf.radii_px) > 1 or not is_alone or not fits_gather(psf):
        return psf
    seen = Visibility(accuracy.allowed, detail, accuracy.peak / max(scale, 1.0) ** 2)
    core = choose_core(psf, channels, seen)
    return psf if core is None else psf.with_core(core, seen)


def plan_psf(
    lens: Lens,
    camera: Camera,
    scene: Scene,
    defocus: Defocus | None,
    scale: float,
    tolerance: float = 0.0,
    focus_px: float = 0.0,
    *,
    most_airy: float = FAR_AIRY,
) -> FieldPsf | None:
    """PSF of a shot, whether visible or not; None for an ideal lens, and photosites that are sensitive all over or in focus.

    scale: scene pixels per photosite. tolerance: as in `Shot`; 0: wave optics at every distance.
    focus_px: signed blur radius of kernels by distance where no surface is blurred otherwise [photosites].
    most_airy: blur radius [radii of the Airy disk] up to which kernels of an ideal lens include a blur that is nowhere smaller.
    Raises PhotositeError for a PSF file that cannot be read or does not hold what the scene needs.
    """
    sampling, lens_psf = Sampling(camera.fill_factor, camera.low_pass_um), _plan_lens_psf(lens, camera, scene)
    if lens_psf is None and (defocus is None or sampling == Sampling()):
        return None
    radii_px, by_distance = _choose_slabs(lens_psf, lens, defocus, camera.pixel_pitch_um, focus_px, most_airy)
    corrected_px: tuple[float, ...] = ()
    if tolerance and by_distance and _is_ideal(lens_psf) and defocus is not None and len(radii_px) > 1:
        radii_px, by_distance, corrected_px = (0.0,), False, _corrected_px(lens_psf, defocus)
    nodes = FIELD_NODES if _varies_over_field(lens_psf) else (1, 1)
    over = choose_over(lens_psf, sampling, scale) if by_distance else 1
    pupil, sensor_px = replace(lens.pupil, stops=()), (camera.width_px, camera.height_px)
    return FieldPsf(
        lens_psf,
        pupil,
        sampling,
        camera.pixel_pitch_um,
        over,
        radii_px,
        by_distance,
        sensor_px,
        nodes,
        corrected_px=corrected_px,
    )


def _is_ideal(lens_psf: WavefrontPsf | PsfTable | None) -> TypeGuard[WavefrontPsf]:
    """Whether a lens has diffraction and no aberrations."""
    return isinstance(lens_psf, WavefrontPsf) and lens_psf.aberrations == Aberrations()


def _corrected_px(lens_psf: WavefrontPsf, defocus: Defocus) -> tuple[float, ...]:
    """Blur radii at which the geometric blur is corrected to wave optics, ascending [photosites]."""
    most = farthest_correction_px(lens_psf)
    gone = FADE * most  # the last correction, which is none
    least, greatest = max(defocus.least_px, -gone), min(defocus.greatest_px, gone)
    starts = (0.0, *(end for _, end in CORRECTIONS_PX))
    steps = [np.arange(start, min(end, most), step) for start, (step, end) in zip(starts, CORRECTIONS_PX, strict=False)]
    grid = np.concatenate([*steps, [most, gone]])
    grid = np.unique(np.concatenate([-grid[1:], grid]))
    first, last = np.searchsorted(grid, least, side="right") - 1, np.searchsorted(grid, greatest)
    return tuple(float(radius) for radius in grid[max(first, 0) : last + 1])


def _plan_lens_psf(lens: Lens, camera: Camera, scene: Scene) -> WavefrontPsf | PsfTable | None:
    """PSF of the lens alone, from its file or its wavefront; None: an ideal lens."""
    if lens.psf is not None:
        table = read_psf(lens.psf, camera.pixel_pitch_um)
        channels, rule = table.kernels.shape[2], f"the camera has {camera.channels}; give one for each, or one for all"
        require(channels in (1, camera.channels), "channels of the kernels", channels, rule, file=lens.psf)
        return table.whole()
    if not lens.has_diffraction:
        return None
    aberrations, f_number = working_wavefront(lens)
    light = _channel_light(scene, camera)
    chosen_nm = channel_wavelengths(scene.wavelengths_nm, light, WAVELENGTHS[camera.channels])
    opening = _opening(replace(lens.pupil, stops=()))
    wavelengths_nm = tuple(tuple(float(nm) for nm in row) for row in chosen_nm)
    return WavefrontPsf(aberrations, f_number, camera.pixel_pitch_um, wavelengths_nm, 1, 1, opening)


def working_wavefront(lens: Lens) -> tuple[Aberrations, float]:
    """Return the aberrations of a lens, and the f-number at which they and its diffraction hold.

    Raises PhotositeError where the pupil is larger than that of the stated wavefront.
    """
    f_number, aberrations = lens.diffraction_f_number, lens.aberrations or Aberrations()
    aberrations.pupil_radius_ratio(lens.f_number)
    if aberrations.at_f_number is not None:  # the size of the pupil counts, not the distance of the sensor
        aberrations = replace(aberrations, at_f_number=aberrations.at_f_number * f_number / lens.f_number)
    return aberrations, f_number


def _channel_light(scene: Scene, camera: Camera) -> np.ndarray:
    """Photons of the illuminant that each channel detects, (wavelengths, channels); if none, its efficiency, or 1."""
    curves = camera.response.wavelengths_nm, camera.response.quantum_efficiency
    counted = scene.illuminant[:, None] * integral_weights(scene.wavelengths_nm, *curves, of_photons=True)
    efficiency = efficiency_on(scene.wavelengths_nm, *curves)
    counted = np.where(counted.sum(axis=0) > 0, counted, efficiency)
    return np.where(counted.sum(axis=0) > 0, counted, 1.0)


def _opening(pupil: Pupil) -> Opening:
    """Shape of the pupil for wave optics."""
    if pupil == Pupil():
        return ROUND
    return Opening(pupil.depth, pupil.corner_radius, pupil.blades or 0, math.radians(pupil.rotation_deg))


def _varies_over_field(lens_psf: WavefrontPsf | PsfTable | None) -> bool:
    """Whether kernels differ over the field."""
    if isinstance(lens_psf, PsfTable):
        return len(lens_psf.fields) > 1
    if lens_psf is None:
        return False
    return lens_psf.aberrations.varies_over_field


def _choose_slabs(
    lens_psf: WavefrontPsf | PsfTable | None,
    lens: Lens,
    defocus: Defocus | None,
    pitch_um: float,
    focus_px: float,
    most_airy: float,
) -> tuple[tuple[float, ...], bool]:
    """Signed blur radii of the slabs [photosites], and whether their kernels include the blur of defocus.

    most_airy: of `plan_psf`.
    """
    one_radius = lens_psf is None or isinstance(lens_psf, PsfTable) and len(lens_psf.blur_radii_px) == 1
    if isinstance(lens_psf, PsfTable) and not one_radius:
        _check_range(lens_psf, defocus)
    if defocus is None:
        return (focus_px,), True
    if one_radius or (
        isinstance(lens_psf, WavefrontPsf) and not _fits_in_kernels(lens_psf, lens, defocus, pitch_um, most_airy)
    ):
        return (0.0,), False
    return tuple(sorted({radius for one in defocus.radii_px for radius in _radii_px(one)})), True


def _check_range(table: PsfTable, defocus: Defocus | None) -> None:
    """Raise PhotositeError for a table whose blur radii do not cover those of the scene."""
    least, greatest = (0.0, 0.0) if defocus is None else (defocus.least_px, defocus.greatest_px)
    known = table.blur_radii_px
    rule = f"{table.source} holds blur radii from {known[0]:g} to {known[-1]:g}; tabulate more, or stop down"
    within = known[0] - SHARP_PX <= least and greatest <= known[-1] + SHARP_PX
    require(bool(within), "blur of the scene", f"{least:.2f} to {greatest:.2f} photosites", rule, part="lens.psf")


def _radii_px(radius: float | np.ndarray) -> list[float]:
    """Signed blur radii of the slabs that a layer needs [photosites]."""
    if not isinstance(radius, np.ndarray):
        return [float(radius)]
    few = np.unique(radius.ravel()[:: max(1, radius.size // 4096)])
    if len(few) <= MOST_RADII and np.isin(radius, few).all():
        return few.tolist()
    return slab_radii_px(float(radius.min()), float(radius.max()))


def _fits_in_kernels(lens_psf: WavefrontPsf, lens: Lens, defocus: Defocus, pitch_um: float, most_airy: float) -> bool:
    """Whether kernels include the blur of defocus: where they are not too large, and not all far larger than the Airy disk.

    most_airy: of `plan_psf`.
    """
    rim_px = defocus.largest_px * lens_psf.opening.reach
    if 2.0 * rim_px + 14.0 * 0.7 * lens_psf.f_number / pitch_um > 0.9 * LARGEST_KERNEL_PX:
        return False
    airy_px = airy_radius_px(lens_psf)
    if lens_psf.aberrations != Aberrations():
        return rim_px < MOST_AIRY * airy_px
    if defocus.eyes is not None and rim_px > FAR_AIRY * airy_px:
        return False  # kernels have the pupil of the axis
    near, far = defocus.least_px, defocus.greatest_px
    return not lens.has_plane_of_focus or near <= 0.0 <= far or min(abs(near), abs(far)) < most_airy * airy_px


def bound_change(psf: FieldPsf, channels: int, enough: float = math.inf) -> float:
    """Upper bound of the fraction of a scene's contrast, in focus, that the kernels change anywhere on the sensor: 0 to 1.

    enough: fraction from which on no larger one is looked for.
    """
    most = 0.0
    for node, channel in itertools.product(_telling_nodes(psf), range(channels)):
        kernel = psf.kernel(0, channel, False, *node)
        sharp, middle = np.zeros_like(kernel), kernel.shape[-1] // 2
        sharp[:, middle, middle] = 1.0 / len(kernel)
        most = max(most, 0.5 * float(np.abs(kernel - sharp).sum()))
        if most >= enough:
            break
    return most


def _telling_nodes(psf: FieldPsf) -> list[tuple[int, int]]:
    """Nodes nearest to the middle of the sensor, to its corners, and to each field radius at which kernels are known.

    Between these radii kernels are mixed, which changes light by no more than one of them does.
    """
    nodes = list(np.ndindex(*psf.nodes))
    away = np.array([math.hypot(*psf.field_xy(*node)) for node in nodes])
    known = psf.lens_psf.fields if isinstance(psf.lens_psf, PsfTable) else np.linspace(0.0, 1.0, psf.field_steps + 1)
    beside = (np.abs(away - field) for field in (0.0, 1.0, *known))
    return list(dict.fromkeys(nodes[place] for one in beside for place in np.flatnonzero(one <= one.min() + 1e-9)))
