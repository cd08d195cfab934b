"""A study of small frames, and what its folder holds."""

import csv
import io
from pathlib import Path

from simulator.config.study_file import Study
from simulator.studies import load_study

SHOT = """\
scene: {chart: flat_field, luminance: 5 cd/m^2, depth: infinity}
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: infinity}
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 2000, y: 1400, width: 64, height: 48}}
"""
STUDY = """\
study: small
shot: ./flat.yaml
vary:
  - exposure.iso: [100, 400, 1600]
  - {lens.f_number: [f/4, f/8], exposure.time: [1/60 s, 1/15 s]}
measure:
  grey: {patch: {area: [0, 0, 32, 64]}}
  clip: clipped_share
"""
OWN = """\
import time
import numpy as np
from simulator.measurement.quantities import Curve, Figure
def slowly(frame):
    time.sleep(0.15)
    return {"mean": float(frame.dn.mean())}
def rows(frame):
    found = frame.dn.mean(axis=1)
    profile = Curve(np.arange(len(found)), found, "row", "", "mean", "DN")
    return {"range": Figure(float(np.ptp(found)), "DN"), "profile": profile}
def fails_at_400(frame):
    return 1.0 if frame.shot.exposure.iso != 400 else {}["no such key"]
"""


def write_study(folder: Path, text: str = STUDY, shot: str = SHOT) -> Path:
    """Write a study with its shot and the functions of OWN; return its path."""
    (folder / "flat.yaml").write_text(shot)
    (folder / "own.py").write_text(OWN)
    path = folder / "study.yaml"
    path.write_text(text)
    return path


def small_study(folder: Path, text: str = STUDY, shot: str = SHOT) -> Study:
    """Write and read a study."""
    return load_study(write_study(folder, text, shot))


def content(folder: Path) -> dict[str, bytes]:
    """Return all files of a study's folder that are the same for every run: without times, the table without that column."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
    found = {
        name: data for name, data in files.items() if name.split("/")[0] not in ("times", "provenance.json", "points.parquet")
    }
    rows = list(csv.DictReader(io.StringIO(found.pop("points.csv").decode())))
    table = [{key: value for key, value in row.items() if key != "seconds"} for row in rows]
    return found | {"points.csv": repr(table).encode()}
