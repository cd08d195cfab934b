"""Validation of a shutter: simulate the frames, measure them, check them, write JSON."""

import json
import os
from dataclasses import dataclass
from pathlib import Path

from simulator.atomic_files import atomic_write
from simulator.exposure.shutter import AnyShutter, RollingShutter
from simulator.measurement.report.tolerance_check import ToleranceCheck
from simulator.measurement.shutter_check.case import Curve
from simulator.measurement.shutter_check.cases import cases_of
from simulator.measurement.shutter_check.frames import ShutterBench, dark_frames, take_shutter_frames
from simulator.progress import Progress, Steps, silent
from simulator.raw.software import software
from simulator.sensor.camera.camera import Camera


@dataclass(frozen=True)
class ShutterReport:
    """Results of one camera and shutter. shutter: in words. frames: number simulated. window: width and height [px]."""

    camera: str
    shutter: str
    iso: int
    frames: int
    window: tuple[int, int]
    checks: tuple[ToleranceCheck, ...]
    curves: tuple[Curve, ...]

    @property
    def passed(self) -> bool:
        """Whether every tolerance check passed."""
        return all(check.passed for check in self.checks)

    @property
    def title(self) -> str:
        """What was measured."""
        return f"Shutter of {self.camera} at ISO {self.iso}"

    def of(self, quantity: str) -> list[ToleranceCheck]:
        """Tolerance checks of one quantity."""
        return [check for check in self.checks if check.quantity == quantity]


def validate_shutter(
    camera: Camera,
    folder: Path,
    *,
    shutter: AnyShutter | None = None,
    iso: int | None = None,
    device: str | None = None,
    seed: int = 1,
    progress: Progress = silent,
) -> ShutterReport:
    """Simulate what shows a shutter as DNG files in `folder`, and measure it from these files alone.

    shutter: left out, a rolling one with the camera's read-out time. iso: left out, the lowest that was measured.
    seed: of the first frame; the next ones count up from it. progress: counts frames.
    Raises PhotositeError for a rolling shutter without a read-out time, and for an ISO the camera does not have.
    """
    bench = ShutterBench(camera, shutter or RollingShutter(), iso or camera.isos[0], folder, device)
    cases = cases_of(bench)
    frames = list({frame.name: frame for case in cases for frame in case.frames(bench)}.values())
    count = len(frames) + len(dark_frames(frames))
    files = take_shutter_frames(bench, frames, seed, Steps(progress, count))
    found = [case.measure(bench, files) for case in cases]
    checks, curves = (tuple(one for case in found for one in getattr(case, part)) for part in ("checks", "curves"))
    frame, name = bench.strip.frame, f"{camera.make} {camera.model}"
    return ShutterReport(name, bench.describe(), bench.iso, count, (frame.width, frame.height), checks, curves)


def write_shutter_json(report: ShutterReport, path: str | os.PathLike) -> None:
    """Write tolerance checks and curves as JSON. Raises PhotositeError when it cannot be written."""
    curves = [
        {
            "title": curve.title,
            "x_label": curve.x_label,
            "y_label": curve.y_label,
            "model_label": curve.model_label,
            "x": curve.x.tolist(),
            "measured": curve.measured.tolist(),
            "model": curve.model.tolist(),
        }
        for curve in report.curves
    ]
    content = {
        "software": software(),
        "camera": report.camera,
        "shutter": report.shutter,
        "iso": report.iso,
        "frames": report.frames,
        "window": report.window,
        "passed": report.passed,
        "gates": [check.as_dict() for check in report.checks],
        "curves": curves,
    }
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(content) + "\n", encoding="utf-8")
