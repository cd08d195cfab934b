"""What moves while the shutter is open."""

from dataclasses import dataclass

from simulator.exposure.camera_motion import SteadyMotion


@dataclass(frozen=True)
class Motion:
    """Motion of a shot, on one clock for the rows of a frame and the frames of a series (`Exposure.start_s`).

    camera: path of the camera; left out: it stands on a tripod.
    """

    camera: SteadyMotion | None = None
