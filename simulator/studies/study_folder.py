"""Where the files of a study lie, and the record of each point."""

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from simulator.atomic_files import atomic_write
from simulator.errors import PhotositeError, reading
from simulator.measurement.quantities import Figure
from simulator.raw.canonical_json import json_text

STUDY, PROVENANCE, TABLE, PARQUET, COLUMNS = "study.yaml", "provenance.json", "points.csv", "points.parquet", "columns.json"
BROKEN = "delete it and run the study again"
State = Literal["done", "failed", "stale", "missing"]


@dataclass(frozen=True)
class PointFiles:
    """Paths of the files of one point. The record is written last: where it stands, the others are complete."""

    shot: Path
    record: Path
    preview: Path
    curves: Path
    dng: Path
    truth: Path
    time: Path


def files_of_point(folder: Path, name: str) -> PointFiles:
    """Return the paths of the files of a point."""
    points = folder / "points"
    return PointFiles(
        points / f"{name}.yaml",
        points / f"{name}.json",
        points / f"{name}.png",
        folder / "curves" / f"{name}.npz",
        points / f"{name}.dng",
        points / f"{name}.truth.exr",
        folder / "times" / f"{name}.json",
    )


@dataclass(frozen=True)
class Record:
    """What is known of a point that was taken; the same for any number of workers.

    key: hash of all that it follows from. error: why it failed; None: it did not. resolved: dotted key -> number or text of the
    shot that was taken, what the camera chose included. figures: label -> name -> figure. curves: label -> name -> names and
    units of a curve.
    predicted_error_sigma: of the plan [standard deviations of the noise]. predicted_seconds: on the reference machine [s].
    """

    key: str
    error: str | None = None
    resolved: dict[str, Any] = field(default_factory=dict)
    figures: dict[str, dict[str, Figure]] = field(default_factory=dict)
    curves: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    predicted_error_sigma: float | None = None
    predicted_seconds: float | None = None

    @property
    def state(self) -> State:
        """Whether the point was done or failed."""
        return "done" if self.error is None else "failed"


@dataclass(frozen=True)
class Timing:
    """How long a point took [s], on which device."""

    seconds: float
    device: str


def write_record(path: Path, record: Record) -> None:
    """Write the record of a point. Raises PhotositeError."""
    _write(path, asdict(record))


def read_record(path: Path) -> Record | None:
    """Return the record of a point; None where there is none. Raises PhotositeError for a file that is damaged."""
    data = _read(path)
    if data is None:
        return None
    with reading(path, BROKEN):
        figures = {
            label: {name: Figure(_number(one["value"]), one["unit"], _optional(one["sigma"])) for name, one in named.items()}
            for label, named in data.pop("figures").items()
        }
        for key in ("predicted_error_sigma", "predicted_seconds"):
            data[key] = _optional(data[key])
        return Record(**data | {"figures": figures, "warnings": tuple(data["warnings"])})


def write_time(path: Path, timing: Timing) -> None:
    """Write how long a point took. Raises PhotositeError."""
    _write(path, asdict(timing))


def read_time(path: Path) -> Timing | None:
    """Return how long a point took; None where that is not known."""
    try:
        data = _read(path)
        return None if data is None else Timing(**data)
    except (PhotositeError, TypeError):
        return None


def _write(path: Path, data: dict[str, Any]) -> None:
    with atomic_write(path, durable=False) as temporary:
        temporary.write_text(json_text(path.stem, data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _read(path: Path) -> dict[str, Any] | None:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise PhotositeError(f"cannot be read ({error}); {BROKEN}", file=path) from None
    with reading(path, BROKEN):
        data: dict[str, Any] = json.loads(text)
        return data


def _number(value: float | str | None) -> float:
    """Return a number; JSON holds inf and nan as text."""
    return math.nan if value is None else float(value)


def _optional(value: float | str | None) -> float | None:
    return None if value is None else float(value)
