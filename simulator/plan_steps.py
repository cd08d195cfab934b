"""What a plan does, line by line, for people."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.defocus import Defocus
from simulator.defocus.accuracy import Accuracy
from simulator.distortion import Warp
from simulator.fused import stage_order
from simulator.layout import Layout
from simulator.lens import Lens
from simulator.projection import Projection
from simulator.scene import Scene
from simulator.scene.hidden_surface import hidden_share
from simulator.sensor.camera import Camera
from simulator.stage import Stage
from simulator.veiling_glare import VeilingGlare


@dataclass(frozen=True)
class Step:
    """One line of the plan for people."""

    stage: str
    kept: bool
    why: str


def steps_of(
    scene: Scene, camera: Camera, projection: Projection, defocus: Step, glare: Step, layout: Layout, fused: dict[str, Stage]
) -> tuple[Step, ...]:
    """All steps of a plan in physical order; fused: stages of the fused kernel by stem."""
    bands, wavelengths = scene.planes.shape[2], len(scene.wavelengths_nm)
    steps = [
        Step(
            "spectral integration",
            True,
            f"{bands} scene planes of {wavelengths} wavelengths -> {camera.channels} camera planes",
        ),
        Step("projection", True, f"{projection.scale:.3f} scene pixels per photosite, {_samples(projection)}"),
        _distortion_step(projection.warp, camera),
        defocus,
        glare,
    ]
    dark = camera.optical_black
    told = "light reaches all of the sensor" if dark is None else str(dark)
    steps.append(Step("optical black", dark is not None, told))
    sharing = {"light": layout.crosstalk.optical_shares, "charge": layout.crosstalk.electrical_shares}
    for what, shares in sharing.items():
        told = f"{shares[0]:g} to each neighbour beside, {shares[1]:g} at the corners" if any(shares) else "nothing is shared"
        steps.append(Step(f"crosstalk of {what}", any(shares), told))
    for stem in stage_order():
        stage = fused.get(stem)
        if stage is None:
            steps.append(Step(stem, False, "the camera has none, or it would change nothing"))
        else:
            numbers = ", ".join(f"{name} = {_number(value)}" for name, value in stage.kernel_values().items())
            steps.append(Step(stem, True, numbers or "no parameters"))
    binning = layout.binning
    told = "off" if binning is None else f"{binning.factor} x {binning.factor} photosites of one colour, {binning.mode}"
    steps.append(Step("binning", binning is not None, told))
    return tuple(steps)


def hidden_step(scene: Scene, lens: Lens, camera: Camera, projection: Projection) -> Step:
    """What a lens sees behind the edges of near things: the error that no method can remove from one picture with depth."""
    if scene.behind or np.ndim(scene.depth_m) == 0:
        return Step("hidden surfaces", bool(scene.behind), f"the scene has {len(scene.layers)} layers")
    share = hidden_share(scene.depth_m, per_dioptre(lens, camera, projection), lens.focus_distance_m)
    told = "is not shown by the scene, and none is assumed" if scene.hidden == "none" else "is assumed to go on behind edges"
    return Step(
        "hidden surfaces", scene.hidden == "extend", f"about {100 * share:.2g} % of the picture sees background that {told}"
    )


def per_dioptre(lens: Lens, camera: Camera, projection: Projection) -> float:
    """Growth of the signed blur radius [scene pixels] per 1/m of inverse distance."""
    growth_um = float(lens.blur_radius_um(math.inf) - lens.blur_radius_um(1.0))
    return growth_um * projection.scale / camera.pixel_pitch_um


def _number(value: float | tuple[float, ...]) -> str:
    return f"{len(value)} values" if isinstance(value, tuple) else f"{value:.6g}"


def _samples(projection: Projection) -> str:
    return "one sample each" if projection.samples == 1 else f"{projection.samples} x {projection.samples} samples each"


def _distortion_step(warp: Warp | None, camera: Camera) -> Step:
    if warp is None:
        return Step("distortion", False, "the lens has none")
    corner_x, corner_y = warp.distorted(camera.width_px, camera.height_px)
    moved_px = math.hypot(corner_x - warp.centre_x_px, corner_y - warp.centre_y_px) - math.hypot(
        warp.centre_x_px, warp.centre_y_px
    )
    return Step("distortion", True, f"the corner moves {moved_px:+.1f} photosites outwards, traced back in {warp.steps} steps")


def glare_step(glare: VeilingGlare | None) -> Step:
    """Scattered light."""
    if glare is None:
        return Step("veiling glare", False, "the lens scatters no light")
    return Step("veiling glare", True, f"{100 * glare.share:g} % of all light lies evenly on the sensor")


def defocus_step(defocus: Defocus | None, forms_image: bool, accuracy: Accuracy) -> Step:
    """Blur of the lens; forms_image: whether there is one."""
    if not forms_image:
        return Step("defocus", False, "without a lens there is no image: every photosite gathers the whole scene")
    if defocus is None:
        return Step("defocus", False, f"no blur circle has a radius above {accuracy.sharp_px:.2g} photosites")
    surfaces = "one surface" if len(defocus.radii_px) == 1 else f"{len(defocus.radii_px)} surfaces"
    near, far = defocus.least_px, defocus.greatest_px
    radii = f"{abs(near):.2f} photosites" if near == far else f"from {near:.2f} (nearest) to {far:+.2f} photosites"
    eyes = "" if defocus.eyes is None else f"; spots are cat's eyes, by zones of {defocus.eyes.zone_px} photosites"
    return Step("defocus", True, f"{surfaces}, blur radius {radii}{eyes}")
