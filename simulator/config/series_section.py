"""The `series:` part of a sweep: frames that one camera takes one after the other, as a burst, a bracket or a time-lapse."""

from typing import Annotated

from pydantic import Field

from simulator.config.section_types import Quantity, Section
from simulator.units import Unit

ROUNDING = 1e-9  # share of the interval by which an exposure may exceed it, since written times are rounded
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
        Field(description="instead: from the end of an exposure to the next release; 0 s"),
    ] = None
    bracket: Annotated[
        list[float] | None,
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

    def times(self, frame: int, base_s: float) -> tuple[float, float]:
        """Return when a frame is released, counted from the first one, and its exposure time [s].

        frame: 0 for the first. base_s: exposure time at 0 stops [s]. Raises ValueError where an exposure outlasts the interval.
        """
        each_s = [base_s * 2.0**stop for stop in self.bracket or [0.0]]
        rounds, place = divmod(frame, len(each_s))
        if self.interval is None:
            return rounds * sum(each_s) + sum(each_s[:place]) + frame * (self.gap or 0.0), each_s[place]
        if max(each_s) > self.interval * (1.0 + ROUNDING):
            fix = "give a longer one, or a gap instead"
            raise ValueError(f"exposures of {max(each_s):g} s outlast the interval of {self.interval:g} s; {fix}")
        return frame * self.interval, each_s[place]
