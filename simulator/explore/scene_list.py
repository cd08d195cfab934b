"""The scenes that the page offers: that of the opened shot, and charts in its light."""

import math
from typing import Any

from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.scene.charts import ChartScene

OWN = "own"  # the scene of the opened shot
CHARTS = {
    "color_checker": "ColorChecker",
    "grey_ramp": "Grey ramp",
    "slanted_edge": "Slanted edge",
    "siemens_star": "Siemens star",
    "zone_plate": "Zone plate",
    "dots": "Dots",
    "dead_leaves": "Dead leaves",
    "flat_field": "Flat field",
}
LUMINANCE, ILLUMINANT = "120 cd/m^2", "D65"  # of a scene that states none


def scene_labels(shot: Shot) -> dict[str, str]:
    """Return the name of each scene by its value on the page. shot: as opened."""
    own = CHARTS.get(shot.scene.chart, shot.scene.chart) if isinstance(shot.scene, ChartScene) else f"of {shot.name}"
    return {OWN: f"As opened: {own}", **CHARTS}


def chart_section(chart: str, shot: Shot) -> dict[str, Any]:
    """Return the section `scene` of a chart before the camera of a shot.

    It hangs on a black wall, in the light that the shot states, at the distance that its lens is focused at, as wide as that
    lens sees it: a longer lens shows a part of it, a shorter one the wall around it.
    """
    stated, lens = shot.resolved["scene"], shot.lens
    light = {"luminance": stated.get("luminance", LUMINANCE), "illuminant": stated.get("illuminant", ILLUMINANT)}
    if not isinstance(lens, ThinLens):
        return {"chart": chart, **light}
    seen_deg = lens.field_of_view_deg(shot.camera.sensor_mm[0])
    depth = "inf m" if math.isinf(lens.focus_distance_m) else f"{lens.focus_distance_m:.6g} m"
    return {"chart": chart, **light, "depth": depth, "field_of_view": f"{seen_deg:.6g} deg", "outside": "black"}
