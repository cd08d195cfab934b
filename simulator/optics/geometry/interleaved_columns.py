"""The layout of sample planes in interleaved columns, counterpart of kernels/interleaved_columns.h.

A photosite has `over` x `over` samples. Photosites of one colour lie two photosites, that is 2 `over` samples, apart. A plane
(rows, columns) is stored as 2 `over` sets of columns, (column sets, rows, set columns): sample [row, column] stands at
[column % column sets, row, column // column sets]. Photosites of one colour in a row then read adjacent values at any one
offset.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

IntOrArray = int | np.ndarray


@dataclass(frozen=True)
class InterleavedColumns:
    """Memory layout of planes of `over` x `over` samples per photosite.

    over: samples per photosite and axis. rows: of samples. set_columns: columns of each set.
    """

    over: int
    rows: int
    set_columns: int

    @classmethod
    def holding(cls, over: int, rows: int, columns: int) -> Self:
        """Memory layout of planes of so many rows and at least so many columns of samples."""
        return cls(over, rows, -(-columns // (2 * over)))

    @property
    def column_sets(self) -> int:
        """Number of column sets, COLUMN_SETS of the kernels."""
        return 2 * self.over

    def shape(self, planes: int) -> tuple[int, int, int, int]:
        """Shape of the array of so many stored planes."""
        return planes, self.column_sets, self.rows, self.set_columns

    def work_size(self, planes: int, rows: int | None = None) -> tuple[int, int, int]:
        """Global size of a kernel with one work-item per sample: columns of a set, rows, column sets of all planes.

        rows: the first ones alone; None: all.
        """
        return self.set_columns, self.rows if rows is None else rows, self.column_sets * planes

    def encode(self, planes: np.ndarray) -> np.ndarray:
        """Interleave planes (..., rows, columns), with the columns of all sets, into (..., column sets, rows, set columns)."""
        split = planes.reshape(*planes.shape[:-1], self.set_columns, self.column_sets)
        return np.ascontiguousarray(np.moveaxis(split, -1, -3))

    def decode(self, stored: np.ndarray) -> np.ndarray:
        """Return planes (..., rows, columns), with the columns of all sets, from (..., column sets, rows, set columns)."""
        return np.moveaxis(stored, -3, -1).reshape(*stored.shape[:-3], self.rows, self.column_sets * self.set_columns)

    def element(self, plane: IntOrArray, row: IntOrArray, column: IntOrArray) -> IntOrArray:
        """Index of sample [plane, row, column] in a buffer of stored planes."""
        return element(plane, row, column, self.over, self.rows, self.set_columns)


def element(
    plane: IntOrArray, row: IntOrArray, column: IntOrArray, over: int, rows: int | np.ndarray, set_columns: int
) -> IntOrArray:
    """Index of sample [plane, row, column] in a buffer of stored planes; the column may be negative."""
    sets = 2 * over
    return ((plane * sets + column % sets) * rows + row) * set_columns + column // sets


def column_of(column_set: IntOrArray, column_in_set: IntOrArray, over: int) -> IntOrArray:
    """Column of a sample, from its column set and its column in the set."""
    return 2 * over * column_in_set + column_set
