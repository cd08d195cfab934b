"""Test charts with known reflectances, lit by a known light."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM, check_illuminant, illuminant, luminance_cd_m2
from simulator.errors import require
from simulator.scene.chart_patterns import dots, siemens_star, slanted_edge, zone_plate
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.dead_leaves import dead_leaves
from simulator.scene.depth import check_depth
from simulator.scene.scene import Outside, Scene
from simulator.units import CandelasPerSquareMetre, Degrees, Metres

CELL_PX = 12  # a patch and the frame around it, on the chart's own grid
PATCH_PX = 10
MEASURED_PX = 6  # what patch_boxes keeps of a patch, so that a slight blur of its edges does no harm
FRAME_REFLECTANCE = 0.03  # black cardboard; assumed, nothing is measured on it
COLOR_CHECKER_COLUMNS, COLOR_CHECKER_ROWS = 6, 4

Box = tuple[float, float, float, float]


PATTERNS = ("slanted_edge", "siemens_star", "zone_plate", "dots", "dead_leaves")
DEFAULTS = {
    "density_step": 0.15,
    "bright": 0.8,  # 4 : 1 to the dark, as ISO 12233:2017 has it
    "dark": 0.2,
    "angle_deg": 5.0,
    "spokes": 72,
    "frequency": 600.0,
    "columns": 30,
    "diameter": 0.5,
    "smallest": 0.002,
    "largest": 0.1,
    "seed": 1,
}


@dataclass(frozen=True)
class Setting:
    """A setting that some charts use. key: in a shot file. low, high: least and largest value."""

    field: str
    charts: tuple[str, ...]
    low: float
    high: float
    unit: str = ""

    def check(self, chart: str, value: float | None) -> None:
        """Raise PhotositeError for a value that is out of range, or that the chart does not use."""
        if value is None:
            return
        key, shown = f"scene.{self.field.removesuffix('_px').removesuffix('_deg')}", f"{value:g}{self.unit}"
        used = " or ".join(self.charts)
        require(chart in self.charts, key, shown, f"only chart: {used} uses it, not {chart}; leave it out")
        require(self.low <= value <= self.high, key, shown, f"give {self.low:g} to {self.high:g}{self.unit}")


SETTINGS = (
    Setting("reflectance", ("flat_field",), 0, 1),
    Setting("steps", ("grey_ramp", "step_wedge"), 2, 40),
    Setting("density_step", ("step_wedge",), 0.01, 1),
    Setting("bright", PATTERNS, 0, 1),
    Setting("dark", PATTERNS, 0, 1),
    Setting("width_px", PATTERNS, 96, 20000),
    Setting("angle_deg", ("slanted_edge",), -44, 44, " deg"),
    Setting("spokes", ("siemens_star",), 4, 720),
    Setting("frequency", ("zone_plate",), 1, 10000),
    Setting("columns", ("dots",), 2, 200),
    Setting("diameter", ("dots",), 0.05, 0.95),
    Setting("smallest", ("dead_leaves",), 0.0005, 0.5),
    Setting("largest", ("dead_leaves",), 0.001, 0.5),
    Setting("seed", ("dead_leaves",), 0, 2**32 - 1),
)


@dataclass(frozen=True)
class ChartScene:
    """A chart that fills the picture, 3 : 2; docs/scenes.md has the geometry and a picture of each.

    "color_checker": 24 patches of a ColorChecker, row by row from dark skin to black, reflectances measured
        (Ohta 1997, "ColorChecker N Ohta" in colour-science), one plane each, and a frame of 3 %.
    "grey_ramp": `steps` neutral patches from left to right, the first 100 %, each half a stop darker, and the frame.
    "step_wedge": `steps` neutral stripes from left to right, the first 100 %, each `density_step` denser, without a frame.
    "flat_field": one uniform neutral surface without a frame.
    "slanted_edge": an edge through the middle at `angle` to the columns, dark on the left.
    "siemens_star": a sinusoidal star of `spokes` periods, as ISO 12233 has it, on grey.
    "zone_plate": rings whose frequency grows with their radius, `frequency` at half the height.
    "dots": dark dots in a square lattice of `columns`, `diameter` over their distance.
    "dead_leaves": disks over one another, radii from `smallest` to `largest`, random by `seed`.
    luminance_cd_m2: of the perfect white in this light.
    depth_m: distance of the chart.
    field_of_view_deg: full horizontal angle of the chart; left out, it fills the sensor.
    outside: what a camera sees past its edge: an error (refuse), no light (black), the edge (extend), or it again (repeat).
    Raises PhotositeError for a setting that the chosen chart does not use.
    """

    chart: Literal[
        "color_checker",
        "grey_ramp",
        "flat_field",
        "step_wedge",
        "slanted_edge",
        "siemens_star",
        "zone_plate",
        "dots",
        "dead_leaves",
    ]
    luminance_cd_m2: CandelasPerSquareMetre
    illuminant: Annotated[str, 'CIE name such as D65 or A, or "3200 K"'] = "D65"
    depth_m: Metres = 2.0
    field_of_view_deg: Degrees | None = None
    reflectance: Annotated[float | None, "of the flat field, 0 to 1; 1 when left out"] = None
    steps: Annotated[int | None, "patches of the grey ramp, 2 to 40, 12 when left out; stripes of the step wedge, 21"] = None
    density_step: Annotated[float | None, "of the step wedge, 0.01 to 1; 0.15 when left out, half a stop"] = None
    bright: Annotated[float | None, "reflectance of the bright parts of a pattern; 0.8 when left out"] = None
    dark: Annotated[float | None, "reflectance of the dark parts of a pattern; 0.2 when left out"] = None
    width_px: Annotated[int | None, "pixels of a pattern across, 96 to 20000; 3600, of dead leaves 2400, when left out"] = None
    angle_deg: Annotated[Degrees | None, "of the slanted edge to the columns, -44 to 44 deg; 5 deg when left out"] = None
    spokes: Annotated[int | None, "periods of the Siemens star, 4 to 720; 72 when left out"] = None
    frequency: Annotated[float | None, "of the zone plate at half the height, cycles per width; 600 when left out"] = None
    columns: Annotated[int | None, "dots across, 2 to 200; 30 when left out"] = None
    diameter: Annotated[float | None, "of a dot over the distance of dots, 0.05 to 0.95; 0.5 when left out"] = None
    smallest: Annotated[float | None, "radius of a leaf over the chart's width; 0.002 when left out"] = None
    largest: Annotated[float | None, "radius of a leaf over the chart's width; 0.1 when left out"] = None
    seed: Annotated[int | None, "of the leaves; 1 when left out"] = None
    outside: Outside = "refuse"

    def __post_init__(self) -> None:
        check_luminance(self.luminance_cd_m2)
        check_illuminant(self.illuminant, "scene.illuminant")
        check_depth(self.depth_m)
        check_field_of_view(self.field_of_view_deg)
        for setting in SETTINGS:
            setting.check(self.chart, getattr(self, setting.field))
        dark, bright = self._setting("dark"), self._setting("bright")
        require(dark < bright, "scene.dark", f"{dark:g}", f"give less than scene.bright, {bright:g}")
        smallest, largest = self._setting("smallest"), self._setting("largest")
        require(smallest < largest, "scene.smallest", f"{smallest:g}", f"give less than scene.largest, {largest:g}")
        rule = f"is less than one of the chart's {self._width} pixels; give more, or a larger scene.width"
        is_seen = self.chart != "dead_leaves" or smallest * self._width >= 1.0
        require(is_seen, "scene.smallest", f"{smallest:g}", rule)
        finest = self._setting("frequency") / self._width
        rule = f"is more than a period in two of the chart's {self._width} pixels; give a lower one, or a larger scene.width"
        is_seen = self.chart != "zone_plate" or finest <= 0.5
        require(is_seen, "scene.frequency", f"{self._setting('frequency'):g}", rule)

    @property
    def _width(self) -> int:
        """Width of a pattern [px]."""
        return int(self.width_px or (2400 if self.chart == "dead_leaves" else 3600))

    def _setting(self, field: str) -> float:
        """Return a setting of the chart, or what it is when left out."""
        value = getattr(self, field)
        return float(DEFAULTS[field] if value is None else value)

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
            interpolation="bilinear" if self.chart in PATTERNS else "nearest",
            white=white,
            outside=self.outside,
        )

    def grey_reflectances(self) -> np.ndarray:
        """Reflectances of the ramp's patches, (steps,): 2^(-k/2), half a stop (density 0.15) apart."""
        return 2.0 ** (-0.5 * np.arange(self.steps or 12))

    def wedge_reflectances(self) -> np.ndarray:
        """Reflectances of the wedge's stripes, (steps,): 10^-D, densities D = 0, density_step, 2 density_step ..."""
        return 10.0 ** (-self._setting("density_step") * np.arange(self.steps or 21))

    def patch_boxes(self) -> tuple[Box, ...]:
        """Inner parts of the patches as (left, top, right, bottom), from 0 to 1 of the chart's width and height.

        In the order of the patches; a border of a fifth of the patch is left out on every side. A pattern is one whole patch.
        """
        if self.chart == "flat_field" or self.chart in PATTERNS:
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
        if self.chart in ("grey_ramp", "step_wedge"):
            steps = self.steps or (12 if self.chart == "grey_ramp" else 21)
            return steps, 1, steps * CELL_PX * 2 // 3
        return COLOR_CHECKER_COLUMNS, COLOR_CHECKER_ROWS, CELL_PX

    def _draw(self) -> tuple[np.ndarray, np.ndarray]:
        """Planes (height, width, bands) and the bands' reflectances (bands, wavelengths)."""
        flat = np.ones((1, WAVELENGTHS_NM.size))
        if self.chart == "flat_field":
            return np.full((2, 3, 1), 1.0 if self.reflectance is None else self.reflectance), flat
        if self.chart in PATTERNS:
            dark, bright = self._setting("dark"), self._setting("bright")
            return (dark + (bright - dark) * self._pattern())[..., None], flat
        if self.chart == "step_wedge":
            steps, _, height = self._layout()
            stripes = np.repeat(self.wedge_reflectances(), CELL_PX)
            return np.broadcast_to(stripes, (height, steps * CELL_PX))[..., None], flat
        index = _patch_index(*self._layout())
        if self.chart == "grey_ramp":
            return np.append(self.grey_reflectances(), FRAME_REFLECTANCE)[index][..., None], flat
        from simulator.color.camera_matrices import chart_reflectances

        reflectances = np.vstack([chart_reflectances(WAVELENGTHS_NM), FRAME_REFLECTANCE * flat])
        return np.eye(len(reflectances))[index], reflectances

    def _pattern(self) -> np.ndarray:
        """Share of bright in each pixel of a pattern, (height, width) float64."""
        width = self._width
        height, setting = round(width * 2 / 3), self._setting
        if self.chart == "slanted_edge":
            return slanted_edge(width, height, setting("angle_deg"))
        if self.chart == "siemens_star":
            return siemens_star(width, height, int(setting("spokes")))
        if self.chart == "zone_plate":
            return zone_plate(width, height, setting("frequency"))
        if self.chart == "dots":
            return dots(width, height, int(setting("columns")), setting("diameter"))
        return dead_leaves(width, height, width * setting("smallest"), width * setting("largest"), int(setting("seed")))


def _patch_index(columns: int, rows: int, cell_height: int) -> np.ndarray:
    """Return the patch number at each pixel, (height, width) int; the frame has the number after the last."""
    y, x = np.mgrid[: rows * cell_height, : columns * CELL_PX]
    frame = (CELL_PX - PATCH_PX) // 2
    index = (y // cell_height) * columns + x // CELL_PX
    in_column, in_row = x % CELL_PX, y % cell_height
    framed = (in_column < frame) | (in_column >= CELL_PX - frame) | (in_row < frame) | (in_row >= cell_height - frame)
    return np.where(framed, columns * rows, index)
