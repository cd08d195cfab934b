"""Clean pictures made of numbers: no files, as many as are wanted, each a function of its name."""

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal, get_args, overload

import numpy as np

from data_gen.sources.camera_view import CameraView, camera_view, check_illuminants, draw_name
from data_gen.sources.drawings import DRAWINGS
from data_gen.sources.paint import Paint, paint_for
from data_gen.sources.source import CleanImage
from simulator.errors import PhotositeError, require
from simulator.sensor.camera.camera import Camera

Kind = Literal["dead_leaves", "gradients", "slanted_edges", "color_patches", "text", "point_lights"]
LARGEST_SIDE_PX = 8192


@dataclass(frozen=True)
class DrawingNames(Sequence[str]):
    """The names of the first `size` drawings of these kinds, which are made when they are asked for: there may be 10^9."""

    kinds: tuple[str, ...]
    size: int

    def __len__(self) -> int:
        return self.size

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[str, ...]: ...
    def __getitem__(self, index: int | slice) -> str | tuple[str, ...]:
        if isinstance(index, slice):
            return tuple(map(self._name, range(self.size)[index]))
        return self._name(range(self.size)[index])

    def __iter__(self) -> Iterator[str]:
        return map(self._name, range(self.size))

    def _name(self, index: int) -> str:
        return f"{self.kinds[index % len(self.kinds)]}/{index // len(self.kinds):06d}"


@dataclass(frozen=True)
class Procedural:
    """Drawings as a camera sees them, with a slight blur as of a lens and the photosites' area.

    procedural: drawings to take in turn; data_gen/sources/drawings.py says what they hold.
    camera: whose colours the pictures have.
    count: pictures that are listed. Names beyond them can be read as well: NAME/NUMBER for any number.
    seed: another one gives other pictures under the same names.
    illuminants: lights on the surfaces, one drawn for each reading, all equally likely.
    white_signal: signal of a perfect white surface in the channel that sees it brightest, 1 = saturation.
    """

    procedural: tuple[Kind, ...]
    camera: Camera
    count: Annotated[int, "pictures that are listed"] = 600
    width_px: Annotated[int, "of a picture"] = 512
    height_px: Annotated[int, "of a picture"] = 512
    seed: Annotated[int, "of what the pictures show"] = 0
    illuminants: tuple[str, ...] = ("D65",)
    white_signal: Annotated[float, "signal of a perfect white, 1 = saturation"] = 0.9
    _seen: dict[str, tuple[CameraView, Paint]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        known = get_args(Kind)
        some = bool(self.procedural) and set(self.procedural) <= set(known)
        require(some, "procedural", self.procedural, f"give one or more of {', '.join(known)}")
        require(len(set(self.procedural)) == len(self.procedural), "procedural", self.procedural, "name each drawing once")
        require(1 <= self.count <= 10**9, "count", self.count, "give 1 to 1000000000")
        for key, side in (("width", self.width_px), ("height", self.height_px)):
            require(8 <= side <= LARGEST_SIDE_PX, key, side, f"give 8 to {LARGEST_SIDE_PX}")
        require(0 < self.white_signal < 1e6, "white_signal", self.white_signal, "give a signal above 0, such as 0.9")
        check_illuminants(self.illuminants, "illuminants")

    def names(self) -> Sequence[str]:
        """Return KIND/NUMBER of the first `count` pictures, the kinds in turn."""
        return DrawingNames(self.procedural, self.count)

    def fingerprints(self) -> Iterator[str]:
        """Yield nothing: drawings have no files."""
        yield from ()

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Draw a picture. `rng` chooses the light; everything else follows from the name.

        Raises PhotositeError for a name that no drawing has.
        """
        match = re.fullmatch(r"(\w+)/(\d{6}|[1-9]\d{6,17})", name)
        known = self.procedural
        rule = f"no such drawing; give one of {', '.join(known)}, a stroke and a number, such as {known[0]}/000000"
        if match is None or match[1] not in known:
            raise PhotositeError(rule, key="procedural", value=name)
        view, paint = self._view(draw_name(self.illuminants, rng))
        planes = DRAWINGS[match[1]](_generator(name, self.seed), paint, self.height_px, self.width_px)
        return view.picture(_blur(planes.astype(np.float32, copy=False)) * np.float32(self.white_signal))

    def _view(self, light: str) -> tuple[CameraView, Paint]:
        """Return the camera's response and the paint in a light, computed once."""
        if light not in self._seen:
            self._seen[light] = camera_view(self.camera, light), paint_for(self.camera, light)
        return self._seen[light]


def _generator(name: str, seed: int) -> np.random.Generator:
    """Return the generator of a picture: Philox keyed with the hash of seed and name."""
    digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "little")))


def _blur(planes: np.ndarray) -> np.ndarray:
    """Blur with the binomial 1-2-1 / 4 in both directions; the border repeats. A flat field stays flat."""
    for axis in (0, 1):
        padded = np.concatenate([planes.take([0], axis), planes, planes.take([-1], axis)], axis)
        before, after = (slice(None),) * axis + (slice(None, -2),), (slice(None),) * axis + (slice(2, None),)
        planes = np.float32(0.25) * (padded[before] + padded[after]) + np.float32(0.5) * planes
    return planes
