"""Which spread a shot has, which way it is computed, and what of it cannot be seen."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simulator.color.spectra import efficiency_on
from simulator.errors import require
from simulator.optics.defocus.accuracy import SHARP_PX
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.field_psf import FAR_AIRY, Spread, airy_radius_px, slab_radii_px
from simulator.optics.psf.fraunhofer import ROUND, Opening
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_file import read_psf
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import LARGEST_KERNEL_PX, WavefrontPsf, channel_wavelengths
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.stage import Moments

FIELD_NODES = (7, 9)  # rows and columns of kernels over the sensor, where they differ
MOST_OVER = 4  # points per photosite and axis that light is given on
MOST_RADII = 16  # that a depth map may hold for each to be a slab of its own
MOST_AIRY = 64.0  # blur radius over the Airy disk's up to which a wavefront with aberrations is worth its time
BRIGHT = 4.0
UNSEEN_SIGMA = 0.01
LARGE_CONTRAST = 1e3  # of the scene, in standard deviations, for which no kernel is narrow enough to be skipped
WAVELENGTHS = {1: 7, 3: 3}  # per channel, by the number of channels


def contrast_sigma(scene: Scene, electrons: np.ndarray, moments: Callable[[float], Moments]) -> float:
    """Range of a scene's light in standard deviations of its darkest place: an upper bound; inf for a scene of layers.

    electrons: (bands, channels) mean electrons on the axis of a plane of weight 1 [e-]. moments: code of so many.
    """
    if scene.behind or scene.coverage is not None:
        return math.inf
    low, high = (ends(scene.planes, axis=(0, 1)).astype(np.float64) for ends in (np.min, np.max))
    contrast_e = float(((high - low) @ electrons).max())
    if contrast_e == 0.0:
        return 0.0
    gain = moments(1.0).mean - moments(0.0).mean
    return contrast_e * gain / math.sqrt(moments(float((low @ electrons).min())).variance)


def bright_light(scene: Scene, weights: np.ndarray) -> tuple[float, ...]:
    """Light of each channel that counts as bright: BRIGHT times the mean of what is not among the brightest tenth."""
    flat = (layer.planes.reshape(-1, layer.planes.shape[-1]) for layer in scene.layers)
    pixels = np.concatenate([one[:: max(1, len(one) // 65536)] for one in flat])
    light = np.sort(pixels.astype(np.float64) @ weights, axis=0)
    return tuple(float(mean) for mean in BRIGHT * light[: max(1, int(0.9 * len(light)))].mean(axis=0))


def plan_seen_spread(
    lens: Lens, camera: Camera, scene: Scene, weights: np.ndarray, defocus: Defocus | None, scale: float, contrast: float
) -> tuple[Spread | None, str | None]:
    """Spread of a shot, None where nothing of it is seen, and why it is left out, None where it is not.

    contrast: of `contrast_sigma`. weights: of `OpticsPlan`. Raises PhotositeError as `plan_spread`.
    """
    if contrast == 0.0:
        return None, "the scene is the same everywhere"
    spread = plan_spread(lens, camera, scene, defocus, scale)
    if spread is None:
        return None, None
    spread = replace(spread, bright=bright_light(scene, weights))
    if contrast < LARGE_CONTRAST and (defocus is None or not spread.by_distance):
        change = contrast * largest_change(spread, camera.channels)
        if change < UNSEEN_SIGMA:
            return None, f"changes nothing by more than {change:.2g} sigma"
    return spread, None


def plan_spread(lens: Lens, camera: Camera, scene: Scene, defocus: Defocus | None, scale: float) -> Spread | None:
    """Spread of a shot before anything is skipped; None for a perfect lens before photosites that are sensitive all over.

    scale: scene pixels per photosite.
    Raises PhotositeError for a PSF file that cannot be read or does not hold what the scene needs.
    """
    sampling, psf = Sampling(camera.fill_factor, camera.low_pass_um), _psf(lens, camera, scene)
    if psf is None and sampling == Sampling():
        return None
    radii_px, by_distance = _slabs(psf, lens, defocus, camera.pixel_pitch_um)
    nodes = FIELD_NODES if _varies(psf) else (1, 1)
    over = _over(psf, sampling, scale, camera.pixel_pitch_um) if by_distance else 1
    pupil, sensor_px = replace(lens.pupil, stops=()), (camera.width_px, camera.height_px)
    return Spread(psf, pupil, sampling, camera.pixel_pitch_um, over, radii_px, by_distance, sensor_px, nodes)


def _psf(lens: Lens, camera: Camera, scene: Scene) -> WavefrontPsf | PsfTable | None:
    if isinstance(lens, ThinLens) and lens.psf is not None:
        table = read_psf(lens.psf, camera.pixel_pitch_um)
        channels, rule = table.kernels.shape[2], f"the camera has {camera.channels}; give one for each, or one for all"
        require(channels in (1, camera.channels), "channels of the kernels", channels, rule, file=lens.psf)
        return table
    if not (getattr(lens, "diffraction", False) or getattr(lens, "aberrations", None)):
        return None
    aberrations, f_number = Aberrations(), lens.f_number
    if isinstance(lens, ThinLens):
        f_number, aberrations = lens.working_f_number, lens.aberrations or aberrations
        aberrations.pupil_share(lens.f_number)  # checks it
        if aberrations.at_f_number is not None:  # the pupil's size counts, not how far away the sensor is
            aberrations = replace(aberrations, at_f_number=aberrations.at_f_number * f_number / lens.f_number)
    light = _channel_light(scene, camera)
    wavelengths_nm = channel_wavelengths(scene.wavelengths_nm, light, WAVELENGTHS[camera.channels])
    opening = _opening(replace(lens.pupil, stops=()))
    wavelengths_nm = tuple(tuple(float(nm) for nm in row) for row in wavelengths_nm)
    return WavefrontPsf(aberrations, f_number, camera.pixel_pitch_um, wavelengths_nm, 1, 1, opening)


def _channel_light(scene: Scene, camera: Camera) -> np.ndarray:
    """What each channel counts of the light on the scene, by wavelength, (wavelengths, channels); of any light if none."""
    efficiency = efficiency_on(scene.wavelengths_nm, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    counted = (scene.illuminant * scene.wavelengths_nm)[:, None] * efficiency
    counted = np.where(counted.sum(axis=0) > 0, counted, efficiency)
    return np.where(counted.sum(axis=0) > 0, counted, 1.0)


def _opening(pupil: Pupil) -> Opening:
    return ROUND if pupil == Pupil() else Opening(pupil.depth, pupil.corner_radius)


def _varies(psf: WavefrontPsf | PsfTable | None) -> bool:
    """Whether kernels differ over the field."""
    if isinstance(psf, PsfTable):
        return len(psf.fields) > 1
    if psf is None:
        return False
    lens = psf.aberrations
    by_field = lens.coma_um, lens.astigmatism_um, lens.field_curvature_um, *(shift.lateral_um for shift in lens.chromatic)
    return any(by_field)


def _slabs(psf, lens: Lens, defocus: Defocus | None, pitch_um: float) -> tuple[tuple[float, ...], bool]:
    """Blur radii of the slabs, and whether they stand for the blur."""
    one_radius = psf is None or isinstance(psf, PsfTable) and len(psf.blur_radii_px) == 1
    if isinstance(psf, PsfTable) and not one_radius:
        _check_range(psf, defocus)
    if defocus is None:
        return (0.0,), True
    if one_radius or isinstance(psf, WavefrontPsf) and not _fits(psf, lens, defocus, pitch_um):
        return (0.0,), False
    return tuple(sorted({radius for one in defocus.radii_px for radius in _radii_px(one)})), True


def _check_range(table: PsfTable, defocus: Defocus | None) -> None:
    """Refuse a table of blur radii that do not reach those of the scene."""
    least, greatest = (0.0, 0.0) if defocus is None else (defocus.least_px, defocus.greatest_px)
    known = table.blur_radii_px
    rule = f"{table.source} holds blur radii from {known[0]:g} to {known[-1]:g}; tabulate more, or stop down"
    within = known[0] - SHARP_PX <= least and greatest <= known[-1] + SHARP_PX
    require(bool(within), "blur of the scene", f"{least:.2f} to {greatest:.2f} photosites", rule, part="lens.psf")


def _radii_px(radius: float | np.ndarray) -> list[float]:
    """Radii that a layer needs slabs at."""
    if np.ndim(radius) == 0:
        return [float(radius)]
    few = np.unique(radius.ravel()[:: max(1, radius.size // 4096)])
    if len(few) <= MOST_RADII and np.isin(radius, few).all():
        return few.tolist()
    return slab_radii_px(float(radius.min()), float(radius.max()))


def _fits(psf: WavefrontPsf, lens: Lens, defocus: Defocus, pitch_um: float) -> bool:
    """Whether blur and diffraction are one: kernels not too large, and somewhere not far larger than the Airy disk."""
    rim_px = defocus.largest_px * psf.opening.reach
    if 2.0 * rim_px + 14.0 * 0.7 * psf.f_number / pitch_um > 0.9 * LARGEST_KERNEL_PX:
        return False
    airy_px = airy_radius_px(psf)
    if psf.aberrations != Aberrations():
        return rim_px < MOST_AIRY * airy_px
    if defocus.eyes is not None and rim_px > FAR_AIRY * airy_px:
        return False  # kernels do not know cat's eyes
    near, far = defocus.least_px, defocus.greatest_px
    return isinstance(lens, Pinhole) or near <= 0.0 <= far or min(abs(near), abs(far)) < FAR_AIRY * airy_px


def _over(psf, sampling: Sampling, scale: float, pitch_um: float) -> int:
    """Points per photosite and axis: as many as the scene has, where the lens passes detail between photosites."""
    most = MOST_OVER
    if isinstance(psf, PsfTable):
        most = min(most, psf.cells)
    elif psf is not None:
        cutoff = pitch_um / (1e-3 * float(np.min(psf.wavelengths_nm)) * psf.f_number)  # cycles per photosite
        if cutoff < 0.25:
            return 1
    least = 2 if sampling.fill_factor < 1.0 else 1
    return min(max(round(scale), least), most)


def largest_change(spread: Spread, channels: int) -> float:
    """Share of the contrast of a scene in focus that its kernels can move at most, 0 to 1."""
    changes = []
    for channel in range(channels):
        kernel = spread.kernel(0, channel, False, spread.nodes[0] // 2, spread.nodes[1] // 2)
        sharp, middle = np.zeros_like(kernel), kernel.shape[-1] // 2
        sharp[:, middle, middle] = 1.0 / len(kernel)
        changes.append(0.5 * float(np.abs(kernel - sharp).sum()))
    return max(changes)
