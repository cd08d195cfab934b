"""A shot: everything a photographer decides, in one frozen object."""

from dataclasses import dataclass, field
from typing import Protocol

from simulator.exposure import Exposure
from simulator.lens import ThinLens
from simulator.scene import Scene
from simulator.sensor.camera import Camera


class SceneSource(Protocol):
    """Where a scene comes from; `load` reads it when the shot is taken, not before."""

    def load(self) -> Scene:
        """Read or make the scene."""


@dataclass(frozen=True)
class Seeds:
    """Seeds of the counter-based random numbers, 0 to 2^32 - 1.

    body: what belongs to one camera body (fixed patterns).
    frame: what is new in each frame (temporal noise).
    """

    body: int = 0
    frame: int = 0


@dataclass(frozen=True)
class Shot:
    """One photograph to take.

    resolved: the full configuration the shot was read from, plain data, for the sidecar file.
    """

    scene: SceneSource
    lens: ThinLens
    exposure: Exposure
    camera: Camera
    seeds: Seeds = Seeds()
    name: str = "shot"
    resolved: dict = field(default_factory=dict)
