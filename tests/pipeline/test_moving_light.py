"""What moves, under the light and the shutter of a whole shot: a flash freezes it, lines see it at their own times."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.picture_files import write

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.flash import Flash
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.exposure.vector_maps import VectorMap
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.arrays import scene_from_rgb
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Camera, IsoSetting
from simulator.sensor.camera.hdr_readout import HdrReadout

WIDTH, HEIGHT, PITCH_UM = 64, 24, 40.0
LENS = ThinLens(50.0, 8.0, 3.0, cos4=False)
SPEED = math.degrees(800.0 * PITCH_UM / (1e3 * LENS.image_distance_mm))  # 800 photosites per second on the axis [deg/s]
PAN = Motion(camera=SteadyMotion(pan_deg_per_s=-SPEED))
EDGE = np.repeat((np.arange(WIDTH) >= 40.0)[None, :], HEIGHT, axis=0).astype(np.float32)
SCENE = scene_from_rgb(EDGE, luminance_cd_m2=10.0, depth_m=3.0)
EDGE.setflags(write=False)
for array in SCENE.arrays():
    array.setflags(write=False)


def electrons(exposure: Exposure, motion: Motion | None = PAN, cache: LightCache | None = None) -> np.ndarray:
    camera = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
    shot = Shot(SCENE, LENS, exposure, camera, motion=motion, tolerance=0.1)
    return simulate(shot, cache=cache).mean_electrons.astype(float)


def edge_widths(light: np.ndarray) -> np.ndarray:
    """Width of the ramp of each row's edge: photosites between dark and bright."""
    share = light / light.max(axis=1, keepdims=True)
    return ((share > 0.02) & (share < 0.98)).sum(axis=1)


def test_a_rolling_shutter_leans_the_edge_and_keeps_its_blur():
    light = electrons(Exposure(0.01, shutter=RollingShutter(0.012)))
    middle = WIDTH - (light / light[:, -1:]).sum(axis=1)
    assert np.abs(np.diff(middle) + 800.0 * 0.012 / HEIGHT).max() < 0.01
    assert np.all(np.abs(edge_widths(light) - 8) <= 1)


def test_a_flash_freezes_what_the_ambient_light_blurs():
    """A pulse of 1/30,000 s at the release: the frame less the ambient light has a sharp edge, where the edge stands then."""
    ambient = Exposure(0.01)
    both = electrons(replace(ambient, flash=Flash(length_s=1.0 / 30000.0, guide_number_m=10.0)))
    blurred = electrons(ambient)
    flash = both - blurred
    assert edge_widths(blurred).min() >= 7 and flash.max() > 0.02 * blurred.max()
    assert edge_widths(flash).max() <= 1
    middle = WIDTH - (flash / flash[:, -1:]).sum(axis=1)
    assert np.abs(middle - 40.0).max() < 0.1


def test_a_flash_freezes_what_is_out_of_focus_too():
    """It has the blur of the lens alone, while points of the aperture carry the motion under the light that is there."""
    near = np.repeat((np.arange(WIDTH) < 20.0)[None, :], HEIGHT, axis=0).astype(np.float32)
    light = 0.005 * near[..., None] * SCENE.planes.max(), 0.01 * SCENE.planes
    scene = replace(SCENE, planes=light[0], coverage=near, depth_m=1.5, behind=(Layer(light[1], 3.0),))
    for array in scene.arrays():
        array.setflags(write=False)
    motion = Motion(layers={0: LayerMotion((Speed(800.0, "px/s"), Speed(0.0, "px/s")))})
    lens, camera = ThinLens(50.0, 2.0, 2.0, cos4=False), small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
    ambient = Shot(scene, lens, Exposure(0.01), camera, motion=motion, tolerance=1.0)
    lit = replace(ambient, exposure=Exposure(0.01, flash=Flash(length_s=1e-9, guide_number_m=0.5)))
    (_, steady), (_, flash) = plan(lit).by_light()
    assert steady.optics.joint is not None and flash.optics.motion is None and flash.optics.joint is None
    moved, still = (
        simulate(replace(lit, motion=one)).mean_electrons.astype(float)
        - simulate(replace(ambient, motion=one)).mean_electrons.astype(float)
        for one in (motion, None)
    )
    assert np.abs(moved - still).max() < math.sqrt(still.max()) < 0.1 * still.max()


@pytest.mark.parametrize("motion", [PAN, Motion(camera=SteadyMotion(pan_deg_per_s=SPEED))])
def test_a_cache_tells_motions_and_times_apart(motion):
    cache = LightCache()
    first = electrons(Exposure(0.01), PAN, cache)
    assert np.array_equal(electrons(Exposure(0.01), PAN, cache), first) and cache.reused > 0
    for exposure in (Exposure(0.01), Exposure(0.01, start_s=0.01), Exposure(0.02)):
        assert np.array_equal(electrons(exposure, motion, cache), electrons(exposure, motion))


def test_notes_of_the_files_of_scene_and_vectors_are_told_once(tmp_path):
    vectors = np.broadcast_to(np.float32([40.0, 0.0]), (HEIGHT, WIDTH, 2))
    motion = Motion(vectors=VectorMap(write(tmp_path / "v.exr", vectors, ("u", "v"), (8, 6, 128, 96)), "px/s"))
    note = f"v.exr: the data window ({WIDTH}x{HEIGHT}) is read, not the display window"
    camera = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
    for notes in (SCENE.notes, (*SCENE.notes, note)):  # of one file, which holds the picture as well
        shot = Shot(replace(SCENE, notes=notes), LENS, Exposure(0.1), camera, motion=motion)
        assert plan(shot).notes == [*SCENE.notes, note]


def test_a_cache_tells_vectors_in_a_changed_file_apart(tmp_path):
    """The file's version is a part of the key: other vectors under the same name give another frame."""
    motion, cache, frames = Motion(vectors=VectorMap(tmp_path / "vectors.npy", "px/s")), LightCache(), []
    for right in (800.0, 400.0):
        np.save(tmp_path / "vectors.npy", np.broadcast_to(np.float32([right, 0.0]), (*SCENE.planes.shape[:2], 2)))
        frames += [electrons(Exposure(0.01), motion, cache), electrons(Exposure(0.01), motion, cache)]
        assert cache.reused > 0 and np.array_equal(frames[-2], frames[-1])
    assert edge_widths(frames[0]).min() >= 7 and edge_widths(frames[2]).max() <= 5


def test_a_still_scene_on_a_tripod_costs_nothing_more():
    camera = small_camera(WIDTH, HEIGHT)
    shot = Shot(SCENE, LENS, Exposure(0.01), camera)
    kept = [(one.name, one.cost_ms) for one in plan(shot).passes if one.kept]
    still = plan(replace(shot, motion=Motion(camera=SteadyMotion())))
    assert [(one.name, one.cost_ms) for one in still.passes if one.kept] == kept
    assert next(one for one in still.passes if one.name == "motion").method == "nothing moves"


def test_each_exposure_of_a_frame_sees_its_own_place():
    """An edge that moves on between two exposures: the frame is composed of those two, taken alone at their own times."""
    camera = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM, iso_table={100: IsoSetting(0.01, 0.0)}, bit_depth=12)

    def take(time_s: float, start_s: float = 0.0, camera: Camera = camera) -> np.ndarray:
        shot = Shot(SCENE, LENS, Exposure(time_s, start_s=start_s, shutter=RollingShutter(0.004)), camera, motion=PAN)
        return simulate(shot).noise_free_dn.astype(float)

    bright = 0.01 * float(electrons(Exposure(0.01)).max())  # [DN]
    camera = replace(camera, iso_table={100: IsoSetting(0.01 * 6000.0 / bright, 0.0)})  # 1.5 times the range of the long one
    long, short = take(0.01, camera=camera), take(0.00125, 0.01, camera)
    both = take(0.01, camera=replace(camera, hdr_readout=HdrReadout(exposures=(1.0, 0.125))))
    switch = math.floor(0.9 * 4095)
    near = np.abs(long - switch) < 0.01  # rounding of float32 may decide there
    np.testing.assert_allclose(both[~near], np.where(long < switch, long, 8.0 * short)[~near], rtol=1e-6)
    assert (both > 5000.0).any() and ((long < switch) & (long > 500.0)).any()
    middle = WIDTH - (short / short[:, -1:]).sum(axis=1)
    assert np.abs(middle[0] - middle[-1]) > 2.0 and np.abs(middle.mean() - 40.0) > 6.0
