"""The image behind a low-pass filter: the mean of those that its four spots show, at each of which photosites lie elsewhere.

That is exact whatever moves, also while lines open one after the other: what a photosite sees through a spot, it sees at its
own time. A kernel that gathers light from the photosites around would see it at theirs.
"""

from collections.abc import Callable

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.optics_plan import OpticsPlan


def mean_of_spots(optics: OpticsPlan, device: Device, image: Callable[[OpticsPlan], Buffer]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the filter.

    image: returns the light of a plan without a filter, as `still_mosaic` does.
    """
    window, spots = optics.window, optics.at_spots()
    mosaic = device.zeros((window.height, window.width), np.float32)
    weights = device.upload(np.full(window.height, 1.0 / len(spots), np.float32))
    kernel = device.kernel("weighted_light", {"COLUMNS": 0})
    for spot in spots:
        light = image(spot)
        device.run(kernel, (window.width, window.height), None, light=light, sum=mosaic, weights=weights, first_row=0)
        device.finish()  # the light of this spot is freed before the next
        del light
    return mosaic
