"""What forms the image: focus, field of view, blur, pupil and irradiance of one lens object."""

from simulator.lens.irradiance import Irradiance
from simulator.lens.pupil import Aperture, Pupil, PupilStop
from simulator.lens.thin_lens import ThinLens
from simulator.lens.vignetting import RoundStop, Vignetting

__all__ = ["Aperture", "Irradiance", "Pupil", "PupilStop", "RoundStop", "ThinLens", "Vignetting"]
