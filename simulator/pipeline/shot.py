"""A shot: everything a photographer decides, in one frozen object."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from simulator.displayed import Displayed
from simulator.errors import require
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.lens.lens import Lens
from simulator.raw.raw_format import RawFormat
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.seeds import Seeds
from simulator.units import Seconds

TruthPart = Literal["variance", "depth", "blur", "flow", "rgb"]


class SceneSource(Protocol):
    """Source of a scene; `load` reads it when the shot is planned, not before."""

    def load(self) -> Scene:
        """Read or make the scene."""
        ...


class ShotOrigin(Protocol):
    """The file that a shot was read from; `describe` tells what that file would hold for this shot."""

    def describe(self, shot: "Shot") -> dict[str, Any]:
        """Return the full configuration of a shot some of whose parts may have been replaced; {} where no file can hold it."""
        ...


@dataclass(frozen=True)
class Shot(Displayed):
    """One photograph to take.

    raw: how the raw file holds the frame.
    truth: what the truth twin holds besides mean electrons and noise-free codes: variance, depth, blur, flow, rgb; any of them.
    tolerance: error that the light may have by the methods that compute it, in standard deviations of the noise of the scene's
        brightest light, 0 to 10; 0 is the reference path: rays instead of fast methods (slow).
    time_budget_s: time in which the device shall compute the frame, which chooses the tolerance in place of the stated one;
        left out: the tolerance holds.
    motion: what moves while the shutter is open; left out: nothing.
    origin: the file it was read from, set by `load_shot`; None for a shot made of objects.
    interval_s: from the release to that of the next frame of a series [s], set by a sweep; a time that the camera chooses must
        end before; None: no frame follows.
    Raises PhotositeError for an ISO outside those the camera was measured at, and a tolerance out of range.
    """

    scene: SceneSource
    lens: Lens
    exposure: Exposure
    camera: Camera
    seeds: Seeds = Seeds()
    raw: RawFormat = RawFormat()
    name: str = "shot"
    truth: tuple[TruthPart, ...] = ()
    tolerance: float = 0.1
    time_budget_s: Seconds | None = None
    motion: Motion | None = None
    origin: ShotOrigin | None = field(default=None, repr=False, compare=False)
    interval_s: float | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        require(
            0 <= self.tolerance <= 10, "tolerance", self.tolerance, "give 0 to 10 standard deviations of the noise, such as 0.1"
        )
        is_time = self.time_budget_s is None or 0 < self.time_budget_s < math.inf
        require(is_time, "time_budget", f"{self.time_budget_s} s", "give a time above 0 s, such as 2 s")
        self.camera.iso_setting(self.exposure.iso)
        is_timed = self.motion is None or self.motion.flow_after_s is not None
        rule = "needs the time to the next frame; add motion.flow_time, such as 40 ms"
        require("flow" not in self.truth or is_timed, "truth", "flow", rule)

    @property
    def resolved(self) -> dict[str, Any]:
        """The full configuration of this shot as it is, plain data, for the sidecar file.

        Empty for a shot made of objects, for one whose scene is a `Scene`, and where another part that was replaced has no form
        in a file.
        """
        return {} if self.origin is None or isinstance(self.scene, Scene) else self.origin.describe(self)
