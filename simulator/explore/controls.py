"""The controls of the page: for each its key in a shot file, and its choices as YAML writes them."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.stops import F_MARKS, TIME_MARKS_S
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot

FOCAL_LENGTHS_MM = (14, 17, 20, 24, 28, 35, 50, 70, 85, 100, 135, 200, 300, 400)
FOCUS_DISTANCES_M = (0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 15, 20, 30, 50, 100, math.inf)
PAN_SPEEDS_DEG_PER_S = (0, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
# Widths of sensors [mm], of Wikipedia's table "Image sensor format".
SENSOR_WIDTHS_MM = {"1/2.3 inch": 6.17, "1 inch": 13.2, "Four Thirds": 17.3, "APS-C (Canon)": 22.3, "full frame": 36.0}
SAME = 1e-3  # relative difference below which a choice is the value that is set


@dataclass(frozen=True)
class Choice:
    """One position of a control.

    text: the value as YAML writes it. label: as the page shows it. number: what orders the positions.
    """

    text: str
    label: str
    number: float


@dataclass(frozen=True)
class Control:
    """A slider, or a list to choose from.

    key: dotted key of the shot file. choices: its positions, in order. index: the one that is set. own: the one that holds when
    nothing is set, of the opened file or the chosen camera; -1: there is none.
    """

    key: str
    name: str
    choices: tuple[Choice, ...]
    index: int
    own: int
    kind: Literal["slider", "list"] = "slider"


def controls_of(shot: Shot) -> tuple[Control, ...]:
    """Return the sliders that a shot has, each at the shot's own value, which is one of its choices.

    The format of the sensor is set by the pitch of its photosites, whose number stays.
    """
    return (*_lens_controls(shot), *_exposure_controls(shot), _format_control(shot), *_motion_controls(shot))


def with_own(control: Control, opened: Control | None) -> Control:
    """Return a control of a changed shot with the value that the opened shot has among its choices, as its own.

    opened: the control at that value; None: the opened shot's value cannot be had.
    """
    if opened is None:
        return replace(control, own=-1)
    own, chosen = opened.choices[opened.index], control.choices[control.index]
    known = next((one for one in control.choices if math.isclose(one.number, own.number, rel_tol=SAME)), None)
    choices = control.choices if known else tuple(sorted((*control.choices, own), key=lambda one: one.number))
    return replace(control, choices=choices, index=choices.index(chosen), own=choices.index(known or own))


def list_control(key: str, name: str, labels: dict[str, str], chosen: str) -> Control:
    """Return a list to choose from. labels: of each value. chosen: the value that is set; the first is the opened file's."""
    choices = tuple(Choice(text, label, float(place)) for place, (text, label) in enumerate(labels.items()))
    return Control(key, name, choices, list(labels).index(chosen), 0, "list")


def _lens_controls(shot: Shot) -> list[Control]:
    lens = shot.lens
    if not isinstance(lens, ThinLens):
        return []
    focal_lengths = [_with_unit(length, "mm") for length in FOCAL_LENGTHS_MM]
    marks = [_f_number(mark) for mark in F_MARKS if 1 <= mark <= 32]
    distances = [_distance(distance) for distance in FOCUS_DISTANCES_M if distance > 1.1e-3 * lens.focal_length_mm]
    return [
        _control("lens.focal_length", "Focal length", focal_lengths, _with_unit(lens.focal_length_mm, "mm")),
        _control("lens.f_number", "Aperture", marks, _f_number(lens.f_number)),
        _control("lens.focus_distance", "Focus", distances, _distance(lens.focus_distance_m)),
    ]


def _exposure_controls(shot: Shot) -> list[Control]:
    exposure, isos = shot.exposure, [_iso(iso) for iso in shot.camera.isos]
    times = [_time(time_s) for time_s in TIME_MARKS_S] if exposure.mode == "manual" else []
    shutter = [_control("exposure.time", "Shutter", times, _time(exposure.time_s))] if times else []
    return [*shutter, _control("exposure.iso", "ISO", isos, _iso(exposure.iso))]


def _format_control(shot: Shot) -> Control:
    pitch_um, width_mm = shot.camera.pixel_pitch_um, shot.camera.sensor_mm[0]
    formats = [
        Choice(f"{width / width_mm * pitch_um:.6g} um", f"{name}, {width:g} mm", width)
        for name, width in SENSOR_WIDTHS_MM.items()
    ]
    own = Choice(f"{pitch_um:.6g} um", f"{width_mm:.3g} mm wide", width_mm)
    return _control("camera.pixel_pitch", "Sensor", formats, own)


def _motion_controls(shot: Shot) -> list[Control]:
    path = None if shot.motion is None else shot.motion.camera
    if path is not None and not isinstance(path, SteadyMotion):
        return []  # a path that the page cannot show
    speeds = [_with_unit(speed, "deg/s") for speed in PAN_SPEEDS_DEG_PER_S]
    pan_deg_per_s = 0.0 if path is None else path.pan_deg_per_s
    return [_control("motion.camera.pan", "Camera pans", speeds, _with_unit(pan_deg_per_s, "deg/s"))]


def _control(key: str, name: str, choices: Iterable[Choice], own: Choice) -> Control:
    """Return a control with the shot's own value among its choices, in place of one that is the same."""
    others = [choice for choice in choices if not math.isclose(choice.number, own.number, rel_tol=SAME)]
    ordered = tuple(sorted([*others, own], key=lambda choice: choice.number))
    return Control(key, name, ordered, ordered.index(own), ordered.index(own))


def _with_unit(value: float, unit: str) -> Choice:
    return Choice(f"{value:.6g} {unit}", f"{value:.4g} {unit}", value)


def _f_number(f_number: float) -> Choice:
    return Choice(f"f/{f_number:.6g}", f"f/{f_number:.3g}", f_number)


def _iso(iso: float) -> Choice:
    return Choice(f"{iso:.0f}", f"{iso:.0f}", iso)


def _distance(distance_m: float) -> Choice:
    return Choice(
        *(("inf m", "infinity") if math.isinf(distance_m) else (f"{distance_m:.6g} m", f"{distance_m:.3g} m")), distance_m
    )


def _time(time_s: float) -> Choice:
    reciprocal = 1.0 / time_s
    is_fraction = time_s < 0.3 and math.isclose(reciprocal, round(reciprocal), rel_tol=1e-9)
    text = f"1/{reciprocal:.0f} s" if is_fraction else f"{time_s:.6g} s"
    return Choice(text, text, time_s)
