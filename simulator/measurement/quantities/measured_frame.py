"""A frame to measure: codes and levels of any raw file; of a simulated one, its truth and its shot, too."""

import os
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.pipeline.planner import light_stages
from simulator.pipeline.shot import Shot
from simulator.raw.raw_image import Raw
from simulator.raw.raw_reader import plane_places, read_raw_file
from simulator.sensor.camera.cfa import BAYER
from simulator.sensor.hdr_plan import plan_readings
from simulator.sensor.sensor_plan import SensorPlan, plan_sensor

Area = tuple[int, int, int, int]  # top, left, height, width [photosites of the frame's visible part]
Plane = Literal["R", "Gr", "Gb", "G", "B", "MONO"]


@dataclass(frozen=True, eq=False)
class MeasuredFrame:
    """The visible part of a raw frame.

    dn: (height, width) uint16 codes, pedestal included [DN].
    cfa: colours of the 2x2 block at the upper left corner, row by row, or "MONO".
    black_level_dn: (2, 2) float64 by place in that block [DN].
    white_level_dn: code at which photosites saturate [DN].
    raw, shot: of a simulated frame: the whole frame with its truth, and the shot it was taken from; None for a file.
    name: of the frame, or path of the file, for messages.
    """

    dn: np.ndarray
    cfa: str
    black_level_dn: np.ndarray
    white_level_dn: int
    raw: Raw | None = None
    shot: Shot | None = None
    name: str = "frame"

    @classmethod
    def from_raw(cls, raw: Raw, shot: Shot) -> Self:
        """Return the visible part of a simulated frame; its black level holds each colour's offset."""
        offsets = np.reshape(sensor_plan(raw, shot).black_offsets_dn(), (2, 2))
        return cls(
            dn=raw.dn[raw.active],
            cfa=raw.cfa,
            black_level_dn=raw.black_level_dn + offsets,
            white_level_dn=raw.white_level_dn,
            raw=raw,
            shot=shot,
            name=raw.name,
        )

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read any raw file with a Bayer pattern or none. Raises PhotositeError as `read_raw_file` does."""
        file = read_raw_file(path)
        return cls(file.mosaic, file.cfa, file.black_level_dn, file.white_level_dn, name=file.path)

    def simulated(self, wanted: str) -> tuple[Raw, Shot]:
        """Return the frame with its truth, and its shot. Raises PhotositeError for a bare file.

        wanted: what needs them, for the message.
        """
        if self.raw is None or self.shot is None:
            told = "needs the truth and the shot of a simulated frame, and this is a raw file alone"
            raise PhotositeError(f"{told}; measure it in a study", file=self.name, key=wanted)
        return self.raw, self.shot

    def sensor(self, wanted: str) -> SensorPlan:
        """Return the sensor of a simulated frame at its ISO and exposure time. Raises PhotositeError for a bare file."""
        return sensor_plan(*self.simulated(wanted))

    def places(self, plane: Plane | None) -> list[tuple[int, int]]:
        """Return row and column in the 2x2 block of the photosites of a colour; G is both greens.

        None: G, or MONO of a frame without a filter. Raises PhotositeError for a colour that the frame does not have.
        """
        rule = (
            "only 2 x 2 Bayer patterns and frames without a filter have planes to measure; measure clipped_share without plane"
        )
        require(self.cfa == "MONO" or self.cfa in BAYER, "cfa", self.cfa, rule, file=self.name)
        all_places = plane_places(self.cfa)
        wanted = plane or ("MONO" if self.cfa == "MONO" else "G")
        found = [place for name, place in all_places.items() if wanted in (name, name[0])]
        known = "MONO" if self.cfa == "MONO" else "R, G, Gr, Gb, B"
        require(bool(found), "plane", wanted, f"the frame has {known}; give one of these, or leave it out", file=self.name)
        return found

    def cut(self, area: Area | None) -> tuple[slice, slice]:
        """Return rows and columns of an area; None: all. Raises PhotositeError for one that leaves the frame."""
        height, width = self.dn.shape
        top, left, tall, wide = area or (0, 0, height, width)
        inside = 0 <= top < top + tall <= height and 0 <= left < left + wide <= width
        rule = f"[top, left, height, width] must lie inside the frame of {height} x {width} photosites"
        require(inside, "area", list(area or ()), rule, file=self.name)
        return slice(top, top + tall), slice(left, left + wide)

    def planes(self, values: np.ndarray, plane: Plane | None, area: Area | None) -> list[np.ndarray]:
        """Return views of the photosites of a colour in an area, one for each of its places in the 2x2 block.

        values: (height, width) as the frame. Raises PhotositeError for an area without a photosite of the colour.
        """
        rows, columns = self.cut(area)
        step = 1 if self.cfa == "MONO" else 2
        parts = []
        for row, column in self.places(plane):
            first = rows.start + (row - rows.start) % step, columns.start + (column - columns.start) % step
            parts.append(values[first[0] : rows.stop : step, first[1] : columns.stop : step])
        rule = "holds no photosite of this colour; give a larger area"
        require(any(part.size for part in parts), "area", list(area or ()), rule, file=self.name)
        return parts

    def photosites_of_rows(self, plane: Plane | None, area: Area | None) -> np.ndarray:
        """Return the number of photosites of a colour in each row of an area, (rows,) float64."""
        rows, _ = self.cut(area)
        numbers = np.broadcast_to(np.arange(self.dn.shape[0])[:, np.newaxis], self.dn.shape)
        found = np.zeros(rows.stop - rows.start)
        for part in self.planes(numbers, plane, area):
            found[part[:, :1].ravel() - rows.start] += part.shape[1]
        return found

    def signal(self, plane: Plane | None, area: Area | None) -> np.ndarray:
        """Return the codes above black of the photosites of a colour in an area, (photosites,) float64 [DN]."""
        black = [self.black_level_dn[place] for place in self.places(plane)]
        parts = zip(self.planes(self.dn, plane, area), black, strict=True)
        return np.concatenate([part.ravel() - float(level) for part, level in parts])


def sensor_plan(raw: Raw, shot: Shot) -> SensorPlan:
    """Return the sensor of a shot at the ISO and the time of its frame, which the camera may have metered."""
    return plan_readings(plan_sensor(shot.camera, light_stages(shot), raw.iso, raw.exposure_time_s), raw.iso)
