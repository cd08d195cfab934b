"""A small shot of which the audit knows the truth in closed form."""

import numpy as np
import yaml

from simulator import load_shot

BRIGHT = {"time": "1/100 s", "iso": 100}
DIM = {"time": "1/1000 s", "iso": 100}  # more noise: rays come below it in a tenth of the time


def simple_shot(tmp_path, **settings):
    """Shot of a random scene of 2 pixels per photosite at one distance, by a camera without colour filter."""
    light = np.random.default_rng(2).random((32, 40)).astype(np.float32)
    np.save(tmp_path / "light.npy", light)
    document = {
        "name": "simple",
        "scene": {"image": "light.npy", "luminance": "20 cd/m^2", "depth": "1.97 m"},
        "lens": {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m", "cos4": False},
        "exposure": BRIGHT,
        "camera": {"base": "ideal", "width": 20, "height": 16},
        **settings,
    }
    (tmp_path / "simple.yaml").write_text(yaml.safe_dump(document), "utf-8")
    return load_shot(tmp_path / "simple.yaml")
