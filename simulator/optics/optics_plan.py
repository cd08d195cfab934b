"""Plans the optics: from the radiance of the scene to the electron radiance of each photosite in its own colour."""

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, Self, overload

import numpy as np

from simulator.errors import PhotositeError
from simulator.optics.defocus.accuracy import BRIGHT, SAMPLES_PER_AXIS, Accuracy, brightest_electrons, scene_detail
from simulator.optics.defocus.defocus import Defocus, largest_radius_px, plan_defocus
from simulator.optics.defocus.joint_errors import joint_error
from simulator.optics.defocus.joint_motion import JointMotion, plan_joint_motion
from simulator.optics.defocus.photosite_area import PhotositeArea
from simulator.optics.defocus.scene_contrast import SceneContrast, scene_contrast
from simulator.optics.error_term import Skipped
from simulator.optics.geometry.fixed_blur import DISK_SPREAD, FixedBlur
from simulator.optics.geometry.motion_plan import MotionNeed, MotionPlan, Timing, plan_motion
from simulator.optics.geometry.projection import Projection, plan_projection
from simulator.optics.lens.bare_sensor import integrate_hemisphere
from simulator.optics.lens.lens import Lens
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.psf_planning import contrast_sigma, plan_visible_psf
from simulator.optics.veiling_glare import VeilingGlare, plan_veiling_glare
from simulator.scene.compositing import deep_pixels_of, flatten_layers
from simulator.scene.content_keys import freeze, is_ours
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.occluded_background import disoccluded_share, extend_background
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.kernel.kernel_program import MOST_ELECTRONS
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan

if TYPE_CHECKING:
    from simulator.optics.ray_reference.deep_rays import DeepBlur

TYPICAL = 0.68  # quantile of differences that stands for their standard deviation

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


@dataclass(frozen=True)
class OpticsPlan:
    """Decisions between the scene and the light on the sensor.

    scene: surfaces as they are rendered. weights: (bands, channels) float32 [e- s^-1 um^-2 sr^-1].
    cfa: colour of each photosite, from the sensor's upper left corner on.
    window: photosites that are computed; it may extend beyond the sensor. sensor_px: width and height of the sensor.
    defocus: blur of the ideal lens; None: sharp everywhere.
    psf: kernels of diffraction, aberrations, low-pass filter and aperture of the photosites; None: none are needed.
    disoccluded_share: fraction of the picture that sees background which is occluded in the scene; None: its layers contain it.
    deep_blur: blur of the samples of a deep picture, where rays are followed (tolerance 0); None: the layers are blurred.
    psf_skipped: why a point spread function is left out, with its predicted error; None: it is not.
    ignored_px: largest blur radius that is left out where `defocus` is None [photosites].
    contrast: of the scene, on which the error of the blur depends; that of the laws where there is no blur.
    motion: how the image moves while the shutter is open; None: it does not. flash_motion: while a flash shines.
    has_flash: whether a flash lights the bands of the scene's second half.
    joint: motion that the points of the aperture carry, of the method "joint"; None: they carry none.
    motion_skipped: why motion is left out, with its predicted error; None: it is not.
    """

    scene: Scene
    weights: np.ndarray
    projection: Projection
    cfa: Cfa
    window: Window
    sensor_px: tuple[int, int]
    accuracy: Accuracy
    defocus: Defocus | None = None
    veiling_glare: VeilingGlare | None = None
    psf: FieldPsf | None = None
    disoccluded_share: float | None = None
    deep_blur: "DeepBlur | None" = None
    psf_skipped: Skipped | None = None
    ignored_px: float = 0.0
    contrast: SceneContrast = SceneContrast()
    motion: MotionPlan | None = None
    flash_motion: MotionPlan | None = None
    has_flash: bool = False
    motion_skipped: Skipped | None = None
    joint: JointMotion | None = None

    @property
    def covering_layers(self) -> int:
        """Layers up to the first that covers all of the picture."""
        opaque = (number for number, layer in enumerate(self.scene.layers, 1) if layer.coverage is None)
        return next(opaque, len(self.scene.layers))

    @property
    def sweeps_rows(self) -> bool:
        """Whether a swept image is read by spans of a row, which is several times faster than photosite by photosite."""
        projection, motion = self.projection, self.motion
        plain = projection.warp is None and (projection.is_fine or not projection.nearest)
        if motion is None or motion.vectors is not None:
            return False
        return plain and motion.turns_slowly and motion.path.lines.axis != "columns"

    @property
    def sweeps_lamps_apart(self) -> bool:
        """Whether places that lamps pass have more instants than others: where spans of one picture are swept."""
        return self.motion is not None and self.motion.lamp_count > 0 and self.sweeps_rows and self.covering_layers == 1

    @property
    def channels(self) -> int:
        """Colour planes of the camera."""
        return self.weights.shape[1]

    @property
    def has_coverage(self) -> bool:
        """Whether any surface has a coverage below 1."""
        return any(layer.coverage is not None for layer in self.scene.layers)

    def blur_window(self) -> Window:
        """Photosites of the geometric blur: the window, and the margin that a convolution after it needs."""
        if self.psf is None or self.psf.by_distance:
            return self.window
        if self.psf.core is not None:
            reach, own = self.psf.gather_reach_px, self.window
            return Window(own.x - reach, own.y - reach, own.width + 2 * reach, own.height + 2 * reach)
        from simulator.optics.psf.tiled_convolution import bound_tiles, split_into_tiles  # imports scipy.fft

        tiles = split_into_tiles(self.psf.x_px, self.psf.y_px, (self.sensor_px[1], self.sensor_px[0]))
        return bound_tiles(tiles, self.psf.reach_px, self.window)

    def in_one_color(self, plane: int) -> Self:
        """Return the plan of a sensor whose photosites all have this colour."""
        return replace(self, cfa=Cfa.uniform(plane))

    @property
    def moves_by_component(self) -> bool:
        """Whether there is a flash that sees what moves at other times than the scene's own light does."""
        return self.has_flash and not (self.motion is None and self.flash_motion is None)

    def lit_by(self, bands: slice, is_flash: bool = False) -> Self:
        """Return the plan of the light of these bands of the scene alone, such as those of a flash."""
        weights = np.zeros_like(self.weights)
        weights[bands] = self.weights[bands]
        glare = None if self.veiling_glare is None else self.veiling_glare.lit_by(bands)
        motion = self.flash_motion if is_flash else self.motion
        return replace(self, weights=weights, veiling_glare=glare, motion=motion)

    def on_wider_photosites(self) -> Self:
        """Return the plan of the same blur on photosites twice as wide, which cover the window and one more on each side."""
        assert self.defocus is not None  # only a blur is computed on wider photosites
        x, y = self.window.x // 2 - 1, self.window.y // 2 - 1
        right, bottom = (self.window.x + self.window.width + 1) // 2 + 1, (self.window.y + self.window.height + 1) // 2 + 1
        width, height = self.sensor_px
        return replace(
            self,
            projection=self.projection.on_wider_photosites(),
            window=Window(x, y, right - x, bottom - y),
            sensor_px=((width + 1) // 2, (height + 1) // 2),
            defocus=self.defocus.on_wider_photosites(),
        )

    @property
    def moving_blur(self) -> Defocus | None:
        """The blur with the motion that the points of its aperture carry, of the light whose error is larger; None: no blur."""
        if self.joint is None or self.defocus is None:
            return self.defocus
        moving = [motion for motion in (self.motion, self.flash_motion) if motion is not None]
        return replace(self.defocus, motion=replace(self.joint, path=max(moving, key=lambda motion: motion.error).path))

    def cfa_macros(self) -> dict[str, int]:
        """Macros of kernels/cfa.h for the window."""
        return self.cfa.macros(self.window.x, self.window.y)


def plan_optics(loaded: Scene, lens: Lens, sensor: SensorPlan, tolerance: float, timing: Timing | None = None) -> OpticsPlan:
    """Plan the image of a scene on a sensor.

    tolerance: as in `Shot`. timing: of what moves; None: nothing does.
    Raises PhotositeError for light, blur, motion or geometry that cannot be computed.
    All but the window is that of the whole sensor, and kept with the scene for another window of it.
    """

    def make() -> OpticsPlan:
        if timing is not None:  # the plan of the image at rest is kept with the scene, too
            return _with_motion(plan_optics(loaded, lens, sensor, tolerance), loaded, lens, sensor, timing)
        made = _plan_sensor_optics(loaded, lens, sensor, tolerance)
        if made.scene is not loaded and not any(array.flags.writeable for array in loaded.arrays()):
            for array in made.scene.arrays():
                array.setflags(write=False)
        return made

    key = optics_key(lens, sensor, tolerance, timing)
    planned = make() if key is None else loaded.remember(key, make)
    return replace(planned, window=sensor.readout.computed)


def optics_key(lens: Lens, sensor: SensorPlan, tolerance: float, timing: Timing | None = None) -> Hashable | None:
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


def _plan_sensor_optics(loaded: Scene, lens: Lens, sensor: SensorPlan, tolerance: float) -> OpticsPlan:
    """Plan the image on the window of a sensor; nothing but the field `window` depends on the window."""
    camera, window = sensor.camera, sensor.readout.computed
    scene = flatten_layers(loaded) if lens.forms_image else integrate_hemisphere(loaded)
    weights = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    if weights.shape[1] != camera.channels:
        rule = f"has {weights.shape[1]} curves, but cfa {camera.cfa} needs {camera.channels}"
        raise PhotositeError(rule, key="camera.response", joint=" ")
    _check_light(scene, weights, lens, sensor)
    projection = plan_projection(scene, lens, camera)
    if _gathers_squares(projection, lens, camera):
        projection = replace(projection, open_side=math.sqrt(camera.fill_factor))
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
    )
    floor = noise_floor(sensor)
    if lens.forms_image and floor is not None:
        accuracy = plan_accuracy(planned, lens, sensor, floor, tolerance)
        planned = replace(planned, accuracy=accuracy)
    if lens.forms_image:
        planned = _with_defocus(planned, loaded, lens, sensor)
    return _with_psf(planned, lens, sensor, floor)


def blur_per_dioptre(lens: Lens, pixel_pitch_um: float, scale: float) -> float:
    """Growth of the signed blur radius [scene pixels] per 1/m of inverse distance; scale: scene pixels per photosite."""
    growth_um = float(lens.blur_radius_um(math.inf) - lens.blur_radius_um(1.0))
    return growth_um * scale / pixel_pitch_um


def plan_accuracy(optics: OpticsPlan, lens: Lens, sensor: SensorPlan, floor: NoiseFloor, tolerance: float) -> Accuracy:
    """Tolerance of the blur, relative to the least noise that the exposure has at any ISO of the camera (`NoiseFloor`).

    It is the noise at the scene's brightest light or, if that is less, at the ISO that saturates last. So a blur is as exact as
    the shot with the least noise needs it, and shots that differ in their ISO have the same light, bit for bit.
    """
    per_radiance = _electrons_per_radiance(lens, sensor)
    brightest_e, peak_e = brightest_electrons(optics.scene, optics.weights, per_radiance)
    electrons = max(min(brightest_e, floor.most_electrons), 1.0)
    accuracy = Accuracy(
        tolerance,
        electrons,
        floor.read_noise_e,
        max(peak_e / electrons, 1.0),
        electrons_per_radiance=per_radiance,
        brightest=electrons / per_radiance,
    )
    if not _gathers_squares(optics.projection, lens, sensor.camera):
        return accuracy
    detail = scene_detail(optics.scene, optics.weights, per_radiance, accuracy)
    detail /= sensor.camera.fill_factor  # a smaller square averages fewer pixels
    return replace(accuracy, detail=detail, whole_pixels=optics.projection.whole_pixels(SAMPLES_PER_AXIS))


def _gathers_squares(projection: Projection, lens: Lens, camera: Camera) -> bool:
    """Whether photosites gather the even squares of a fine scene directly, over their open area.

    Behind a lens or a filter with a point spread function its kernels hold the aperture of the photosites. A scene coarser than
    the photosites shows nothing inside them.
    """
    has_psf = lens.psf is not None or lens.has_diffraction or camera.low_pass_um > 0.0
    return projection.is_fine and not has_psf


def _electrons_per_radiance(lens: Lens, sensor: SensorPlan) -> float:
    """Electrons of a photosite on the axis per electron radiance [e- / (e- s^-1 um^-2 sr^-1)]."""
    exposure, camera = sensor.exposure, sensor.camera
    return lens.irradiance_per_radiance_sr() * exposure.time_s * camera.pixel_pitch_um**2 * camera.fill_factor


def _with_defocus(planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan) -> OpticsPlan:
    """Return the plan with the blur of the scene's surfaces, and with the background that shows beside blurred edges."""
    camera, scale, accuracy = sensor.camera, planned.projection.scale, planned.accuracy
    pitch_um = camera.pixel_pitch_um
    defocus = _plan_defocus(planned, loaded, lens, camera)
    if defocus is None:
        return replace(planned, ignored_px=largest_radius_px(lens, pitch_um, loaded))
    per_dioptre, share = blur_per_dioptre(lens, pitch_um, scale), None
    if not loaded.behind and isinstance(loaded.depth_m, np.ndarray):
        share = disoccluded_share(loaded.depth_m, per_dioptre, lens.focus_distance_m)
    contrast = _contrast_of(planned, loaded, lens, sensor, defocus)
    scene = extend_background(loaded, per_dioptre) if accuracy.tolerance else loaded
    if scene is not loaded:
        extended = _plan_defocus(planned, scene, lens, camera)
        assert extended is not None  # an extended background keeps the foreground that is blurred
        defocus = replace(extended, guessed=defocus.guessed)
    if accuracy.tolerance == 0.0 and scene.deep is None and scene.behind and _is_steep(defocus, scale):
        scene = replace(scene, deep=deep_pixels_of(scene.layers))
    deep_blur = None if accuracy.tolerance else _blur_deep(scene, lens, pitch_um)
    return replace(planned, scene=scene, defocus=defocus, disoccluded_share=share, deep_blur=deep_blur, contrast=contrast)


@overload
def _plan_defocus(planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera, *, keeps_sharp: Literal[True]) -> Defocus: ...
@overload
def _plan_defocus(
    planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera, *, keeps_sharp: bool = False
) -> Defocus | None: ...
def _plan_defocus(
    planned: OpticsPlan, scene: Scene, lens: Lens, camera: Camera, *, keeps_sharp: bool = False
) -> Defocus | None:
    """Return the blur of a scene's surfaces, as `plan_defocus`; never None where a sharp one is kept."""
    accuracy, projection = planned.accuracy, planned.projection
    area = PhotositeArea(_gathers_squares(projection, lens, camera), accuracy.whole_pixels, projection.open_side)
    return plan_defocus(
        lens, camera.pixel_pitch_um, scene, projection.scale, accuracy, planned.sensor_px, area, keeps_sharp=keeps_sharp
    )


def _contrast_of(planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, defocus: Defocus) -> SceneContrast:
    """Return the contrasts of a scene on which the error of its blur depends."""
    per_share = _electrons_per_radiance(lens, sensor) / planned.accuracy.electrons
    return scene_contrast(loaded, planned.weights, per_share, defocus)


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


def _with_psf(planned: OpticsPlan, lens: Lens, sensor: SensorPlan, floor: NoiseFloor | None) -> OpticsPlan:
    """Return the plan with the point spread function, unless its effect is invisible at every ISO."""
    if planned.projection.open_side < 1.0:
        return planned  # the scene is integrated over the open area of each photosite
    exposure, irradiance = sensor.exposure, sensor.irradiance
    factor = exposure.time_s * exposure.collecting_area_um2 * irradiance.effective_solid_angle_sr
    contrast = contrast_sigma(planned.scene, factor * planned.weights, (floor or NoiseFloor(1.0, 1.0)).moments)
    if contrast > 0.0 and planned.accuracy.tolerance == 0.0:
        contrast = math.inf  # nothing is left out
    psf, skipped = plan_visible_psf(
        lens,
        sensor.camera,
        planned.scene,
        planned.weights,
        planned.defocus,
        planned.projection.scale,
        contrast,
        planned.accuracy,
        planned.projection.is_fine or planned.projection.nearest,
    )
    defocus = planned.defocus
    if defocus is not None and psf is not None and psf.corrected_px:
        defocus = replace(defocus, corrected_px=max(abs(radius) for radius in psf.corrected_px))
    return replace(planned, psf=psf, psf_skipped=skipped, defocus=defocus)


def _with_motion(planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, timing: Timing) -> OpticsPlan:
    """Return the plan with the motion of the image, unless it is invisible."""
    if not lens.forms_image:
        return replace(planned, motion_skipped=Skipped("without a lens there is no image that could move"))
    accuracy, scale = planned.accuracy, planned.projection.scale
    edges, texture = (
        scene_detail(loaded, planned.weights, _electrons_per_radiance(lens, sensor), accuracy, quantile)
        for quantile in (BRIGHT, TYPICAL)
    )
    steepness = 1.0 if planned.projection.nearest else min(scale, 1.0)  # a coarse pixel read as it is ends in a step
    need = MotionNeed(
        contrast=min(edges * max(scale, steepness), max(edges, 1.0)),
        texture=texture * steepness,
        allowed=accuracy.allowed or accuracy.ray_error * accuracy.sigma,
        cut_off=0.5 * max(scale, steepness),
        border=max(edges, accuracy.lamp_contrast),
        sigma=accuracy.sigma,
        lamps=steepness * accuracy.lamp_contrast,
    )
    blur = _fixed_blur(planned, need.largest)
    need = need.behind(_steepest_edge(planned.defocus))
    found: list[MotionPlan | None] = []
    joins = _can_join(planned, timing)
    is_layered, skipped = False, None
    for number, component in enumerate(timing.components):
        own = need.of_share(_seen_share(planned, number, len(timing.components), _electrons_per_radiance(lens, sensor)))
        motion = plan_motion(loaded, lens, sensor.camera, planned.projection, timing.motion, component, own, blur, joins)
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
        found, planned = _with_joint_motion(planned, loaded, found, lens, sensor)
        scene = planned.scene
    flash = found[1] if len(found) > 1 else None
    return replace(planned, scene=scene, motion=found[0], flash_motion=flash, has_flash=len(found) > 1)


def _fixed_blur(planned: OpticsPlan, contrast: float) -> FixedBlur | str | None:
    """Return what blurs the light of a moving scene alike at each instant; None: nothing blurs; a reason where it is not fixed.

    contrast: of the scene's edges, as a share of the brightest light.
    """
    defocus, psf, accuracy = planned.defocus, planned.psf, planned.accuracy
    if defocus is None and psf is None:
        return None
    if accuracy.tolerance == 0.0:
        return "the reference runs the optics at each instant"
    if psf is not None and psf.by_distance and len(psf.radii_px) > 1:
        return "the point spread function depends on the distance"
    if defocus is None:
        assert psf is not None  # one of both blurs
        return FixedBlur(psf.over, contrast, _spread_px(psf, planned.channels))
    if len(planned.scene.layers) > 1:
        return "surfaces behind one another are blurred each by its own radius"
    radius = defocus.radii_px[0]
    if isinstance(radius, np.ndarray):
        return "the blur radius differs from place to place"
    if psf is not None and psf.by_distance:
        return FixedBlur(psf.over, contrast, _spread_px(psf, planned.channels))
    grid = replace(accuracy, whole_pixels=0)  # what moves does not stay on the borders of pixels
    size, scale = np.array(abs(radius)), planned.projection.scale
    over = int(grid.samples_per_axis(size, size, scale))
    sampling = float(grid.sampling_error(size, over, scale)) if grid.detail else 0.0
    spread_px = DISK_SPREAD * abs(radius) + (0.0 if psf is None else _spread_px(psf, planned.channels))
    return FixedBlur(over, contrast, spread_px, sampling)


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
    brightest_e = max(brightest_electrons(planned.scene, lit.weights, per_radiance))
    noise_e2 = max(0.1 * brightest_e + accuracy.read_noise_e**2, 1.0)
    noise_at_brightest_e2 = accuracy.electrons + accuracy.read_noise_e**2
    return min(brightest_e * math.sqrt(noise_at_brightest_e2 / noise_e2) / accuracy.electrons, 1.0)


def _can_join(planned: OpticsPlan, timing: Timing) -> bool:
    """Whether points of the aperture may carry instants: places of the picture are those of the scene, lines are rows."""
    psf = planned.psf
    plain_psf = psf is None or not (psf.by_distance or psf.corrected_px)
    return plain_psf and planned.projection.warp is None and timing.components[0].openings[0].axis != "columns"


def _with_joint_motion(
    planned: OpticsPlan, loaded: Scene, motions: list[MotionPlan | None], lens: Lens, sensor: SensorPlan
) -> tuple[list[MotionPlan | None], OpticsPlan]:
    """Return motions whose instants points of the aperture carry, and the plan of their blur, however small that is.

    motions: of each component of the light; None where all is at rest.
    """
    camera, defocus = sensor.camera, planned.defocus
    if defocus is None:
        defocus = _plan_defocus(planned, loaded, lens, camera, keeps_sharp=True)
        contrast = _contrast_of(planned, loaded, lens, sensor, defocus)
        planned = replace(planned, scene=loaded, contrast=contrast)
    moving = [motion for motion in motions if motion is not None]

    def join(radii_px: tuple[float | np.ndarray, ...]) -> JointMotion:
        return plan_joint_motion(moving[0].path, lens, camera.pixel_pitch_um, radii_px)

    joint = join(defocus.radii_px)
    per_dioptre = blur_per_dioptre(lens, camera.pixel_pitch_um, planned.projection.scale)
    is_extended = planned.scene is not loaded and joint.largest_aperture == 0.0
    reach = (1.0 + joint.largest_aperture) * per_dioptre  # so far do rays see behind edges
    scene = extend_background(loaded, reach) if planned.accuracy.tolerance and not is_extended else loaded
    if scene is not loaded:
        extended = _plan_defocus(planned, scene, lens, camera, keeps_sharp=True)
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
