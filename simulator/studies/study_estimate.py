"""What a study will take: points, time and disk, from the plans of its points."""

import time
from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path

from simulator.config.study_file import Study
from simulator.device import has_devices, open_device
from simulator.errors import PhotositeError
from simulator.pipeline.device_rates import DeviceRates, rates_of
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.light_reuse import ONCE
from simulator.pipeline.planned_pass import Pass
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.time_budget import plan_in_time
from simulator.progress import Progress, Steps, silent
from simulator.studies.study_folder import State
from simulator.studies.study_point import StudyTask, state_of_point

MOST_PLANNED = 200  # points of which a plan is made; more are taken to be like those
POINT_S = 0.05  # of a point beside its passes: its shot, its measurements and its files
PIXEL_S = 25e-9  # of a photosite: the preview, and a measurement of the whole frame
POINT_BYTES = 100_000  # of the files of a point that always stay, in whole blocks of a disk
CODE_BYTES, TRUTH_BYTES = 2, 8  # of a photosite in a DNG, and in its truth
MAP_BYTES = {"variance": 4, "depth": 2, "blur": 2, "flow": 4, "rgb": 12}  # of a photosite, some of them compressed


@dataclass(frozen=True)
class Estimate:
    """What a study takes. states: points by state. planned: points of which plans were made.

    seconds: of the points that are to be taken, in one process, kernels built: of planning as it took here, of the passes as
        their plans say [s]. bytes: that they add to the disk.
    lights: images of the light that are computed; other points share one of them.
    failures: name of a point -> why it cannot be taken, of those that were planned.
    """

    states: dict[State, int]
    planned: int
    seconds: float
    bytes: float
    lights: int
    failures: dict[str, PhotositeError]

    @property
    def to_take(self) -> int:
        """Points that a run takes."""
        return sum(count for state, count in self.states.items() if state != "done")


def estimate_study(
    study: Study,
    folder: Path,
    device: str | None = None,
    redo: bool = False,
    progress: Progress = silent,
    most_planned: int = MOST_PLANNED,
) -> Estimate:
    """Plan the points of a study, in the order in which they are taken; of many, some.

    folder: of the results; what is done there counts as such. redo: as of `run_study`. progress: called for each plan.
    most_planned: points of which plans are made, when there are more; up to five times as many to keep shared light together.
    Times are those of the device where there is one, which is measured once for each user, else of the reference machine.
    """
    task = StudyTask(study, folder.absolute(), device, LightCache())
    opened = open_device(device) if has_devices() else None
    rates = DeviceRates() if opened is None else rates_of(opened, progress)
    groups = study.by_light()
    order = [index for group in groups for index in group]
    step = max(1, -(-len(order) // most_planned))
    # Whole groups stay together, so that shared light counts as often as it will.
    chosen = order if step == 1 else [index for group in groups[::step] for index in group][: 5 * most_planned]
    steps, states, failures = Steps(progress, len(chosen)), Counter[State](), dict[str, PhotositeError]()
    seconds = size = 0.0
    lights = set[Hashable]()
    for index in chosen:
        point = study[index]
        try:
            state: State = "missing" if redo else state_of_point(task, point)
            if state != "done":
                shot, began = point.shot(), time.perf_counter()
                planned = plan(shot, cache=task.cache) if opened is None else plan_in_time(shot, opened, cache=task.cache)
                seconds += time.perf_counter() - began
                light = _light_of(planned)
                passes = [one for one in planned.passes if _is_own(one)] if light in lights else list(planned.passes)
                lights.add(index if light is None else light)
                pixels = planned.sensor.readout.rows * planned.sensor.readout.output.width
                seconds += 1e-3 * rates.cost_ms(passes) + POINT_S + PIXEL_S * pixels
                size += POINT_BYTES + pixels * _kept_bytes(study, shot.truth)
            states[state] += 1
        except PhotositeError as error:
            failures[point.name] = point.locate_error(error)
            states["failed"] += 1
        steps.add(point.name)
    share = len(study) / max(len(chosen), 1)
    counts: dict[State, int] = {state: round(share * count) for state, count in states.items()}
    return Estimate(counts, len(chosen), share * seconds, share * size, round(share * len(lights)), failures)


def _light_of(planned: Plan) -> Hashable:
    """Return what recognises the light of a plan; None: it is not shared."""
    if planned.key is None or len(planned.strips) > 1:
        return None
    return planned.key.of_mosaic(planned.optics, planned.sensor)


def _is_own(one: Pass) -> bool:
    """Return whether a pass runs for each point whose light is there."""
    return one.name in ONCE or one.name.startswith("truth: ")


def _kept_bytes(study: Study, truth: tuple[str, ...]) -> float:
    """Return the size on disk of what is kept of a frame, for each photosite [byte]."""
    of_truth = TRUTH_BYTES + sum(MAP_BYTES[part] for part in truth)
    return sum({"dng": CODE_BYTES, "truth": of_truth}[kind] for kind in study.keep)
