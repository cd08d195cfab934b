"""The mosaic of a large colour filter pattern: the image in each colour by itself, then each photosite's own colour of them."""

from collections.abc import Callable

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.optics_plan import OpticsPlan


def join_colors(optics: OpticsPlan, device: Device, image: Callable[[OpticsPlan], Buffer]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance in each photosite's own colour.

    The kernels of blur and motion run along photosites of one colour, which lie two apart in Bayer's pattern. Another pattern
    has the bits of a sensor of each single colour.
    image: returns the light of a plan whose photosites all have one colour, as `still_mosaic` does.
    """
    window = optics.window
    mosaic = device.empty((window.height, window.width), np.float32)
    kernel = device.kernel("own_color", optics.cfa_macros())
    for plane in optics.cfa.colors:
        light = image(optics.in_one_color(plane))
        device.run(kernel, (window.width, window.height), None, light=light, mosaic=mosaic, channel=plane)
        device.finish()  # the light of this colour is freed before the next
        del light
    return mosaic
