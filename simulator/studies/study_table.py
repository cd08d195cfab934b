"""The table of a study: a row for each point, as CSV and, where pyarrow is installed, as Parquet; what its columns are."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from simulator.atomic_files import atomic_write
from simulator.config.quantity import convert, split_quantity
from simulator.config.study_file import Study
from simulator.config.unit_words import APERTURES
from simulator.raw.canonical_json import json_text
from simulator.studies.study_folder import (
    COLUMNS,
    PARQUET,
    TABLE,
    Record,
    files_of_point,
    read_time,
)
from simulator.studies.study_point import flat_leaves, number_and_unit

Kind = Literal["point", "axis", "resolved", "measured", "sigma", "run"]
PARQUET_HINT = "pip install 'photosite[study]'"


@dataclass(frozen=True)
class Column:
    """What a column of the table holds. quantity: word of the study file that measures it."""

    kind: Kind
    unit: str
    title: str
    quantity: str | None = None

    def describe(self) -> dict[str, str]:
        """Return it as plain data."""
        told = {"kind": self.kind, "unit": self.unit, "title": self.title}
        return told if self.quantity is None else told | {"quantity": self.quantity}


POINT_COLUMNS = {
    "index": Column("point", "", "number of the point"),
    "name": Column("point", "", "name of the point"),
    "state": Column("point", "", "state"),
    "error": Column("point", "", "why it failed"),
    "command": Column("point", "", "command that takes it alone"),
    "seconds": Column("run", "s", "time that the point took"),
    "predicted_error_sigma": Column("point", "", "predicted error, in standard deviations of the noise"),
    "predicted_seconds": Column("point", "s", "predicted time on the reference machine"),
}


@dataclass(frozen=True)
class Table:
    """Rows of all points in the order of the study. curves: names and units of each `LABEL.CURVE`."""

    columns: dict[str, Column]
    rows: list[dict[str, Any]]
    curves: dict[str, dict[str, str]]
    dimensions: list[dict[str, Any]]


def make_table(study: Study, folder: Path, checked: Mapping[int, Record]) -> Table:
    """Return the table of a study.

    checked: records of the points that this run has taken or found done, by index. Others are read; they count as stale, since
    nobody has compared them with the study.
    """
    axes = _axis_units(study, checked)
    resolved, measured, sigmas = dict[str, str](), dict[str, tuple[str, str]](), dict[str, str]()
    rows, curves = list[dict[str, Any]](), dict[str, dict[str, str]]()
    for point in study:
        files = files_of_point(folder, point.name)
        record = checked.get(point.index)
        state = record.state if record is not None else "stale" if files.record.exists() else "missing"
        time = read_time(files.time)
        row: dict[str, Any] = {
            "index": point.index,
            "name": point.name,
            "state": state,
            "error": None if record is None else record.error,
            "command": point.command,
            "seconds": None if time is None else time.seconds,
        }
        leaves = record.resolved if record is not None and state == "done" else {}
        row |= {key: _axis_value(written, axes[key]) for key, written in point.values.items()}
        if record is not None and state == "done":
            row |= {name: getattr(record, name) for name in ("predicted_error_sigma", "predicted_seconds")}
            for key, leaf in leaves.items():
                if key not in axes and key not in ("name", "seeds.frame"):
                    row[key], unit = number_and_unit(leaf)
                    resolved[key] = resolved.get(key) or unit
            for label, figures in record.figures.items():
                for name, figure in figures.items():
                    row[f"{label}.{name}"] = figure.value
                    measured[f"{label}.{name}"] = figure.unit, label
                    if figure.sigma is not None:
                        row[f"{label}.{name}.sigma"] = figure.sigma
                        sigmas[f"{label}.{name}"] = figure.unit
            curves |= {f"{label}.{name}": one for label, named in record.curves.items() for name, one in named.items()}
        rows.append(row)
    columns = dict(POINT_COLUMNS) | {key: Column("axis", unit, _title(key)) for key, unit in axes.items()}
    labels = list(study.measure)
    for name, (unit, label) in sorted(measured.items(), key=lambda one: (labels.index(one[1][1]), one[0])):
        word = next(iter(study.measured[label]))
        columns[name] = Column("measured", unit, name.replace(".", " ").replace("_", " "), word)
        if name in sigmas:
            columns[f"{name}.sigma"] = Column("sigma", unit, f"standard error of {columns[name].title}", word)
    columns |= {key: Column("resolved", unit, _title(key)) for key, unit in sorted(resolved.items())}
    dimensions = [{"keys": list(keys), "length": length} for keys, length in study.dimensions]
    return Table(columns, [{name: row.get(name) for name in columns} for row in rows], curves, dimensions)


def _axis_units(study: Study, checked: Mapping[int, Record]) -> dict[str, str]:
    """Return the unit of each axis: that in which a shot holds it, else that of its first value."""
    done = (record.resolved for record in checked.values() if record.error is None)
    known = flat_leaves(study.describe()["resolved"]["shot"]) | next(done, {})
    first = study[0].values
    return {key: number_and_unit(known[key] if key in known else first[key])[1] for key in study.keys}


def _axis_value(written: object, unit: str) -> object:
    """Return the value of an axis: a number in a unit where it is one, else text."""
    if isinstance(written, int | float) and not isinstance(written, bool):
        return written
    if isinstance(written, str):
        with suppress(ValueError):
            number, own = split_quantity(written)
            return number if own in ("", unit, *APERTURES) else convert(number, own, unit, "")
    return _text(written)


def _title(key: str) -> str:
    return "f-number" if key == "lens.f_number" else key.rpartition(".")[2].replace("_", " ")


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if isinstance(value, str) else json_text("study", value)


def write_table(table: Table, folder: Path) -> None:
    """Write points.csv, columns.json, and points.parquet where pyarrow is installed. Raises PhotositeError."""
    kinds = {name: "number" if is_number_column(row[name] for row in table.rows) else "text" for name in table.columns}
    told = {
        "columns": {name: column.describe() | {"type": kinds[name]} for name, column in table.columns.items()},
        "curves": table.curves,
        "dimensions": table.dimensions,
    }
    with atomic_write(folder / COLUMNS) as path:
        path.write_text(json_text("study", told, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    with atomic_write(folder / TABLE) as path, open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table.columns)
        writer.writerows([_cell(row[name]) for name in table.columns] for row in table.rows)
    if has_parquet():
        _write_parquet(table, folder / PARQUET)
    else:
        (folder / PARQUET).unlink(missing_ok=True)  # an older one would tell something else


def has_parquet() -> bool:
    """Return whether Parquet can be written."""
    return find_spec("pyarrow") is not None


def _cell(value: object) -> str:
    """Return a value as CSV holds it: numbers as Python writes them, nothing for what is not there."""
    return (
        "" if value is None else value if isinstance(value, str) else _text(value) if isinstance(value, bool) else repr(value)
    )


def is_number_column(values: Iterable[object]) -> bool:
    """Return whether values are all numbers or missing, at least one a number."""
    there = [value for value in values if value is not None]
    return bool(there) and all(isinstance(value, int | float) and not isinstance(value, bool) for value in there)


def _write_parquet(table: Table, path: Path) -> None:
    import pyarrow  # pyright: ignore[reportMissingImports]
    from pyarrow import parquet  # pyright: ignore[reportMissingImports]

    arrays, fields = [], []
    for name, column in table.columns.items():
        values: Sequence[Any] = [row[name] for row in table.rows]
        if is_number_column(values):
            is_whole = all(isinstance(value, int) for value in values)
            kind = pyarrow.int64() if is_whole else pyarrow.float64()
            values = values if is_whole else [None if value is None else float(value) for value in values]
        else:
            kind, values = pyarrow.string(), [None if value is None else _cell(value) for value in values]
        arrays.append(pyarrow.array(values, kind))
        fields.append(pyarrow.field(name, kind, metadata={key: text for key, text in column.describe().items() if text}))
    with atomic_write(path) as temporary:
        parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields)), temporary)
