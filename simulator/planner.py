"""The plan of a shot: what is computed, what is skipped and why. Executing it is the pipeline's work."""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from simulator.color import as_shot_neutral, color_matrix, forward_matrix
from simulator.defocus import Defocus, plan_defocus
from simulator.defocus.accuracy import Accuracy, brightest_electrons
from simulator.defocus.prediction import told
from simulator.errors import PhotositeError
from simulator.exposure import Integration
from simulator.fused import CHARGE_STAGES, MOST_ELECTRONS, READOUT_STAGES, in_order, white_level_dn
from simulator.layout import Layout, plan_layout
from simulator.lens import BareSensor, Irradiance
from simulator.lens.bare_sensor import gathered
from simulator.plan_steps import Step, defocus_step, glare_step, hidden_step, per_dioptre, steps_of
from simulator.point_spread import Spread
from simulator.projection import Projection, plan_projection
from simulator.scene import Scene
from simulator.scene.hidden_surface import with_hidden_surface
from simulator.scene.pinhole import pinhole_scene
from simulator.sensor import STAGES
from simulator.sensor.camera import Camera, Window
from simulator.shot import Shot
from simulator.spectra import electron_radiance_weights
from simulator.stage import Moments, Stage
from simulator.veiling_glare import VeilingGlare, plan_veiling_glare

_TRUTH_BYTES = {"variance": 4, "depth": 12, "blur": 20}  # per photosite, with what the float64 steps to it hold


@dataclass(frozen=True)
class Plan:
    """All numbers that executing needs.

    weights: (bands, channels) float32 [e- s^-1 um^-2 sr^-1]. stages: the fused stages in physical order.
    only_colour: channel that every photosite sees instead of its own; None: the camera's filter pattern.
    spread: diffraction, aberrations, filter and aperture beyond the thin lens; None: nothing to do.
    area: photosites that are computed instead of the camera's frame; may reach beyond the sensor.
    """

    scene: Scene
    camera: Camera
    weights: np.ndarray
    projection: Projection
    layout: Layout
    defocus: Defocus | None
    stages: tuple[Stage, ...]
    steps: tuple[Step, ...]
    only_colour: int | None = None
    veiling_glare: VeilingGlare | None = None
    spread: Spread | None = None
    area: Window | None = None

    @property
    def frame(self) -> Window:
        """Photosites that are computed."""
        return self.area or self.camera.frame

    def filter_block(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Channels that the 2x2 block at the frame's upper left corner sees, [row][column]."""
        own = self.only_colour
        return self.camera.filter_block() if own is None else ((own, own), (own, own))

    def filter_macros(self) -> dict[str, int]:
        """Macros of kernels/cfa.h."""
        (c00, c01), (c10, c11) = self.filter_block()
        return {"CFA_00": c00, "CFA_01": c01, "CFA_10": c10, "CFA_11": c11}

    def stage(self, stem: str) -> Stage | None:
        """The fused stage of this stem, or None when it is skipped."""
        return next((stage for stage in self.stages if stage.stem == stem), None)

    def moments(self, mean_electrons: float) -> Moments:
        """Mean and variance of the code [DN] for a photosite that expects these photoelectrons."""
        signal = Moments(mean_electrons, 0.0)
        for _, step in self.moment_steps():
            signal = step(signal)
        return signal

    def moment_steps(self) -> list[tuple[str, Callable[[Moments], Moments]]]:
        """Name and effect on mean and variance of everything from the photoelectrons to the code, in physical order."""
        sensor, binning = [stage for stage in self.stages if stage.stem in STAGES], self.layout.binning
        steps = [(stage.stem, stage.moments) for stage in sensor if stage.stem in CHARGE_STAGES]
        steps.append(("crosstalk", self.layout.crosstalk.of_charge))
        if binning is not None:
            steps.append(("binning", binning.of_charge))
        steps += [(stage.stem, stage.moments) for stage in sensor if stage.stem in READOUT_STAGES]
        return steps if binning is None else [*steps, ("binning", binning.of_code)]

    def memory_bytes(self, truth: Collection[str] = ()) -> int:
        """What a shot holds at once on the device and the host together, estimated [byte]; both share memory on a CPU.

        truth: parts of the truth that it asks for, as `Shot.truth`.
        """
        pixels = self.frame.width * self.frame.height
        per_photosite = 4 + 2 * (2 + 4 + 4)  # mosaic; codes, mean electrons and noise-free codes, on both sides
        per_photosite += 4 * any(self.layout.crosstalk.optical_shares) + 8 * self.layout.shares_charge  # what passes leave
        if self.defocus is not None:
            per_photosite += 4 * sum(np.ndim(radius) > 0 for radius in self.defocus.radii_px)
        if self.spread is not None:
            per_photosite += 4 + 8 * self.camera.channels * (not self.spread.by_distance)
        per_photosite += sum(_TRUTH_BYTES.get(part, 0) for part in truth)
        per_photosite += (8 * self.camera.channels + 20) * ("rgb" in truth)  # planes, then stacked; mosaic and both truths
        return int(pixels * per_photosite) + self.scene.planes.nbytes * 2

    def white_level_dn(self) -> int:
        """Code of a saturated photosite: of the full well or of the ADC, whichever is lower; above black [DN]."""
        return white_level_dn(self.stages, self.moments)

    def black_offsets_dn(self) -> tuple[float, float, float, float]:
        """What color_bias adds to the black level at the four places of the frame's upper left 2x2 block, row by row [DN]."""
        bias, output = self.stage("color_bias"), self.layout.output
        if bias is None:
            return (0.0,) * 4
        later = self.stages[self.stages.index(bias) + 1 :]

        def code_dn(signal_dn: float) -> float:
            return reduce(lambda signal, stage: stage.moments(signal), later, Moments(signal_dn, 0.0)).mean

        block = np.reshape([code_dn(offset) - code_dn(0.0) for offset in bias.offsets_dn], (2, 2))
        return tuple(float(offset) for offset in np.roll(block, (-output.y % 2, -output.x % 2), axis=(0, 1)).ravel())

    def noise_profile(self) -> tuple[float, float]:
        """S and O of DNG's NoiseProfile: variance = S x + O, x from 0 at black to 1 at white (DNG 1.4)."""
        unclipped = replace(self, stages=tuple(stage for stage in self.stages if stage.stem != "full_well"))
        dark, one = unclipped.moments(0.0), unclipped.moments(1.0)
        span = self.white_level_dn() - self.stage("adc").black_level_dn
        slope = (one.variance - dark.variance) / (one.mean - dark.mean)
        return slope / span, dark.variance / span**2

    def warp_rectilinear(self) -> tuple[tuple[tuple[float, ...], ...], tuple[float, float]] | None:
        """Return what undoes the lens's distortion in the lit part of the frame; see `Raw.warp_rectilinear`."""
        warp, output, lit = self.projection.warp, self.layout.output, self.layout.lit
        if warp is None:
            return None
        left, top = max(output.x, lit.x), max(output.y, lit.y)
        right, bottom = min(output.x + output.width, lit.x + lit.width), min(output.y + output.height, lit.y + lit.height)
        half = 0.5 * (1 if self.layout.binning is None else self.layout.binning.factor)
        return warp.rectilinear(left + half, top + half, right - half, bottom - half)

    def color_matrices(self) -> dict[str, np.ndarray]:
        """Fields of Raw beside color_matrix; none without a colour filter or with a published matrix, which is for D65."""
        camera, response = self.camera, self.camera.response
        if camera.channels == 1 or (camera.color_matrix is not None and camera.color_matrix.in_dng):
            return {}
        curves = response.wavelengths_nm, response.quantum_efficiency
        forward = {f"forward_matrix_{light.lower()}": forward_matrix(*curves, light) for light in ("D65", "A")}
        return {"color_matrix_a": color_matrix(*curves, "A"), **forward}

    def color_metadata(self) -> tuple[np.ndarray | None, tuple[float, ...]]:
        """ColorMatrix under D65 (None without a colour filter) and AsShotNeutral."""
        response, scene = self.camera.response, self.scene
        neutral = as_shot_neutral(scene.illuminant, response.wavelengths_nm, response.quantum_efficiency, scene.wavelengths_nm)
        return matrix_under_d65(self.camera), tuple(float(value) for value in neutral)


def matrix_under_d65(camera: Camera) -> np.ndarray | None:
    """XYZ to camera under D65, (3, 3): the published matrix if the DNG has it, else fitted to the response; None for MONO."""
    if camera.channels == 1:
        return None
    if camera.color_matrix is not None and camera.color_matrix.in_dng:
        return np.array(camera.color_matrix.xyz_to_camera)
    return color_matrix(camera.response.wavelengths_nm, camera.response.quantum_efficiency)


def plan(shot: Shot) -> Plan:
    """Plan a shot; reads its scene. Raises PhotositeError for what cannot be simulated."""
    layout = plan_layout(shot.camera)
    loaded, camera = shot.scene.load(), replace(shot.camera, window=layout.computed)
    forms_image = not isinstance(shot.lens, BareSensor)
    scene = pinhole_scene(loaded) if forms_image else gathered(loaded)
    weights = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    if weights.shape[1] != camera.channels:
        rule = f"has {weights.shape[1]} curves, but cfa {camera.cfa} needs {camera.channels}"
        raise PhotositeError(rule, key="camera.response", joint=" ")
    _check_light(scene, weights, shot)
    projection = plan_projection(scene, shot.lens, camera)
    stages = fused_stages(shot)
    planned = Plan(scene, camera, weights.astype(np.float32), projection, layout, None, stages, ())
    accuracy = _accuracy(planned, shot) if forms_image else Accuracy()
    blur = {"scale": projection.scale, "accuracy": accuracy, "sensor_px": (camera.width_px, camera.height_px)}
    defocus = plan_defocus(shot.lens, camera.pixel_pitch_um, loaded, **blur) if forms_image else None
    fused = {stage.stem: stage for stage in stages}
    glare = plan_veiling_glare(shot.lens.veiling_glare, scene, weights, projection, camera, fused[Irradiance.stem])
    steps = steps_of(scene, camera, projection, defocus_step(defocus, forms_image, accuracy), glare_step(glare), layout, fused)
    if defocus is not None:
        steps += (
            hidden_step(loaded, shot.lens, camera, projection),
            Step("blur accuracy", True, told(defocus)),
        )
        scene = with_hidden_surface(loaded, per_dioptre(shot.lens, camera, projection)) if shot.tolerance else loaded
        extended = plan_defocus(shot.lens, camera.pixel_pitch_um, scene, **blur)
        defocus = replace(extended, guessed=defocus.guessed)
    planned = replace(planned, scene=scene, defocus=defocus, steps=steps, veiling_glare=glare)
    return _with_spread(planned, shot)


def _with_spread(planned: Plan, shot: Shot) -> Plan:
    """Return the plan with what makes a point's image wider than the thin lens does."""
    from simulator.point_spread.planning import contrast_sigma, spread_and_reasons

    integration, irradiance = planned.stage("exposure"), planned.stage("irradiance")
    factor = integration.time_s * integration.collecting_area_um2 * irradiance.solid_angle_sr
    contrast = contrast_sigma(planned.scene, factor * planned.weights, planned.moments)
    if contrast > 0.0 and shot.tolerance == 0.0:
        contrast = math.inf  # nothing is skipped
    scale = planned.projection.scale
    spread, told = spread_and_reasons(
        shot.lens, planned.camera, planned.scene, planned.weights, planned.defocus, scale, contrast
    )
    behind = [step.stage for step in planned.steps].index("defocus") + 1
    steps = (*planned.steps[:behind], *(Step(*reason) for reason in told), *planned.steps[behind:])
    return replace(planned, spread=spread, steps=steps)


def _accuracy(planned: Plan, shot: Shot) -> Accuracy:
    """Error that the blur may have: of the noise at the scene's brightest light, or at what saturates a photosite."""
    dark, one = planned.moments(0.0), planned.moments(1.0)
    gain = one.mean - dark.mean
    if gain <= 0.0:  # dark current alone fills the well: the frame shows nothing
        return Accuracy(shot.tolerance)
    per_radiance = shot.lens.irradiance_per_radiance_sr() * shot.exposure.time_s
    per_radiance *= shot.camera.pixel_pitch_um**2 * shot.camera.fill_factor
    full_e = (planned.white_level_dn() - planned.stage("adc").black_level_dn) / gain
    brightest_e, peak_e = brightest_electrons(planned.scene, planned.weights, per_radiance)
    electrons = max(min(brightest_e, full_e), 1.0)
    return Accuracy(shot.tolerance, electrons, math.sqrt(dark.variance) / gain, max(peak_e / electrons, 1.0))


def _check_light(scene: Scene, weights: np.ndarray, shot: Shot) -> None:
    """Refuse light of which single precision loses count (its largest number is 3e38)."""
    radiance = float(scene.planes.max()) * float(weights.sum(axis=0).max())
    per_radiance = shot.lens.irradiance_per_radiance_sr() * shot.exposure.time_s * shot.camera.pixel_pitch_um**2
    if max(radiance, radiance * per_radiance) > MOST_ELECTRONS:
        raise PhotositeError(
            f"the brightest place gives {radiance * per_radiance:.2g} electrons per photosite, more than the "
            f"{MOST_ELECTRONS:g} that single precision counts safely; lower scene.luminance or exposure.time",
            key="scene",
        )


def fused_stages(shot: Shot) -> tuple[Stage, ...]:
    """Stages of the fused kernel for a shot that have an effect, in physical order."""
    return in_order(_fused_stages(shot).values())


def _fused_stages(shot: Shot) -> dict[str, Stage]:
    lens, camera = shot.lens, shot.camera
    return {
        Irradiance.stem: Irradiance.behind(lens, camera.pixel_pitch_um, camera.width_px, camera.height_px),
        Integration.stem: Integration(shot.exposure.time_s, camera.pixel_pitch_um**2 * camera.fill_factor),
        **camera.sensor_stages(shot.exposure.iso, shot.exposure.time_s),
    }


def projection_defines(planned: Plan, over: int = 1) -> dict[str, object]:
    """Macros of kernels/projection.cl, for planes of `over` x `over` points per photosite."""
    warp, samples = planned.projection.warp, -(-planned.projection.samples // over)
    warped = {"DISTORTION": int(warp is not None)} | ({} if warp is None else warp.macros())
    return {"SAMPLES": samples, "NEAREST": int(planned.projection.nearest), "OVER": over, **warped, **planned.filter_macros()}


def projection_arguments(planned: Plan, origin_x: int, origin_y: int) -> dict[str, object]:
    """Scalar arguments of kernels/projection.cl for an output that begins at this photosite of the sensor."""
    projection, (height, width) = planned.projection, planned.scene.planes.shape[:2]
    return {
        "scene_width": width,
        "scene_height": height,
        "origin_x": origin_x,
        "origin_y": origin_y,
        "scale": projection.scale,
        "offset_x": projection.offset_x,
        "offset_y": projection.offset_y,
    }
