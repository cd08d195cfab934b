"""The pass of the point spread function: skipped, transformed by the host, or gathered by the device."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from simulator.optics.defocus.predicted_error import BLUR
from simulator.optics.error_term import PSF
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.psf_bands import node_rows, split_into_bands
from simulator.optics.passes.psf_work import gathered_work, transformed_work
from simulator.optics.psf import psf_cost
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.kernel_split import Core
from simulator.pipeline.error_budget import ErrorBudget
from simulator.pipeline.planned_pass import Pass, error_of, pixels_of

if TYPE_CHECKING:
    from simulator.optics.passes.tile_plan import TilePlan


def psf_pass(optics: OpticsPlan, budget: ErrorBudget, tiles: "TilePlan | None") -> Pass:
    """Return the pass of the plan's point spread function. tiles: method of each tile; None: not measured yet."""
    psf = optics.psf
    assert psf is not None  # else there is no such pass
    places = "one kernel" if psf.nodes == (1, 1) else f"kernels at {psf.nodes[0]} x {psf.nodes[1]} places"
    includes_blur = psf.by_distance and optics.defocus is not None
    error = error_of(budget, PSF, BLUR) if includes_blur else error_of(budget, PSF)
    core = psf.core
    one = _transformed_psf(optics, psf, places, error) if core is None else _gathered_psf(optics, psf, core, places, error)
    if optics.lamps is not None:
        method = f"{one.method}, {optics.lamps.count} lamps one by one"
        work = psf_cost.lamp_work(psf, optics.projection, optics.lamps, optics.channels)
        one = replace(one, method=method, cost_ms=one.cost_ms + psf_cost.cost_ms(work))
    return _with_covariance(one, tiles) if includes_blur and tiles is not None else one


def _with_covariance(one: Pass, tiles: "TilePlan") -> Pass:
    """Return the pass of kernels by distance with the blocks that add the covariance of layers."""
    from simulator.optics.defocus.predicted_cost import cost_ms
    from simulator.optics.passes.blur_work import work_of

    share = float(tiles.chosen.blocks.sampled().mean())
    method = f"{one.method}, covariance of layers from points of the aperture in {100 * share:.3g} %"
    return replace(one, method=method, cost_ms=one.cost_ms + cost_ms(work_of(tiles)))


def _transformed_psf(optics: OpticsPlan, psf: FieldPsf, places: str, error: float | None) -> Pass:
    """Pass of a PSF that the host transforms. error: predicted."""
    pixels = pixels_of(optics)
    slabs = f", {len(psf.radii_px)} slabs of blur radius" if len(psf.radii_px) > 1 else ""
    method = f"{places}, {2 * psf.reach_px + 1} photosites wide{slabs}{_corrections(psf)}"
    bytes_each = 4 + 8 * optics.channels * (not psf.by_distance) + 4 * (optics.defocus is None or psf.by_distance)
    if optics.defocus is not None and psf.by_distance:
        bytes_each += 4 * optics.defocus.maps
    cost = psf_cost.cost_ms(transformed_work(optics, psf))
    return Pass("point spread function", True, method, pixels, bytes_each * pixels, error, cost)


def _corrections(psf: FieldPsf) -> str:
    """What a method says of corrections to wave optics."""
    return f", blur corrected to wave optics at {len(psf.corrected_px)} radii" if psf.corrected_px else ""


def _gathered_psf(optics: OpticsPlan, psf: FieldPsf, core: Core, places: str, error: float | None) -> Pass:
    """Pass of a PSF that the device gathers. error: predicted."""
    pixels, across = pixels_of(optics), 2 * core.reach_px + 1
    method = f"{places}, gathered from {'up to ' if psf.is_gathered_by_distance else ''}{across} x {across} photosites"
    if core.arm_px > core.reach_px:
        method += f", from its row and column up to {core.arm_px} away"
    if core.has_tail:
        method += f", and from cells of {core.cell_px} x {core.cell_px} up to {psf.reach_px} photosites away"
    method += _corrections(psf)
    if psf.is_gathered_by_distance:
        method += f", {len(psf.radii_px)} slabs of blur radius"
    bytes_each = 4 + 4 * optics.channels * (not psf.by_distance)
    return Pass(
        "point spread function",
        True,
        method,
        pixels,
        bytes_each * pixels,
        error,
        psf_cost.cost_ms(gathered_work(optics, psf)),
        _gather_bytes(optics, psf, core),
    )


def _gather_bytes(optics: OpticsPlan, psf: FieldPsf, core: Core) -> int:
    """Memory of a band of light that is gathered: its samples, cells of the tail, layers for a correction, and kernels."""
    bands = split_into_bands(optics.window, psf.gather_reach_px, psf.over)
    planes, kernels, band = optics.channels, 0, bands[0]
    if psf.is_gathered_by_distance:
        rows = [node_rows(one, psf.y_px) for one in bands]
        kernels = psf_cost.core_bytes(psf, optics.channels, max(one.stop - one.start for one in rows))
    if psf.corrected_px or psf.is_gathered_by_distance:
        layers = len(optics.scene.layers) if optics.has_coverage else 1
        planes += layers * (optics.channels + optics.has_coverage + 1)
    cells = optics.channels * band.layout.set_columns * (band.rows // 2) if core.has_tail else 0
    return 4 * (planes * math.prod(band.layout.shape(1)) + 2 * cells) + kernels
