"""Tables of a path over time in CSV files, and smooth curves through them."""

import csv
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError, check_file, reading, require

TIME = "time_s"
SLACK_S = 1e-9  # by which an instant may lie beyond the end of a path, for rounding


@dataclass(frozen=True)
class PathTable:
    """Curves over time: cubic splines through the lines of a table (not-a-knot; through two lines, straight ones).

    times_s: (lines,) float64, ascending [s]. values: (lines, columns) float64, 0 for a column that the file lacks.
    """

    times_s: np.ndarray
    values: np.ndarray

    @property
    def highest_hz(self) -> float:
        """Highest frequency that the lines show, a period in four of them, where they lie densest [Hz]; 0: they go straight.

        A tenth of their distances may be smaller, as those of a clock that stutters.
        """
        if len(self.times_s) == 2 or not np.ptp(self.values, axis=0).any():
            return 0.0
        return 0.25 / float(np.quantile(np.diff(self.times_s), 0.1))

    def at(self, times_s: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return values, or their derivative by time, at instants of the table, (instants, columns) float64."""
        from scipy.interpolate import CubicSpline  # a fifth of a second to import

        inside = np.clip(times_s, self.times_s[0], self.times_s[-1])
        return CubicSpline(self.times_s, self.values, axis=0)(inside, derivative)


def check_inside(
    times_s: np.ndarray, span_s: tuple[float, float], key: str, value: object, fix: str = "give a longer path"
) -> None:
    """Raise PhotositeError for instants [s] that lie outside the span of a path on the shot's clock [s]."""
    if len(times_s) == 0:
        return
    first, last = float(np.min(times_s)), float(np.max(times_s))
    if not (span_s[0] - SLACK_S <= first and last <= span_s[1] + SLACK_S):
        raise PhotositeError(
            f"the path holds from {span_s[0]:.6g} s to {span_s[1]:.6g} s of the shot's clock, "
            f"but it is needed from {first:.6g} s to {last:.6g} s; {fix}",
            key=key,
            value=value,
        )


def read_path(path: Path, columns: tuple[str, ...], key: str) -> PathTable:
    """Read a table of a path: a CSV file, first the names of its columns, `time_s` and some of `columns`.

    Lines that begin with # are left out, angles are not unwrapped.
    Raises PhotositeError for a file that is missing, damaged, without `time_s` or all of the columns, with a column of another
    name, with less than two lines, with what is no finite number, or whose times do not ascend.
    """
    check_file(path, key)
    stat = path.stat()
    return _read(path, columns, key, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=64)
def _read(path: Path, columns: tuple[str, ...], key: str, _modified: int, _size: int) -> PathTable:
    with reading(path, "export it again as CSV", key=key), open(path, encoding="utf-8-sig", newline="") as lines:
        names, *rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#"))) or [[]]
    names = [name.strip() for name in names]
    known = TIME, *columns
    rule = f"its columns are {', '.join(names) or 'none'}; name them {TIME} and some of {', '.join(columns)}, in the first line"
    require(TIME in names and len(names) > 1 and set(names) <= set(known) and len(set(names)) == len(names), key, path, rule)
    require(len(rows) >= 2, key, path, f"holds {len(rows)} lines; a path needs two or more")
    table = np.array([_numbers(row, len(names), number, path, key) for number, row in enumerate(rows, 1)])
    times_s = table[:, names.index(TIME)]
    steps = np.flatnonzero(np.diff(times_s) <= 0)
    if len(steps):
        raise PhotositeError(
            f"{TIME} does not ascend: {times_s[steps[0] + 1]:g} s comes after {times_s[steps[0]]:g} s; sort the lines by time",
            key=key,
            value=path,
        )
    values = np.stack([table[:, names.index(name)] if name in names else np.zeros(len(table)) for name in columns], axis=1)
    for array in (times_s, values):
        array.setflags(write=False)
    return PathTable(times_s, values)


def _numbers(row: list[str], count: int, number: int, path: Path, key: str) -> list[float]:
    """Return the numbers of a line. Raises PhotositeError for anything that is none, and for NaN and Inf."""
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        raise PhotositeError(
            f"line {number} of its numbers is {','.join(row)[:80]}; give {count} finite numbers in each", key=key, value=path
        )
    return values
