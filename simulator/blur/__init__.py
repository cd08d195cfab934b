"""Executes the planned lens blur on the device, in bands of rows that stay in the cache."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simulator.blur.blur_tables import BlurTables
from simulator.blur.frame import BlurFrame
from simulator.blur.reference import reference_mosaic
from simulator.blur.relief import measured_maps
from simulator.blur.strip import Strip
from simulator.defocus import Method
from simulator.defocus.tiles import choose
from simulator.defocus.zones import Zones
from simulator.device import Device
from simulator.planner import Plan


def blurred_mosaic(planned: Plan, device: Device, planes: list, progress: Callable[[float], None]):
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    planes: for each layer a device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1]; with the layer's
        coverage as one plane more where any layer of the scene has one.
    """
    if planned.defocus.accuracy.tolerance == 0.0:
        return reference_mosaic(planned, device, planes, progress)
    frame, area = planned.frame, BlurFrame(planned)
    maps = measured_maps(planned, device, area)
    chosen, zones = choose(planned.defocus, maps.reliefs, area.inside(planned)), None
    if planned.defocus.eyes is not None:
        zones = Zones(planned.defocus.eyes, area.x, area.y, area.grid)
        chosen = replace(chosen, zone=zones.first_corner)
    light = device.zeros((frame.height, frame.width), np.float32)
    composite = chosen.with_method(Method.COMPOSITE, Method.CORRECTED).any()
    open_ = device.ones((frame.height, frame.width) if composite else (1,), np.float32)
    tables = [BlurTables(planned, device, area, chosen, zones, over) for over in chosen.overs()]
    strips = [Strip(planned, device, area, maps, chosen, one, planes, open_) for one in tables]
    for band in range(area.bands):
        for strip in strips:
            strip.band(band, light)
        device.finish()
        progress((band + 1) / area.bands)
    return light
