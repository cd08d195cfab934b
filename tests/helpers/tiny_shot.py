"""The files of a shot by a camera of 64 x 48 photosites."""

from pathlib import Path

SHOT = """\
scene:
  chart: flat_field
  luminance: 100 cd/m^2
lens:
  focal_length: 50 mm
  f_number: f/4
  focus_distance: 2 m
exposure:
  time: 1/125 s
  iso: 100
camera: tiny
"""
CAMERA = """\
make: Maker
model: Tiny
width: 64
height: 48
pixel_pitch: 5 um
cfa: RGGB
bit_depth: 12
black_level: 64 DN
response: {file: curves.yaml}
iso_table:
  100: {gain: 0.5 DN/e-, read_noise: 2 DN}
  200: {gain: 1 DN/e-, read_noise: 3 DN}
read_noise_after_gain: 1.5 DN
stages:
  photon_shot_noise: {}
  full_well: {capacity: 5000 e-}
"""
CURVES = """\
wavelengths: {start: 400 nm, step: 100 nm}
peak_quantum_efficiency: 0.5
relative: [[0, 0, 1], [0.2, 0.9, 0.1], [0.8, 0.1, 0], [0.1, 0, 0]]
"""


def tiny_folder(folder: Path) -> Path:
    """Write the camera's files into a folder, and return it."""
    (folder / "tiny.yaml").write_text(CAMERA)
    (folder / "curves.yaml").write_text(CURVES)
    return folder


def write_shot(folder: Path, text: str = SHOT) -> Path:
    """Write a shot by that camera beside its files, and return its path."""
    path = folder / "shot.yaml"
    path.write_text(text.replace("camera: tiny", "camera: tiny.yaml"))
    return path
