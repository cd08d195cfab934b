"""The plan of a shot: what is computed, what is skipped and why. `pipeline.simulate` executes it."""

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Self

import numpy as np

from simulator.device import Device
from simulator.displayed import Displayed
from simulator.errors import require
from simulator.exposure.exposed_light import ExposedLight, LightComponent, plan_exposure
from simulator.exposure.later_exposures import check_interval, later_exposures
from simulator.optics.geometry.projection import tangent_per_pixel
from simulator.optics.lens.relative_illumination import plan_irradiance
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.optics_planning import plan_optics
from simulator.optics.passes.tile_grid import BAND_ROWS
from simulator.pipeline.allotment import allot, with_few_instants, with_wide_zones
from simulator.pipeline.error_budget import ErrorBudget, error_budget
from simulator.pipeline.light_cache import LightCache, LightKey, light_key
from simulator.pipeline.metered_shot import Metered, meter_shot
from simulator.pipeline.passes import passes_of
from simulator.pipeline.plan_steps import steps_of
from simulator.pipeline.planned_pass import Pass
from simulator.pipeline.scene_loading import load_seen
from simulator.pipeline.shot import Shot, TruthPart
from simulator.pipeline.step import Step
from simulator.pipeline.time_fit import TimeFit
from simulator.sensor.camera.readout_window import ReadoutGeometry, split_readout
from simulator.sensor.hdr_plan import HdrSensorPlan, plan_readings
from simulator.sensor.sensor_plan import SensorPlan, plan_sensor
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.stage import Stage

if TYPE_CHECKING:
    from simulator.optics.passes.tile_plan import TilePlan

STRIP_PX = 2**25  # photosites that are computed at once


@dataclass(frozen=True)
class Plan(Displayed):
    """All decisions that the execution of a shot needs.

    exposed: light of the scene and the flash over time, of which lines collect their shares.
    truth: maps that the truth holds besides mean electrons and noise-free codes.
    steps: effects on the light and the signal, in physical order, as `explain` prints them.
    passes: what the executor runs and what it skips: method, size, memory, predicted error and time.
    tiles: method of each tile, as `measure` chooses them; None: not measured, or no method is chosen by tile.
    key: what the light depends on, of a plan that was made with a cache.
    strips: readout of each strip of the frame, from top to bottom, which are computed one after the other.
    metered: what the camera chose for the shot; None: all is set by hand.
    later: plans of the light of the exposures after the first, of a frame of several whose light differs.
    fitted: what a time budget chose; None: the shot has none.
    """

    optics: OpticsPlan
    sensor: SensorPlan
    exposed: ExposedLight
    truth: tuple[TruthPart, ...]
    steps: tuple[Step, ...]
    passes: tuple[Pass, ...]
    tiles: "TilePlan | None" = None
    strips: tuple[ReadoutGeometry, ...] = ()
    key: LightKey | None = None
    metered: Metered | None = None
    later: "tuple[Plan, ...]" = ()
    fitted: TimeFit | None = None

    def settle(self, shot: Shot) -> Shot:
        """Return the planned shot with all that was chosen for it: a manual exposure, where it was metered, and a tolerance."""
        shot = shot if self.metered is None else self.metered.settle(shot)
        return shot if self.fitted is None else self.fitted.settle(shot)

    def by_strip(self) -> list[Self]:
        """Return the plan of each strip, which is not measured yet; a frame of one strip has this plan."""
        if len(self.strips) <= 1:
            return [self]
        return [self._of_strip(readout) for readout in self.strips]

    def _of_strip(self, readout: ReadoutGeometry) -> Self:
        defocus = self.optics.defocus
        # Its own blur holds the methods of its tiles, so that they are freed with the strip.
        own = None if defocus is None else replace(defocus)
        optics = replace(self.optics, window=readout.computed, defocus=own)
        sensor = replace(self.sensor, readout=readout)
        later = tuple(one._of_strip(readout) for one in self.later)
        return replace(self, optics=optics, sensor=sensor, tiles=None, strips=(readout,), later=later)

    def in_one_color(self, plane: int) -> Self:
        """Return the plan of a sensor whose photosites all see this colour plane; the methods of the tiles are the same."""
        later = tuple(one.in_one_color(plane) for one in self.later)
        return replace(self, optics=self.optics.in_one_color(plane), later=later)

    def by_light(self) -> list[tuple[LightComponent, Self]]:
        """Return the plan of each component of the light whose image is a pass of its own, not measured yet.

        One component stands for all where all lines collect the same shares of them: their bands then add up in one image.
        """
        if not (self.exposed.is_split or self.optics.moves_by_component):
            return [(self.exposed.components[0], self)]
        count = self.optics.weights.shape[0]
        bands = [(one, self.exposed.bands(one, count)) for one in self.exposed.components]
        return [(one, replace(self, optics=self.optics.lit_by(own, one.is_flash), tiles=None)) for one, own in bands]

    @property
    def notes(self) -> list[str]:
        """What was assumed while the scene's files and those of what moves in it were read, each once."""
        motion = self.optics.motion
        vectors = None if motion is None else motion.vectors
        return list(dict.fromkeys((*self.optics.scene.notes, *(() if vectors is None else vectors.notes))))

    def warnings(self) -> list[str]:
        """Return a sentence for each promise that the plan may not keep."""
        missed = self.exposed.missed_flash()
        in_time = [] if self.fitted is None else self.fitted.warnings()
        return [*([] if missed is None else [missed]), *self.error_budget.warnings(), *in_time]

    @property
    def error_budget(self) -> ErrorBudget:
        """Predicted errors of all approximations of the light; of a frame of several exposures, of the one with the largest."""
        budgets = [error_budget(self.optics), *(one.error_budget for one in self.later)]
        return max(budgets, key=lambda one: one.predicted_sigma)

    def memory_bytes(self) -> int:
        """Estimate the most memory that a shot needs at once, on device and host together [byte].

        A CPU device shares the host's memory.
        """
        held = peak = 0
        for one in self.passes:
            held += one.memory_bytes
            peak = max(peak, held + one.scratch_bytes)
        return peak

    def cost_ms(self) -> float:
        """Predicted time of all passes on the reference machine of `simulator.pipeline.passes` [ms]."""
        return sum(one.cost_ms for one in self.passes)


def plan(shot: Shot, strip_px: int = STRIP_PX, cache: LightCache | None = None) -> Plan:
    """Plan a shot; reads its scene. Raises PhotositeError for what cannot be simulated.

    strip_px: photosites that are computed at once, at most; larger frames are computed in strips, with the same bits.
    cache: holds plans of the optics, whose light may be shared; None: nothing is held.
    """
    rule = "needs a device: plan the shot with plan_in_time of simulator.pipeline.time_budget, or give tolerance instead"
    require(shot.time_budget_s is None, "time_budget", f"{shot.time_budget_s} s", rule)
    rule = "is not known where charge blooms; leave variance out of truth, or camera.blooming out"
    require(shot.camera.blooming is None or "variance" not in shot.truth, "truth", "variance", rule)
    metered = meter_shot(shot)
    shot = shot if metered is None else metered.settle(shot)
    if metered is not None and shot.interval_s is not None:
        check_interval(shot.exposure, shot.camera, shot.interval_s)
    sensor = plan_readings(plan_sensor_of(shot), shot.exposure.iso)
    exposed = plan_exposure(shot.exposure, shot.camera, shot.lens.f_number, shot.lens.diffraction_f_number)
    optics, key = _plan_light(shot, sensor, exposed, cache)
    steps = steps_of(optics, sensor, shot.lens, exposed)
    strips = tuple(split_readout(shot.camera, strip_px, BAND_ROWS))
    planned = Plan(optics, sensor, exposed, shot.truth, steps, (), strips=strips, key=key, metered=metered)
    if isinstance(sensor, HdrSensorPlan):
        planned = replace(planned, later=_plan_later(shot, planned, cache))
    return replace(planned, passes=_passes_of(planned))


def plan_sensor_of(shot: Shot) -> SensorPlan:
    """Return the plan of a shot's sensor alone, which needs no scene."""
    return plan_sensor(shot.camera, light_stages(shot), shot.exposure.iso, shot.exposure.time_s)


def _plan_later(shot: Shot, first: Plan, cache: LightCache | None) -> tuple[Plan, ...]:
    """Plan the light of the exposures after the first; none where it is the same, at rest and in steady light."""
    found = []
    for exposure in later_exposures(shot.exposure, shot.camera):
        part = replace(shot, exposure=exposure)
        exposed = plan_exposure(exposure, shot.camera, shot.lens.f_number, shot.lens.diffraction_f_number)
        sensor = plan_sensor_of(part)
        optics, key = _plan_light(part, sensor, exposed, cache)
        found.append(Plan(optics, sensor, exposed, (), (), (), key=key))
    is_same = shot.motion is None and all(one.exposed.is_plain for one in (first, *found))
    return () if is_same else tuple(found)


def _plan_light(
    shot: Shot, sensor: SensorPlan, exposed: ExposedLight, cache: LightCache | None
) -> tuple[OpticsPlan, LightKey | None]:
    """Return the plan of the optics, and the key of its light where a cache holds it."""
    scene = load_seen(shot)
    timing = None
    if shot.motion is not None:
        from simulator.optics.geometry.motion_plan import Timing  # nothing moves in most shots

        timing = Timing(shot.motion, exposed.components)
        shot.motion.check_layers([float(np.min(layer.depth_m)) for layer in scene.layers])
        shot.motion.check_span(*shot.motion.needed_span(shot.exposure.start_s, exposed.openings, "flow" in shot.truth))
    tangent = 0.0 if exposed.flash is None else tangent_per_pixel(scene, shot.lens, shot.camera)

    def make() -> OpticsPlan:
        lit = exposed.expose(scene, tangent)

        def of(tolerance: float, is_sharp: bool = False, beside_sigma: float = 0.0) -> OpticsPlan:
            return plan_optics(
                lit, shot.lens, sensor, tolerance, timing, whole=shot.tolerance, is_sharp=is_sharp, beside_sigma=beside_sigma
            )

        return with_wide_zones(with_few_instants(allot(shot.tolerance, of, make_sharp=partial(of, is_sharp=True)), of))

    key = None if cache is None or cache.memory_bytes == 0 else light_key(shot, sensor, scene, exposed.key(tangent), timing)
    if cache is None or key is None:
        return make(), None
    return cache.get(key, make), key


def measure(planned: Plan, device: Device) -> Plan:
    """Return the plan with the method of each tile, chosen by the blur radii that a device finds around it.

    A frame of several strips is measured strip by strip, when each is computed.
    """
    if planned.optics.defocus is None or planned.optics.motion is not None or len(planned.strips) > 1:
        return planned
    from simulator.optics.passes.tile_plan import plan_tiles  # not needed for a sharp frame

    measured = replace(planned, tiles=plan_tiles(planned.optics, device))
    return replace(measured, passes=_passes_of(measured))


def _passes_of(planned: Plan) -> tuple[Pass, ...]:
    """Return the passes of a plan; of several strips, those of the whole frame with the memory of the largest strip."""
    later = len(planned.later)
    passes = passes_of(planned.optics, planned.sensor, planned.exposed, planned.truth, planned.tiles, planned.strips, later)
    if len(planned.strips) <= 1:
        return passes
    largest = max(planned.by_strip(), key=lambda strip: strip.optics.window.height)
    in_one = passes_of(largest.optics, largest.sensor, largest.exposed, largest.truth, later=later)
    parts = {one.name: one for one in in_one}

    def of_strip(one: Pass) -> Pass:
        part = parts.get(one.name, one)
        return replace(one, memory_bytes=part.memory_bytes, scratch_bytes=part.scratch_bytes)

    return tuple(map(of_strip, passes))


def light_stages(shot: Shot) -> tuple[Stage, Stage]:
    """Return the stages of the fused kernel from the radiance behind the lens to the photoelectrons."""
    camera = shot.camera
    irradiance = plan_irradiance(shot.lens, camera.pixel_pitch_um, camera.width_px, camera.height_px)
    return irradiance, Integration(shot.exposure.time_s, camera.pixel_pitch_um**2 * camera.fill_factor)
