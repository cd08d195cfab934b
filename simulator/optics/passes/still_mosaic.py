"""The image of a scene at rest: the pass of the plan that gathers it, with defocus and point spread function where planned."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from simulator.device import Buffer, Device
from simulator.optics.geometry.projection import project
from simulator.optics.optics_plan import OpticsPlan

if TYPE_CHECKING:
    from simulator.optics.passes.tile_plan import TilePlan


def still_mosaic(
    optics: OpticsPlan, tiles: "TilePlan | None", device: Device, planes: list[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance, of a scene and a camera at rest.

    tiles: methods of the blur; None: of the reference, by rays, or no blur. planes: a device buffer for each layer, as for
    `defocused_mosaic`.
    """
    if optics.psf is not None:
        from simulator.optics.passes.psf_mosaic import psf_mosaic  # brings SciPy's transforms

        return psf_mosaic(optics, tiles, device, planes, progress)
    if optics.defocus is None:
        return project(device, optics.projection, optics.cfa, optics.window, planes[0])
    if optics.lamps is None:
        return _blurred(optics, tiles, device, planes, progress)
    from simulator.optics.passes.lamp_pass import add_lamps, take_lamps

    take_lamps(optics, device, planes[0])
    return add_lamps(optics, device, _blurred(optics, tiles, device, planes, progress))


def _blurred(
    optics: OpticsPlan, tiles: "TilePlan | None", device: Device, planes: list[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """`still_mosaic` of a scene out of focus behind an ideal lens."""
    if tiles is not None:
        from simulator.optics.passes.defocused_mosaic import defocused_mosaic

        return defocused_mosaic(tiles, optics.cfa, device, planes, progress)
    from simulator.optics.passes.reference_mosaic import reference_mosaic

    return reference_mosaic(optics, device, planes, progress)


def still_name(optics: OpticsPlan) -> str:
    """Name of the pass that `still_mosaic` runs."""
    if optics.psf is not None:
        return "point spread function"
    return "projection" if optics.defocus is None else "defocus"
