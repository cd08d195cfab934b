"""Writes docs/images/charts.png: the charts that are drawn, as sRGB.

python docs/make_charts.py
"""

from pathlib import Path
from typing import Any

import numpy as np

from simulator.raw.development import srgb_encoded, write_image
from simulator.scene.charts import ChartScene

SHEET = Path(__file__).resolve().parent / "images" / "charts.png"
WIDTH_PX, HEIGHT_PX, GAP_PX = 480, 320, 8
CHARTS: dict[str, dict[str, Any]] = {
    "slanted_edge": {},
    "siemens_star": {},
    "step_wedge": {},
    "dots": {"columns": 15},
    "zone_plate": {"frequency": 120.0},
    "dead_leaves": {"smallest": 0.004},
}


def main() -> None:
    """Write the sheet: two rows of three charts."""
    drawn = [_draw(name, settings) for name, settings in CHARTS.items()]
    rows = [_beside(drawn[first : first + 3], 1) for first in (0, 3)]
    write_image(SHEET, (255.0 * _beside(rows, 0) + 0.5).astype(np.uint8))


def _draw(name: str, settings: dict[str, Any]) -> np.ndarray:
    size = {} if name == "step_wedge" else {"width_px": WIDTH_PX}
    planes = ChartScene(name, 100.0, **size, **settings).load().planes[..., 0]  # type: ignore[arg-type]  # a name of CHARTS
    rows, columns = (np.arange(count) * side // count for count, side in zip((HEIGHT_PX, WIDTH_PX), planes.shape, strict=True))
    return srgb_encoded(planes[np.ix_(rows, columns)])


def _beside(pictures: list[np.ndarray], axis: int) -> np.ndarray:
    """Join pictures with white gaps."""
    shape = list(pictures[0].shape)
    shape[axis] = GAP_PX
    joined = [part for picture in pictures for part in (np.ones(shape), picture)]
    return np.concatenate(joined[1:], axis=axis)


if __name__ == "__main__":
    main()
