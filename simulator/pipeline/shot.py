"""A shot: everything a photographer decides, in one frozen object."""

from dataclasses import dataclass, field
from typing import Literal, Protocol

from simulator.errors import require
from simulator.exposure.settings import Exposure
from simulator.optics.lens.lens import Lens
from simulator.raw.raw_format import RawFormat
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.seeds import Seeds

TruthPart = Literal["variance", "depth", "blur", "rgb"]


class SceneSource(Protocol):
    """Source of a scene; `load` reads it when the shot is planned, not before."""

    def load(self) -> Scene:
        """Read or make the scene."""
        ...


@dataclass(frozen=True)
class Shot:
    """One photograph to take.

    raw: how the raw file holds the frame.
    truth: what the truth twin holds besides mean electrons and noise-free codes: variance, depth, blur, rgb; any of them.
    tolerance: error that the lens blur may have, in standard deviations of the noise of the scene's brightest light, 0 to 10;
        0 follows rays instead (slow).
    resolved: the full configuration the shot was read from, plain data, for the sidecar file; empty for a shot made of objects,
        and always for one whose scene is a `Scene`, which no file describes.
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
    resolved: dict[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if isinstance(self.scene, Scene):
            object.__setattr__(self, "resolved", {})  # another scene's, when the shot was loaded and its scene replaced
        require(
            0 <= self.tolerance <= 10, "tolerance", self.tolerance, "give 0 to 10 standard deviations of the noise, such as 0.1"
        )
        self.camera.iso_setting(self.exposure.iso)
