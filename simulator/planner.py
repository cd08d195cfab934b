"""The plan of a shot: what is computed, what is skipped and why. Executing it is the pipeline's work."""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from simulator.color import as_shot_neutral, color_matrix, forward_matrix
from simulator.defocus import SHARP_PX, Layers, plan_layers
from simulator.errors import PhotositeError
from simulator.exposure import Integration
from simulator.fused import CHARGE_STAGES, READOUT_STAGES, stage_order
from simulator.layout import Layout, plan_layout
from simulator.lens import Irradiance
from simulator.projection import Projection, plan_projection
from simulator.scene import Scene
from simulator.sensor import STAGES
from simulator.sensor.camera import Camera, Window
from simulator.shot import Shot
from simulator.spectra import electron_radiance_weights
from simulator.stage import Moments, Stage

MOST_ELECTRONS = 1e30  # far above any light, and far enough below 3e38 that no product on the way overflows
_TRUTH_BYTES = {"variance": 4, "depth": 12, "blur": 20}  # per photosite, with what the float64 steps to it hold


@dataclass(frozen=True)
class Step:
    """One line of the plan for people."""

    stage: str
    kept: bool
    why: str


@dataclass(frozen=True)
class Plan:
    """All numbers that executing needs.

    weights: (bands, channels) float32 [e- s^-1 um^-2 sr^-1]. stages: the fused stages in physical order.
    only_colour: channel that every photosite sees instead of its own; None: the camera's filter pattern.
    """

    scene: Scene
    camera: Camera
    weights: np.ndarray
    projection: Projection
    layout: Layout
    layers: Layers | None
    stages: tuple[Stage, ...]
    steps: tuple[Step, ...]
    only_colour: int | None = None

    @property
    def frame(self) -> Window:
        """Photosites that are computed."""
        return self.camera.frame

    def filter_block(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Channels that the 2x2 block at the frame's upper left corner sees, [row][column]."""
        own = self.only_colour
        return self.camera.filter_block() if own is None else ((own, own), (own, own))

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

    def electrons_per_radiance(self) -> tuple[float, float]:
        """Mean electrons per electron radiance at the frame's darkest and brightest photosite, a little beyond either."""
        irradiance, integration, frame = self.stage("irradiance"), self.stage("exposure"), self.frame
        dx = max(abs(frame.x - irradiance.centre_x_px), abs(frame.x + frame.width - irradiance.centre_x_px))
        dy = max(abs(frame.y - irradiance.centre_y_px), abs(frame.y + frame.height - irradiance.centre_y_px))
        cos4 = 1.0 / (1.0 + (dx**2 + dy**2) * irradiance.tan2_per_px2) ** 2
        on_axis = irradiance.solid_angle_sr * integration.time_s * integration.collecting_area_um2
        response = self.stage("prnu")
        reach = 0.0 if response is None else 6.8 * response.sigma  # of the normal numbers of kernels/normal.h
        return 0.9999 * cos4 * on_axis * max(0.0, 1.0 - reach), 1.0001 * on_axis * (1.0 + reach)

    def memory_bytes(self, truth: Collection[str] = ()) -> int:
        """What a shot holds at once on the device and the host together, estimated [byte]; both share memory on a CPU.

        truth: parts of the truth that it asks for, as `Shot.truth`.
        """
        pixels, channels = self.frame.width * self.frame.height, self.camera.channels
        per_photosite = 4 + 2 * (2 + 4 + 4)  # mosaic; codes, mean electrons and noise-free codes, on both sides
        per_photosite += 4 * any(self.layout.crosstalk.optical_shares) + 8 * self.layout.shares_charge  # what passes leave
        if self.layers is not None:
            sums = 4 * (channels + 1) * (1.0 + 2.0 * self.layers.reach_px / 128.0)
            per_photosite += 4 * channels + 1 + 8 + sums
        per_photosite += sum(_TRUTH_BYTES.get(part, 0) for part in truth)
        per_photosite += (8 * channels + 20) * ("rgb" in truth)  # planes, then stacked; mosaic and both truths of one more
        return int(pixels * per_photosite) + self.scene.planes.nbytes * 2

    def white_level_dn(self) -> int:
        """Code of a saturated photosite: of the full well or of the ADC, whichever is lower; above black [DN]."""
        adc, well, digital = self.stage("adc"), self.stage("full_well"), self.stage("digital_gain")
        top_dn = float(adc.max_code)
        if digital is not None:
            top_dn = min(top_dn, digital.moments(Moments(top_dn, 0.0)).mean)
        if well is not None:
            top_dn = min(top_dn, self.moments(well.capacity_e).mean)
        return max(round(top_dn), math.floor(adc.black_level_dn) + 1)  # ties to even, as the ADC's

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
        if self.camera.channels == 1:
            return None, tuple(float(value) for value in neutral)
        published = self.camera.color_matrix
        if published is not None and published.in_dng:
            return np.array(published.xyz_to_camera), tuple(float(value) for value in neutral)
        return color_matrix(response.wavelengths_nm, response.quantum_efficiency), tuple(float(v) for v in neutral)


def plan(shot: Shot) -> Plan:
    """Plan a shot; reads its scene. Raises PhotositeError for what cannot be simulated."""
    layout = plan_layout(shot.camera)
    scene, camera = shot.scene.load(), replace(shot.camera, window=layout.computed)
    weights = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    if weights.shape[1] != camera.channels:
        raise PhotositeError(f"camera.response has {weights.shape[1]} curves, but cfa {camera.cfa} needs {camera.channels}")
    _check_light(scene, weights, shot)
    projection = plan_projection(scene, shot.lens, camera)
    layers = plan_layers(shot.lens, camera.pixel_pitch_um, scene.depth_m)
    stages = fused_stages(shot)
    fused = {stage.stem: stage for stage in stages}
    steps = _steps(scene, camera, projection, layers, layout, fused)
    return Plan(scene, camera, weights.astype(np.float32), projection, layout, layers, stages, steps)


def _check_light(scene: Scene, weights: np.ndarray, shot: Shot) -> None:
    """Refuse light of which single precision loses count (its largest number is 3e38)."""
    radiance = float(scene.planes.max()) * float(weights.sum(axis=0).max())
    per_radiance = shot.lens.irradiance_per_radiance_sr() * shot.exposure.time_s * shot.camera.pixel_pitch_um**2
    if max(radiance, radiance * per_radiance) > MOST_ELECTRONS:
        raise PhotositeError(
            f"scene: the brightest place gives {radiance * per_radiance:.2g} electrons per photosite, more than the "
            f"{MOST_ELECTRONS:g} that single precision counts safely; lower scene.luminance or exposure.time"
        )


def fused_stages(shot: Shot) -> tuple[Stage, ...]:
    """Stages of the fused kernel for a shot that have an effect, in physical order."""
    fused = {stem: stage for stem, stage in _fused_stages(shot).items() if stage.has_effect}
    return tuple(fused[stem] for stem in stage_order() if stem in fused)


def _fused_stages(shot: Shot) -> dict[str, Stage]:
    lens, camera = shot.lens, shot.camera
    return {
        Irradiance.stem: Irradiance(
            solid_angle_sr=lens.irradiance_per_radiance_sr(),
            tan2_per_px2=(1e-3 * camera.pixel_pitch_um / lens.image_distance_mm) ** 2 if lens.cos4 else 0.0,
            centre_x_px=0.5 * camera.width_px,
            centre_y_px=0.5 * camera.height_px,
        ),
        Integration.stem: Integration(shot.exposure.time_s, camera.pixel_pitch_um**2 * camera.fill_factor),
        **camera.sensor_stages(shot.exposure.iso, shot.exposure.time_s),
    }


def projection_defines(planned: Plan) -> dict[str, object]:
    """Macros of kernels/projection.cl."""
    (c00, c01), (c10, c11) = planned.filter_block()
    cfa = {"CFA_00": c00, "CFA_01": c01, "CFA_10": c10, "CFA_11": c11}
    return {"SAMPLES": planned.projection.samples, "NEAREST": int(planned.projection.nearest), **cfa}


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


def _steps(scene, camera, projection, layers, layout, fused) -> tuple[Step, ...]:
    bands, wavelengths = scene.planes.shape[2], len(scene.wavelengths_nm)
    steps = [
        Step(
            "spectral integration",
            True,
            f"{bands} scene planes of {wavelengths} wavelengths -> {camera.channels} camera planes",
        ),
        Step("projection", True, f"{projection.scale:.3f} scene pixels per photosite, {_samples(projection)}"),
        _defocus_step(layers),
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


def _number(value: float | tuple[float, ...]) -> str:
    return f"{len(value)} values" if isinstance(value, tuple) else f"{value:.6g}"


def _samples(projection: Projection) -> str:
    return "one sample each" if projection.samples == 1 else f"{projection.samples} x {projection.samples} samples each"


def _defocus_step(layers: Layers | None) -> Step:
    if layers is None:
        return Step("defocus", False, f"no blur circle has a radius above {SHARP_PX} photosites")
    radii = layers.radii_px
    return Step("defocus", True, f"{len(radii)} depth layers, blur radius {min(radii):.2f} to {max(radii):.2f} photosites")
