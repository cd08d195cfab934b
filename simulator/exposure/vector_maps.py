"""Motion of things in a scene of one picture: a velocity for each pixel, as renderers write it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from simulator.errors import require
from simulator.exposure.object_motion import SpeedUnit
from simulator.scene.pixel_file import DataWindow, PixelFile, check_finite, check_window, read_pixels

KEY = "motion.vectors"


@dataclass(frozen=True)
class VectorField:
    """Velocity of each pixel of a scene: the surface that it shows at clock 0 moves evenly along a straight line.

    velocity: (height, width, 2) float32, to the right and down, [px/s] of the scene, or [m/s] across the optical axis.
    is_in_metres: whether it is in metres, so that the way on the picture needs the distance.
    notes: of the file, for the log.
    """

    velocity: np.ndarray
    is_in_metres: bool
    notes: tuple[str, ...] = ()

    def px_per_s(self, depth_m: float | np.ndarray, focal_px: float) -> np.ndarray:
        """Return the velocity in pixels of the scene, (height, width, 2) float32 [px/s].

        depth_m: distance along the optical axis, a float or (height, width) [m]; not used for a field in pixels.
        focal_px: pixels of the scene of one unit of the tangent of the field angle.
        """
        if not self.is_in_metres:
            return self.velocity
        scale = np.broadcast_to(np.asarray(focal_px / np.asarray(depth_m), np.float32), self.velocity.shape[:2])
        return self.velocity * scale[..., None]


@dataclass(frozen=True)
class VectorMap:
    """Velocities in two channels of a picture of the scene's size.

    unit: of the numbers; per frame needs motion.frame_time.
    y_axis: where the second number points; renderers' pixels count down or up.
    scale: factor on the numbers; -1 turns vectors that point to where a surface was.
    """

    image: Annotated[Path, "EXR or .npy array (height, width, 2): way to the right, and down"]
    unit: SpeedUnit
    x: Annotated[str | None, "channel of the way to the right; not needed where there are two"] = None
    y: Annotated[str | None, "channel of the way down or up"] = None
    y_axis: Literal["down", "up"] = "down"
    scale: float = 1.0

    def __post_init__(self) -> None:
        require(bool(np.isfinite(self.scale)), f"{KEY}.scale", self.scale, "give a finite number, such as 1 or -1")
        given = self.y if self.x is None else self.x
        require((self.x is None) == (self.y is None), f"{KEY}.x", given, "name both channels, x and y, or none")

    @property
    def is_per_frame(self) -> bool:
        """Whether the numbers are ways in a frame time."""
        return self.unit.endswith("/frame")

    def load(self, size: tuple[int, int], frame_time_s: float | None = None, window: DataWindow | None = None) -> VectorField:
        """Read the field of a scene of this size (height, width) and data window; see `Motion.vector_field`."""
        file = read_vectors(self.image, size, window)
        names = self.x, self.y
        if self.x is None or self.y is None:
            rule = f"has channels {', '.join(file.channels)}; name the two of them as x: and y:"
            require(len(file.channels) == 2, f"{KEY}.image", self.image, rule)
            names = file.channels[0], file.channels[1]
        planes = [file.channel(str(name), f"{KEY}.{axis}") for axis, name in zip("xy", names, strict=True)]
        up = -1.0 if self.y_axis == "up" else 1.0
        return _field(np.stack(planes, axis=-1), (self.scale, up * self.scale), self, frame_time_s, file.notes)


@dataclass(frozen=True)
class BlenderVectors:
    """The Vector pass of Blender's Cycles: ways from and to the frames beside [px/frame], whose mean is the velocity.

    Its X, Y hold the way from here to the place in the frame before, its Z, W the way from the place in the frame after to
    here, y up (Cycles, kernel/geom/primitive.h).
    """

    image: Annotated[Path, "EXR with the Vector pass"]
    vector_pass: Annotated[str, "name of the pass, such as ViewLayer.Vector, whose channels end with .X, .Y, .Z and .W"]

    is_per_frame: ClassVar[bool] = True
    unit: ClassVar[SpeedUnit] = "px/frame"

    def load(self, size: tuple[int, int], frame_time_s: float | None = None, window: DataWindow | None = None) -> VectorField:
        """Read the field of a scene of this size (height, width) and data window; see `Motion.vector_field`."""
        file = read_vectors(self.image, size, window)
        x, y, z, w = (file.channel(f"{self.vector_pass}.{axis}", f"{KEY}.vector_pass") for axis in "XYZW")
        planes = np.stack([0.5 * (x.astype(np.float64) + z), 0.5 * (y.astype(np.float64) + w)], axis=-1)
        return _field(planes, (-1.0, 1.0), self, frame_time_s, file.notes)


def read_vectors(path: Path, size: tuple[int, int], window: DataWindow | None) -> PixelFile:
    """Read a picture of vectors. Raises PhotositeError for another size (height, width) or data window than the scene's."""
    file = read_pixels(path, f"{KEY}.image")
    rule = f"is {file.size[1]}x{file.size[0]} pixels, but the scene is {size[1]}x{size[0]}; export both at one size"
    require(file.size == size, f"{KEY}.image", path, rule)
    check_window(path, f"{KEY}.image", file.window, window, "the scene")
    return file


def _field(
    planes: np.ndarray,
    scale: tuple[float, float],
    of: VectorMap | BlenderVectors,
    frame_time_s: float | None,
    notes: tuple[str, ...],
) -> VectorField:
    """Return numbers of a file times these factors as velocities. Raises PhotositeError for NaN and Inf."""
    check_finite(planes, f"{KEY}.image", of.image)
    per_second = 1.0 if not of.is_per_frame or frame_time_s is None else 1.0 / frame_time_s
    velocity = (planes * (per_second * np.array(scale))).astype(np.float32)
    velocity.setflags(write=False)
    return VectorField(velocity, of.unit.startswith("m"), notes)
