"""A plot as data: lines with units, marks and scales. `figures.py` draws it, `write_plots_csv` writes its numbers."""

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol, Self

import numpy as np

from simulator.atomic_files import atomic_write

Scale = Literal["linear", "log", "iso", "dial"]  # iso, dial: logarithmic, labelled as on a camera


class Numbers(Protocol):
    """The numbers of a line: y over x, both (points,) float64, with names and units ("" of a ratio), such as a `Curve`."""

    @property
    def x(self) -> np.ndarray:
        """Abscissae."""
        ...

    @property
    def y(self) -> np.ndarray:
        """Ordinates."""
        ...

    @property
    def x_name(self) -> str:
        """What x is."""
        ...

    @property
    def x_unit(self) -> str:
        """Unit of x."""
        ...

    @property
    def y_name(self) -> str:
        """What y is."""
        ...

    @property
    def y_unit(self) -> str:
        """Unit of y."""
        ...


@dataclass(frozen=True, eq=False)
class Line:
    """One line of a plot.

    curve: its numbers. label: for the legend. subject: what it is of, such as a camera; lines of one subject share a colour.
    has_points: draw the points. has_line: join them. is_reference: a model or limit that the other lines are compared with.
    """

    curve: Numbers
    label: str
    subject: str = ""
    has_points: bool = False
    has_line: bool = True
    is_reference: bool = False


@dataclass(frozen=True)
class Mark:
    """A straight line across a plot at one value of x or y, such as a circle of confusion."""

    axis: Literal["x", "y"]
    value: float
    label: str


@dataclass(frozen=True, eq=False)
class Plot:
    """One plot.

    name: for files and options, such as snr. title: one line. note: conditions and formula, in words.
    x_scale, y_scale: of the axes. y_from: where a logarithmic y axis begins; None: at the least value.
    is_ordered: the lines are steps of one quantity, such as the ISO, and get steps of one colour.
    """

    name: str
    title: str
    lines: tuple[Line, ...]
    note: str = ""
    x_scale: Scale = "linear"
    y_scale: Scale = "linear"
    y_from: float | None = None
    marks: tuple[Mark, ...] = ()
    is_ordered: bool = False

    def about(self, subject: str) -> Self:
        """Return the plot with all its lines of this subject."""
        return replace(self, lines=tuple(replace(line, subject=subject) for line in self.lines))


def overlay(plots: Sequence[Plot]) -> list[Plot]:
    """Put plots of one name into one, in the order in which the names come first; lines keep the subjects that they have.

    Title, scales and note are those of the first plot of a name; equal marks are kept once.
    """
    found: dict[str, Plot] = {}
    for plot in plots:
        first = found.get(plot.name)
        if first is None:
            found[plot.name] = plot
            continue
        marks = (*first.marks, *(mark for mark in plot.marks if mark not in first.marks))
        found[plot.name] = replace(first, lines=(*first.lines, *plot.lines), marks=marks, is_ordered=False)
    return list(found.values())


def axis_label(name: str, unit: str) -> str:
    """Return the label of an axis: name and unit, without brackets for a ratio."""
    return f"{name} [{unit}]" if unit else name


CSV_HEAD = ("plot", "subject", "line", "x_name", "x_unit", "x", "y_name", "y_unit", "y")


def write_plots_csv(plots: Sequence[Plot], path: str | os.PathLike[str]) -> None:
    """Write all numbers of plots, a row for each point, with every digit. Raises PhotositeError when it cannot be written."""
    with atomic_write(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(CSV_HEAD)
        for plot in plots:
            for line in plot.lines:
                one = line.curve
                for x, y in zip(one.x.tolist(), one.y.tolist(), strict=True):
                    names = (plot.name, line.subject, line.label)
                    rows.writerow([*names, one.x_name, one.x_unit, repr(x), one.y_name, one.y_unit, repr(y)])
