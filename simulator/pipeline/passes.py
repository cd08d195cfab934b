"""The passes of a plan: what `pipeline.simulate` runs, with size, memory, predicted error and predicted time of each.

Predicted times are those of the reference machine: two cores of a server's CPU with Debian's PoCL 3.1, kernels already built.
They rank plans and name the slowest passes; `photosite explain --measure` shows the times of the device at hand beside them.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from simulator.exposure.exposed_light import ExposedLight
from simulator.optics.blur_planning import ignored_terms
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.predicted_error import BLUR, MOVING, describe_ignored
from simulator.optics.error_term import PSF, WINGS, together
from simulator.optics.geometry.motion_cost import (
    DRIFTING,
    FOUR_READ,
    SHIFT_MARGIN_PX,
    instants_cost_ms,
    instants_of,
    moving_cost_ms,
    place_work,
    row_work,
    sweep_cost_ms,
)
from simulator.optics.geometry.motion_errors import MOTION
from simulator.optics.geometry.projection_cost import COST_NS as PROJECTION_NS
from simulator.optics.geometry.projection_cost import projection_work
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.psf_bands import read_by_bands
from simulator.optics.passes.tile_grid import TileGrid, band_sizes
from simulator.optics.veiling_glare import GLARE
from simulator.pipeline.error_budget import ILLUMINATION, ErrorBudget, error_budget
from simulator.pipeline.planned_pass import Pass, error_of, pixels_of
from simulator.sensor.camera.readout_window import ReadoutGeometry
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.sensor_plan import SensorPlan

if TYPE_CHECKING:
    from simulator.optics.geometry.motion_plan import MotionPlan
    from simulator.optics.passes.tile_plan import TilePlan

PROGRAM_BYTES = 150_000_000  # of Python, its packages and an OpenCL driver, before a shot is taken
BLUR_PROGRAM_BYTES = 80_000_000  # more of kernels and packages that the lens blur loads
OCCLUDING = 0.15  # assumed share of a frame with several surfaces where they occlude each other, before its tiles are measured
LAUNCH_MS = {  # of a pass, however small: Python, plan of its launches, and their queue
    "scene planes": 0.13,
    "radius statistics": 0.35,
    "sensor": 0.37,
    "truth": 0.17,
}
MAP_MS = 0.3  # the same of each map of blur radii
LEAST_MS = 0.13  # the same of a pass that is not listed
# Nanoseconds per photosite, unless the key says otherwise.
COST_NS = {
    "scene planes": 0.15,  # per scene pixel, spectral band and colour
    "scene colours": 0.5,  # per scene pixel and colour
    "projection": 1.6,  # for each point that a photosite averages
    "footprint": 5.0,  # of several squares
    "projection pixel": 0.5,  # for each scene pixel that a photosite averages
    "radius statistics": 10.0,  # for each surface with a map of blur radii
    "rays": 160000.0,
    WINGS: 1.8,
    "veiling glare": 3.0,
    "optical black": 1.0,
    "crosstalk": 4.0,
    "line exposure": 0.2,
    "sensor": 2.2,
    "sensor stage": 0.25,  # for each stage
    "remosaic": 30.0,
    "combination": 0.2,  # for each reading
    "truth": 6.0,
    "strips": 4.0,
    "variance": 8.0,
    "mixed variance": 150.0,
    "depth": 10.0,
    "blur": 10.0,
    "flow": 2000.0,
}
TRUTH_BYTES = {
    "variance": 4,
    "mixed variance": 40,
    "depth": 12,
    "blur": 20,
    "flow": 96,
}  # per photosite, with the float64 arrays of their computation


def passes_of(
    optics: OpticsPlan,
    sensor: SensorPlan,
    exposed: ExposedLight,
    truth: Collection[str],
    tiles: "TilePlan | None" = None,
    strips: Sequence[ReadoutGeometry] = (),
    later: int = 0,
) -> tuple[Pass, ...]:
    """Return all passes in the order of the light.

    exposed: light over time. truth: maps that a shot asks for, as `Shot.truth`. tiles: method of each tile; None: not measured
    yet. strips: readout of each strip of the frame, where there are several. later: exposures after the first whose light is
    computed on its own.
    """
    budget = error_budget(optics)
    projection, defocus, psf = still = (_projection(optics), _defocus(optics, tiles, budget), _psf(optics, budget, tiles))
    motion = _by_spot(_motion(optics, still, budget), optics)
    projection, defocus, psf = (_by_spot(one, optics) for one in (projection, defocus, psf))
    is_first = optics.motion is not None and optics.motion.method == "swept_first"
    if is_first:
        assert optics.motion is not None and optics.motion.blur is not None  # what is swept is blurred
        swept = replace(optics, projection=optics.projection.on_samples(optics.motion.blur.samples_per_axis))
        defocus, psf = _defocus(swept, tiles, budget), _psf(swept, budget, tiles)
        projection = replace(projection, method="part of the motion")
    elif motion.kept:
        projection, defocus, psf = (
            Pass(one.name, False, "part of the motion, at each instant") if one.kept else one for one in still
        )
    sampling = (_scene_planes(optics), projection)
    blur = (motion, defocus, psf) if is_first else (defocus, psf, motion)
    image = (
        *(_by_color(one, optics) if optics.joins_colors else one for one in blur),
        _wings(optics, budget),
        _veiling_glare(optics, budget),
        _optical_crosstalk(optics, sensor),
        _optical_black(optics, sensor),
    )
    lines = _line_exposure(optics, exposed, (*sampling, *image))
    noise_free = _truth(optics)
    maps = [_truth_map(name, optics, sensor) for name in ("variance", "depth", "blur", "flow") if name in truth]
    if "rgb" in truth:
        maps.append(_truth_rgb(optics, (*sampling, *image, lines, noise_free)))
    again = (_later_exposures(optics, later, (*sampling, *image, lines)),) if later else ()
    read = _readings(optics, sensor) if isinstance(sensor, HdrSensorPlan) else _sensor(optics, sensor)
    read = replace(read, error_sigma=error_of(budget, ILLUMINATION))
    frame = (*again, read, noise_free, *maps, _strips(optics, strips))
    return (*sampling, _radius_statistics(optics, defocus), *image, lines, *frame)


def _ms(count: float, nanoseconds: float, name: str = "") -> float:
    """Time of so many units. name: of the pass."""
    return LAUNCH_MS.get(name, LEAST_MS) + 1e-6 * count * nanoseconds


def _scene_planes(optics: OpticsPlan) -> Pass:
    scene = optics.scene
    height, width, bands = scene.planes.shape
    size, surfaces = height * width * len(scene.layers), len(scene.layers)
    method = f"{surfaces} x {width} x {height} scene pixels, {bands} planes -> {optics.channels} colours"
    cost = _ms(size * optics.channels, bands * COST_NS["scene planes"] + COST_NS["scene colours"], "scene planes")
    return Pass("scene planes", True, method, size, 2 * scene.planes.nbytes, cost_ms=cost)


def _projection(optics: OpticsPlan) -> Pass:
    if optics.defocus is not None or optics.psf is not None:
        return Pass("projection", False, "part of the blur, which needs the scene around each photosite")
    projection, pixels = optics.projection, pixels_of(optics)
    if projection.is_displaced:
        work = projection_work(projection, 1, pixels)
        cost = LEAST_MS + 1e-6 * sum(PROJECTION_NS[name] * count for name, count in work.items())
        return Pass("projection", True, "mean over each photosite's area, which leans", pixels, 4 * pixels, cost_ms=cost)
    if projection.taps(projection.open_side):
        reads = projection.taps(projection.open_side) ** 2
        method, cost = "exact mean over each photosite's area", _ms(pixels * reads, COST_NS["projection pixel"])
    else:
        per_photosite = projection.samples**2 * COST_NS["footprint" if projection.footprints else "projection"]
        area = "exact mean of bilinear light over each photosite's area" if projection.is_bilinear else "one scene pixel each"
        method, cost = area, _ms(pixels, per_photosite)
    return Pass("projection", True, method, pixels, 4 * pixels, cost_ms=cost)


def _radius_statistics(optics: OpticsPlan, defocus: Pass) -> Pass:
    """Pass that chooses the methods of tiles. defocus: pass that uses them, unless it follows rays (tolerance 0)."""
    name = "radius statistics"
    if optics.defocus is None or not defocus.kept or optics.accuracy.tolerance == 0.0:
        return Pass(name, False, "no method is chosen by tile")
    maps, pixels = optics.defocus.maps, pixels_of(optics)
    cost = _ms(maps * pixels, COST_NS[name], name) + MAP_MS * maps
    return Pass(
        name, True, f"blur radii of {maps} of {len(optics.scene.layers)} surfaces, patch by patch", pixels, cost_ms=cost
    )


def _defocus(optics: OpticsPlan, tiles: "TilePlan | None", budget: ErrorBudget) -> Pass:
    defocus, pixels = optics.defocus, pixels_of(optics)
    if defocus is None:
        told = describe_ignored(optics.accuracy, optics.ignored_px, ignored_terms(optics))
        return Pass("defocus", False, told, error_sigma=error_of(budget, BLUR))
    if optics.psf is not None and optics.psf.by_distance:
        return Pass("defocus", False, "part of the point spread function")
    lamps = "" if optics.lamps is None else f", {optics.lamps.count} lamps one by one"
    if optics.accuracy.tolerance == 0.0:
        memory, cost = pixels * (4 + 4 * defocus.maps), _ms(pixels, COST_NS["rays"])
        return Pass("defocus", True, f"rays through lens and scene{lamps}", pixels, memory, optics.accuracy.ray_error, cost)
    from simulator.optics.defocus.predicted_cost import cost_ms  # a sharp frame has no tiles
    from simulator.optics.passes.blur_work import unmeasured_work, work_of

    if tiles is None:
        work, methods = unmeasured_work(optics, OCCLUDING * _may_occlude(optics)), "methods by tile not measured yet"
    else:
        work = work_of(tiles)
        methods = ", ".join(f"{one.name.lower()} {100 * share:.3g} %" for one, share in tiles.shares().items() if share > 0)
    memory, scratch = _blur_bytes(replace(optics, window=optics.blur_window()), defocus, tiles)
    error, methods = error_of(budget, BLUR, MOVING), methods + lamps
    return Pass("defocus", True, methods, pixels, BLUR_PROGRAM_BYTES + memory, error, cost_ms(work), scratch)


def _blur_bytes(optics: OpticsPlan, defocus: Defocus, tiles: "TilePlan | None") -> tuple[int, int]:
    """Memory of the lens blur of a window: of its light and its maps of radii, and of what is freed when it is done.

    Bands have as many samples as the tiles with the smallest blur circles need. Where tiles are not measured these are the
    smallest of the scene.
    """
    area, pixels, layers = TileGrid(optics.window, defocus.reach_px), pixels_of(optics), len(defocus.radii_px)
    if tiles is None:
        least = np.array([min(least for least, _ in defocus.ranges_px)])
        over = int(defocus.samples_per_axis(least, least)[0])
        is_wide = defocus.largest_px >= defocus.wide_px
    else:
        over, is_wide = max(tiles.chosen.sample_grids(), default=1), tiles.wide is not None
    layout = area.band_layout(over, whole=True)
    bands = 4 * sum(band_sizes(layout, layers, optics.channels + optics.has_coverage, defocus.maps))
    light, maps = 4 * pixels, 4 * 2 * area.set_columns * area.rows * max(defocus.maps, 1)
    scratch = bands + (light if layers > 1 else 0)
    if not is_wide:
        return light + maps, scratch
    wider = optics.on_wider_photosites()
    assert wider.defocus is not None  # it is that of `optics`
    held, wider_scratch = _blur_bytes(wider, wider.defocus, None if tiles is None else tiles.wide)
    wider_light = 4 * pixels_of(wider)
    return light + maps + held - wider_light, max(scratch, wider_light + wider_scratch)


def _motion(optics: OpticsPlan, still: tuple[Pass, ...], budget: ErrorBudget) -> Pass:
    """Pass of the image's motion. still: passes of the image at rest, which run at each instant where no kernel sweeps."""
    motion, pixels, name = optics.motion, pixels_of(optics), "motion"
    if motion is None:
        skipped = optics.motion_skipped
        why = "nothing moves" if skipped is None else skipped.reason
        return Pass(name, False, why, error_sigma=error_of(budget, MOTION))
    error = error_of(budget, MOTION)
    if motion.method in ("instants", "joint"):  # their passes run in this one
        error = together([error or 0.0, *(one.error_sigma for one in still if one.kept and one.error_sigma)]) or None
    if motion.method == "instants":
        count = motion.count if motion.is_common else len(motion.shared_nodes())
        cost = _instants_ms(optics, motion, budget)
        told = ", ".join(f"{one.name} ({one.method})" for one in still if one.kept)
        memory = 8 * pixels + sum(one.memory_bytes for one in still)
        why = f", since {motion.reason}" if motion.reason else ""
        return Pass(name, True, f"sum of the image at {count} instants{why}: {told}", pixels, memory, error, cost)
    if motion.method == "joint":
        cost = _moving_ms(optics)
        if optics.samples_shifted_layers:
            points = optics.shifted_points
            each = 1.0 if optics.reads_rows else FOUR_READ
            cost = sweep_cost_ms("shifting layers", each * pixels * points * (2 * optics.covering_layers - 1))
            if optics.mixes_points:
                cost += 1e-6 * pixels * points * optics.mixed_share() * optics.cells_ns()
        method = "with the blur: each point of the aperture carries an instant"
        return Pass(name, True, method, pixels, 8 * pixels, error, cost)
    projection, layers, before = optics.projection, optics.covering_layers, ""
    if not optics.sweeps_lamps_apart:
        motion = motion.with_lamps_everywhere()
    if motion.blur is not None:  # all colours of all samples that the blur reads
        pixels = _blurred_pixels(optics) * optics.channels * motion.blur.samples_per_axis**2
        before = ", in all colours before the blur, which is the same at each instant"
        if motion.blur.followed is not None:
            before += "; its spots are skewed by the motion from row to row"
    if motion.vectors is not None:
        cost = sweep_cost_ms("sweep by vector", pixels * motion.count)
        method = f"swept by the velocity of each pixel: {motion.count} instants on each line{before}"
        return Pass(name, True, method, pixels, 4 * pixels + 12 * optics.scene.planes[..., 0].size, error, cost)
    if optics.sweeps_shift(optics.light_samples):
        cost = sweep_cost_ms("shift", pixels * (motion.length.longest_px + SHIFT_MARGIN_PX))
        straight = motion.path.straight_shift() is not None
        weights = "exact weights" if straight else f"weights of {motion.count} instants on each line"
        method = f"swept along its path by its {weights}{before}"
        return Pass(name, True, method, pixels, 4 * pixels, error, cost)
    over = 1 if motion.blur is None else motion.blur.samples_per_axis
    key, reads = place_work(projection, over)
    if optics.sweeps_rows:
        key, reads = "sweep", row_work(projection, over)
        if abs(projection.scale - 1.0) < 1e-3 and not projection.is_fine:
            key = "even sweep"
    planes = 2 * optics.moving_layers - (optics.moving_layers == layers)  # light and coverage of what is read at each instant
    method = f"{motion.count} instants on each line"
    if optics.sweeps_shifted_layers(optics.light_samples):
        key, reads = "shifting layers", 1.0 if optics.layer_phases is None else optics.layer_phases.work
    elif optics.sweeps_drifting_layers:
        key, reads = "shifting layers", DRIFTING
    if layers > 1:
        method += f", {layers} layers"
    if motion.lamp_count:
        method += f", {motion.lamp_count} where lamps pass"
    cost = sweep_cost_ms(key, pixels * motion.count * planes * reads)
    if optics.mixes_edges(optics.light_samples):
        share, own_ns = optics.mixed_share(optics.light_samples), optics.cells_ns(optics.light_samples)
        cost = cost if optics.sweeps_shifted_layers(optics.light_samples) else sweep_cost_ms(key, 0.0)
        cost += 1e-6 * pixels * optics.cell_instants * share * own_ns
        method += f", edges within photosites exactly in {100.0 * share:.0f} % of the picture"
    return Pass(name, True, f"swept along its path: {method}{before}", pixels, 4 * pixels, error, cost)


def _blurred_pixels(optics: OpticsPlan) -> int:
    """Photosites that the blur of a window reads, with the margins of its bands."""
    if optics.psf is not None and optics.psf.core is not None and optics.defocus is None:
        seen = read_by_bands(optics.window, optics.psf.gather_reach_px, optics.psf.over)
    elif optics.defocus is not None:
        seen = TileGrid(optics.blur_window(), optics.defocus.reach_px).read_area()
    else:
        seen = optics.blur_window()
    return seen.width * seen.height


def _moving_ms(optics: OpticsPlan) -> float:
    """Time of points of the aperture that carry instants, with the samples that they read."""
    from simulator.optics.defocus.predicted_cost import cost_ms
    from simulator.optics.passes.blur_work import moving_work

    samples, points, tables = moving_work(optics)
    return moving_cost_ms(points, tables) + cost_ms(samples)


def _by_color(one: Pass, optics: OpticsPlan) -> Pass:
    """Return a pass of blur or motion that runs once for each colour of a large filter pattern."""
    if not one.kept:
        return one
    count, pixels = len(optics.cfa.colors), pixels_of(optics)
    method = f"{one.method}, once for each of {count} colours of a filter of {'{} x {}'.format(*optics.cfa.period)}"
    return replace(one, method=method, cost_ms=count * one.cost_ms, scratch_bytes=one.scratch_bytes + 4 * pixels)


def _by_spot(one: Pass, optics: OpticsPlan) -> Pass:
    """Return a pass of an image that runs once for each spot of a low-pass filter."""
    if not (one.kept and optics.sees_spots):
        return one
    count, scratch = len(optics.projection.spots), one.scratch_bytes + 4 * pixels_of(optics)
    method = f"{one.method}, once for each of {count} spots of the filter"
    return replace(one, method=method, cost_ms=count * one.cost_ms, scratch_bytes=scratch)


def _may_occlude(optics: OpticsPlan) -> bool:
    """Whether blocks may sample the aperture: of several layers, or of one with steps in depth."""
    return len(optics.scene.layers) > 1 or optics.contrast.has_steps


def _psf(optics: OpticsPlan, budget: ErrorBudget, tiles: "TilePlan | None") -> Pass:
    """Return the pass of the plan's point spread function. tiles: method of each tile; None: not measured yet."""
    if optics.psf is not None:
        from simulator.pipeline.psf_passes import psf_pass  # not needed without kernels

        one = psf_pass(optics, budget, tiles)
        if not optics.layer_rays:
            return one
        rays_ms = (2 * len(optics.scene.layers) + 1) * _ms(pixels_of(optics), COST_NS["rays"])  # all, each light, each cover
        return replace(one, method=f"{one.method}, rays for layers that hide each other", cost_ms=one.cost_ms + rays_ms)
    ideal = "the lens is ideal and photosites are sensitive all over"
    if optics.projection.open_side < 1.0:
        ideal = "the lens is ideal, and the scene is averaged over the sensitive square of each photosite"
    if optics.projection.footprints:
        ideal = "the lens is ideal, and the scene is averaged over what photosites see through the low-pass filter"
    why = ideal if optics.psf_skipped is None else optics.psf_skipped.reason
    return Pass("point spread function", False, why, error_sigma=error_of(budget, PSF))


def _instants_ms(optics: OpticsPlan, motion: "MotionPlan", budget: ErrorBudget) -> float:
    """Time of the image at each instant, over the lines that it lights, of a scene that is posed and measured anew."""
    from simulator.optics.geometry.posed_projection import most_leaning  # nothing moves in most shots

    window, axis = optics.window, motion.path.lines.axis
    nodes, lit = instants_of(motion, window.height)
    part = replace(window, height=lit) if axis == "rows" else window
    moved = most_leaning(optics.projection, motion, optics.accuracy.allowed)
    still = replace(optics, projection=moved, motion=None, flash_motion=None, window=part)
    defocus = _defocus(still, None, budget)
    each = (_projection(still), _radius_statistics(still, defocus), defocus, _psf(still, budget, None))
    return instants_cost_ms(nodes, sum(one.cost_ms for one in each))


def _wings(optics: OpticsPlan, budget: ErrorBudget) -> Pass:
    """Light of diffraction from beyond the kernels."""
    wings, lacking = optics.wings, "no kernels of diffraction"
    if optics.wings_error:
        lacking = f"kernels hold all but {optics.wings_error:.2g} sigma of the light"
    method = "" if wings is None else f"smooth light of cells of {wings.cell_px} x {wings.cell_px} photosites"
    return replace(_skippable(WINGS, wings is not None, optics, method, lacking), error_sigma=error_of(budget, WINGS))


def _veiling_glare(optics: OpticsPlan, budget: ErrorBudget) -> Pass:
    is_there, lacking = optics.veiling_glare is not None, "the lens scatters no light"
    return replace(_skippable(GLARE, is_there, optics, "even light added", lacking), error_sigma=error_of(budget, GLARE))


def _optical_crosstalk(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    is_shared = any(sensor.readout.crosstalk.optical_shares)
    return _skippable("crosstalk of light", is_shared, optics, "3 x 3 photosites", "nothing is shared", 4, "crosstalk")


def _optical_black(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    reaches_black = sensor.readout.reaches_optical_black
    return _skippable("optical black", reaches_black, optics, "light removed there", "light reaches all of the window")


def _line_exposure(optics: OpticsPlan, exposed: ExposedLight, image: tuple[Pass, ...]) -> Pass:
    """Shares that lines collect. image: passes of the light, which run again for a flash whose shares differ."""
    if exposed.is_split or optics.moves_by_component:
        method, again = "image of the flash added, each line with its shares of both", sum(one.cost_ms for one in image)
        pixels = pixels_of(optics)
        cost_ms = again + 2 * _ms(pixels, COST_NS["line exposure"])
        return Pass("line exposure", True, method, pixels, 4 * pixels, cost_ms=cost_ms)
    return _skippable("line exposure", exposed.varies, optics, f"each of the {exposed.axis} by its share", exposed.even_text())


def _sensor(optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    layout, pixels = sensor.readout, pixels_of(optics)
    parts = "in two parts, charge is shared in between" if layout.shares_charge else "in one pass"
    binned = "" if layout.binning is None else f", {layout.binning.factor} x {layout.binning.factor} binned"
    if layout.blooming is not None:
        parts += f", in up to {layout.blooming.reach} steps where wells are full"
    if layout.pattern is not None:
        binned = f", {layout.pattern.group} x {layout.pattern.group} groups remosaiced"
    cost = COST_NS["sensor"] + COST_NS["sensor stage"] * len(sensor.stages)
    cost += COST_NS["remosaic"] * (layout.pattern is not None)
    combines = layout.averages or layout.pattern is not None
    packets = 0 if layout.blooming is None else 8 * layout.blooming.sides
    bytes_each = 2 + 8 * layout.shares_charge + 2 * combines + packets  # codes; what the passes in between leave
    return Pass(
        "sensor",
        True,
        f"{len(sensor.stages)} stages {parts}{binned}",
        pixels,
        bytes_each * pixels,
        cost_ms=_ms(pixels, cost, "sensor"),
    )


def _readings(optics: OpticsPlan, sensor: HdrSensorPlan) -> Pass:
    """All readings and their combination, in place of the sensor's one pass."""
    pixels, readings, exposures = pixels_of(optics), len(sensor.readings), len(sensor.exposures)
    diodes = max(sensor.spec.diode_of) + 1
    of_diodes = f" by {diodes} photodiodes" if diodes > 1 else ""
    method = (
        f"{len(sensor.stages)} stages, {readings} readings of {exposures} exposure{'s' * (exposures > 1)}{of_diodes}, combined"
    )
    each = COST_NS["sensor"] + COST_NS["sensor stage"] * len(sensor.stages) + COST_NS["combination"]
    cost_ms = readings * _ms(pixels, each, "sensor")
    return Pass("sensor", True, method, pixels, 8 * pixels, cost_ms=cost_ms)  # charge, codes of a reading, codes


def _later_exposures(optics: OpticsPlan, later: int, image: tuple[Pass, ...]) -> Pass:
    """Light of the exposures after the first. image: passes of the light, which run again for each of them."""
    pixels, repeated = pixels_of(optics), later * sum(one.cost_ms for one in image)
    method = f"light once more for each of {later}, which see other lamps or places"
    return Pass("later exposures", True, method, pixels, 4 * later * pixels, cost_ms=repeated)


def _truth(optics: OpticsPlan) -> Pass:
    pixels = pixels_of(optics)
    return Pass(
        "truth",
        True,
        "mean electrons, codes without noise, when read",
        pixels,
        8 * pixels,
        cost_ms=_ms(pixels, COST_NS["truth"], "truth"),
    )


def _truth_map(name: str, optics: OpticsPlan, sensor: SensorPlan) -> Pass:
    pixels, is_mixed = pixels_of(optics), name == "variance" and sensor.readout.mixes_charge
    kind, method = ("mixed variance", "of each photosite's charge, then mixed") if is_mixed else (name, "on the host")
    return Pass(f"truth: {name}", True, method, pixels, TRUTH_BYTES[kind] * pixels, cost_ms=_ms(pixels, COST_NS[kind]))


def _truth_rgb(optics: OpticsPlan, repeated: tuple[Pass, ...]) -> Pass:
    """Noise-free frame in each colour. repeated: passes of the light and of the noise-free frame, run once for each colour."""
    pixels = pixels_of(optics)
    # The frames of the colours, then their stack, or a frame and its difference from black; and the mosaic.
    memory = (max(8 * optics.channels, 12) + 4) * pixels
    cost_ms = optics.channels * sum(one.cost_ms for one in repeated)
    return Pass("truth: rgb", True, "light and truth once more for each colour", pixels, memory, cost_ms=cost_ms)


def _strips(optics: OpticsPlan, strips: Sequence[ReadoutGeometry]) -> Pass:
    """Putting the frame together from its strips. Its arrays lie in files until the raw file and its twin are written."""
    if len(strips) <= 1:
        return Pass("strips", False, "the frame is computed in one piece")
    rows, pixels = max(strip.output.height for strip in strips), pixels_of(optics)
    method = f"{len(strips)} of up to {rows} rows, one after the other; memory is that of one strip"
    return Pass("strips", True, method, pixels, cost_ms=_ms(pixels, COST_NS["strips"]))


def _skippable(
    name: str, kept: bool, optics: OpticsPlan, method: str, reason: str, bytes_each: int = 0, cost: str = ""
) -> Pass:
    """Pass over all photosites. reason: why it is skipped. bytes_each: per photosite. cost: key of COST_NS, if not `name`."""
    if not kept:
        return Pass(name, False, reason)
    pixels = pixels_of(optics)
    return Pass(name, True, method, pixels, bytes_each * pixels, cost_ms=_ms(pixels, COST_NS[cost or name]))
