"""The results of a study, read from its folder: rows, curves, a pandas table and an xarray dataset."""

import csv
import json
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simulator.config.document import read_document
from simulator.errors import PhotositeError, reading
from simulator.measurement.quantities import Curve
from simulator.studies.study_folder import BROKEN, COLUMNS, PROVENANCE, STUDY, TABLE, files_of_point

if TYPE_CHECKING:
    import pandas  # pyright: ignore[reportMissingImports]
    import xarray  # pyright: ignore[reportMissingImports]

HINT = "pip install 'photosite[study]'"


@dataclass(frozen=True, eq=False)
class StudyResult:
    """What a study found.

    folder: of the study. columns: of the table, each with kind ("point", "axis", "resolved", "measured", "sigma", "run"), unit,
    title, type ("number", "text"), and the quantity that measured it. rows: one for each point, column -> value; None where
    there is none. curves: `LABEL.CURVE` -> names and units of its axes. dimensions: axes that vary together, with the number of
    their values; the points are all combinations, the last fastest.
    """

    folder: Path
    columns: dict[str, dict[str, str]]
    rows: list[dict[str, Any]]
    curves: dict[str, dict[str, str]]
    dimensions: list[dict[str, Any]]

    @cached_property
    def study(self) -> dict[str, Any]:
        """The study as it was run. Raises PhotositeError for a folder without it."""
        data: dict[str, Any] = read_document(self.folder / STUDY).data
        return data

    @cached_property
    def provenance(self) -> dict[str, Any]:
        """Version, device, libraries, command and times of the last run. Raises PhotositeError for a folder without it."""
        return _read_json(self.folder / PROVENANCE)

    def keys(self, kind: str) -> list[str]:
        """Return the names of the columns of a kind."""
        return [name for name, column in self.columns.items() if column["kind"] == kind]

    def table(self) -> "pandas.DataFrame":
        """Return the rows as a table of pandas, numbers as float64 or int64. Raises PhotositeError without pandas."""
        try:
            import pandas  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise PhotositeError(f"a table needs pandas: {HINT}") from None
        table = pandas.DataFrame(self.rows, columns=list(self.columns))
        for name, column in self.columns.items():
            if column["type"] == "number" and table[name].dtype == object:
                table[name] = pandas.to_numeric(table[name])
        return table

    def dataset(self) -> "xarray.Dataset":
        """Return the measured figures over the varied axes, units as attributes. Raises PhotositeError without xarray.

        A dimension is an axis, or several that vary together: it has the name of the first of them, and the others are
        coordinates along it. Figures of points that are not done are nan.
        """
        try:
            import xarray  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise PhotositeError(f"a dataset needs xarray: {HINT}") from None
        shape = tuple(one["length"] for one in self.dimensions)
        names = [one["keys"][0] for one in self.dimensions]
        coordinates: dict[str, Any] = {}
        for place, one in enumerate(self.dimensions):
            for key in one["keys"]:
                along = np.moveaxis(self._grid(key, shape), place, 0).reshape(one["length"], -1)
                coordinates[key] = (names[place], self._merge(key, along), self._attributes(key))
        variables = {
            name: (
                names,
                self._grid(name, shape),
                {"units": self.columns[name]["unit"], "long_name": self.columns[name]["title"]},
            )
            for name in (*self.keys("measured"), *self.keys("sigma"), *self.keys("run"), "state")
        }
        return xarray.Dataset(variables, coordinates, {"study": self.study["study"]})

    def _attributes(self, name: str) -> dict[str, str]:
        """Return unit and title of a column as xarray's plots expect them."""
        return {"units": self.columns[name]["unit"], "long_name": self.columns[name]["title"]}

    def _grid(self, name: str, shape: tuple[int, ...]) -> np.ndarray:
        """Return a column over the dimensions: float64, or objects of a column of text."""
        values = [row[name] for row in self.rows]
        if self.columns[name]["type"] == "number":
            return np.array([np.nan if value is None else value for value in values], np.float64).reshape(shape)
        return np.array(values, object).reshape(shape)

    def _merge(self, key: str, along: np.ndarray) -> np.ndarray:
        """Return the values of an axis: those of any point that has one. along: (values, points)."""
        if self.columns[key]["type"] == "number":
            return np.array([next((one for one in row if not np.isnan(one)), np.nan) for row in along])
        return np.array([next((one for one in row if one is not None), "") for row in along], str)

    def curve(self, name: str, label: str) -> Curve:
        """Return a curve of a point. name: of the point. label: `LABEL.CURVE`, or LABEL where it has one curve.

        Raises PhotositeError for a point or a curve that is not there.
        """
        known = [one for one in self.curves if one == label or one.partition(".")[0] == label]
        if len(known) != 1:
            told = "no such curve" if not known else f"has the curves {', '.join(known)}"
            raise PhotositeError(f"{told}; there are {', '.join(self.curves) or 'none'}", key="curve", value=label)
        path = files_of_point(self.folder, name).curves
        if not path.is_file():
            raise PhotositeError(f"no curves of {name}; it may have failed, see the table", file=path)
        with reading(path, BROKEN), np.load(path) as arrays:
            x, y = arrays[f"{known[0]}.x"], arrays[f"{known[0]}.y"]
        return Curve(x, y, **self.curves[known[0]])


def load(folder: str | os.PathLike[str]) -> StudyResult:
    """Read the results of a study from its folder. Raises PhotositeError for a folder that holds none."""
    place = Path(folder)
    if not (place / TABLE).is_file() or not (place / COLUMNS).is_file():
        told = "holds no results of a study; give the folder that `photosite study STUDY.yaml --out FOLDER` wrote"
        raise PhotositeError(told, file=place)
    known = _read_json(place / COLUMNS)
    with reading(place / COLUMNS, BROKEN):
        numeric = {name: column["type"] == "number" for name, column in known["columns"].items()}
        curves, dimensions = known["curves"], known["dimensions"]
    with reading(place / TABLE, BROKEN), open(place / TABLE, newline="", encoding="utf-8") as file:
        lines = csv.DictReader(file)
        rows = [{name: _value(text, numeric[name]) for name, text in line.items()} for line in lines]
        columns = {name: known["columns"][name] for name in lines.fieldnames or ()}  # in the order of the table
    return StudyResult(place, columns, rows, curves, dimensions)


def _value(text: str, is_number: bool) -> float | int | str | None:
    """Return the value of a cell; None for an empty one."""
    if text == "":
        return None
    if not is_number:
        return text
    return int(text) if text.lstrip("-").isdecimal() else float(text)


def _read_json(path: Path) -> dict[str, Any]:
    with reading(path, BROKEN):
        data: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return data
