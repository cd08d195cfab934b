"""Where clean pictures come from. A source lists names cheaply and in a fixed order, and reads one of them at a time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from simulator.sensor.camera.cfa import CfaName


@dataclass(frozen=True)
class CleanImage:
    """Noise-free camera signal, linear: 0 without light, 1 where the reference exposure saturates.

    signal: (height, width, 3) float32 camera R, G, B at every pixel, or (height, width) float32, a mosaic. Finite; above 1
        is light that the sensor will clip.
    cfa: colours of the mosaic's upper left 2x2 block; None for three planes.
    white_balance: gains of R, G, B that make the light's white neutral, green = 1.
    color_matrix: (3, 3) XYZ to camera under D65; None when not known.
    """

    signal: np.ndarray
    cfa: CfaName | None
    white_balance: tuple[float, float, float]
    color_matrix: tuple[tuple[float, ...], ...] | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) [px]."""
        height, width = self.signal.shape[:2]
        return height, width

    @property
    def held_bytes(self) -> int:
        """Memory that the picture holds [bytes]."""
        return self.signal.nbytes

    def cut(self, top: int, left: int, height: int, width: int) -> np.ndarray:
        """Return the signal of a rectangle that lies inside [px]."""
        return self.signal[top : top + height, left : left + width]

    def mosaic(self, top: int, left: int, height: int, width: int, cfa: str) -> np.ndarray:
        """Return R, G, B planes of a rectangle as the mosaic (height, width) that begins with the letters `cfa`."""
        return apply_cfa(self.cut(top, left, height, width), cfa)


class Picture(Protocol):
    """A clean picture: a `CleanImage`, or one whose signal is computed where it is cut. All of it is as `CleanImage` says."""

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) [px]."""
        ...

    @property
    def cfa(self) -> CfaName | None:
        """Colours of the mosaic's upper left 2x2 block; None for three planes."""
        ...

    @property
    def white_balance(self) -> tuple[float, float, float]:
        """Gains of R, G, B that make the light's white neutral, green = 1."""
        ...

    @property
    def color_matrix(self) -> tuple[tuple[float, ...], ...] | None:
        """(3, 3) XYZ to camera under D65; None when not known."""
        ...

    @property
    def held_bytes(self) -> int:
        """Memory that the picture holds, mapped files included [bytes]."""
        ...

    def cut(self, top: int, left: int, height: int, width: int) -> np.ndarray:
        """Return the signal of a rectangle that lies inside [px]; the same bits, whatever else is cut."""
        ...

    def mosaic(self, top: int, left: int, height: int, width: int, cfa: str) -> np.ndarray:
        """Return R, G, B planes of a rectangle as the mosaic (height, width) that begins with the letters `cfa`."""
        ...


@runtime_checkable
class PictureSource(Protocol):
    """A collection of clean pictures."""

    def names(self) -> Sequence[str]:
        """Names of all pictures, unique, in an order that does not depend on the machine."""
        ...

    def fingerprints(self) -> Iterator[str]:
        """Yield texts that differ where the files behind the pictures do, as far as can be told without reading pictures.

        What follows from the configuration and the names alone needs no text. Raises PhotositeError for a file that is missing.
        """
        ...

    def read(self, name: str, rng: np.random.Generator) -> Picture:
        """Read one picture. `rng` makes the source's random choices, such as the colour matrix of an inverse ISP.

        Raises PhotositeError that names the file and what is wrong with it.
        """
        ...


def apply_cfa(planes: np.ndarray, cfa: str) -> np.ndarray:
    """Sample R, G, B planes (height, width, 3) through a colour filter array: mosaic (height, width) of the same type."""
    mosaic = np.empty(planes.shape[:2], planes.dtype)
    for place, letter in enumerate(cfa):
        row, column = divmod(place, 2)
        mosaic[row::2, column::2] = planes[row::2, column::2, "RGB".index(letter)]
    return mosaic
