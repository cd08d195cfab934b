"""Colour error of a developed ColorChecker."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from simulator.color.camera_matrices import adapted_to_d50, chart_reflectances, delta_e_in_d50
from simulator.color.spectra import WAVELENGTHS_NM, check_illuminant, illuminant, tristimulus
from simulator.errors import PhotositeError, require
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame
from simulator.measurement.quantities.quantity import Curve, Figure, Measured
from simulator.raw.development import develop
from simulator.scene.charts import ChartScene

GREYS = slice(18, 24)  # of the chart's 24 patches
LEAST_PX = 3  # pixels of the developed picture on a side of a patch's middle


@dataclass(frozen=True)
class ColorError:
    """Delta E 2000 (CIE 142-2001) of the 24 patches of a ColorChecker in the developed picture against the chart's colours.

    The frame is developed by LibRaw as the file says (its white balance and colour matrix, linear demosaicing, CIE XYZ). The
    reference is the chart's measured reflectances (Ohta 1997) in the light. Both are adapted to D50 by linear Bradford, and the
    picture's exposure is fitted: one factor on all patches, least squares in Y.
    Figures: mean, largest and grey, the mean of the six neutral patches; without unit. Curve: each patch's, from dark skin, 1,
    to black, 24.

    area: [top, left, height, width] of the chart in photosites, upright; left out, the whole frame.
    illuminant: of the chart, CIE name such as D65 or A, or "3200 K"; left out, that of the shot's chart, D65 for a raw file.
    """

    area: Area | None = None
    illuminant: Annotated[str | None, 'CIE name such as D65 or A, or "3200 K"'] = None

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Develop and compare. Raises PhotositeError for a frame without colour, or too small for 24 patches."""
        require(
            frame.cfa != "MONO",
            "color_error",
            "MONO",
            "a sensor without filter measures no colour; leave it out",
            file=frame.name,
        )
        light = self._light(frame)
        picture = develop(frame.raw or frame.name, output="xyz", demosaic="linear")
        found = _patch_means(picture, frame, self.area) * tristimulus(illuminant("D65"))[1]
        power = illuminant(light)
        measured = adapted_to_d50(found, "D65")
        true = adapted_to_d50(tristimulus(chart_reflectances(WAVELENGTHS_NM) * power), light)
        luminance = float(measured[:, 1] @ measured[:, 1])
        if luminance == 0:
            raise PhotositeError("the chart is black; expose it longer", file=frame.name, key="color_error")
        differences = delta_e_in_d50(measured * float(measured[:, 1] @ true[:, 1]) / luminance, true)
        figures = {
            "mean": Figure(float(differences.mean()), ""),
            "largest": Figure(float(differences.max()), ""),
            "grey": Figure(float(differences[GREYS].mean()), ""),
        }
        patches = Curve(np.arange(1.0, 25.0), differences, "patch", "", "Delta E 2000", "")
        return Measured(figures, {"patches": patches})

    def _light(self, frame: MeasuredFrame) -> str:
        scene = None if frame.shot is None else frame.shot.scene
        if self.illuminant is not None:
            check_illuminant(self.illuminant, "illuminant")
            return self.illuminant
        return scene.illuminant if isinstance(scene, ChartScene) else "D65"


def _patch_means(picture: np.ndarray, frame: MeasuredFrame, area: Area | None) -> np.ndarray:
    """Return the mean XYZ of the middle of each patch, (24, 3); the picture's white is that of D65 with Y = 1."""
    rows, columns = frame.cut(area)
    top, left, height, width = rows.start, columns.start, rows.stop - rows.start, columns.stop - columns.start
    means = []
    for x0, y0, x1, y1 in ChartScene("color_checker", 1.0).patch_boxes():
        down = slice(round(top + y0 * height), round(top + y1 * height))
        across = slice(round(left + x0 * width), round(left + x1 * width))
        part = picture[down, across]
        rule = f"holds 24 patches of {LEAST_PX} x {LEAST_PX} photosites inside; give a larger area or frame"
        require(min(part.shape[:2]) >= LEAST_PX, "area", [top, left, height, width], rule, file=frame.name)
        means.append(part.mean(axis=(0, 1), dtype=np.float64) / 65535.0)
    return np.array(means)
