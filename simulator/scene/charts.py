"""Test charts with known reflectances, lit by a known light."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM, check_illuminant, illuminant, luminance_cd_m2
from simulator.errors import require
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.depth import check_depth
from simulator.scene.scene import Outside, Scene
from simulator.units import CandelasPerSquareMetre, Degrees, Metres

CELL_PX = 12  # a patch and the frame around it, on the chart's own grid
PATCH_PX = 10
MEASURED_PX = 6  # what patch_boxes keeps of a patch, so that a slight blur of its edges does no harm
FRAME_REFLECTANCE = 0.03  # black cardboard; assumed, nothing is measured on it
COLOR_CHECKER_COLUMNS, COLOR_CHECKER_ROWS = 6, 4

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class ChartScene:
    """A chart that fills the picture, 3 : 2.

    "color_checker": 24 patches of a ColorChecker, row by row from dark skin to black, reflectances measured
        (Ohta 1997, "ColorChecker N Ohta" in colour-science), one plane each, and a frame of 3 %.
    "grey_ramp": `steps` neutral patches from left to right, the first 100 %, each half a stop darker, and the frame.
    "flat_field": one uniform neutral surface without a frame.
    luminance_cd_m2: of the perfect white in this light.
    depth_m: distance of the chart.
    field_of_view_deg: full horizontal angle of the chart; left out, it fills the sensor.
    outside: what a camera sees past its edge: an error (refuse), no light (black), the edge (extend), or it again (repeat).
    Raises PhotositeError for a setting that the chosen chart does not use.
    """

    chart: Literal["color_checker", "grey_ramp", "flat_field"]
    luminance_cd_m2: CandelasPerSquareMetre
    illuminant: Annotated[str, 'CIE name such as D65 or A, or "3200 K"'] = "D65"
    depth_m: Metres = 2.0
    field_of_view_deg: Degrees | None = None
    reflectance: Annotated[float | None, "of the flat field, 0 to 1; 1 when left out"] = None
    steps: Annotated[int | None, "patches of the grey ramp, 2 to 40; 12 when left out"] = None
    outside: Outside = "refuse"

    def __post_init__(self) -> None:
        check_luminance(self.luminance_cd_m2)
        check_illuminant(self.illuminant, "scene.illuminant")
        check_depth(self.depth_m)
        check_field_of_view(self.field_of_view_deg)
        for key, chart, low, high in (("reflectance", "flat_field", 0, 1), ("steps", "grey_ramp", 2, 40)):
            value = getattr(self, key)
            if value is not None:
                require(
                    self.chart == chart, f"scene.{key}", value, f"only chart: {chart} uses it, not {self.chart}; leave it out"
                )
                require(low <= value <= high, f"scene.{key}", value, f"give {low} to {high}")

    def load(self) -> Scene:
        """Draw the chart."""
        light = illuminant(self.illuminant)
        planes, reflectances = self._draw()
        white = self.luminance_cd_m2 / float(luminance_cd_m2(light))
        return Scene(
            planes=planes.astype(np.float32),
            spectra_w_m2_sr_nm=reflectances * light * white,
            wavelengths_nm=WAVELENGTHS_NM,
            illuminant=light,
            depth_m=float(self.depth_m),
            field_of_view_deg=self.field_of_view_deg,
            interpolation="nearest",
            white=white,
            outside=self.outside,
        )

    def grey_reflectances(self) -> np.ndarray:
        """Reflectances of the ramp's patches, (steps,): 2^(-k/2), half a stop (density 0.15) apart."""
        return 2.0 ** (-0.5 * np.arange(self.steps or 12))

    def patch_boxes(self) -> tuple[Box, ...]:
        """Inner parts of the patches as (left, top, right, bottom), from 0 to 1 of the chart's width and height.

        In the order of the patches; a border of a fifth of the patch is left out on every side.
        """
        if self.chart == "flat_field":
            return ((0.0, 0.0, 1.0, 1.0),)
        columns, rows, cell_height = self._layout()
        width, height = columns * CELL_PX, rows * cell_height
        margin = (CELL_PX - MEASURED_PX) // 2
        return tuple(
            (
                (column * CELL_PX + margin) / width,
                (row * cell_height + margin) / height,
                ((column + 1) * CELL_PX - margin) / width,
                ((row + 1) * cell_height - margin) / height,
            )
            for row in range(rows)
            for column in range(columns)
        )

    def _layout(self) -> tuple[int, int, int]:
        """Columns, rows and height of a cell; every chart is 3 : 2."""
        if self.chart == "grey_ramp":
            steps = self.steps or 12
            return steps, 1, steps * CELL_PX * 2 // 3
        return COLOR_CHECKER_COLUMNS, COLOR_CHECKER_ROWS, CELL_PX

    def _draw(self) -> tuple[np.ndarray, np.ndarray]:
        """Planes (height, width, bands) and the bands' reflectances (bands, wavelengths)."""
        flat = np.ones((1, WAVELENGTHS_NM.size))
        if self.chart == "flat_field":
            return np.full((2, 3, 1), 1.0 if self.reflectance is None else self.reflectance), flat
        index = _patch_index(*self._layout())
        if self.chart == "grey_ramp":
            return np.append(self.grey_reflectances(), FRAME_REFLECTANCE)[index][..., None], flat
        from simulator.color.camera_matrices import chart_reflectances

        reflectances = np.vstack([chart_reflectances(WAVELENGTHS_NM), FRAME_REFLECTANCE * flat])
        return np.eye(len(reflectances))[index], reflectances


def _patch_index(columns: int, rows: int, cell_height: int) -> np.ndarray:
    """Return the patch number at each pixel, (height, width) int; the frame has the number after the last."""
    y, x = np.mgrid[: rows * cell_height, : columns * CELL_PX]
    frame = (CELL_PX - PATCH_PX) // 2
    index = (y // cell_height) * columns + x // CELL_PX
    in_column, in_row = x % CELL_PX, y % cell_height
    framed = (in_column < frame) | (in_column >= CELL_PX - frame) | (in_row < frame) | (in_row >= cell_height - frame)
    return np.where(framed, columns * rows, index)
