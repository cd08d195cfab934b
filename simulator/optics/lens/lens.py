"""What forms the image: focus, field of view, blur, pupil and irradiance of one lens object."""

from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens

Lens = ThinLens | Pinhole | BareSensor
