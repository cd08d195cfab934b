"""Clean pictures from shots: a scene through lens and shutter onto the camera, without the sensor's noise."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np

from data_gen.sources.camera_view import stored_matrix
from data_gen.sources.source import CleanImage
from simulator.color.reproducible import nine_digits
from simulator.config import Sweep, load_shot, load_sweep
from simulator.device import Device, open_device
from simulator.errors import PhotositeError, require
from simulator.pipeline.execution import expose
from simulator.pipeline.frame_metadata import neutral_of
from simulator.pipeline.input_files import fingerprints
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import check_memory
from simulator.sensor.camera.camera_color import matrix_under_d65
from simulator.sensor.camera.cfa import BAYER
from simulator.sensor.readout import read_mean_electrons
from simulator.sensor.sensor_plan import SensorPlan


@dataclass(frozen=True)
class Shots:
    """A shot file, or every point of its sweep, as mean photoelectrons over those that saturate the camera at the shot's ISO.

    Planes of all three colours where photosites share nothing; with crosstalk or binning, which mix neighbours, the mosaic
    of the shot's own camera.
    shot: file as `photosite simulate` takes it.
    device: part of the label of the OpenCL device that computes them, None for the default.
    """

    shot: Annotated[Path, "shot file, with or without a sweep"]
    device: str | None = field(default=None, compare=False, repr=False)

    def names(self) -> tuple[str, ...]:
        """Return the names of the sweep's points, or that of the single shot. Raises PhotositeError for a wrong file."""
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        if self._sweep is None:
            return (load_shot(self.shot).name,)
        return tuple(point.name for point in self._sweep)

    @cached_property
    def _sweep(self) -> Sweep | None:
        return load_sweep(self.shot)

    def fingerprints(self) -> Iterator[str]:
        """Yield the full configuration of the shot, or of points with every value of its sweep, and the SHA-256 of its files.

        Raises PhotositeError for a file that is missing.
        """
        shots = [load_shot(self.shot)] if self._sweep is None else (point.shot() for point in self._sweep.covering_points())
        for shot in shots:
            try:
                files = fingerprints(shot.scene, shot.lens, shot.motion)
            except OSError as error:
                rule = f"names {error.filename}: {error.strerror}; check the path"
                raise PhotositeError(rule, file=self.shot, part=shot.name) from None
            yield json.dumps([shot.resolved, files], sort_keys=True)

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Expose one shot; nothing is drawn.

        Raises PhotositeError for a name that is not of this file and for all that a shot may be refused for.
        """
        require(
            name in self._names, "shot", name, f"no such shot in {self.shot}, which has {self._names[0]} to {self._names[-1]}"
        )
        try:
            return clean_picture(self._shot(name), open_device(self.device))
        except PhotositeError as error:
            raise error.with_file(self.shot, part=name) from error

    def _shot(self, name: str) -> Shot:
        return load_shot(self.shot) if self._sweep is None else self._sweep[self._names.index(name)].shot()


def clean_picture(shot: Shot, device: Device) -> CleanImage:
    """Return the clean picture of a shot: 0 without light, 1 where its camera saturates at its ISO.

    What optical black covers is cut off; it is an even number of rows and columns, so the pattern stays.
    """
    planned = plan(replace(shot, truth=()))
    check_memory(planned, device.info)
    planned = measure(planned, device)
    sensor = replace(planned.sensor, readout=replace(planned.sensor.readout, pattern=None))  # the light of each place
    planned = replace(planned, sensor=sensor)
    matrix, balance = (
        stored_matrix(matrix_under_d65(shot.camera)),
        _white_balance(neutral_of(planned.optics.scene, shot.camera)),
    )
    scale, active = np.float32(1.0 / saturating_electrons(sensor)), _active_slices(sensor)
    crosstalk, binning = sensor.readout.crosstalk, sensor.readout.binning
    has_rgb = shot.camera.channels == 3 and shot.camera.filter.letters == "RGB"
    if has_rgb and binning is None and not any(crosstalk.optical_shares + crosstalk.electrical_shares):
        planes = [_electrons(planned.in_one_color(channel), device)[active] for channel in range(3)]
        return CleanImage(np.stack(planes, axis=-1) * scale, None, balance, matrix)
    cfa = shot.camera.frame_cfa()
    rule = "a mosaic of this pattern cannot be turned to that of a data set; take crosstalk and binning away, or another camera"
    require(cfa == "MONO" or cfa in BAYER, "camera.cfa", cfa, rule)
    return CleanImage(_electrons(planned, device)[active] * scale, cfa, balance, matrix)


def saturating_electrons(sensor: SensorPlan) -> float:
    """Mean photoelectrons [e-] in what is read at once at which the code without noise reaches white, linearly from dark."""
    binning = sensor.readout.binning
    read_together = binning.count if binning is not None and sensor.readout.adds_charge else 1
    return read_together * sensor.electrons_at_white()


def _white_balance(neutral: tuple[float, ...]) -> tuple[float, float, float]:
    """Return the gains that make the camera's response to white neutral, green = 1; all 1 for MONO."""
    if len(neutral) != 3:
        return 1.0, 1.0, 1.0
    red, green, blue = map(nine_digits, neutral)
    return green / red, green / green, green / blue


def _electrons(planned: Plan, device: Device) -> np.ndarray:
    """Mean photoelectrons of every pixel that is given out, (height, width) float32 [e-]."""
    return read_mean_electrons(device, planned.sensor, expose(planned, device))


def _active_slices(sensor: SensorPlan) -> tuple[slice, slice]:
    """Return rows and columns of the active area within the frame."""
    area = sensor.readout.active_area
    return (slice(None), slice(None)) if area is None else (slice(area[0], area[2]), slice(area[1], area[3]))
