"""`photosite lens`: what a lens amounts to on a sensor, as a table, JSON, CSV or picture."""

import csv
import json
import math
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from simulator.command_line.lens_numbers import LensNumber, exposure_value_numbers, list_numbers, metres, write_number
from simulator.command_line.output_file import check_output
from simulator.command_line.screen import console, show_files
from simulator.config import distance_m, length_um, lens_option, load_camera, load_shot, locate_errors, time_s
from simulator.config.source_files import camera_files, shot_files
from simulator.errors import PhotositeError, require
from simulator.measurement.report.figures import FORMATS
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.sensor_formats import SENSOR_FORMATS
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

LAYOUTS = ("table", "json", "csv")
_LENS_OPTIONS = ("focal_length", "f_number", "focus_distance", "circle_of_confusion")


@dataclass(frozen=True)
class Choice:
    """The options as they were written; None where one was left out."""

    focal_length: str | None
    f_number: str | None
    focus_distance: str | None
    circle_of_confusion: str | None
    camera: str | None
    sensor: str | None
    at: list[str]
    time: str | None
    iso: int | None

    def lens_options(self) -> dict[str, str]:
        """Return the options that are keys of a shot's lens, with their dashes."""
        given = {f"--{name.replace('_', '-')}": getattr(self, name) for name in _LENS_OPTIONS}
        return {option: value for option, value in given.items() if value is not None}

    def settings_of_shot(self, settings: list[str]) -> list[str]:
        """Return the settings of a shot with those of the options behind them, as `--set` takes them."""
        keys = {"camera": self.camera, "exposure.time": self.time, "exposure.iso": self.iso}
        changes = [f"{key}={value}" for key, value in keys.items() if value is not None]
        changes += [f"lens.{option[2:].replace('-', '_')}={value}" for option, value in self.lens_options().items()]
        return [*settings, *changes]


@dataclass(frozen=True)
class LensOnSensor:
    """What is shown.

    name: for people. lens: the lens. sensor_mm: width and height. pitch_um: None where the sensor has no stated photosites.
    time_s: None where no exposure is known. iso: of the EV. distances_m: of the points whose blur circles are shown.
    """

    name: str
    lens: Lens
    sensor_mm: tuple[float, float]
    pitch_um: float | None
    time_s: float | None
    iso: int
    distances_m: list[float]

    def numbers(self) -> list[LensNumber]:
        """Return all numbers, those of the exposure last."""
        found = list_numbers(self.lens, self.sensor_mm, self.distances_m)
        if self.time_s is None or not math.isfinite(self.lens.f_number):
            return found
        return [*found, *exposure_value_numbers(self.lens.f_number, self.time_s, self.iso)]


def show_lens(shot: str | None, choice: Choice, settings: list[str], layout: str, plot: Path | None) -> None:
    """Print the numbers, and draw them into `plot`. Raises PhotositeError."""
    require(layout in LAYOUTS, "--format", layout, f"give one of {', '.join(LAYOUTS)}")
    if plot is not None:
        check_output(plot, "--plot", FORMATS, lambda: _inputs(shot, choice, settings))
    shown = _choose_by_options(choice, settings) if shot is None else _choose_of_shot(shot, choice, settings)
    numbers = shown.numbers()
    if plot is not None:
        _draw(shown, plot)
    if layout == "json":
        print(json.dumps({"name": shown.name, "numbers": [_plain(one) for one in numbers]}, indent=2))
    elif layout == "csv":
        _print_csv(numbers)
    else:
        console().print(_make_table(shown, numbers))
    show_files(plot, is_data=layout != "table")


def _inputs(shot: str | None, choice: Choice, settings: list[str]) -> Iterator[Path]:
    """Yield the files that the shot, or the camera without one, is read from."""
    if shot is not None:
        yield from shot_files(shot, choice.settings_of_shot(settings))
    elif choice.camera is not None:
        yield from camera_files(choice.camera)


def _choose_by_options(choice: Choice, settings: list[str]) -> LensOnSensor:
    """Return the lens of options alone. Raises PhotositeError."""
    of_camera = [text for text in settings if text.startswith("camera.")]
    of_lens = [text for text in settings if text not in of_camera]
    options = choice.lens_options()
    if not of_lens:
        missing = [option for option in ("--focal-length", "--f-number") if option not in options]
        rule = "is needed without a shot; write for example --focal-length 50mm --f-number f/1.8, or name a shot"
        if missing:
            raise PhotositeError(rule, key=" and ".join(missing))
    lens = lens_option(options, of_lens)
    exposure_s = None if choice.time is None else time_s(choice.time, "--time")
    sensor_mm, on = (36.0, 24.0), "36 mm x 24 mm"
    pitch_um: float | None = None
    if choice.camera is not None:
        camera = load_camera(choice.camera, of_camera)
        sensor_mm, pitch_um, on = camera.sensor_mm, camera.pixel_pitch_um, f"{camera.make} {camera.model}"
    if choice.sensor is not None:
        (sensor_mm, on), pitch_um = _sensor(choice.sensor), None
    return _shown(choice, lens, sensor_mm, pitch_um, on, exposure_s, 100 if choice.iso is None else choice.iso)


def _choose_of_shot(path: str, choice: Choice, settings: list[str]) -> LensOnSensor:
    """Return the lens of a shot with the options laid over it. Raises PhotositeError."""
    texts = choice.settings_of_shot(settings)
    shot = load_shot(path, texts)
    with locate_errors(path, texts):
        shot = _settle(shot)
    camera = shot.camera
    sensor_mm, on = camera.sensor_mm, f"{shot.name}, {camera.make} {camera.model}"
    pitch_um: float | None = camera.pixel_pitch_um
    if choice.sensor is not None:
        (sensor_mm, on), pitch_um = _sensor(choice.sensor), None
    return _shown(choice, shot.lens, sensor_mm, pitch_um, on, shot.exposure.time_s, shot.exposure.iso)


def _settle(shot: Shot) -> Shot:
    """Return the shot with the settings that the camera chooses."""
    return plan(shot).settle(shot) if shot.exposure.is_metered else shot


def _shown(
    choice: Choice,
    lens: Lens,
    sensor_mm: tuple[float, float],
    pitch_um: float | None,
    on: str,
    exposure_s: float | None,
    iso: int,
) -> LensOnSensor:
    good = exposure_s is None or 0 < exposure_s < math.inf
    require(good, "--time", choice.time, "the shutter must open and close; give a time above 0 s, such as 1/125s")
    distances_m = [_subject_m(text) for text in choice.at] or _usual_distances_m(lens, math.hypot(*sensor_mm))
    return LensOnSensor(f"{_describe(lens)} on {on}", lens, sensor_mm, pitch_um, exposure_s, iso, distances_m)


def _describe(lens: Lens) -> str:
    if isinstance(lens, ThinLens):
        return f"{lens.focal_length_mm:g} mm f/{lens.f_number:g} focused at {metres(lens.focus_distance_m)}"
    return lens.model


def _subject_m(text: str) -> float:
    found = distance_m(text, "--at")
    require(found > 0, "--at", text, "give a distance above 0 m, such as 4m")
    return found


def _usual_distances_m(lens: Lens, diagonal_mm: float) -> list[float]:
    """Return distances on both sides of the plane in focus; of a lens focused at infinity, nearer ones."""
    if isinstance(lens, BareSensor):
        return []
    if not isinstance(lens, ThinLens):
        return [1.0, math.inf]
    if math.isinf(lens.focus_distance_m):
        hyperfocal_m = lens.hyperfocal_m(lens.circle_um(diagonal_mm))
        return [0.25 * hyperfocal_m, hyperfocal_m]
    return [0.5 * lens.focus_distance_m, 2.0 * lens.focus_distance_m, math.inf]


def _sensor(text: str) -> tuple[tuple[float, float], str]:
    """Return width and height [mm] of a format's name or of `36mm x 24mm`, and what to call it. Raises PhotositeError."""
    if text in SENSOR_FORMATS:
        known = SENSOR_FORMATS[text]
        return (known.width_mm, known.height_mm), f"{known.title}, {known.width_mm:g} mm x {known.height_mm:g} mm"
    sides = re.split(r"\s*[x×]\s*", text.strip())
    rule = f"give width x height, such as 23.6mm x 15.6mm, or one of {', '.join(SENSOR_FORMATS)}"
    require(len(sides) == 2, "--sensor", text, rule)
    width_mm, height_mm = (1e-3 * length_um(side, "--sensor") for side in sides)
    require(0 < width_mm < math.inf and 0 < height_mm < math.inf, "--sensor", text, rule)
    return (width_mm, height_mm), f"{width_mm:g} mm x {height_mm:g} mm"


def _plain(number: LensNumber) -> dict[str, str | float | None]:
    """Return a number as plain data; infinity, which JSON lacks, in words."""
    return {key: "infinity" if value == math.inf else value for key, value in asdict(number).items()}


def _print_csv(numbers: Sequence[LensNumber]) -> None:
    rows = [_plain(number) for number in numbers]
    writer = csv.DictWriter(sys.stdout, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)


def _make_table(shown: LensOnSensor, numbers: Sequence[LensNumber]) -> Table:
    table = Table(title=escape(shown.name))
    for column in ("quantity", "value", "formula"):
        table.add_column(column, justify="right" if column == "value" else "left")
    for number in numbers:
        table.add_row(escape(number.quantity), escape(write_number(number, shown.pitch_um)), escape(number.formula))
    return table


def _draw(shown: LensOnSensor, path: Path) -> None:
    from simulator.command_line.lens_figure import draw_lens
    from simulator.measurement.report.figures import write_figure

    lens = shown.lens
    rule = "only a lens that focuses has this picture; leave --plot out"
    if not isinstance(lens, ThinLens):
        raise PhotositeError(rule, key="--plot", value=path)
    write_figure(draw_lens(lens, shown.sensor_mm, shown.distances_m, shown.name), path)
