"""Configuration: YAML and dotted overrides to shots and sweeps. The only package that knows YAML."""

from simulator.config.any_file import load_file
from simulator.config.camera_file import camera_document, load_camera
from simulator.config.document_merge import named_file
from simulator.config.json_schema import schema
from simulator.config.option_values import camera_data, length_um, response_name
from simulator.config.sections_of_dataclasses import given_later
from simulator.config.shot_file import load_shot, located, shot_of_data
from simulator.config.sweep import Sweep, SweepPoint, load_sweep
from simulator.config.warnings import shot_warnings
from simulator.config.yaml_dialect import dump_yaml

__all__ = [
    "Sweep",
    "SweepPoint",
    "camera_data",
    "camera_document",
    "dump_yaml",
    "given_later",
    "length_um",
    "load_camera",
    "load_file",
    "load_shot",
    "load_sweep",
    "located",
    "named_file",
    "response_name",
    "schema",
    "shot_of_data",
    "shot_warnings",
]
