"""A shot file with a sweep, and the sweep that is read from it."""

import yaml

from simulator.config import load_sweep
from simulator.config.sweep import Sweep

SHOT = """\
scene: {chart: flat_field, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}
exposure: {time: 1/125 s, iso: 100}
camera: sony_a7s2
seeds: {frame: 40}
"""


def write_sweep(tmp_path, sweep: dict, text: str = SHOT):
    path = tmp_path / "s.yaml"
    path.write_text(text + yaml.safe_dump({"sweep": sweep}, sort_keys=False))
    return path


def read_sweep(tmp_path, sweep: dict, text: str = SHOT) -> Sweep:
    return load_sweep(write_sweep(tmp_path, sweep, text))
