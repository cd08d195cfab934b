"""The reference blur of layers whose pixels no grid of samples divides: their coverage is a mean, rounded to 1 and beyond."""

import numpy as np
import pytest
import yaml

from simulator import load_shot, simulate


@pytest.mark.parametrize("size", [(26, 21), (29, 23)])
def test_layers_of_any_scale_are_followed_by_rays(tmp_path, size):
    """Even light behind half a layer of the same light, out of focus: every photosite has the same."""
    alpha = np.repeat([[1.0] * 40 + [0.0] * 40], 64, axis=0).astype(np.float32)
    np.save(tmp_path / "light.npy", np.full((64, 80), 0.5, np.float32))
    np.save(tmp_path / "alpha.npy", alpha)
    document = {
        "name": "halves",
        "scene": {
            "layers": [
                {"image": "light.npy", "alpha_image": "alpha.npy", "depth": "1.9 m"},
                {"image": "light.npy", "depth": "2.1 m"},
            ],
            "luminance": "20 cd/m^2",
        },
        "lens": {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m", "cos4": False},
        "exposure": {"time": "1/100 s", "iso": 100},
        "camera": {"base": "ideal", "width": size[0], "height": size[1]},
        "tolerance": 0,
    }
    (tmp_path / "halves.yaml").write_text(yaml.safe_dump(document), "utf-8")
    electrons = simulate(load_shot(tmp_path / "halves.yaml")).mean_electrons
    assert electrons == pytest.approx(np.full(electrons.shape, electrons[0, 0]), rel=1e-5)
