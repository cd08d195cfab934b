"""Colour filter array: the colour plane of each photosite of the sensor."""

from dataclasses import dataclass
from typing import Literal, Self

CfaName = Literal["RGGB", "BGGR", "GRBG", "GBRG", "MONO"]
Block = tuple[tuple[int, int], tuple[int, int]]


@dataclass(frozen=True)
class Cfa:
    """Pattern of 2 x 2 photosites that repeats from the sensor's upper left corner on.

    planes: colour planes (0 R, 1 G, 2 B; all 0 without a filter), [row][column].
    """

    planes: Block

    @classmethod
    def named(cls, name: CfaName) -> Self:
        """Return the pattern of this name; the letters are colours row by row."""
        if name == "MONO":
            return cls.uniform(0)
        top_left, top_right, bottom_left, bottom_right = ("RGB".index(letter) for letter in name)
        return cls(((top_left, top_right), (bottom_left, bottom_right)))

    @classmethod
    def uniform(cls, plane: int) -> Self:
        """Return the pattern whose photosites all have the same colour plane."""
        return cls(((plane, plane), (plane, plane)))

    def block(self, x: int, y: int) -> Block:
        """Return the colour planes of the 2 x 2 block whose upper left photosite is (x, y) of the sensor, [row][column]."""
        rows = self.planes[y % 2], self.planes[(y + 1) % 2]
        (a, b), (c, d) = ((row[x % 2], row[(x + 1) % 2]) for row in rows)
        return (a, b), (c, d)

    def name_at(self, x: int, y: int) -> CfaName:
        """Return the name of the pattern that starts at photosite (x, y) of the sensor."""
        if self == Cfa.uniform(0):
            return "MONO"
        name: CfaName = "".join("RGB"[plane] for row in self.block(x, y) for plane in row)  # type: ignore[assignment]  # four letters of RGB are a name
        return name

    def macros(self, x: int, y: int) -> dict[str, int]:
        """Return the macros of kernels/cfa.h for a frame whose upper left photosite is (x, y) of the sensor."""
        (c00, c01), (c10, c11) = self.block(x, y)
        return {"CFA_00": c00, "CFA_01": c01, "CFA_10": c10, "CFA_11": c11}

    @property
    def colors(self) -> list[int]:
        """Colour planes that occur, ascending."""
        return sorted({plane for row in self.planes for plane in row})
