"""Configuration: YAML and dotted overrides to shots and sweeps. The only package that knows YAML.

Studies are read by `simulator.config.study_file`, which is not among the names here: its models take long to import, and a
shot needs none of them.
"""

from simulator.config.any_file import load_file
from simulator.config.camera_file import load_camera, read_camera_document
from simulator.config.dataclass_sections import defer_fields, hide_fields
from simulator.config.document_merge import named_file, parse_override, shipped_names
from simulator.config.json_schema import schema
from simulator.config.option_values import (
    camera_data,
    distance_m,
    irradiance_w_m2,
    length_um,
    lens_option,
    response_name,
    shutter_option,
    time_s,
)
from simulator.config.shot_file import build_shot_from_data, load_shot, locate_errors
from simulator.config.sweep import Sweep, SweepPoint, load_sweep
from simulator.config.warnings import frame_warnings, shot_warnings
from simulator.config.yaml_dialect import dump_yaml

__all__ = [
    "Sweep",
    "SweepPoint",
    "build_shot_from_data",
    "camera_data",
    "defer_fields",
    "distance_m",
    "dump_yaml",
    "frame_warnings",
    "hide_fields",
    "irradiance_w_m2",
    "length_um",
    "lens_option",
    "load_camera",
    "load_file",
    "load_shot",
    "load_sweep",
    "locate_errors",
    "named_file",
    "parse_override",
    "read_camera_document",
    "response_name",
    "schema",
    "shipped_names",
    "shot_warnings",
    "shutter_option",
    "time_s",
]
