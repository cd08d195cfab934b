"""Draws docs/images/gallery/*.jpg: the shots of things that move, each with all points of its sweep.

python docs/make_gallery.py
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np

from data_gen.sources.moving_scenes import SCENES, moving_scene
from simulator.config import load_shot, load_sweep
from simulator.config.document_merge import named_file
from simulator.pipeline.simulate import simulate_many
from simulator.raw.development import develop

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

FOLDER = Path(__file__).resolve().parent / "images" / "gallery"
TITLES = {
    "ball": ("1/2000 s, f/2", "1/250 s, f/5.7", "1/30 s, f/15.5"),
    "pattern": ("at rest", "moves by two photosites to the right"),
    "fan": ("all rows at once", "rows read from the top, 62 ms", "columns read from the left, 62 ms"),
    "drop": ("flash of 1/30,000 s", "flash of 1/200 s"),
    "bullet": ("spark of 1 us", "flash of 1/30,000 s"),
    "stars": ("40 minutes",),
}
BRIGHTER_EV = 1.0  # development: the shots keep a stop of highlights


def pictures(name: str, folder: Path) -> list[np.ndarray]:
    """Return the developed pictures of a shot, one for each point of its sweep, (height, width, 3) uint8."""
    layers = moving_scene(name, folder)
    keys = [f"scene.layers.{number}.image" for number in range(len(layers))] if len(layers) > 1 else ["scene.image"]
    settings = [f"{key}={path}" for key, path in zip(keys, layers, strict=True)]
    path = named_file("shots", name)
    sweep = load_sweep(path, settings)
    shots = [load_shot(path, settings)] if sweep is None else [point.shot() for point in sweep]
    return [develop(raw, exposure_ev=BRIGHTER_EV, bits=8) for raw in simulate_many(shots)]


def main() -> None:
    """Write one picture for each shot."""
    FOLDER.mkdir(exist_ok=True)
    with TemporaryDirectory() as folder:
        for name in SCENES:
            found, titles = pictures(name, Path(folder)), TITLES[name]
            height, width = found[0].shape[:2]
            size = 12.0, 12.0 / len(found) * height / width + 0.3
            figure, axes = plt.subplots(1, len(found), figsize=size, layout="constrained", dpi=100, squeeze=False)
            for axis, picture, title in zip(axes[0], found, titles, strict=True):
                axis.imshow(picture, interpolation="antialiased")
                axis.set_title(title, fontsize=10)
                axis.axis("off")
            figure.savefig(FOLDER / f"{name}.jpg", pil_kwargs={"quality": 85})
            plt.close(figure)


if __name__ == "__main__":
    main()
