"""Mosaics of several colours that are blurred together: the bits of each alone."""

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, Method
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.defocused_mosaic import defocused_mosaic, defocused_mosaics
from simulator.optics.passes.row_band import Mosaics
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.cfa import Cfa

ROWS, COLUMNS = 48, 160


def planned_blur(device, near_m, brightest=400.0):
    """Plan of a frame with a slope behind a step, and the planes of its scene, whose brightest pixel may be a highlight."""
    rng, camera = np.random.default_rng(0), small_camera(COLUMNS, ROWS, "RGGB")
    light = rng.random((ROWS, COLUMNS, camera.channels))
    light[20, 40] = brightest
    depth_m = np.where(np.arange(COLUMNS) < 90, near_m, np.linspace(2.0, 2.1, COLUMNS)) * np.ones((ROWS, 1))
    shot = Shot(band_scene(light, depth_m), ThinLens(50.0, 2.8, 2.0), Exposure(0.001), camera)
    planned = measure(plan(shot), device)
    optics = planned.optics
    assert planned.tiles is not None
    planes = [camera_planes(device, layer, optics.weights, optics.has_coverage, None) for layer in optics.scene.layers]
    return optics, planned.tiles, planes


@pytest.mark.parametrize("near_m", [1.9, 1.2], ids=["slope", "steps"])
def test_colours_that_are_blurred_together_have_the_bits_of_each_alone(device, near_m):
    optics, tiles, planes = planned_blur(device, near_m)
    filters = [optics.cfa, *(Cfa.uniform(channel) for channel in optics.cfa.colors)]
    shape = tiles.optics.window.height, tiles.optics.window.width
    made = defocused_mosaics(tiles, filters, device, planes, lambda share: None)
    together = device.download(made, (len(filters), *shape), np.float32)
    for cfa, found in zip(filters, together, strict=True):
        alone = defocused_mosaic(tiles, cfa, device, planes, lambda share: None)
        np.testing.assert_array_equal(found, device.download(alone, shape, np.float32))


def test_the_blur_takes_one_build_for_all_filters_and_one_for_all_colours(device, monkeypatch):
    """A build of `occlusion` takes seconds. Few blocks take more rays in one filter than in another, until they agree."""
    built, kernel = dict[str, set[int]](occlusion=set(), defocus_mean=set()), device.kernel

    def ask(name, defines, file=None):
        found = kernel(name, defines, file)
        built.setdefault(name, set()).add(id(found))
        return found

    monkeypatch.setattr(device, "kernel", ask)
    _, tiles, planes = planned_blur(device, 1.2)
    filters = [*map(Cfa.named, ("RGGB", "BGGR", "GRBG", "GBRG")), *map(Cfa.uniform, range(3))]
    light = defocused_mosaics(tiles, filters, device, planes, lambda share: None)
    *mosaics, red, green, blue = device.download(light, (len(filters), ROWS, COLUMNS), np.float32)
    for cfa, found in zip(filters, mosaics, strict=False):
        own = np.tile(cfa.planes, (ROWS // 2, COLUMNS // 2))
        assert (found == np.choose(own, [red, green, blue])).mean() > 0.9
    assert len(built["occlusion"]) == 2
    assert len(built["defocus_mean"]) == 2 * 2  # of tiles that are composited, and of others


def test_blocks_that_sample_the_aperture_take_no_means(device, monkeypatch):
    """Without the samples these blocks stay dark, and no others do."""
    optics, tiles, planes = planned_blur(device, 1.2, brightest=1.0)
    run = device.run
    monkeypatch.setattr(
        device, "run", lambda kernel, *sizes, **arguments: kernel.name == "occlusion" or run(kernel, *sizes, **arguments)
    )
    light = device.download(
        defocused_mosaic(tiles, optics.cfa, device, planes, lambda share: None), (ROWS, COLUMNS), np.float32
    )
    sampled = tiles.chosen.blocks.methods == Method.OCCLUSION
    sampled = np.repeat(np.repeat(sampled, BLOCK_ROWS, axis=0), BLOCK_COLUMNS, axis=1)
    window, area = tiles.optics.window, tiles.area
    down, right = window.y - area.tile_y, window.x - area.tile_x
    np.testing.assert_array_equal(light == 0.0, sampled[down : down + ROWS, right : right + COLUMNS])
    assert 0.1 < (light == 0.0).mean() < 0.9


def test_colours_that_follow_one_another_are_made_together():
    filters = [*map(Cfa.named, ("RGGB", "MONO", "GRBG")), *map(Cfa.uniform, (0, 1, 2, 3, 1, 0))]
    launches = Mosaics(filters, None, None).launches()
    assert [len(one) for one in launches] == [1, 1, 1, 3, 1, 1, 1]
    assert [number for launch in launches for number in launch] == list(range(len(filters)))
