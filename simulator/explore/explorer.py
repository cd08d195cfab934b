"""Answers to the page: a quick picture, a window at 1:1 with its numbers, the whole frame, and files to take away."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.explore.figures import Data, figures_of
from simulator.explore.opened_shot import OpenedShot, Panel
from simulator.explore.pace import Pace
from simulator.explore.pictures import Histogram, histogram, paint
from simulator.explore.pixel import explain_pixel, window_at
from simulator.explore.preview import WIDTH_PX, preview_of
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import plan, plan_sensor_of
from simulator.pipeline.scene_loading import load_scene
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.pipeline.time_budget import plan_in_time
from simulator.raw.dng.writer import dng_bytes

DETAIL_PX = (384, 256)  # width and height of the window that is shown at 1:1
BRIGHTER = 1.25  # than the brightest photosite of a place: the end of its histogram
Want = Literal["controls", "preview", "detail", "frame"]


class SupersededError(Exception):
    """A newer request has come, so that nobody waits for the answer."""


@dataclass(frozen=True)
class Request:
    """What the page asks for.

    want: "controls": the controls at these values; "preview": a quick picture of the whole frame; "detail": the window at 1:1
        around a place; "frame": the whole frame.
    shot: name of an opened shot. settings: values of its controls. at: the place, as shares 0 to 1 of width and height.
    is_moving: whether a control is being moved, so that a preview may be coarser where it would be late.
    """

    want: Want
    shot: str
    settings: Mapping[str, str]
    at: tuple[float, float] = (0.5, 0.5)
    is_moving: bool = False


@dataclass(frozen=True)
class Answer:
    """pixels: (height, width, 4) uint8 RGBA; of controls none. data: numbers beside it, plain data."""

    pixels: np.ndarray
    data: Data


class Explorer:
    """The shots that a page may open, and the OpenCL device that takes them.

    shots: by name. device: part of an OpenCL device's label, or None for the default.
    One thread at a time may ask it.
    """

    def __init__(self, shots: Sequence[OpenedShot], device: str | None = None):
        self._shots = {shot.path: shot for shot in shots}
        self._device, self._cache, self._pace = device, LightCache(), Pace()

    def names(self) -> list[str]:
        """Return the names of the shots that can be opened, the first opened first."""
        return list(self._shots)

    def opened(self, name: str) -> OpenedShot:
        """Return a shot that can be opened. Raises PhotositeError for any other name."""
        if name not in self._shots:
            raise PhotositeError(f"cannot be opened from the page; it has {', '.join(self._shots)}", key="shot", value=name)
        return self._shots[name]

    def answer(self, request: Request, is_stale: Callable[[], bool] = lambda: False) -> Answer:
        """Return what the page asked for.

        is_stale: asked while the work is done. Raises SupersededError once it is true, PhotositeError for what a shot file
        could not hold either.
        """
        opened = self.opened(request.shot)
        if request.want == "controls":
            return Answer(np.zeros((0, 0, 4), np.uint8), _plain_panel(opened.panel(request.settings)))
        shot = opened.shot(request.settings)
        match request.want:
            case "preview":
                return self._preview(shot, request.is_moving, is_stale)
            case "detail":
                return self._detail(shot, request.at, is_stale)
            case "frame":
                shot = replace(self._in_time(shot), truth=())
                return Answer(paint(self._take(shot, is_stale)), {"warnings": plan(shot, cache=self._cache).warnings()})

    def dng(self, request: Request, is_stale: Callable[[], bool] = lambda: False) -> bytes:
        """Return the frame of a view as a DNG file. is_stale: as of `answer`."""
        return dng_bytes(self._take(self.opened(request.shot).shot(request.settings), is_stale))

    def _preview(self, shot: Shot, is_moving: bool, is_stale: Callable[[], bool]) -> Answer:
        begun_s, columns_px = time.perf_counter(), self._pace.columns_px(is_moving)
        quick = preview_of(shot, load_scene(shot.scene), columns_px)
        raw = self._take(quick.shot, is_stale)
        planned, pixels = plan(quick.shot, cache=self._cache), paint(raw)
        self._pace.note(columns_px, time.perf_counter() - begun_s, is_moving)
        size = {"side": quick.side, "is_coarse": columns_px < WIDTH_PX and quick.side > 1, "cfa": raw.cfa}
        chosen = planned.settle(quick.shot)  # by a meter
        shot = replace(shot, exposure=chosen.exposure, lens=chosen.lens)
        return Answer(pixels, figures_of(shot, planned, plan_sensor_of(shot)) | size)

    def _detail(self, shot: Shot, at: tuple[float, float], is_stale: Callable[[], bool]) -> Answer:
        part = window_at(self._in_time(shot), *at, *DETAIL_PX)
        raw = self._take(part, is_stale)
        again = self._take(replace(part, seeds=replace(part.seeds, frame=part.seeds.frame + 1)), is_stale)
        planned, frame, window = plan(part, cache=self._cache), shot.camera.frame, part.camera.frame
        x = _place(at[0], (frame.x, frame.width), (window.x, window.width), raw.dn.shape[1])
        y = _place(at[1], (frame.y, frame.height), (window.y, window.height), raw.dn.shape[0])
        pixel = explain_pixel(planned.settle(part), planned, raw, again, x, y)
        brightest_e = max(BRIGHTER * float(np.max(raw.mean_electrons)), 1.0)
        counts = histogram(raw, planned.sensor.gain_dn_per_e(), min(brightest_e, planned.sensor.electrons_at_white()))
        place = {"x": window.x - frame.x, "y": window.y - frame.y, "width": window.width, "height": window.height}
        return Answer(paint(raw), {"pixel": pixel, "histogram": _plain(counts), "window": place})

    def _in_time(self, shot: Shot) -> Shot:
        """Return the shot with the tolerance that its time budget allows for the whole frame; one without a budget as it is."""
        if shot.time_budget_s is None:
            return shot
        device = open_device(self._device)
        return replace(plan_in_time(shot, device, cache=self._cache).settle(shot), time_budget_s=None)

    def _take(self, shot: Shot, is_stale: Callable[[], bool]) -> Any:
        def watch(what: str, share: float) -> None:
            if is_stale():
                raise SupersededError

        return simulate(shot, device=self._device, progress=watch, cache=self._cache)


def _place(share: float, frame: tuple[int, int], window: tuple[int, int], pixels: int) -> int:
    """Return the row or column of a window's picture at this share of the frame. frame, window: first photosite and length."""
    inside = (frame[0] + share * frame[1] - window[0]) / window[1]
    return min(max(int(inside * pixels), 0), pixels - 1)


def _plain(counts: Histogram) -> Data:
    return {"edges_e": counts.edges_e.tolist(), "counts": {name: one.tolist() for name, one in counts.counts.items()}}


def _plain_panel(panel: Panel) -> Data:
    controls = [
        asdict(control)
        | {"choices": [{"text": one.text, "label": one.label, "number": _number(one.number)} for one in control.choices]}
        for control in panel.controls
    ]
    return {"controls": controls, "settings": dict(panel.settings), "notes": list(panel.notes)}


def _number(value: float) -> float | None:
    return None if value == float("inf") else float(value)
