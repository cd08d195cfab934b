"""The work of a blurred frame, by which its time is predicted."""

import dataclasses

import numpy as np
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene

from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.predicted_cost import cost_ms, points_work
from simulator.optics.passes.blur_work import work_of
from simulator.optics.passes.tile_plan import TilePlan, plan_tiles
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.cfa import Cfa


def tiles_of_plane(*, has_rim: bool) -> TilePlan:
    """A plane tilted through the focus, behind a rim that clips the light of most of the frame or none."""
    side = 48
    radius_px = np.linspace(-2.0, 2.0, side)[None, :].repeat(side, 0)
    scene = band_scene(np.random.default_rng(1).random((side, side)), np.asarray(depth_of(radius_px)))
    cone_mm = LENS.focal_length_mm / LENS.f_number * (1.0 - 150.0 / (1e3 * LENS.focus_distance_m))
    rim = Vignetting(front=RoundStop(150.0, 1.002 * cone_mm))
    lens = dataclasses.replace(LENS, vignetting=rim) if has_rim else LENS
    tiles = plan_tiles(plan(Shot(scene, lens, Exposure(0.001), small_camera(side, side))).optics, open_device())
    assert tiles is not None
    return tiles


def test_colours_that_are_blurred_together_share_all_but_their_means():
    """Behind a point spread function three mosaics are made by the launches, samples and tables of one."""
    tiles = tiles_of_plane(has_rim=False)
    scene = band_scene([[0.1, 1.0] * 24] * 48, LENS.focus_distance_m)
    lens = dataclasses.replace(LENS, f_number=16.0, diffraction=True)
    psf = plan(Shot(scene, lens, Exposure(0.01), small_camera(48, 48))).optics.psf
    assert psf is not None
    optics = dataclasses.replace(tiles.optics, cfa=Cfa.named("RGGB"))
    alone, together = (
        work_of(dataclasses.replace(tiles, optics=dataclasses.replace(optics, psf=behind))) for behind in (None, psf)
    )
    assert together["means"] == 3.0 * alone["means"] > 0.0
    assert alone["launches"] >= 2.0
    changed = {name for name in alone if together[name] != alone[name]}
    assert changed == {"means"}


def test_a_block_costs_by_the_slabs_that_its_rays_meet():
    """A point of a grid of several samples costs more, one more colour a quarter of the first."""
    count = np.array([64, 128])
    assert (points_work(count, 1, 1) == count).all()
    assert (points_work(count, np.array([1, 4]), 1) > count).tolist() == [False, True]
    assert (points_work(count, 1, 3) < 2 * count).all() and (points_work(count, 1, 3) > count).all()


def test_images_of_a_clipped_pupil_count_as_they_are_made():
    """One for each corner of a zone and node of radius: most of the time of a small frame."""
    tiles = tiles_of_plane(has_rim=True)
    made, work = 0, work_of(tiles)
    for over in tiles.chosen.sample_grids():
        chosen = tiles.chosen.part(slice(0, len(tiles.chosen.computed)), over)
        taps, _, _ = tiles.zones.images(chosen, *chosen.table(), over, tiles.defocus.area)
        made += len(taps)
    assert tiles.zones.eyes.clips(tiles.zones.fields).all()
    assert work["clipped images"] == made > 10
    assert work["clipped weights"] > made and work["clipped slices"] >= 16 * made
    without = work_of(tiles_of_plane(has_rim=False))
    assert without.get("clipped images", 0.0) == 0.0 and cost_ms(work) > 2.0 * cost_ms(without)
