"""What explain says of light that is used again is what the cache does."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.light_cache import LIGHT_MB, LightCache
from simulator.pipeline.light_reuse import describe_reuse
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

LENS = ThinLens(50.0, 2.0, 2.0, cos4=False)
PLANES = np.random.default_rng(3).uniform(0.1, 1.0, (24, 32, 3))
SCENES = {"sharp": band_scene(PLANES, 2.0), "blurred": band_scene(PLANES, 1.9)}


@pytest.mark.parametrize(("name", "is_shared"), [("sharp", True), ("blurred", False)])
def test_a_shutter_time_is_named_where_its_light_is_the_same(name, is_shared):
    shot, cache = Shot(SCENES[name], LENS, Exposure(0.01), small_camera(cfa="RGGB")), LightCache()
    keys = []
    for one in (shot, replace(shot, exposure=Exposure(0.02))):
        planned = plan(one, cache=cache)
        assert planned.key is not None
        keys.append(planned.key.of_mosaic(planned.optics, planned.sensor))
    assert (keys[0] == keys[1]) == is_shared == ("shutter time" in describe_reuse(plan(shot)))


def test_light_that_is_not_held_is_said(monkeypatch):
    shot = Shot(SCENES["sharp"], LENS, Exposure(0.01), small_camera(20, 200, "RGGB"))
    assert "2 strips" in describe_reuse(plan(shot, 20 * 150))
    cost_ms = math.fsum(one.cost_ms for one in plan(shot).passes if one.name in ("sensor", "truth"))
    assert f"about {cost_ms:.3g} ms each" in describe_reuse(plan(shot))
    monkeypatch.setenv(LIGHT_MB, "0")
    assert "is not held in 0 MB" in describe_reuse(plan(shot))
