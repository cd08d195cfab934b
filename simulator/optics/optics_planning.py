"""Plans the optics: from the radiance of the scene to the electron radiance of each photosite in its own colour."""

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from simulator.errors import PhotositeError
from simulator.optics.blur_planning import (
    electrons_per_radiance,
    gathers_squares,
    plan_accuracy,
    with_defocus,
)
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.error_term import Skipped
from simulator.optics.geometry.projection import plan_projection
from simulator.optics.lens.bare_sensor import integrate_hemisphere
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.relative_illumination import illumination_error
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.veiling_glare import plan_veiling_glare
from simulator.scene.compositing import flatten_layers, join_layers
from simulator.scene.content_keys import freeze, is_ours
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.kernel.kernel_program import MOST_ELECTRONS
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan

if TYPE_CHECKING:
    from simulator.optics.geometry.motion_plan import Timing

# What a camera does with the light, of which its optics knows the NoiseFloor alone. All other fields of `Camera` are keys.
SENSOR_ONLY = frozenset(
    {
        "make",
        "model",
        "bit_depth",
        "black_level_dn",
        "white_level_dn",
        "iso_table",
        "iso_range",
        "read_noise_model",
        "read_noise_after_gain_dn",
        "read_noise_spread",
        "conversion_gain",
        "color_matrix",
        "readout_time_s",
        "stages",
    }
)


def plan_optics(
    loaded: Scene,
    lens: Lens,
    sensor: SensorPlan,
    tolerance: float,
    timing: "Timing | None" = None,
    *,
    is_at_rest: bool = True,
    joins_layers: bool = True,
    whole: float | None = None,
    is_sharp: bool = False,
    beside_sigma: float = 0.0,
) -> OpticsPlan:
    """Plan the image of a scene on a sensor.

    tolerance: of each approximation. timing: of what moves; None: nothing does. is_at_rest: whether nothing moves: lamps
        may be drawn by themselves then, samples of light may have a footprint, and layers hide the same parts of each other.
    joins_layers: whether layers at one distance are one surface, their composite; they are not where layers have a motion of
        their own. whole: tolerance of the photograph, as in `Shot`; None: that of each approximation.
    is_sharp: whether blur is left out, however large it is. beside_sigma: as of `with_motion`.
    Raises PhotositeError for light, blur, motion or geometry that cannot be computed.
    All but the window is that of the whole sensor, and kept with the scene for another window of it.
    """
    joins_layers = joins_layers and not (timing is not None and timing.motion.layers)
    loaded = join_layers(loaded) if joins_layers else loaded

    def make() -> OpticsPlan:
        if timing is not None:  # the plan of the image at rest is kept with the scene, too
            from simulator.optics.motion_planning import with_motion  # nothing moves in most shots

            plan_still = partial(
                plan_optics, loaded, lens, sensor, tolerance, joins_layers=joins_layers, whole=whole, is_sharp=is_sharp
            )
            moved = with_motion(plan_still(is_at_rest=False), loaded, lens, sensor, timing, beside_sigma)
            if moved.motion is None and moved.flash_motion is None:  # what is not seen to move is as exact as what rests
                return replace(plan_still(is_at_rest=True), motion_skipped=moved.motion_skipped)
            return moved
        made = _plan_sensor_optics(
            loaded, lens, sensor, tolerance, tolerance if whole is None else whole, is_at_rest, is_sharp=is_sharp
        )
        if made.scene is not loaded and not any(array.flags.writeable for array in loaded.arrays()):
            for array in made.scene.arrays():
                array.setflags(write=False)
        return made

    key = optics_key(lens, sensor, tolerance, timing)
    planned = make() if key is None else loaded.remember((key, is_at_rest, whole, is_sharp, beside_sigma), make)
    return replace(planned, window=sensor.readout.computed)


def optics_key(lens: Lens, sensor: SensorPlan, tolerance: float, timing: "Timing | None" = None) -> Hashable | None:
    """Return what a plan depends on besides scene and window; None for a lens of which nothing tells when it is the same.

    Of what the camera does with the light, that is the NoiseFloor alone.
    """
    if not is_ours(lens):
        return None
    try:
        camera = freeze(sensor.camera, SENSOR_ONLY | {"window"})
        moving = None if timing is None else timing.key
        return "optics", freeze(lens), camera, sensor.exposure.time_s, noise_floor(sensor), tolerance, moving
    except OSError:  # a file of the lens or of a path has gone: what reads it says so
        return None


def noise_floor(sensor: SensorPlan) -> NoiseFloor | None:
    """Return `SensorPlan.noise_floor`, which asks for all ISOs of the camera, from the last sensors where it is known."""
    return _noise_floor_of(_AskedSensor((freeze(sensor.camera, frozenset({"window"})), freeze(sensor.stages)), sensor))


@dataclass(frozen=True)
class _AskedSensor:
    """A sensor whose noise is asked for. content: all that its noise depends on."""

    content: Hashable
    sensor: SensorPlan = field(compare=False)


@lru_cache(maxsize=32)
def _noise_floor_of(asked: _AskedSensor) -> NoiseFloor | None:
    return asked.sensor.noise_floor()


def _plan_sensor_optics(
    loaded: Scene,
    lens: Lens,
    sensor: SensorPlan,
    tolerance: float,
    whole: float,
    is_at_rest: bool,
    *,
    is_sharp: bool = False,
) -> OpticsPlan:
    """Plan the image on the window of a sensor; nothing but the field `window` depends on the window."""
    camera, window = sensor.camera, sensor.readout.computed
    scene = flatten_layers(loaded) if lens.forms_image else integrate_hemisphere(loaded)
    weights = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    if weights.shape[1] != camera.channels:
        rule = f"has {weights.shape[1]} curves, but cfa {camera.cfa} needs {camera.channels}"
        raise PhotositeError(rule, key="camera.response", joint=" ")
    weights = weights * _arriving_light(lens, camera)
    _check_light(scene, weights, lens, sensor)
    projection = plan_projection(scene, lens, camera)
    glare = plan_veiling_glare(lens.veiling_glare, scene, weights, projection, camera, sensor.irradiance)
    planned = OpticsPlan(
        scene=scene,
        weights=weights.astype(np.float32),
        projection=projection,
        cfa=camera.filter,
        window=window,
        sensor_px=(camera.width_px, camera.height_px),
        accuracy=Accuracy(tolerance),
        veiling_glare=glare,
        illumination_error=illumination_error(lens, camera.pixel_pitch_um, camera.width_px, camera.height_px),
        tolerance=whole,
    )
    floor = noise_floor(sensor)
    planned = _with_blur(planned, loaded, lens, sensor, is_sharp=is_sharp, is_at_rest=is_at_rest)
    if lens.forms_image:
        if is_at_rest and tolerance and _mixes_pixels(planned):
            cut = replace(planned, projection=replace(planned.projection, cuts_pixels=True))
            cut = _with_blur(cut, loaded, lens, sensor, is_at_rest=True)
            planned = cut if cut.is_direct else planned
        if is_at_rest and floor is not None and planned.defocus is not None:
            from simulator.optics.lamp_planning import with_drawn_lamps  # not needed for a sharp frame

            planned = with_drawn_lamps(planned, loaded, lens, sensor, floor)
        planned = _with_rays_through_filter(planned, lens, sensor)
        planned = _with_filter_in_focus(planned, lens, sensor, is_at_rest=is_at_rest)
    is_whole = planned.projection.open_side == 1.0 and planned.projection.low_pass_px == 0.0  # nothing is averaged before
    if is_whole and not planned.projection.footprints and _is_even(planned.scene):
        return replace(planned, psf_skipped=Skipped("the scene is the same everywhere"))
    from simulator.optics.kernel_planning import with_psf, with_wings  # not needed for an even scene

    planned = with_wings(with_psf(planned, lens, sensor, floor, is_at_rest), scene)
    if is_at_rest and planned.projection.lies_between_pixels and not planned.is_direct:
        from simulator.optics.path_planning import with_path_weights  # photosites of most scenes have pixels of their own

        planned = with_path_weights(planned, electrons_per_radiance(lens, sensor))
    return planned


def _mixes_pixels(planned: OpticsPlan) -> bool:
    """Whether blurred photosites lie between pixels as wide as themselves, in a scene that no weights of one path tell.

    Of distortion, whose photosites are no squares of pixels, it would take a hundred times as long to gather them.
    """
    defocus = planned.defocus
    is_known = defocus is None or (len(defocus.radii_px) == 1 and not defocus.maps)
    return planned.projection.lies_between_pixels and planned.projection.warp is None and not is_known


def _with_blur(
    planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, *, is_sharp: bool = False, is_at_rest: bool
) -> OpticsPlan:
    """Return the plan with the accuracy and the blur of a scene, and with the area over which photosites gather its squares."""
    camera, tolerance, floor = sensor.camera, planned.accuracy.tolerance, noise_floor(sensor)
    if gathers_squares(planned.scene, planned.projection, lens, camera, tolerance, is_at_rest=is_at_rest):
        projection = replace(planned.projection, open_side=math.sqrt(camera.fill_factor))
        planned = replace(planned, projection=projection, is_direct=True)
    if not lens.forms_image:
        return planned
    if floor is not None:
        accuracy = plan_accuracy(planned, loaded, lens, sensor, floor, tolerance, is_at_rest=is_at_rest)
        planned = replace(planned, accuracy=accuracy)
    return with_defocus(planned, loaded, lens, sensor, is_sharp=is_sharp, is_at_rest=is_at_rest)


def _with_rays_through_filter(planned: OpticsPlan, lens: Lens, sensor: SensorPlan) -> OpticsPlan:
    """Return the plan of a reference whose rays start where a low-pass filter and the open area let them, if the lens is ideal.

    A kernel after the blur would see its light on whole photosites.
    """
    camera = sensor.camera
    if planned.accuracy.tolerance or planned.defocus is None or planned.deep_blur is not None:
        return planned
    if lens.psf is not None or lens.has_diffraction or lens.aberrations is not None:
        return planned
    low_pass_px = camera.low_pass_um / camera.pixel_pitch_um
    projection = replace(planned.projection, open_side=math.sqrt(camera.fill_factor), low_pass_px=low_pass_px)
    return replace(planned, projection=projection)


def _with_filter_in_focus(planned: OpticsPlan, lens: Lens, sensor: SensorPlan, *, is_at_rest: bool) -> OpticsPlan:
    """Return the plan of a scene whose photosites average it over their open area behind a filter, if the lens is ideal.

    Squares of a footprint average a coarse scene in focus at rest. The image of another in focus, of a fine one out of focus at
    rest, and of one whose lamps are drawn, is the mean of the filter's four spots, each over open areas.
    """
    camera, projection = sensor.camera, planned.projection
    sampling = Sampling(camera.fill_factor, camera.low_pass_um)
    is_ideal = lens.psf is None and not lens.has_diffraction and lens.aberrations is None
    has_spots = planned.lamps is not None or (planned.is_direct and planned.accuracy.tolerance)
    if (planned.defocus is not None and not has_spots) or sampling == Sampling() or not is_ideal or _is_even(planned.scene):
        return planned
    if is_at_rest and projection.is_bilinear and projection.fits_footprint and planned.defocus is None:
        footprints = (sampling.footprint(camera.pixel_pitch_um),)
        return replace(planned, projection=replace(projection, footprints=footprints))
    low_pass_px = camera.low_pass_um / camera.pixel_pitch_um
    projection = replace(projection, open_side=math.sqrt(camera.fill_factor), low_pass_px=low_pass_px)
    return replace(planned, projection=projection)


def _arriving_light(lens: Lens, camera: Camera) -> float:
    """Share of the light that the kernels of a lens hold: it counts where they are left out, and in scattered light, too."""
    if lens.psf is None:
        return 1.0
    from simulator.optics.psf.psf_file import read_light  # few lenses have a file

    return read_light(lens.psf, camera.pixel_pitch_um)


def _is_even(scene: Scene) -> bool:
    """Whether a scene has the same light everywhere, so that its contrast is 0. The first row of most tells that it is not."""
    if scene.behind or scene.coverage is not None:
        return False
    return bool((scene.planes[0] == scene.planes[0, 0]).all() and (scene.planes == scene.planes[0, 0]).all())


def _check_light(scene: Scene, weights: np.ndarray, lens: Lens, sensor: SensorPlan) -> None:
    """Raise PhotositeError for light near the range of single precision, whose largest number is 3e38."""
    radiance = float(scene.planes.max()) * float(weights.sum(axis=0).max())
    per_radiance = lens.irradiance_per_radiance_sr() * sensor.exposure.time_s * sensor.camera.pixel_pitch_um**2
    if max(radiance, radiance * per_radiance) > MOST_ELECTRONS:
        raise PhotositeError(
            f"the brightest place gives {radiance * per_radiance:.2g} electrons per photosite, more than the "
            f"{MOST_ELECTRONS:g} that single precision counts safely; lower scene.luminance or exposure.time",
            key="scene",
        )
