"""What forms the image: focus, field of view, blur, pupil and irradiance of one lens object."""

from simulator.lens.bare_sensor import BareSensor
from simulator.lens.pinhole import Pinhole
from simulator.lens.pupil import Aperture, Pupil, PupilStop
from simulator.lens.thin_lens import ThinLens
from simulator.lens.vignetting import RoundStop, Vignetting

Lens = ThinLens | Pinhole | BareSensor

__all__ = [
    "Aperture",
    "BareSensor",
    "Lens",
    "Pinhole",
    "Pupil",
    "PupilStop",
    "RoundStop",
    "ThinLens",
    "Vignetting",
]
