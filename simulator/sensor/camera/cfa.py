"""Colour filter array: the colour plane of each photosite of the sensor."""

from dataclasses import dataclass
from functools import cache
from typing import Self

from simulator.errors import require

CfaName = str  # "RCCB", "RGGB", "BGGR", "GRBG", "GBRG", "MONO", or rows of a larger pattern, such as "GBGGRG/RGRBGB/..."
Pattern = tuple[tuple[int, ...], ...]
BAYER = ("RGGB", "BGGR", "GRBG", "GBRG")
LARGEST_SIDE = 8  # photosites of a pattern per side: Adobe's DNG SDK reads no larger ones (kMaxCFAPattern)
# Colours in the order of their planes. C, clear, stands in the place of green, W, white, beside it; both have no filter.
COLORS = ("RGB", "RCB", "RGBW")


@dataclass(frozen=True)
class Cfa:
    """Pattern of photosites that repeats from the sensor's upper left corner on.

    planes: colour planes (0 R, 1 G, 2 B; all 0 without a filter), [row][column], of one period on each axis, 2 photosites at
        least. letters: colour of each plane, one of COLORS.
    """

    planes: Pattern
    letters: str = "RGB"

    @staticmethod
    @cache
    def named(name: CfaName) -> "Cfa":
        """Return the pattern of this name; the letters are colours row by row, with "/" between rows unless it is 2 x 2.

        Raises PhotositeError for text that is no pattern.
        """
        if name == "MONO":
            return Cfa.uniform(0)
        named = f"give one of {', '.join(BAYER)}, MONO, RCCB, RGWB"
        known = f"{named}, or the rows of a pattern with / between them, such as RRGG/RRGG/GGBB/GGBB"
        rows = [name[:2], name[2:]] if "/" not in name and len(name) == 4 else name.split("/")
        sides = len(rows), len(rows[0])
        require(all(2 <= side <= LARGEST_SIDE for side in sides), "camera.cfa", name, f"{known}, of 2 to {LARGEST_SIDE} a side")
        require(all(len(row) == sides[1] for row in rows), "camera.cfa", name, f"the rows differ in length; {known}")
        letters = next((colors for colors in COLORS if {*colors} == {*"".join(rows)}), "")
        require(letters != "", "camera.cfa", name, f"{known}, of the colours {', '.join(COLORS)}")
        found = Cfa(_shortest(tuple(tuple(letters.index(letter) for letter in row) for row in rows)), letters)
        twice = (found.planes[0][0], found.planes[1][1]), (found.planes[0][1], found.planes[1][0])
        require(not found.is_small or len(letters) == 4 or (1, 1) in twice, "camera.cfa", name, known)
        return found

    @classmethod
    def uniform(cls, plane: int) -> Self:
        """Return the pattern whose photosites all have the same colour plane."""
        return cls(((plane, plane), (plane, plane)))

    @property
    def period(self) -> tuple[int, int]:
        """Photosites after which the pattern repeats: from row to row, from column to column."""
        return len(self.planes), len(self.planes[0])

    @property
    def is_small(self) -> bool:
        """Whether the pattern repeats after 2 x 2 photosites: the kernels of blur and motion compute no others at once."""
        return self.period == (2, 2)

    @property
    def group(self) -> int:
        """Photosites per side of the square groups of one colour that form a Bayer pattern: 2 of quad-Bayer; 1: none."""
        rows, columns = self.period
        side = rows // 2
        grouped = tuple(tuple(self.planes[y // side * side][x // side * side] for x in range(columns)) for y in range(rows))
        is_bayer = Cfa(tuple(row[::side] for row in self.planes[::side]), self.letters).name_at(0, 0) in BAYER
        return side if rows == columns == 2 * side and grouped == self.planes and is_bayer else 1

    def of_groups(self) -> Self:
        """Return the pattern in which each group of photosites is one."""
        return type(self)(tuple(row[:: self.group] for row in self.planes[:: self.group]), self.letters)

    def block(self, x: int, y: int) -> Pattern:
        """Return the colour planes of one period whose upper left photosite is (x, y) of the sensor, [row][column]."""
        rows, columns = self.period
        return tuple(tuple(self.planes[(y + i) % rows][(x + j) % columns] for j in range(columns)) for i in range(rows))

    def name_at(self, x: int, y: int) -> CfaName:
        """Return the name of the pattern that starts at photosite (x, y) of the sensor."""
        if self == Cfa.uniform(0):
            return "MONO"
        rows = ["".join(self.letters[plane] for plane in row) for row in self.block(x, y)]
        return ("" if self.is_small else "/").join(rows)

    def macros(self, x: int, y: int) -> dict[str, object]:
        """Return the macros of kernels/cfa.h for a frame whose upper left photosite is (x, y) of the sensor."""
        block = self.block(x, y)
        if self.is_small:
            return {f"CFA_{i}{j}": block[i][j] for i in (0, 1) for j in (0, 1)}
        rows, columns = self.period
        table = ", ".join(str(plane) for row in block for plane in row)
        return {"CFA_ROWS": rows, "CFA_COLUMNS": columns, "CFA_TABLE": f"{{{table}}}"}

    def packed(self, x: int, y: int) -> int:
        """Return the planes of a pattern of 2 x 2 photosites that starts at (x, y) of the sensor, row by row, a byte each."""
        (first, second), (third, fourth) = self.block(x, y)
        return first | second << 8 | third << 16 | fourth << 24

    @property
    def colors(self) -> list[int]:
        """Colour planes that occur, ascending."""
        return sorted({plane for row in self.planes for plane in row})


def _shortest(planes: Pattern) -> Pattern:
    """Return one period of a pattern on each axis, of 2 photosites at least."""
    rows = _period(planes)
    columns = _period(tuple(zip(*planes, strict=True)))
    return tuple(row[:columns] for row in planes[:rows])


def _period(lines: Pattern) -> int:
    """Return after how many lines they repeat: a divisor of their number, 2 at least."""
    count = len(lines)
    return next(step for step in range(2, count + 1) if count % step == 0 and lines == lines[:step] * (count // step))
