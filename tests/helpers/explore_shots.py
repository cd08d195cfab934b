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
