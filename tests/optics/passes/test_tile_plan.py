"""The methods of a blur's tiles are chosen once for a window, and kept with the blur."""

import dataclasses

import numpy as np
from helpers.lens_frame import case_plan, executed_case
from helpers.textured_planes import one_picture, textured_planes

from simulator.device import open_device
from simulator.optics.passes.tile_plan import plan_tiles
from simulator.sensor.camera.camera import Window


def test_a_second_plan_of_the_same_window_keeps_the_methods():
    case = one_picture(textured_planes((-4.0, 0.0, 4.0), shape=(80, 104)))
    planned, device = case_plan(case), open_device()
    first, again = (plan_tiles(planned.optics, device) for _ in range(2))
    assert again.chosen is first.chosen
    part = dataclasses.replace(planned.optics, window=Window(8, 8, 40, 24))
    assert plan_tiles(part, device).chosen is not first.chosen
    fresh = dataclasses.replace(planned.optics, defocus=dataclasses.replace(planned.optics.defocus))
    assert plan_tiles(fresh, device).chosen is not first.chosen
    kept = executed_case(case, planned)
    assert np.array_equal(kept, executed_case(case, dataclasses.replace(planned, optics=fresh)))
