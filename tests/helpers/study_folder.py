"""A folder as a study of a camera's ISO and aperture leaves it, made of closed forms without a frame."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from simulator.config import dump_yaml, load_shot

ISOS, STOPS = (100, 400, 1600, 6400), (2.0, 4.0, 8.0)
POINT, AXIS, MEASURED = "point", "axis", "measured"
FIGURES = {
    "grey.mean_dn": ("DN", "patch"),
    "grey.noise_dn": ("DN", "patch"),
    "grey.snr": ("", "patch"),
    "range.range_ev": ("EV", "dynamic_range"),
    "pdr.range_ev": ("EV", "photons_to_photos"),
    "edge.mtf50": ("cycles/px", "mtf"),
    "edge_blur.length_px": ("px", "blur_length"),
}


def figures_at(iso: int, stop: float) -> dict[str, float]:
    """Measured figures of a point."""
    gain, electrons = 0.2 * iso / 100, 40000.0 * 100 / iso * 16.0 / stop**2 / 16.0
    noise_e = math.sqrt(electrons + 9.0)
    numbers = {
        "grey.mean_dn": gain * electrons,
        "grey.noise_dn": gain * noise_e,
        "grey.snr": electrons / noise_e,
        "range.range_ev": math.log2(50000.0 * 100 / iso / 3.0),
        "pdr.range_ev": math.log2(50000.0 * 100 / iso / 3.0) - 2.496,
        "edge.mtf50": 0.5 / (1.0 + 0.05 * stop),
        "edge_blur.length_px": 24.0 / stop,
    }
    return numbers


def row_at(index: int, iso: int, stop: float) -> dict[str, Any]:
    """One row of the table."""
    row: dict[str, Any] = {"index": index, "name": f"iso{iso}_f{stop:g}", "state": "done", "error": None}
    row |= {"command": f"photosite simulate color_checker --set exposure.iso={iso} --set lens.f_number=f/{stop:g}"}
    row |= {"seconds": 0.5 + 0.013 * index, "predicted_error_sigma": 0.1 / stop, "predicted_seconds": 0.4}
    return row | {"exposure.iso": iso, "lens.f_number": stop} | figures_at(iso, stop)


def write_study_folder(folder: Path, failed: int | None = None, letters: str = "") -> Path:
    """Write the folder. failed: index of a point that failed. letters: added to its message."""
    points = [(iso, stop) for iso in ISOS for stop in STOPS]
    rows = [row_at(index, *point) for index, point in enumerate(points)]
    for place in ("points", "curves"):
        (folder / place).mkdir(parents=True)
    columns: dict[str, dict[str, str]] = {
        "index": {"kind": POINT, "unit": "", "title": "number of the point"},
        "name": {"kind": POINT, "unit": "", "title": "name of the point"},
        "state": {"kind": POINT, "unit": "", "title": "state"},
        "error": {"kind": POINT, "unit": "", "title": "why it failed"},
        "command": {"kind": POINT, "unit": "", "title": "command that takes it alone"},
        "seconds": {"kind": "run", "unit": "s", "title": "time that the point took"},
        "predicted_error_sigma": {"kind": POINT, "unit": "", "title": "predicted error"},
        "predicted_seconds": {"kind": POINT, "unit": "s", "title": "predicted time"},
        "exposure.iso": {"kind": AXIS, "unit": "", "title": "iso"},
        "lens.f_number": {"kind": AXIS, "unit": "", "title": "f-number"},
    }
    for name, (unit, quantity) in FIGURES.items():
        title = name.replace(".", " ").replace("_", " ")
        columns[name] = {"kind": MEASURED, "unit": unit, "title": title, "quantity": quantity}
    if failed is not None:
        empty = dict.fromkeys((*FIGURES, "seconds", "predicted_error_sigma", "predicted_seconds"))
        rows[failed] |= {"state": "failed", "error": f"lens.f_number = f/0.1: too fast{letters}", **empty}
    for row, (iso, stop) in zip(rows, points, strict=True):
        if row["state"] == "done":
            _write_point(folder, row["name"], iso, stop)
    texts = ("name", "state", "error", "command")
    kinds = {name: one | {"type": "text" if name in texts else "number"} for name, one in columns.items()}
    transfer = {"x_name": "frequency", "x_unit": "cycles/px", "y_name": "transfer", "y_unit": ""}
    about = {
        "columns": kinds,
        "curves": {"edge.transfer": transfer},
        "dimensions": [{"keys": ["exposure.iso"], "length": 4}, {"keys": ["lens.f_number"], "length": 3}],
    }
    (folder / "columns.json").write_text(json.dumps(about))
    with (folder / "points.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([_cell(row[name]) for name in columns] for row in rows)
    text = "study: iso_and_aperture\nshot: color_checker\nvary:\n  - exposure.iso: [100, 400, 1600, 6400]  # <b>&\n"
    (folder / "study.yaml").write_text(text)
    told = {"study": "iso_and_aperture", "photosite": "0.2.0", "device": {"name": "cpu", "platform": "PoCL"}, "wall_s": 12.5}
    (folder / "provenance.json").write_text(json.dumps(told))
    return folder


def _cell(value: object) -> str:
    return "" if value is None else value if isinstance(value, str) else repr(value)


def _write_point(folder: Path, name: str, iso: int, stop: float) -> None:
    if iso == ISOS[0]:  # the lens is the same at all ISOs
        settings = [f"lens.f_number=f/{stop:g}", "lens.focus_distance=5 m", f"name={name}"]
        (folder / "points" / f"{name}.yaml").write_text(dump_yaml(load_shot("color_checker", settings).resolved))
    across, down = np.meshgrid(np.linspace(0, 1, 96), np.linspace(0, 1, 64))
    noise = np.random.default_rng(iso).normal(0, 0.02 * math.sqrt(iso / 100), (64, 96))
    grey = np.clip(0.2 + 0.6 * (across + 0.2 * down > 0.6) + noise, 0, 1)
    Image.fromarray((255 * np.stack([grey, 0.9 * grey, 0.8 * grey], -1)).astype(np.uint8)).save(
        folder / "points" / f"{name}.png"
    )
    frequency = np.linspace(0.0, 1.0, 41)
    curve = {"edge.transfer.x": frequency, "edge.transfer.y": np.exp(-2.0 * frequency * (0.6 + 0.1 * stop))}
    np.savez(folder / "curves" / f"{name}.npz", **curve)
