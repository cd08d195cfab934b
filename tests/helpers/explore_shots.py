"""A shot with depth, small enough for a test of the page, in a folder of its own."""

from pathlib import Path

import numpy as np

from simulator.raw.image_files import write_picture

WIDTH, HEIGHT = 960, 640

SHOT = """
scene:
  image: wall.exr
  depth: {image: depth.exr, unit: m}
  field_of_view: 60 deg
  luminance: 500 cd/m^2
lens: {focal_length: 8 mm, f_number: f/2, focus_distance: 2 m}
exposure: {time: 1/100 s, iso: 100}
camera:
  base: sony_a7s2
  width: 960
  height: 640
  pixel_pitch: 6 um
"""


def write_shot(folder: Path, name: str = "wall") -> Path:
    """Write a textured wall with a near half at 2 m and a far half at 8 m, and the shot of it; returns the shot file."""
    rng = np.random.default_rng(1)
    coarse = rng.uniform(0.05, 0.9, (HEIGHT // 16, WIDTH // 16, 3)).astype(np.float32)
    write_picture(folder / "wall.exr", np.kron(coarse, np.ones((16, 16, 1), np.float32)), ())
    depth_m = np.full((HEIGHT, WIDTH, 1), 8.0, np.float32)
    depth_m[:, : WIDTH // 2] = 2.0
    write_picture(folder / "depth.exr", depth_m, ("Z",))
    path = folder / f"{name}.yaml"
    path.write_text(SHOT, encoding="utf-8")
    return path


MOVING = """
scene:
  layers:
    - {image: bar.exr, depth: 5 m}
    - {image: wall.exr, depth: 5 m}
  luminance: 500 cd/m^2
lens: {focal_length: 50 mm, f_number: f/8, focus_distance: 5 m}
exposure: {time: 1/30 s, iso: 100}
camera: {base: sony_a7s2, width: 480, height: 320}
motion:
  layers:
    0: {velocity: [1200 px/s, 0 px/s]}
sweep:
  vary:
    exposure.time: [1/30 s, 1/100 s]
"""


def write_moving(folder: Path) -> Path:
    """Write a bright bar that moves by 40 pixels before a dark wall, and the shot of it, a sweep; returns the shot file."""
    wall, bar = np.full((320, 480, 3), 0.1, np.float32), np.zeros((320, 480, 4), np.float32)
    bar[96:224, 200:232] = 1.0
    write_picture(folder / "wall.exr", wall, ())
    write_picture(folder / "bar.exr", bar, ("R", "G", "B", "A"))
    path = folder / "moving.yaml"
    path.write_text(MOVING, encoding="utf-8")
    return path
