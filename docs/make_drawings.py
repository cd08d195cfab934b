"""Writes docs/images/drawings.jpg: drawings of every kind, white-balanced and encoded as sRGB, without a colour matrix.

python docs/make_drawings.py
"""

from pathlib import Path

import numpy as np

from data_gen.sources.drawings import DRAWINGS
from data_gen.sources.procedural import Procedural
from simulator.config import load_camera
from simulator.raw.development import srgb_encoded, write_image

SHEET = Path(__file__).resolve().parent / "images" / "drawings.jpg"
SIDE_PX = 256


def main() -> None:
    """Write the sheet: one column for each kind, two drawings of each."""
    source = Procedural(tuple(DRAWINGS), load_camera("sony_a7s2"), width_px=SIDE_PX, height_px=SIDE_PX)
    rows = [np.hstack([_shown(source, f"{kind}/{number:06d}") for kind in DRAWINGS]) for number in (0, 1)]
    write_image(SHEET, np.vstack(rows))


def _shown(source: Procedural, name: str) -> np.ndarray:
    picture = source.read(name, np.random.default_rng(0))
    return srgb_encoded(np.clip(picture.signal * picture.white_balance, 0.0, 1.0)).astype(np.float32)


if __name__ == "__main__":
    main()
