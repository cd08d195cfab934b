"""The layout of sample planes in interleaved columns, counterpart of kernels/interleaved_columns.h.

A photosite has `over` x `over` samples. Photosites of one colour lie two photosites, that is 2 `over` samples, apart. A plane
(rows, columns) is stored as 2 `over` sets of columns, (column sets, rows, set columns): sample [row, column] stands at
[column % column sets, row, column // column sets]. Photosites of one colour in a row then read adjacent values at any one
offset.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np


@dataclass(frozen=True)
class InterleavedColumns:
    """ReadoutGeometry of planes of `over` x `over` samples per photosite.

    over: samples per photosite and axis. rows: of samples. set_columns: columns of each set.
    """

    over: int
    rows: int
    set_columns: int

    @classmethod
    def holding(cls, over: int, rows: int, columns: int) -> Self:
        """ReadoutGeometry of planes of so many rows and at least so many columns of samples."""
        return cls(over, rows, -(-columns // (2 * over)))

    @property
    def column_sets(self) -> int:
        """Number of column sets, COLUMN_SETS of the kernels."""
        return 2 * self.over

    def shape(self, planes: int) -> tuple[int, int, int, int]:
        """Shape of so many stored planes."""
        return planes, self.column_sets, self.rows, self.set_columns

    def work_size(self, planes: int) -> tuple[int, int, int]:
        """Work-items of a kernel with one for each sample: columns of a set, rows, column sets of all planes."""
        return self.set_columns, self.rows, self.column_sets * planes

    def encode(self, planes: np.ndarray) -> np.ndarray:
        """Stored planes (..., column sets, rows, set columns) of planes (..., rows, columns); columns: of all sets together."""
        split = planes.reshape(*planes.shape[:-1], self.set_columns, self.column_sets)
        return np.ascontiguousarray(np.moveaxis(split, -1, -3))

    def decode(self, stored: np.ndarray) -> np.ndarray:
        """Planes (..., rows, columns) of stored planes (..., column sets, rows, set columns); columns: of all sets together."""
        return np.moveaxis(stored, -3, -1).reshape(*stored.shape[:-3], self.rows, self.column_sets * self.set_columns)

    def element(self, plane, row, column) -> np.ndarray:
        """Number of a sample in a buffer of stored planes; numbers or arrays of them."""
        return element(plane, row, column, self.over, self.rows, self.set_columns)


def element(plane, row, column, over: int, rows, set_columns: int):
    """Number of sample [plane, row, column] in a buffer of planes; numbers or arrays. A column may be negative."""
    sets = 2 * over
    return ((plane * sets + column % sets) * rows + row) * set_columns + column // sets


def column_of(column_set, column_in_set, over: int):
    """Column of samples that stands at this place of a column set; numbers or arrays."""
    return 2 * over * column_in_set + column_set
