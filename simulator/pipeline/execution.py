"""Executes a plan: its passes on an OpenCL device, in the order of the light."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from simulator.device import Buffer, Device
from simulator.exposure.line_exposure import add_exposed_lines, expose_lines
from simulator.optics.error_term import WINGS
from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.scene_part import find_scene_part
from simulator.optics.lens.lens import Lens
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.low_pass_spots import mean_of_spots
from simulator.optics.passes.own_colors import join_colors
from simulator.optics.passes.still_mosaic import still_mosaic, still_name
from simulator.optics.veiling_glare import add_veiling_glare
from simulator.pipeline.frame_metadata import assemble_raw
from simulator.pipeline.frame_strips import Allocate, FrameArrays, MemoryStore
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.motion_truth import flow_map
from simulator.pipeline.planner import Plan, measure
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.pipeline.truth_maps import blur_map, depth_map, variance_map
from simulator.progress import Progress
from simulator.raw.raw_image import Raw
from simulator.scene.content_keys import Itself
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.hdr_passes import read_noise_free_combined, read_out_combined
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.hdr_variance import mixed_combined_variance
from simulator.sensor.readout import (
    darken_optical_black,
    mixed_variance,
    read_mean_electrons,
    read_noise_free,
    read_out,
    remosaic_variance,
    share_with_neighbors,
)
from simulator.sensor.sensor_plan import SensorPlan

if TYPE_CHECKING:
    from simulator.optics.passes.tile_plan import TilePlan


def execute(
    planned: Plan,
    shot: Shot,
    device: Device,
    report: Progress,
    timed: Stopwatch,
    allocate: Allocate = MemoryStore,
    cache: LightCache | None = None,
) -> Raw:
    """Run the passes of a shot's plan on a device.

    report: as progress of `simulate`. timed: gets the time of each pass.
    allocate: makes the arrays of a frame of several strips. cache: as of `simulate`, of a plan that was made with it.
    """
    parts, shot = planned.by_strip(), planned.settle(shot)
    if len(parts) == 1:
        arrays = _execute_strip(planned, shot, device, report, timed, cache)
    else:
        arrays = _execute_strips(parts, shot, device, report, timed, allocate)
    report("done", 1.0)
    return assemble_raw(shot, planned, device.info, arrays)


def _execute_strips(
    parts: list[Plan], shot: Shot, device: Device, report: Progress, timed: Stopwatch, allocate: Allocate
) -> dict[str, np.ndarray]:
    """Run the passes of all strips, one after the other; returns the arrays of the whole frame, named as those of a strip."""
    frame = FrameArrays(sum(part.sensor.readout.rows for part in parts), allocate)
    for count, part in enumerate(parts):

        def report_strip(what: str, share: float, count: int = count) -> None:
            report(what, (count + share) / len(parts))

        strip = _execute_strip(part, shot, device, report_strip, timed, None)
        made: dict[str, Any] = {name: array() if callable(array) else array for name, array in strip.items()}
        with timed("strips", device):
            frame.append(made)
        del strip, made  # their memory is for the next one
    return frame.arrays()


def _execute_strip(
    planned: Plan, shot: Shot, device: Device, report: Progress, timed: Stopwatch, cache: LightCache | None
) -> dict[str, Any]:
    """Run the passes of a strip; returns its arrays: codes "dn", "mean_electrons", "noise_free_dn", and maps of the truth.

    Mean electrons and noise-free codes may be functions that make them.
    """
    if planned.key is None:
        cache = None
    report("light", 0.1)
    if cache is None:
        planned = _measure(planned, device, timed)
    light = _light(planned, device, lambda share: report("light", 0.1 + 0.7 * share), timed, cache)
    with timed("later exposures", device) if planned.later else nullcontext():
        lights = [light, *_later_lights(planned, device, Stopwatch(), cache)]
    report("sensor", 0.8)
    with timed("sensor", device):
        if isinstance(planned.sensor, HdrSensorPlan):
            dn = read_out_combined(device, planned.sensor, _by_exposure(planned.sensor, lights), shot.seeds)
        else:
            dn = read_out(device, planned.sensor, light, shot.seeds)
    report("truth", 0.9)
    late = LateTruth(device, planned.sensor, lights, timed)
    is_mixed = planned.sensor.readout.mixes_charge
    electrons, *later = late.exposures() if "variance" in planned.truth and not is_mixed else [None]
    further = [one for one in later if one is not None]
    maps = compute_truth_maps(planned, shot.lens, device, electrons, timed, cache, further, lights)
    if "flow" in planned.truth:
        with timed("truth: flow", device):
            maps["flow"] = flow_map(
                shot, planned.optics.scene, planned.optics.projection, planned.sensor.readout, planned.exposed.openings
            )
    mean_electrons = late.mean_electrons if electrons is None or late.is_remosaiced else electrons
    return {"dn": dn, "mean_electrons": mean_electrons, "noise_free_dn": late.noise_free_dn, **maps}


class LateTruth:
    """Truth of a frame that is computed when it is first asked for, from the light on the sensor, which is held until then.

    lights: mosaic of electron radiance of each exposure, as `expose` returns it; one where they are all the same. Nothing
    changes them. timed: gets the time, as that of "truth".
    """

    def __init__(self, device: Device, sensor: SensorPlan, lights: Sequence[Buffer], timed: Stopwatch) -> None:
        self._device, self._sensor, self._lights, self._timed = device, sensor, lights, timed

    @property
    def is_remosaiced(self) -> bool:
        """Whether pixels are computed from several photosites, whose variances differ."""
        return self._sensor.readout.pattern is not None

    def mean_electrons(self) -> np.ndarray:
        """Return the mean electrons [e-] of the frame's pixels, (height, width) float32, a new array."""
        with self._timed("truth", self._device):
            return read_mean_electrons(self._device, self._sensor, self._lights[0])

    def exposures(self) -> list[np.ndarray]:
        """Return the mean electrons of each exposure, as `mean_electrons` does; a frame has one unless its readings differ.

        Those of a frame that is remosaiced are of its photosites, with their margin.
        """
        if self.is_remosaiced:
            photosites = replace(self._sensor, readout=self._sensor.readout.of_photosites)
            return [read_mean_electrons(self._device, photosites, self._lights[0])]
        if not isinstance(self._sensor, HdrSensorPlan):
            return [self.mean_electrons()]
        parts = zip(self._sensor.exposures, _by_exposure(self._sensor, self._lights), strict=True)
        with self._timed("truth", self._device):
            return [read_mean_electrons(self._device, part, light) for part, light in parts]

    def noise_free_dn(self) -> np.ndarray:
        """Return the codes without noise [DN] of the frame's pixels, (height, width) float32, a new array."""
        with self._timed("truth", self._device):
            return _read_noise_free(self._device, self._sensor, self._lights)


def _by_exposure(sensor: HdrSensorPlan, lights: Sequence[Buffer]) -> list[Buffer]:
    """Return the light of each exposure, where `lights` has one for all of them, too."""
    return [lights[place % len(lights)] for place in range(len(sensor.exposures))]


def _read_noise_free(device: Device, sensor: SensorPlan, lights: Sequence[Buffer]) -> np.ndarray:
    """Return the codes without noise [DN] of the frame's pixels, (height, width) float32."""
    if isinstance(sensor, HdrSensorPlan):
        return read_noise_free_combined(device, sensor, _by_exposure(sensor, lights))
    return read_noise_free(device, sensor, lights[0])


def _measure(planned: Plan, device: Device, timed: Stopwatch) -> Plan:
    with timed("radius statistics", device):
        return measure(planned, device)


def _light(
    planned: Plan,
    device: Device,
    progress: Callable[[float], None],
    timed: Stopwatch,
    cache: LightCache | None,
) -> Buffer:
    """Return the mosaic of `expose`, from the cache where it is there. Nobody may change it."""
    if cache is None or planned.key is None:
        return expose(planned, device, progress, timed)
    key = Itself(device), planned.key.of_mosaic(planned.optics, planned.sensor)
    return cache.get(key, lambda: expose(_measure(planned, device, timed), device, progress, timed))


def _later_lights(planned: Plan, device: Device, timed: Stopwatch, cache: LightCache | None) -> list[Buffer]:
    """Return the mosaic of each exposure after the first whose light is not the same, as `_light` does."""
    later = planned.later if cache is not None else [_measure(one, device, timed) for one in planned.later]
    return [_light(one, device, lambda share: None, timed, cache) for one in later]


def expose(
    planned: Plan,
    device: Device,
    progress: Callable[[float], None] = lambda share: None,
    timed: Stopwatch | None = None,
) -> Buffer:
    """Return the light on the sensor: device buffer (height, width) float32, electron radiance in each photosite's colour.

    planned: with the methods of its tiles, as `measure` returns it. progress: called with the share of the blur that is done.
    """
    timed, exposed, window = timed or Stopwatch(), planned.exposed, planned.optics.window
    (first, part), *others = planned.by_light()
    mosaic = _image(part if part.tiles or not others else measure(part, device), device, progress, timed)
    if exposed.varies:
        with timed("line exposure", device):
            expose_lines(device, mosaic, window, exposed, first)
    for component, part in others:
        light = _image(measure(part, device), device, progress, timed)
        with timed("line exposure", device):
            add_exposed_lines(device, mosaic, light, window, exposed, component)
    return mosaic


def _image(planned: Plan, device: Device, progress: Callable[[float], None], timed: Stopwatch) -> Buffer:
    """Return the image of the scene in each photosite's own colour, as `expose` does, before lines collect their shares."""
    optics, layout, tiles = planned.optics, planned.sensor.readout, planned.tiles
    with timed("scene planes", device):
        is_summed = optics.motion is not None and optics.motion.method in ("joint", "instants")
        part = None if is_summed else find_scene_part(_read_areas(planned, device))
        planes = [camera_planes(device, layer, optics.weights, optics.has_coverage, part) for layer in optics.scene.layers]
    if optics.motion is not None and optics.motion.method == "swept_first":
        from simulator.optics.passes.swept_light import sweep_light

        with timed("motion", device):
            optics, tiles, planes = sweep_light(optics, device, planes)
    if optics.motion is not None:
        from simulator.optics.passes.moving_mosaic import moving_mosaic

        def image(own: OpticsPlan) -> Buffer:
            return moving_mosaic(own, device, planes, progress)
    else:

        def image(own: OpticsPlan) -> Buffer:
            return still_mosaic(own, _tiles_at(own, tiles, device), device, planes, progress)

    def through_filter(own: OpticsPlan) -> Buffer:
        return mean_of_spots(own, device, image) if own.sees_spots else image(own)

    with timed(still_name(optics) if optics.motion is None else "motion", device):
        mosaic = join_colors(optics, device, through_filter) if optics.joins_colors else through_filter(optics)
    if optics.wings is not None:
        from simulator.optics.passes.wings import add_wings

        with timed(WINGS, device):
            add_wings(device, mosaic, optics.wings, optics.weights, optics.cfa_macros(), optics.window)
    if (glare := optics.veiling_glare) is not None:
        with timed("veiling glare", device):
            add_veiling_glare(device, mosaic, glare, planned.sensor.irradiance, optics.cfa_macros(), optics.window)
    if any(shares := layout.crosstalk.optical_shares):
        with timed("crosstalk of light", device):
            mosaic = share_with_neighbors(device, mosaic, optics.window, shares)
    if layout.reaches_optical_black:
        with timed("optical black", device):
            darken_optical_black(device, mosaic, optics.window, layout.active)
    return mosaic


def _tiles_at(optics: OpticsPlan, tiles: "TilePlan | None", device: Device) -> "TilePlan | None":
    """Return the methods of tiles: those that are chosen, or of optics that see the scene from a spot of a low-pass filter."""
    if tiles is None or optics.projection is tiles.optics.projection:
        return tiles
    from simulator.optics.passes.tile_plan import plan_tiles  # not needed without a blur

    return plan_tiles(optics, device)


def _read_areas(planned: Plan, device: Device) -> list[tuple[Projection, Window]]:
    """Windows whose photosites see what is read of the scene, each with its projection."""
    optics = planned.optics
    if optics.sees_spots:
        return [area for spot in optics.at_spots() for area in _read_areas(replace(planned, optics=spot), device)]
    if optics.motion is not None:
        window = optics.window
        if optics.motion.method == "swept_first":
            from simulator.optics.passes.swept_light import light_window

            window = light_window(optics, device)
        return [(optics.projection, optics.motion.seen_window(window))]
    if optics.psf is None and optics.defocus is None:
        return [(optics.projection, optics.window)]
    from simulator.optics.passes.read_areas import read_areas  # not needed for a sharp frame

    return read_areas(optics, planned.tiles)


def compute_truth_maps(
    planned: Plan,
    lens: Lens,
    device: Device,
    mean_electrons: np.ndarray | None,
    timed: Stopwatch | None = None,
    cache: LightCache | None = None,
    later_electrons: Sequence[np.ndarray] = (),
    lights: Sequence[Buffer] = (),
) -> dict[str, np.ndarray]:
    """Return the maps that the plan's truth asks for, by name; see `Raw.truth`.

    mean_electrons: of the frame's pixels [e-], for the map of the variance, as `LateTruth.exposures` gives; None: it is not
    asked for, or electrical crosstalk mixes the charges. later_electrons: of the further exposures of an HDR read-out.
    lights: as of `LateTruth`, for the map of the variance where electrical crosstalk mixes the charges.
    """
    optics, sensor, wanted, timed = planned.optics, planned.sensor, planned.truth, timed or Stopwatch()
    maps: dict[str, np.ndarray] = {}
    if "variance" in wanted and (mean_electrons is not None or lights):
        with timed("truth: variance", device):
            if mean_electrons is not None:
                maps["variance"] = variance_map(sensor, mean_electrons, *later_electrons)
            elif isinstance(sensor, HdrSensorPlan):
                maps["variance"] = mixed_combined_variance(device, sensor, _by_exposure(sensor, lights))
            else:
                photosites = replace(sensor, readout=sensor.readout.of_photosites) if sensor.readout.pattern else sensor
                maps["variance"] = mixed_variance(device, photosites, lights[0])
            if sensor.readout.pattern is not None:
                maps["variance"] = remosaic_variance(device, sensor, maps["variance"])
    if "depth" in wanted:
        with timed("truth: depth", device):
            maps["depth"] = depth_map(optics.scene, optics.projection, sensor.readout)
    if "blur" in wanted:
        with timed("truth: blur", device):
            depth_m = maps["depth"] if "depth" in maps else depth_map(optics.scene, optics.projection, sensor.readout)
            maps["blur"] = blur_map(sensor, lens, depth_m)
    if "rgb" in wanted:
        with timed("truth: rgb", device):
            maps["rgb"] = clean_rgb(planned, device, cache)
    return maps


def clean_rgb(planned: Plan, device: Device, cache: LightCache | None = None) -> np.ndarray:
    """Return the noise-free signal in every colour at every pixel, (height, width, channels) float32, 0 at black, 1 at white.

    Camera colours, linear, not white-balanced: the result of a demosaicing without error. A channel is the noise-free code
    of a sensor that has this channel's filter on all photosites. In a pixel's own colour it is
    (noise-free code - black) / (white - black), unless crosstalk mixes colours.
    """
    sensor = planned.sensor
    sensor = replace(sensor, readout=replace(sensor.readout, pattern=None))  # a pixel has the light of its place
    black_dn, span_dn = np.float32(sensor.black_level_dn), np.float32(sensor.full_scale_dn())
    planes = []
    for channel in range(planned.optics.channels):
        part = planned.in_one_color(channel)
        light = _light(part, device, lambda share: None, Stopwatch(), cache)
        lights = [light, *_later_lights(part, device, Stopwatch(), cache)]
        # Unnamed, so that the frame's memory is free before the next colour is computed.
        planes.append((_read_noise_free(device, sensor, lights) - black_dn) / span_dn)
    return np.stack(planes, axis=-1)
