"""The `series:` part of a sweep: frames that one camera takes one after the other, as a burst, a bracket or a time-lapse."""

from typing import Annotated

from pydantic import Field

from simulator.config.build import build, validate
from simulator.config.dataclass_sections import make_section
from simulator.config.document import Document
from simulator.config.document_merge import select_section
from simulator.config.section_types import Quantity, Section
from simulator.errors import PhotositeError
from simulator.exposure.later_exposures import outlasting
from simulator.exposure.settings import MOST_COMPENSATION_STOPS
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.units import Unit

SECONDS = Unit("second", "_s")


class SeriesSection(Section):
    """Frames of one camera on one clock, on which all that moves or flickers goes on from frame to frame."""

    frames: Annotated[int, Field(ge=1, le=1_000_000, description="number of frames")]
    interval: Annotated[
        Annotated[float, Quantity(SECONDS)] | None,
        Field(description="from the release of one frame to that of the next, such as 40 ms"),
    ] = None
    gap: Annotated[
        Annotated[float, Quantity(SECONDS)] | None,
        Field(description="instead: from the end of a frame's exposures to the next release; 0 s"),
    ] = None
    bracket: Annotated[
        list[Annotated[float, Field(ge=-MOST_COMPENSATION_STOPS, le=MOST_COMPENSATION_STOPS)]] | None,
        Field(
            min_length=1,
            description="stops of time, or of compensation where it is metered, frame by frame and over again: [0, -2, 2]",
        ),
    ] = None

    def check(self) -> None:
        """Raise ValueError for an interval and a gap, and for one below 0."""
        if self.interval is not None and self.gap is not None:
            raise ValueError("interval and gap both say when the next frame begins; leave one of them out")
        if min(self.interval or 0.0, self.gap or 0.0) < 0.0:
            raise ValueError("interval and gap are 0 s or more")

    def times(self, frame: int, base_s: float, exposure_times: float, varies_time: bool = True) -> tuple[float, float]:
        """Return when a frame is released, counted from the first one, and its exposure time [s].

        frame: 0 for the first. base_s: exposure time at 0 stops [s]. exposure_times: what a frame takes, in its exposure times.
        varies_time: whether a bracket is one of times. Raises ValueError where a frame's exposures outlast the interval.
        """
        each_s = [base_s * 2.0**stop for stop in (self.bracket if varies_time and self.bracket else [0.0])]
        taken_s = [exposure_times * time_s for time_s in each_s]
        rounds, place = divmod(frame, len(each_s))
        if self.interval is None:
            return rounds * sum(taken_s) + sum(taken_s[:place]) + frame * (self.gap or 0.0), each_s[place]
        fault = outlasting(max(taken_s), self.interval, exposure_times > 1.0)
        if fault is not None:
            raise ValueError(f"{fault}, or a gap instead")
        return frame * self.interval, each_s[place]


def count_exposure_times(shot: Document) -> float:
    """Return what a frame of a shot's document takes, in its exposure times: above 1 where its readings have several.

    1 as well where the readings are not understood, which the check of the shot names.
    """
    camera = shot.data.get("camera")
    if not isinstance(camera, dict) or camera.get("hdr_readout") is None:
        return 1.0
    section = select_section(select_section(shot, "camera"), "hdr_readout")
    try:
        readout: HdrReadout = build(validate(make_section(HdrReadout), section), (), section)
    except PhotositeError:
        return 1.0
    return sum(readout.exposure_shares)
