"""Noise validation of a simulated camera: simulate the frames, measure them, check them, write JSON."""

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from simulator.atomic_files import atomic_write
from simulator.measurement.noise_check.checks import check_iso, check_iso_table
from simulator.measurement.noise_check.frames import FramePlan, NoiseFiles, make_noise_bench, plan_frames, take_frames
from simulator.measurement.noise_check.measure import IsoNoise, measure_iso_noise
from simulator.measurement.report.tolerance_check import ToleranceCheck
from simulator.progress import Progress, Steps, silent
from simulator.raw.software import software
from simulator.sensor.camera.camera import Camera


@dataclass(frozen=True)
class NoiseReport:
    """Noise of a camera at several ISO settings, and its tolerance checks."""

    camera: str
    points: tuple[IsoNoise, ...]
    plans: tuple[FramePlan, ...]
    checks: tuple[ToleranceCheck, ...]

    @property
    def frames(self) -> int:
        """Number of frames simulated."""
        return sum(plan.frames for plan in self.plans)

    @property
    def passed(self) -> bool:
        """Whether every tolerance check passed."""
        return all(check.passed for check in self.checks)

    def of(self, quantity: str) -> list[ToleranceCheck]:
        """Tolerance checks of one quantity, in ascending order of ISO."""
        return [check for check in self.checks if check.quantity == quantity]


def validate_noise(
    camera: Camera,
    isos: Sequence[int],
    folder: Path,
    *,
    keep: bool = True,
    device: str | None = None,
    seed: int = 1,
    progress: Progress = silent,
) -> NoiseReport:
    """Simulate dark frames and flat pairs at each ISO as DNG files in `folder`, and measure the camera from them alone.

    keep: whether the files stay; else those of one ISO are removed before the next. seed: of the first frame; the next ones
    count up from it. progress: counts frames. Raises PhotositeError for an ISO the camera does not have.
    """
    benches = [make_noise_bench(camera, iso, folder, device) for iso in sorted(set(isos))]
    plans = [plan_frames(bench) for bench in benches]
    steps, points, checks = Steps(progress, sum(plan.frames for plan in plans)), [], []
    for bench, wanted in zip(benches, plans, strict=True):
        files = take_frames(bench, wanted, seed + steps.done, steps)
        points.append(measure_iso_noise(files))
        checks += check_iso(points[-1], bench, wanted)
        if not keep:
            _remove(files)
    settings = {point.iso: camera.iso_setting(point.iso) for point in points}
    gains = {iso: setting.gain_dn_per_e for iso, setting in settings.items()}
    read_e = {iso: setting.read_noise_dn / setting.gain_dn_per_e for iso, setting in settings.items()}
    checks += check_iso_table(points, gains, read_e)
    return NoiseReport(f"{camera.make} {camera.model}", tuple(points), tuple(plans), tuple(checks))


def _remove(files: NoiseFiles) -> None:
    for path in [*sum(files.dark + files.flat, ()), files.saturated]:
        path.unlink()


def write_noise_json(report: NoiseReport, path: str | os.PathLike) -> None:
    """Write the measured numbers and the tolerance checks as JSON. Raises PhotositeError when it cannot be written."""
    points = [
        {
            **asdict(point),
            "read_noise_dn": point.read_noise_dn,
            "read_noise_e": point.read_noise_e,
            "full_scale_e": point.full_scale_e,
            "dynamic_range_stops": point.dynamic_range_stops,
        }
        for point in report.points
    ]
    content = {
        "software": software(),
        "camera": report.camera,
        "passed": report.passed,
        "points": points,
        "frames": [asdict(plan) for plan in report.plans],
        "gates": [check.as_dict() for check in report.checks],
    }
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
