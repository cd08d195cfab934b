"""Clean pictures from finished photographs: sRGB back to camera signal, computed where a patch is cut."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from data_gen.sources.camera_view import CameraView, camera_view, check_illuminants, draw_name
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.folder import FolderSource, check_extensions
from data_gen.sources.inverse_isp import (
    XYZ_TO_SRGB,
    draw_brightness,
    draw_white,
    expand_gamma,
    inverse_gain,
    inverse_smoothstep,
    mix_matrix,
    to_balanced_camera,
    to_balanced_camera_in,
)
from data_gen.sources.patches import Augmentation
from data_gen.sources.source import apply_cfa
from simulator.color.reproducible import ordered_product, weighted_sum
from simulator.errors import PhotositeError, require
from simulator.scene.color_channels import srgb_to_linear
from simulator.scene.pixel_file import check_rgb, memory_for, read_pixels
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.cfa import CfaName

KEY = "photographs"
InverseIsp = Literal["camera", "brooks2019"]
# Exif 2.3, Orientation: what turns the stored rows and columns upright.
UPRIGHT = {
    1: Augmentation(),
    2: Augmentation(flip_x=True),
    3: Augmentation(flip_y=True, flip_x=True),
    4: Augmentation(flip_y=True),
    5: Augmentation(transpose=True),
    6: Augmentation(transpose=True, flip_x=True),
    7: Augmentation(transpose=True, flip_y=True, flip_x=True),
    8: Augmentation(transpose=True, flip_y=True),
}


@dataclass(frozen=True)
class Photograph:
    """A photograph with the colours drawn for one reading. The inverse ISP is computed where it is cut.

    Arithmetic is element by element in one order, so a patch has the bits of the whole picture.
    codes: (height, width, 1 or 3) uint8 or uint16, upright. linear: (codes,) float32, linear colour of each code, 0 to 1.
    matrix: (3, 3) linear sRGB to white-balanced camera. gains: (3,) camera signal of white, times the brightness.
    most: largest signal. downscale: side of the square of pixels that are averaged.
    """

    codes: np.ndarray
    linear: np.ndarray
    matrix: np.ndarray
    gains: np.ndarray
    most: float
    downscale: int
    white_balance: tuple[float, float, float]
    color_matrix: tuple[tuple[float, ...], ...] | None
    cfa: CfaName | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) after downscaling [px]; incomplete squares at the right and lower border are dropped."""
        height, width = self.codes.shape[:2]
        return height // self.downscale, width // self.downscale

    @property
    def held_bytes(self) -> int:
        """Memory that the codes hold, mapped or not [bytes]."""
        return self.codes.nbytes

    @property
    def signal(self) -> np.ndarray:
        """All of it, (height, width, 3) float32."""
        return self.cut(0, 0, *self.size)

    def cut(self, top: int, left: int, height: int, width: int) -> np.ndarray:
        """Return the signal (height, width, 3) float32 of a rectangle that lies inside [px]."""
        side = self.downscale
        linear = self._linear(top * side, left * side, height * side, width * side)
        mean = weighted_sum(linear, self._weights[3])
        planes = [self._signal(linear, channel, mean) for channel in range(3)]
        return np.stack([_mean_of_squares(plane, side) for plane in planes], axis=-1)

    def mosaic(self, top: int, left: int, height: int, width: int, cfa: str) -> np.ndarray:
        """Return the mosaic (height, width) float32 of a rectangle; each photosite's own colour alone is computed."""
        if self.downscale > 1:
            return apply_cfa(self.cut(top, left, height, width), cfa)
        linear, mosaic = self._linear(top, left, height, width), np.empty((height, width), np.float32)
        for place, letter in enumerate(cfa):
            own = slice(place // 2, None, 2), slice(place % 2, None, 2)
            seen = [plane[own] for plane in linear]
            mosaic[own] = self._signal(seen, "RGB".index(letter), weighted_sum(seen, self._weights[3]))
        return mosaic

    @cached_property
    def _weights(self) -> np.ndarray:
        """Matrix (4, 3) float32 from linear sRGB to white-balanced camera R, G, B and their mean."""
        return np.vstack([self.matrix, self.matrix.mean(axis=0)]).astype(np.float32)

    def _linear(self, top: int, left: int, height: int, width: int) -> list[np.ndarray]:
        """Return linear sRGB of a rectangle of the codes, three planes; a grey picture, of neutral surfaces, has one thrice."""
        found = self.linear.take(self.codes[top : top + height, left : left + width])
        return [found[..., min(channel, found.shape[2] - 1)] for channel in range(3)]

    def _signal(self, linear: Sequence[np.ndarray], channel: int, mean: np.ndarray) -> np.ndarray:
        """Return the camera signal in one colour from linear sRGB and the mean of the white-balanced colours."""
        signal = weighted_sum(linear, self._weights[channel])
        signal *= inverse_gain(mean, self.gains[channel])
        return np.clip(signal, np.float32(0), np.float32(self.most), out=signal)


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
    decoded: where decoded pictures are kept; without it a file is decoded at each reading.
    """

    key: ClassVar[str] = KEY
    photographs: Annotated[Path, "folder of sRGB pictures"]
    camera: Camera
    inverse_isp: InverseIsp = "camera"
    illuminants: tuple[str, ...] = ("D65",)
    downscale: Annotated[int, "1 keeps every pixel"] = 1
    extensions: tuple[str, ...] = (".jpg", ".jpeg", ".png", ".tif", ".tiff")
    decoded: DecodedPictures | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        colour = (self.camera.channels == 3 and self.camera.filter.letters == "RGB") or self.inverse_isp == "brooks2019"
        rule = "an inverse ISP ends in R, G, B; take another camera, or linear_images for a monochrome one"
        require(colour, "camera.cfa", self.camera.cfa, rule)
        require(1 <= self.downscale <= 64, "downscale", self.downscale, "give 1 to 64")
        used = self.inverse_isp == "camera" or self.illuminants == ("D65",)
        require(used, "illuminants", self.illuminants, "brooks2019 draws gains in their place; leave them out")
        check_illuminants(self.illuminants, "illuminants")
        check_extensions(self.extensions)

    def read(self, name: str, rng: np.random.Generator) -> Photograph:
        """Read one picture; `rng` gives light, matrix, gains and brightness.

        A grey picture is one of neutral surfaces. A picture is turned upright as its Exif orientation says.
        Raises PhotositeError for a file that is missing, damaged, of a camera's raw format, of floats, of CMYK or Lab colours,
        or larger than memory.
        """
        path = self.photographs / name
        with memory_for(path, KEY):
            codes = _rgb_codes(path) if self.decoded is None else self.decoded.codes(path, _rgb_codes)
        smallest, rule = min(codes.shape[:2]), f"smaller than the {self.downscale} x {self.downscale} pixels of downscale"
        require(smallest >= self.downscale, KEY, path, f"{rule}; take it out of the folder")
        matrix, white, balance, xyz_to_camera = self._draw_colours(rng)
        return Photograph(
            codes,
            linear_colours(np.iinfo(codes.dtype).max, self.inverse_isp),
            matrix,
            white * draw_brightness(rng),
            np.inf if self.inverse_isp == "camera" else 1.0,
            self.downscale,
            balance,
            xyz_to_camera,
        )

    def _draw_colours(
        self, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float], tuple[tuple[float, ...], ...] | None]:
        """Draw the colours of one reading.

        Returns the matrix (3, 3) from linear sRGB to white-balanced camera, the signal of white (3,), the gains that make it
        neutral, and the matrix (3, 3) from XYZ to camera under D65.
        """
        if self.inverse_isp == "camera":
            light = draw_name(self.illuminants, rng)
            view, matrix = self._views.get(light) or self._views.setdefault(light, self._view(light))
            return matrix, view.white, view.white_balance, view.color_matrix
        matrix, white = to_balanced_camera(mix_matrix(rng)), draw_white(rng)
        # The rows of `matrix` sum to 1, so this is the D65 matrix of a camera whose response to white is the drawn one.
        xyz_to_camera = tuple(map(tuple, ordered_product(white[:, None] * matrix, XYZ_TO_SRGB).tolist()))
        red, green, blue = (float(1.0 / value) for value in white)
        return matrix, white, (red, green, blue), xyz_to_camera

    @cached_property
    def _views(self) -> dict[str, tuple[CameraView, np.ndarray]]:
        """Lights that were drawn before, see `_view`."""
        return {}

    def _view(self, light: str) -> tuple[CameraView, np.ndarray]:
        """Return the camera in a light, and the matrix (3, 3) from linear sRGB to its white-balanced colours."""
        return camera_view(self.camera, light), to_balanced_camera_in(self.camera, light)


@lru_cache(maxsize=4)
def linear_colours(largest: int, inverse_isp: InverseIsp) -> np.ndarray:
    """Return the linear colour, 0 to 1, of each code from 0 to `largest`, (codes,) float32: tone curve and gamma undone."""
    curve = expand_gamma if inverse_isp == "brooks2019" else srgb_to_linear
    return curve(inverse_smoothstep(np.arange(largest + 1) / largest)).astype(np.float32)


def _rgb_codes(path: Path) -> np.ndarray:
    """Return the codes (height, width, 3 or 1 where it is grey) uint8 or uint16 of a picture, upright, alpha left out."""
    file = read_pixels(path, KEY, develop_options="")
    check_rgb(file, KEY, "convert it to R, G, B, or take it out of the folder")
    colours = [name for index, name in enumerate(file.channels) if index != file.alpha]
    kind = f"of {len(colours)} channels ({', '.join(colours[:6])})"
    good = len(colours) == 1 or colours == ["R", "G", "B"]
    require(good, KEY, path, f"the picture is {kind}; give R, G, B or grey, or take it out of the folder")
    if file.pixels.dtype not in (np.uint8, np.uint16):
        raise PhotositeError(
            f"holds {file.pixels.dtype}, no 8 or 16 bit codes; take linear_images for such files", key=KEY, value=path
        )
    pixels = file.pixels
    if colours != list(file.channels):
        pixels = pixels[..., [file.channels.index(name) for name in colours]]
    return np.ascontiguousarray(UPRIGHT.get(file.orientation, UPRIGHT[1]).of(pixels))


def _mean_of_squares(plane: np.ndarray, side: int) -> np.ndarray:
    """Average squares of `side` pixels of a plane whose height and width are multiples of it, in an order of its own."""
    if side == 1:
        return plane
    rows = sum((plane[row::side] for row in range(1, side)), plane[::side])
    return sum((rows[:, column::side] for column in range(1, side)), rows[:, ::side]) / np.float32(side * side)
