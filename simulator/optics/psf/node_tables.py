"""Tables of kernels at all nodes: made at some of them, and interpolated between these.

Light between nodes is interpolated linearly, which is why there are so many. Polynomials of the fifth degree through every
second or third are nearer to their kernels than what is allowed.
"""

from collections.abc import Callable

import numpy as np

from simulator.optics.psf.rotated_kernels import lagrange_weights

STEPS = (3, 2)  # nodes from one that is made to the next, if what lies between is right
QUINTIC = 6  # nodes of an interpolation

Make = Callable[[int, int], np.ndarray]  # table (..., size, size) float32 at a node row and column


class NodeTables:
    """Tables of the nodes of a sensor; those that are made are kept.

    make: makes one. nodes: rows and columns. mirrors: whether nodes have mirror images of the tables of those in the first
    quarter. made: rows and columns of the nodes at which tables are made, ascending.
    """

    def __init__(self, make: Make, nodes: tuple[int, int], *, mirrors: bool) -> None:
        self.make, self.nodes, self.mirrors = make, nodes, mirrors
        self.made = [list(range(count)) for count in nodes]
        self._kept: dict[tuple[int, int], np.ndarray] = {}
        self._row, self._in_row = -1, dict[int, np.ndarray]()

    def space(self, made: list[list[int]]) -> None:
        """Make tables at these rows and columns from now on."""
        self.made, self._row = made, -1

    def at(self, row: int, column: int) -> np.ndarray:
        """Table of a node."""
        return _weighted(self._around(column, self.made[1]), lambda across: self._of_row(row, across))

    def _of_row(self, row: int, column: int) -> np.ndarray:
        """Table of a node in a column of those that are made; kept until another row is asked for."""
        if self._row != row:
            self._row, self._in_row = row, {}
        if column not in self._in_row:
            self._in_row[column] = _weighted(self._around(row, self.made[0]), lambda down: self.own(down, column))
        return self._in_row[column]

    @staticmethod
    def _around(place: int, made: list[int]) -> list[tuple[int, float]]:
        """Those made around a row or column of nodes, and their weights."""
        if place in made:
            return [(place, 1.0)]
        numbers, weights = lagrange_weights(np.array(made, float), place, QUINTIC)
        return [(made[number], float(weight)) for number, weight in zip(numbers, weights, strict=True)]

    def own(self, row: int, column: int) -> np.ndarray:
        """Table that is made for a node, or the mirror image of one."""
        first = row, column
        if self.mirrors:
            first = min(row, self.nodes[0] - 1 - row), min(column, self.nodes[1] - 1 - column)
        if first not in self._kept:
            self._kept[first] = self.make(*first)
        return self._kept[first][..., :: 1 if first[0] == row else -1, :: 1 if first[1] == column else -1]


def _weighted(parts: list[tuple[int, float]], table: Callable[[int], np.ndarray]) -> np.ndarray:
    """Weighted sum of tables of some numbers."""
    (first, weight), *others = parts
    if not others:
        return table(first)
    found = np.float32(weight) * table(first)
    for number, weight in others:
        found += np.float32(weight) * table(number)
    return found


def tables_of(make: Make, nodes: tuple[int, int], fits: Callable[[np.ndarray], bool], *, mirrors: bool) -> NodeTables:
    """Tables that are made at as few nodes as fit. fits: whether a difference of tables is small enough.

    It is asked beside a corner and beside the middle, as far as nodes are from those made.
    """
    found = NodeTables(make, nodes, mirrors=mirrors)
    every, places = found.made, ((1, 1), (nodes[0] // 2 - 1, nodes[1] // 2 - 1))
    for step in STEPS:
        found.space([_some(count, step) for count in nodes])
        fewer = all(QUINTIC <= len(own) < count for own, count in zip(found.made, nodes, strict=True))
        if fewer and all(fits(found.at(*place) - found.own(*place)) for place in places):
            return found
    found.space(every)
    return found


def _some(count: int, step: int) -> list[int]:
    """Numbers from 0 to count - 1, odd, at most so far apart, the middle one and mirror images of all among them."""
    middle = count // 2
    half = np.rint(np.linspace(0, middle, -(-middle // step) + 1)).astype(int)
    return sorted({*half.tolist(), *(count - 1 - half).tolist()})
