"""The steps of a plan in physical order, each with its numbers or the reason why it is skipped, as `explain` prints them."""

import math

from simulator.exposure.exposed_light import ExposedLight
from simulator.optics.blur_planning import ignored_terms
from simulator.optics.defocus.predicted_error import describe_ignored, describe_noise
from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.distortion import Warp
from simulator.optics.lens.lens import Lens
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.veiling_glare import VeilingGlare
from simulator.pipeline.psf_steps import psf_steps
from simulator.pipeline.step import Step
from simulator.pipeline.time_steps import time_steps
from simulator.sensor.camera.camera import Camera
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.kernel.kernel_program import stage_order
from simulator.sensor.sensor_plan import SensorPlan


def steps_of(optics: OpticsPlan, sensor: SensorPlan, lens: Lens, exposed: ExposedLight) -> tuple[Step, ...]:
    """Return all steps of a plan in physical order, then the limits of the blur's accuracy."""
    camera, layout, scene = sensor.camera, sensor.readout, optics.scene
    bands, wavelengths = scene.planes.shape[2], len(scene.wavelengths_nm)
    steps = [
        Step(
            "spectral integration",
            True,
            f"{bands} scene planes of {wavelengths} wavelengths -> {camera.channels} camera planes",
        ),
        Step("projection", True, f"{optics.projection.scale:.3f} scene pixels per photosite, {_samples(optics.projection)}"),
        _distortion_step(optics.projection.warp, camera),
        _motion_step(optics),
        _defocus_step(optics, lens),
        *psf_steps(lens, camera, optics.defocus, optics.psf, optics.psf_skipped),
        _glare_step(optics.veiling_glare),
    ]
    dark = camera.optical_black
    covered = "light reaches all of the sensor" if dark is None else str(dark)
    steps.append(Step("optical black", dark is not None, covered))
    sharing = {"light": layout.crosstalk.optical_shares, "charge": layout.crosstalk.electrical_shares}
    for what, shares in sharing.items():
        reason = f"{shares[0]:g} to each neighbour beside, {shares[1]:g} at the corners" if any(shares) else "nothing is shared"
        steps.append(Step(f"crosstalk of {what}", any(shares), reason))
    steps += time_steps(exposed)
    for stem in stage_order():
        stage = sensor.stage(stem)
        if stage is None:
            steps.append(Step(stem, False, "the camera has none, or it would change nothing"))
        else:
            numbers = ", ".join(f"{name} = {_number(value)}" for name, value in stage.kernel_values().items())
            steps.append(Step(stem, True, numbers or "no parameters"))
    binning = layout.binning
    method = "off" if binning is None else f"{binning.factor} x {binning.factor} photosites of one colour, {binning.mode}"
    steps.append(Step("binning", binning is not None, method))
    blooming = layout.blooming
    method = "charge above the full well is drained"
    if blooming is not None:
        ways = "up and down" if blooming.sides == 2 else "up, down, left and right"
        method = f"charge above {sensor.capacity_e:g} e- moves {ways}, up to {blooming.reach} photosites"
    steps.append(Step("blooming", blooming is not None, method))
    pattern = layout.pattern
    method = (
        "off" if pattern is None else f"groups of {pattern.group} x {pattern.group} photosites to a Bayer pattern, by planes"
    )
    steps.append(Step("remosaic", pattern is not None, method))
    if isinstance(sensor, HdrSensorPlan):
        steps += [Step("hdr read-out", True, sensor.describe()), Step("companding", *sensor.describe_companding())]
    if optics.defocus is not None:
        steps += [_occluded_background_step(optics), Step("blur accuracy", True, describe_noise(optics.accuracy))]
    return tuple(steps)


def _occluded_background_step(optics: OpticsPlan) -> Step:
    """Share of the picture that sees occluded background: an error that no method can remove from one picture with depth."""
    scene, share = optics.scene, optics.disoccluded_share
    if share is None:
        return Step("hidden surfaces", bool(scene.behind), f"the scene has {len(scene.layers)} layers")
    assumption = (
        "is not shown by the scene, and none is assumed"
        if scene.hidden == "none"
        else "is assumed to go on behind edges as the mean of what lies beside them, without its detail"
    )
    return Step(
        "hidden surfaces",
        scene.hidden == "extend",
        f"about {100 * share:.2g} % of the picture sees background that {assumption}",
    )


def _number(value: float | tuple[float, ...]) -> str:
    return f"{len(value)} values" if isinstance(value, tuple) else f"{value:.6g}"


def _samples(projection: Projection) -> str:
    if projection.taps(1.0) or projection.is_bilinear:
        side = "" if projection.open_side == 1.0 else f", a square of side {projection.open_side:.3g}"
        return f"each the exact mean over its area{side}"
    return "one sample each" if projection.samples == 1 else f"{projection.samples} x {projection.samples} samples each"


def _distortion_step(warp: Warp | None, camera: Camera) -> Step:
    if warp is None:
        return Step("distortion", False, "the lens has none")
    corner_x, corner_y = warp.distorted(camera.width_px, camera.height_px)
    moved_px = math.hypot(corner_x - warp.centre_x_px, corner_y - warp.centre_y_px) - math.hypot(
        warp.centre_x_px, warp.centre_y_px
    )
    way = f"{abs(moved_px):.1f} photosites {'inwards' if moved_px < 0 else 'outwards'}"
    return Step("distortion", True, f"the corner moves {way}, traced back in {warp.steps} steps")


def _motion_step(optics: OpticsPlan) -> Step:
    """Path of the image while the shutter is open."""
    motion = optics.motion
    if motion is None:
        return Step("motion blur", False, _without_motion(optics))
    length, layers = motion.length.longest_px, len(motion.path.motion.surfaces)
    moved = "all of the picture alike" if motion.moves_alike else f"{layers} layers apart"
    if motion.vectors is not None:
        moved = "each pixel by its own velocity, where " + (
            "the faster covers the slower" if motion.vectors.depth_m is None else "the nearer covers the farther"
        )
    own = "" if motion.is_common else f", each of the {motion.path.lines.axis} at its own time"
    return Step("motion blur", True, f"paths of up to {length:.3g} photosites, {moved}{own}")


def _without_motion(optics: OpticsPlan) -> str:
    """Why no motion is computed, with the predicted error."""
    return "nothing moves" if optics.motion_skipped is None else optics.motion_skipped.reason


def _glare_step(glare: VeilingGlare | None) -> Step:
    """Light that the lens scatters over the sensor."""
    if glare is None:
        return Step("veiling glare", False, "the lens scatters no light")
    return Step("veiling glare", True, f"{100 * glare.share:g} % of all light lies evenly on the sensor")


def _defocus_step(optics: OpticsPlan, lens: Lens) -> Step:
    """Geometric blur of the lens: surfaces and the range of their signed blur radii."""
    defocus = optics.defocus
    if not lens.forms_image:
        return Step("defocus", False, "without a lens there is no image: every photosite gathers the whole scene")
    if defocus is None:
        return Step("defocus", False, describe_ignored(optics.accuracy, optics.ignored_px, ignored_terms(optics)))
    defocus = defocus.of_scene()
    surfaces = "one surface" if len(defocus.radii_px) == 1 else f"{len(defocus.radii_px)} surfaces"
    near, far = defocus.least_px, defocus.greatest_px
    radii = f"{abs(near):.2f} photosites" if near == far else f"from {near:.2f} (nearest) to {far:+.2f} photosites"
    cats_eyes = "" if defocus.eyes is None else f"; spots are cat's eyes, by zones of {defocus.eyes.zone_px} photosites"
    return Step("defocus", True, f"{surfaces}, blur radius {radii}{cats_eyes}")
