"""The passes of a plan: what the executor runs, how large it is, what it holds in memory, and what error and time it will have.

Predicted times are those of the reference machine: two cores of a server's CPU with Debian's PoCL 3.1, kernels already built.
They rank plans and say what dominates; `photosite explain --measure` shows the times of the device at hand beside them.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.defocus import Method
from simulator.optics.defocus.predicted_error import predicted_errors
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.tile_plan import TilePlan
from simulator.sensor.sensor_plan import SensorPlan

LAUNCH_MS = 0.1  # of any pass, however small
# Nanoseconds per photosite, unless the key says otherwise.
COST_NS = {
    "scene planes": 0.6,  # per scene pixel, band and colour
    "projection": 4.0,  # and per point that a photosite averages
    "radius statistics": 6.0,  # per surface with a map of radii
    "copy": 6.0,
    "mean": 14.0,  # and
    "mean per px": 2.5,  # for each photosite of blur radius, as all below
    "points": 40.0,
    "points per px": 12.0,
    "rays": 60000.0,
    "psf": 600.0,  # per colour
    "veiling glare": 3.0,
    "optical black": 1.0,
    "crosstalk": 4.0,
    "sensor": 5.0,
    "sensor stage": 1.0,  # for each stage
    "truth": 8.0,
    "variance": 8.0,
    "depth": 10.0,
    "blur": 10.0,
}
TRUTH_BYTES = {"variance": 4, "depth": 12, "blur": 20}  # per photosite, with what the float64 steps to it hold


@dataclass(frozen=True)
class Pass:
    """One pass of the executor.

    kept: whether it runs. method: how, or why it is skipped. size: photosites, or what `method` names.
    memory_bytes: on device and host together. error_sigma: largest predicted error, in standard deviations of the noise at
    the brightest light; None: exact but for rounding. cost_ms: predicted time.
    """

    name: str
    kept: bool
    method: str
    size: int = 0
    memory_bytes: int = 0
    error_sigma: float | None = None
    cost_ms: float = 0.0


def passes_of(
    optics: OpticsPlan, sensor: SensorPlan, truth: Collection[str], tiles: TilePlan | None = None
) -> tuple[Pass, ...]:
    """All passes in the order in which they run.

    truth: parts that a shot asks for, as `Shot.truth`. tiles: methods by tile, where they have been measured.
    """
    return (
        _scene_planes(optics),
        _projection(optics),
        _radius_statistics(optics),
        _defocus(optics, tiles),
        _psf(optics),
        _skippable("veiling glare", optics.veiling_glare is not None, optics, "even light added", "the lens scatters no light"),
        _optical_crosstalk(optics, sensor),
        _optical_black(optics, sensor),
        _sensor(optics, sensor),
        _truth(optics, sensor),
        *(_truth_part(part, optics) for part in ("variance", "depth", "blur", "rgb") if part in truth),
    )


def _pixels(optics: OpticsPlan) -> int:
    return optics.window.width * optics.window.height


def _ms(count: float, nanoseconds: float) -> float:
    return LAUNCH_MS + 1e-6 * count * nanoseconds


def _scene_planes(optics: OpticsPlan) -> Pass:
    scene = optics.scene
    height, width, bands = scene.planes.shape
    size, surfaces = height * width * len(scene.layers), len(scene.layers)
    method = f"{surfaces} x {width} x {height} scene pixels, {bands} planes -> {optics.channels} colours"
    cost = _ms(size * bands * optics.channels, COST_NS["scene planes"])
    return Pass("scene planes", True, method, size, 2 * scene.planes.nbytes, cost_ms=cost)


def _projection(optics: OpticsPlan) -> Pass:
    if optics.defocus is not None or optics.psf is not None:
        return Pass("projection", False, "part of the blur, which needs the scene around each photosite")
    points, pixels = optics.projection.samples**2, _pixels(optics)
    method = "nearest pixel" if optics.projection.nearest else "bilinear"
    cost = _ms(pixels * points, COST_NS["projection"])
    return Pass("projection", True, f"{method}, {points} points per photosite", pixels, 4 * pixels, cost_ms=cost)


def _radius_statistics(optics: OpticsPlan) -> Pass:
    name = "radius statistics"
    if optics.defocus is None or optics.accuracy.tolerance == 0.0:
        return Pass(name, False, "no method is chosen by tile")
    maps, pixels = optics.defocus.maps, _pixels(optics)
    cost = _ms(maps * pixels, COST_NS[name])
    return Pass(
        name, True, f"blur radii of {maps} of {len(optics.scene.layers)} surfaces, patch by patch", pixels, cost_ms=cost
    )


def _defocus(optics: OpticsPlan, tiles: TilePlan | None) -> Pass:
    defocus, pixels = optics.defocus, _pixels(optics)
    if defocus is None:
        return Pass("defocus", False, f"no blur circle has a radius above {optics.accuracy.sharp_px:.2g} photosites")
    if optics.psf is not None and optics.psf.by_distance:
        return Pass("defocus", False, "part of the point spread function")
    memory = pixels * (4 + 4 * defocus.maps)
    if optics.accuracy.tolerance == 0.0:
        return Pass("defocus", True, "rays through lens and scene", pixels, memory, 0.0, _ms(pixels, COST_NS["rays"]))
    shares, told = _estimated_shares(optics), "methods by tile not measured yet"
    if tiles is not None:
        shares = tiles.shares()
        told = ", ".join(f"{method.name.lower()} {100 * share:.3g} %" for method, share in shares.items() if share > 0)
    per_px = defocus.largest_px
    means = COST_NS["mean"] + COST_NS["mean per px"] * per_px
    points = COST_NS["points"] + COST_NS["points per px"] * per_px
    cost = {
        Method.COPY: COST_NS["copy"],
        Method.MEAN: means,
        Method.COMPOSITE: means * len(defocus.radii_px),
        Method.CORRECTED: means * len(defocus.radii_px) + points,
        Method.OCCLUSION: points,
    }
    cost_ms = _ms(pixels, sum(share * cost[method] for method, share in shares.items()))
    return Pass("defocus", True, told, pixels, memory, max(predicted_errors(defocus).values()), cost_ms)


def _estimated_shares(optics: OpticsPlan) -> dict[Method, float]:
    """Share of the frame that each method gets, before anything is measured."""
    several = len(optics.scene.layers) > 1 or any(np.ndim(radius) for radius in optics.defocus.radii_px)
    return {Method.MEAN: 0.85, Method.OCCLUSION: 0.15} if several else {Method.MEAN: 1.0}


def _psf(optics: OpticsPlan) -> Pass:
    psf, pixels = optics.psf, _pixels(optics)
    if psf is None:
        why = optics.psf_skip_reason or "the lens is ideal and photosites are sensitive all over"
        return Pass("point spread function", False, why)
    places = "one kernel" if psf.nodes == (1, 1) else f"kernels at {psf.nodes[0]} x {psf.nodes[1]} places"
    slabs = f", {len(psf.radii_px)} slabs of blur radius" if len(psf.radii_px) > 1 else ""
    method = f"{places}, {2 * psf.reach_px + 1} photosites wide{slabs}"
    bytes_each = 4 + 8 * optics.channels * (not psf.by_distance) + 4 * (optics.defocus is None or psf.by_distance)
    if optics.defocus is not None and psf.by_distance:
        bytes_each += 4 * optics.defocus.maps
    cost = _ms(pixels * optics.channels * len(psf.radii_px), COST_NS["psf"])
    return Pass("point spread function", True, method, pixels, bytes_each * pixels, cost_ms=cost)


def _optical_crosstalk(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    shares = any(sensor.readout.crosstalk.optical_shares)
    return _skippable("crosstalk of light", shares, optics, "3 x 3 photosites", "nothing is shared", 4, "crosstalk")


def _optical_black(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    dark = sensor.readout.reaches_optical_black
    return _skippable("optical black", dark, optics, "light removed there", "light reaches all of the window")


def _sensor(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    layout, pixels = sensor.readout, _pixels(optics)
    parts = "in two parts, charge is shared in between" if layout.shares_charge else "in one pass"
    binned = "" if layout.binning is None else f", {layout.binning.factor} x {layout.binning.factor} binned"
    cost = COST_NS["sensor"] + COST_NS["sensor stage"] * len(sensor.stages)
    bytes_each = 4 + 8 * layout.shares_charge  # codes on device and host; what the passes in between leave
    return Pass(
        "sensor", True, f"{len(sensor.stages)} stages {parts}{binned}", pixels, bytes_each * pixels, cost_ms=_ms(pixels, cost)
    )


def _truth(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    pixels = _pixels(optics)
    return Pass(
        "truth", True, "mean electrons, codes without noise", pixels, 16 * pixels, cost_ms=_ms(pixels, COST_NS["truth"])
    )


def _truth_part(part: str, optics: OpticsPlan) -> Pass:
    pixels = _pixels(optics)
    if part == "rgb":  # planes, then stacked; the mosaic and both truths on the device
        return Pass(
            "truth: rgb",
            True,
            "light and truth once more for each colour",
            pixels,
            (max(8 * optics.channels, 12) + 12) * pixels,
        )
    return Pass(f"truth: {part}", True, "on the host", pixels, TRUTH_BYTES[part] * pixels, cost_ms=_ms(pixels, COST_NS[part]))


def _skippable(name: str, kept: bool, optics: OpticsPlan, method: str, why: str, bytes_each: int = 0, cost: str = "") -> Pass:
    if not kept:
        return Pass(name, False, why)
    pixels = _pixels(optics)
    return Pass(name, True, method, pixels, bytes_each * pixels, cost_ms=_ms(pixels, COST_NS[cost or name]))
