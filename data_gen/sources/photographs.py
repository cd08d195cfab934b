"""Clean pictures from finished photographs: sRGB back to camera signal."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from data_gen.sources.camera_view import camera_view, check_illuminants, draw_name
from data_gen.sources.folder import FolderSource, check_extensions
from data_gen.sources.inverse_isp import (
    SRGB_TO_XYZ,
    draw_brightness,
    draw_white,
    expand_gamma,
    inverse_smoothstep,
    mix_matrix,
    remove_gains,
    to_balanced_camera,
    to_balanced_camera_in,
)
from data_gen.sources.source import CleanImage
from simulator.errors import PhotositeError, require
from simulator.scene.color_channels import srgb_to_linear
from simulator.scene.pixel_file import memory_for, read_pixels
from simulator.sensor.camera.camera import Camera

KEY = "photographs"


@dataclass(frozen=True)
class Photographs(FolderSource):
    """sRGB pictures of 8 or 16 bits, taken back to camera signal by an inverse ISP (data_gen/sources/inverse_isp.py).

    photographs: folder, with all folders in it. Colours are taken as sRGB; an embedded profile is not read.
    camera: whose colours the pictures get. brooks2019 does not need it.
    inverse_isp: "camera" undoes the curve of sRGB and takes colours to this camera in the drawn light, "brooks2019" does all as
        the paper does: gamma 2.2, a mixture of four cameras, gains drawn at random. Both undo the smoothstep tone curve, draw
        the brightness from N(0.8, 0.1), and keep what is saturated.
    illuminants: lights for "camera", one drawn for each reading, all equally likely.
    downscale: side of the square of pixels that are averaged, in linear light, which takes off noise and JPEG blocks.
    extensions: of the files to take, in lower case.
    """

    key: ClassVar[str] = KEY
    photographs: Annotated[Path, "folder of sRGB pictures"]
    camera: Camera
    inverse_isp: Literal["camera", "brooks2019"] = "camera"
    illuminants: tuple[str, ...] = ("D65",)
    downscale: Annotated[int, "1 keeps every pixel"] = 1
    extensions: tuple[str, ...] = (".jpg", ".jpeg", ".png", ".tif", ".tiff")

    def __post_init__(self) -> None:
        colour = self.camera.channels == 3 or self.inverse_isp == "brooks2019"
        rule = "an inverse ISP ends in R, G, B; take another camera, or linear_images for a monochrome one"
        require(colour, "camera.cfa", self.camera.cfa, rule)
        require(1 <= self.downscale <= 64, "downscale", self.downscale, "give 1 to 64")
        used = self.inverse_isp == "camera" or self.illuminants == ("D65",)
        require(used, "illuminants", self.illuminants, "brooks2019 draws gains in their place; leave them out")
        check_illuminants(self.illuminants, "illuminants")
        check_extensions(self.extensions)

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Read one picture; `rng` gives light, matrix, gains and brightness.

        A grey picture is one of neutral surfaces.
        Raises PhotositeError for a file that is missing, damaged, of floats, or larger than memory.
        """
        path = self.photographs / name
        with memory_for(path, KEY):
            codes = _rgb_codes(path)
            matrix, white, picture = self._draw_colours(rng)
            balanced = _decode(codes, self.inverse_isp) @ matrix.T.astype(np.float32)
            signal = np.maximum(remove_gains(balanced, white * draw_brightness(rng)), np.float32(0))
            if self.inverse_isp == "brooks2019":
                signal = np.minimum(signal, np.float32(1))
            return picture(_downscale(signal, self.downscale, path))

    def _draw_colours(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, Callable[[np.ndarray], CleanImage]]:
        """Draw the colours of one reading.

        Returns the matrix (3, 3) from linear sRGB to white-balanced camera, the signal of white (3,), and the function that
        makes a CleanImage of planes.
        """
        if self.inverse_isp == "camera":
            view = camera_view(self.camera, draw_name(self.illuminants, rng))
            return to_balanced_camera_in(self.camera, view.light), view.white, view.picture
        matrix, white = to_balanced_camera(mix_matrix(rng)), draw_white(rng)
        # The rows of `matrix` sum to 1, so this is the D65 matrix of a camera whose response to white is the drawn one.
        xyz_to_camera = tuple(map(tuple, (white[:, None] * matrix @ np.linalg.inv(SRGB_TO_XYZ)).tolist()))
        red, green, blue = (float(1.0 / value) for value in white)
        balance = red, green, blue
        return matrix, white, lambda planes: CleanImage(planes, None, balance, xyz_to_camera)


def _rgb_codes(path: Path) -> np.ndarray:
    """Codes (height, width, 3) uint8 or uint16 of a picture, alpha left out; those of a grey one three times."""
    file = read_pixels(path, KEY)
    colours = [name for index, name in enumerate(file.channels) if index != file.alpha]
    kind = f"of {len(colours)} channels ({', '.join(colours[:6])})"
    good = len(colours) == 1 or colours == ["R", "G", "B"]
    require(good, KEY, path, f"the picture is {kind}; give R, G, B or grey, or take it out of the folder")
    if file.pixels.dtype not in (np.uint8, np.uint16):
        raise PhotositeError(
            f"holds {file.pixels.dtype}, no 8 or 16 bit codes; take linear_images for such files", key=KEY, value=path
        )
    return file.pixels[..., [file.channels.index(name) for name in (colours if len(colours) == 3 else colours * 3)]]


def _decode(codes: np.ndarray, inverse_isp: str) -> np.ndarray:
    """Undo tone curve and gamma with a lookup table of all codes: linear colours float32, 0 to 1."""
    largest = np.iinfo(codes.dtype).max
    curve = expand_gamma if inverse_isp == "brooks2019" else srgb_to_linear
    return curve(inverse_smoothstep(np.arange(largest + 1) / largest)).astype(np.float32)[codes]


def _downscale(planes: np.ndarray, side: int, path: Path) -> np.ndarray:
    """Average squares of `side` pixels; incomplete squares at the right and lower border are dropped."""
    if side == 1:
        return planes
    height, width = planes.shape[0] // side, planes.shape[1] // side
    rule = f"smaller than the {side} x {side} pixels of downscale; take it out of the folder"
    require(min(height, width) > 0, KEY, path, rule)
    return planes[: height * side, : width * side].reshape(height, side, width, side, 3).mean(axis=(1, 3))
