"""The response of a camera to white in a light: from it follow white balance and clean pictures."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from data_gen.sources.source import CleanImage
from simulator.color.camera_matrices import as_shot_neutral
from simulator.color.reproducible import nine_digits_each
from simulator.color.spectra import WAVELENGTHS_NM, check_illuminant, illuminant
from simulator.errors import require
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_color import matrix_under_d65


@dataclass(frozen=True)
class CameraView:
    """A camera in one light.

    light: name that `simulator.color.spectra.illuminant` knows.
    white: (channels,) float64, signal of a white surface, largest = 1 (DNG AsShotNeutral), to nine digits.
    color_matrix: (3, 3) XYZ to camera under D65, to nine digits; None for MONO.
    """

    camera: Camera
    light: str
    white: np.ndarray
    color_matrix: tuple[tuple[float, ...], ...] | None

    @property
    def white_balance(self) -> tuple[float, float, float]:
        """Gains of R, G, B that make white neutral, green = 1; all 1 for MONO."""
        if self.white.size != 3:
            return 1.0, 1.0, 1.0
        red, green, blue = map(float, self.white)
        return green / red, 1.0, green / blue

    def picture(self, planes: np.ndarray) -> CleanImage:
        """Clean picture of planes (height, width, channels); a monochrome camera's one plane is its mosaic."""
        planes = np.ascontiguousarray(planes, dtype=np.float32)
        if self.camera.channels == 1:
            return CleanImage(planes[..., 0], "MONO", self.white_balance)
        return CleanImage(planes, None, self.white_balance, self.color_matrix)


def camera_view(
    camera: Camera, light: str, power: np.ndarray | None = None, grid_nm: np.ndarray = WAVELENGTHS_NM
) -> CameraView:
    """Return what a camera sees in a light. Raises PhotositeError for an unknown light or one that a channel cannot see.

    power: (wavelengths,) relative power on grid_nm, where it is not that of the named light.
    """
    response = camera.response
    power = illuminant(light, grid_nm) if power is None else power
    white = as_shot_neutral(power, response.wavelengths_nm, response.quantum_efficiency, grid_nm)
    return CameraView(camera, light, nine_digits_each(white), stored_matrix(matrix_under_d65(camera)))


def stored_matrix(matrix: np.ndarray | None) -> tuple[tuple[float, ...], ...] | None:
    """Return a colour matrix (3, 3) as samples hold it, to nine digits; None for MONO."""
    return None if matrix is None else tuple(map(tuple, nine_digits_each(matrix).tolist()))


def check_illuminants(names: Iterable[str], key: str) -> None:
    """Raise PhotositeError unless there is at least one illuminant and all are known."""
    names = tuple(names)
    require(len(names) > 0, key, "nothing", "name one light or more, such as D65")
    for name in names:
        check_illuminant(name, key)


def draw_name(names: tuple[str, ...], rng: np.random.Generator) -> str:
    """Draw one of the names, all equally likely; a single name uses no random number."""
    return names[0] if len(names) == 1 else names[int(rng.integers(len(names)))]
