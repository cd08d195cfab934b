"""EMVA 1288 validation of a simulated camera: simulate the frames, measure them, check them, write JSON."""

import json
import math
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from simulator.atomic_files import atomic_write
from simulator.measurement.emva1288.checks import check_emva
from simulator.measurement.emva1288.files_to_planes import EmvaCamera, measure_emva
from simulator.measurement.emva1288.frames import EXPOSURE_TIME_S, EmvaBench, take_emva_frames
from simulator.measurement.report.tolerance_check import ToleranceCheck
from simulator.progress import Progress, silent
from simulator.raw.software import software
from simulator.sensor.camera.camera import Camera


@dataclass(frozen=True)
class EmvaReport:
    """Results of one camera at one ISO. frames: number simulated. window: width and height [px]."""

    camera: str
    iso: int
    frames: int
    window: tuple[int, int]
    found: EmvaCamera
    checks: tuple[ToleranceCheck, ...]

    @property
    def passed(self) -> bool:
        """Whether every tolerance check passed."""
        return all(check.passed for check in self.checks)

    def summary(self) -> list[tuple[str, str, dict[str, float]]]:
        """Rows of EMVA 1288's summary: quantity, unit, and the number of each plane."""
        return summary_of(self.found)


def summary_of(found: EmvaCamera) -> list[tuple[str, str, dict[str, float]]]:
    """Return the rows of EMVA 1288's summary: quantity, unit, and the number of each plane.

    Rows in photons are left out where the light is not known in photons.
    """
    planes = found.planes
    lines = {
        ("wavelength", "nm"): found.wavelengths_nm,
        ("quantum efficiency", "%"): {name: 100.0 * one.quantum_efficiency.value for name, one in planes.items()},
        ("gain K", "DN/e-"): {name: one.gain.value for name, one in planes.items()},
        ("1 / K", "e-/DN"): {name: 1.0 / one.gain.value for name, one in planes.items()},
        ("temporal dark noise sigma_d", "e-"): {name: one.read_noise.value for name, one in planes.items()},
        ("temporal dark noise sigma_y.dark", "DN"): {name: math.sqrt(p.dark.variance_dn2) for name, p in planes.items()},
        ("absolute sensitivity threshold", "photons"): {name: one.threshold_photons for name, one in planes.items()},
        ("saturation capacity", "e-"): {name: one.saturation_e for name, one in planes.items()},
        ("saturation", "photons"): {name: one.saturation_photons for name, one in planes.items()},
        ("SNR_max", ""): {name: one.snr_max for name, one in planes.items()},
        ("SNR_max", "dB"): {name: 20.0 * math.log10(one.snr_max) for name, one in planes.items()},
        ("dynamic range", "stops"): {name: math.log2(one.dynamic_range) for name, one in planes.items()},
        ("dynamic range", "dB"): {name: 20.0 * math.log10(one.dynamic_range) for name, one in planes.items()},
        ("linearity error LE_min", "%"): {name: 100.0 * one.linearity.least for name, one in planes.items()},
        ("linearity error LE_max", "%"): {name: 100.0 * one.linearity.greatest for name, one in planes.items()},
    }
    for label, unit, scale, kind in (("DSNU", "e-", 1.0, "dsnu"), ("PRNU", "%", 100.0, "prnu")):
        for part in ("total", "row", "column", "pixel"):
            of = {name: scale * getattr(getattr(one, kind), part) for name, one in planes.items()}
            lines[label + ("" if part == "total" else f" of {part}s"), unit] = of
    for index, kind in enumerate(("mean", "variance")):
        if current := found.dark_current_e_per_s:
            lines[f"dark current from the {kind}", "e-/s"] = {name: one[index].value for name, one in current.items()}
    of_photons = ("wavelength", "quantum efficiency", "absolute sensitivity threshold", "saturation")
    kept = {key: values for key, values in lines.items() if found.counts_photons or key[0] not in of_photons}
    return [(quantity, unit, values) for (quantity, unit), values in kept.items()]


def validate_emva(
    camera: Camera, iso: int, folder: Path, *, device: str | None = None, seed: int = 1, progress: Progress = silent
) -> EmvaReport:
    """Simulate EMVA 1288's frames as DNG files in `folder`, and measure the camera from these files alone.

    seed: of the first frame; the next ones count up from it. progress: counts frames.
    Raises PhotositeError for an ISO the camera does not have.
    """
    bench = EmvaBench(camera, iso, folder, device)
    files = take_emva_frames(bench, seed, progress)
    found = measure_emva(files)
    frame = bench.white.camera.frame
    checks = tuple(check_emva(found, bench))
    return EmvaReport(f"{camera.make} {camera.model}", iso, bench.frames(), (frame.width, frame.height), found, checks)


def write_emva_json(report: EmvaReport, path: str | os.PathLike) -> None:
    """Write numbers, intervals, curves and tolerance checks as JSON. Raises PhotositeError when it cannot be written."""
    planes = {name: {**asdict(plane), "snr_max": plane.snr_max} for name, plane in report.found.planes.items()}
    content = {
        "software": software(),
        "standard": "EMVA 1288 Release 4.0 Linear",
        "camera": report.camera,
        "iso": report.iso,
        "exposure_time_s": EXPOSURE_TIME_S,
        "saturation_exposure_lx_s": report.found.saturation_exposure_lx_s,
        "saturation_speed": report.found.saturation_speed,
        "passed": report.passed,
        "summary": [{"quantity": name, "unit": unit, "planes": values} for name, unit, values in report.summary()],
        "planes": planes,
        "gates": [check.as_dict() for check in report.checks],
    }
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2, default=lambda array: array.tolist()) + "\n", encoding="utf-8")
