"""How long passes take on a device beside the reference machine of `simulator.pipeline.passes`: measured once, and kept.

Small shots are taken whose passes have predicted times. The ratios of measured and predicted time are rounded to powers of
the fourth root of 2 and kept in the user's cache, so that what is planned by them repeats.
"""

import hashlib
import json
import logging
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median

import numpy as np

from simulator.atomic_files import atomic_write
from simulator.device import Device
from simulator.errors import PhotositeError, reading
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.predicted_cost import COST_NS as BLUR_NS
from simulator.optics.geometry.motion_cost import COST_NS as MOTION_NS
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.psf.psf_cost import COST_NS as PSF_NS
from simulator.pipeline.execution import expose
from simulator.pipeline.passes import COST_NS, LAUNCH_MS
from simulator.pipeline.planned_pass import Pass
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.progress import Progress, silent
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import IsoSetting, SpectralResponse
from simulator.sensor.readout import read_out
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.stage import Stage

ROUNDED = 4  # steps of the ratio per factor of 2
SIDE_PX = 1024  # of the sharp frame; blurred ones have half of it
LEAST_MS = 0.5  # predicted time of a pass below which its launch counts, not its rate
REPEATS = 3  # runs after the first, which builds kernels; the fastest counts


@dataclass(frozen=True)
class DeviceRates:
    """Time on a device over that on the reference machine, by name of the pass; a pass that has none takes their median."""

    factors: dict[str, float] = field(default_factory=dict)

    def cost_ms(self, passes: Sequence[Pass]) -> float:
        """Return the predicted time of all passes on the device [ms]."""
        usual = median(self.factors.values()) if self.factors else 1.0
        return sum(one.cost_ms * self.factors.get(one.name, usual) for one in passes)


def rates_of(device: Device, progress: Progress = silent, side_px: int = SIDE_PX) -> DeviceRates:
    """Return the rates of a device from the user's cache; where there are none, they are measured, in some seconds, and kept.

    side_px: of the frames that are taken. A cache that cannot be written to is told in the log; the rates then hold for this
    call alone.
    """
    path, key = cache_path(), rates_key(device)
    kept = read_rates(path)
    if key in kept:
        return DeviceRates(kept[key])
    rates = measure_rates(device, progress, side_px)
    try:
        with atomic_write(path, durable=False) as temporary:
            temporary.write_text(
                json.dumps(read_rates(path) | {key: rates.factors}, indent=1, sort_keys=True), encoding="utf-8"
            )
    except PhotositeError as error:
        logging.getLogger(__name__).warning("the rates of the device are not kept: %s", error)
    return rates


def cache_path() -> Path:
    """Return the file that holds the rates of all devices of a user."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "photosite" / "device_rates.json"


def rates_key(device: Device) -> str:
    """Return what rates depend on: the device with its driver, and the predicted times that they refer to."""
    laws = hashlib.sha256(json.dumps([COST_NS, LAUNCH_MS, BLUR_NS, PSF_NS, MOTION_NS], sort_keys=True).encode()).hexdigest()[
        :12
    ]
    return f"{device.info.label}, {device.info.compute_units} units, laws {laws}"


def read_rates(path: Path) -> dict[str, dict[str, float]]:
    """Return the kept factors by key of the device; {} for a file that is not there, or that something else wrote."""
    try:
        with reading(path, "delete it; the device is then measured again"):
            kept = json.loads(path.read_text(encoding="utf-8"))
            return {
                str(key): {str(name): float(factor) for name, factor in factors.items() if 0.0 < float(factor) < math.inf}
                for key, factors in kept.items()
            }
    except PhotositeError:
        return {}


def measure_rates(device: Device, progress: Progress = silent, side_px: int = SIDE_PX) -> DeviceRates:
    """Take small shots on a device and return its rates. side_px: as of `rates_of`."""
    found: dict[str, float] = {}
    shots = calibration_shots(side_px)
    for number, shot in enumerate(shots):
        progress("measuring the device (once)", number / len(shots))
        planned = measure(plan(shot), device)
        times = [_times_ms(planned, shot, device) for _ in range(1 + REPEATS)][1:]
        for one in planned.passes:
            measured = min((run[one.name] for run in times if one.name in run), default=0.0)
            if measured > 0.0 and one.cost_ms >= LEAST_MS:
                found[one.name] = rounded(measured / one.cost_ms)
    return DeviceRates(found)


def rounded(ratio: float) -> float:
    """Return a ratio rounded to a power of 2^(1 / ROUNDED)."""
    return 2.0 ** (round(ROUNDED * math.log2(ratio)) / ROUNDED)


def _times_ms(planned: Plan, shot: Shot, device: Device) -> dict[str, float]:
    """Return the time of each pass of a planned shot [ms], whose tiles are measured."""
    timed = Stopwatch(running=True)
    light = expose(planned, device, timed=timed)
    with timed("sensor", device):
        read_out(device, planned.sensor, light, shot.seeds)
    return timed.times_ms


def calibration_shots(side_px: int) -> tuple[Shot, ...]:
    """Return a sharp shot of so many photosites across; smaller ones out of focus, with steps, with diffraction, and panned."""
    side = side_px // 2
    texture = np.random.default_rng(0).random((side_px, side_px, 1), dtype=np.float32)
    wavelengths_nm = np.arange(400.0, 701.0, 10.0)
    spectra, illuminant = np.full((1, len(wavelengths_nm)), 1e-3), np.ones(len(wavelengths_nm))

    def scene(planes: np.ndarray, depth_m: float | np.ndarray) -> Scene:
        return Scene(planes, spectra, wavelengths_nm, illuminant, depth_m=depth_m)

    small = texture[:side, :side]
    steps_m = np.where(np.arange(side) // 64 % 2, 1.6, 2.4) * np.ones((side, 1))
    wide, narrow = ThinLens(50.0, 2.0, 2.0), ThinLens(50.0, 16.0, 2.0)
    exposure, camera = Exposure(0.01), _camera(side)
    return (
        Shot(scene(texture, 2.0), narrow, exposure, _camera(side_px)),
        Shot(scene(small, 1.6), wide, exposure, camera),
        Shot(scene(small, steps_m.astype(np.float32)), wide, exposure, camera),
        Shot(scene(small, 2.0), replace(narrow, diffraction=True), exposure, camera),
        Shot(scene(small, 2.0), narrow, exposure, camera, motion=Motion(camera=SteadyMotion(pan_deg_per_s=20.0))),
    )


def _camera(side_px: int) -> Camera:
    """Return a camera of so many photosites across."""
    response = SpectralResponse(np.array([400.0, 550.0, 700.0]), np.eye(3)[:, ::-1])
    stages: dict[str, Stage] = {"photon_shot_noise": PhotonShotNoise()}
    table = {100: IsoSetting(1.0, 2.0)}
    return Camera("Photosite", "calibration", side_px, side_px, 5.0, "RGGB", 14, 512.0, response, table, stages=stages)
