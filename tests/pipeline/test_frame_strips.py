"""Frames computed in strips: the bits of the whole frame, in memory and in files."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import every_stage, small_camera
from helpers.scene_builders import band_scene
from hypothesis import given, settings
from hypothesis import strategies as st

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate, simulate_on_disk
from simulator.raw.raw_image import Raw
from simulator.raw.save import save
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.camera.readout_window import plan_readout, split_readout

RANDOM = np.random.default_rng(8)
WIDTH, HEIGHT = 70, 400
PLANES = RANDOM.uniform(0.1, 1.0, (200, 35, 3)).astype(np.float32)
SLOPE_M = np.linspace(1.8, 2.2, 200)[:, None].repeat(35, axis=1)
SHARP = ThinLens(50.0, 2.0, 2.0, cos4=False)
BAYER = small_camera(WIDTH, HEIGHT, "RGGB", stages=every_stage(), optical_black=OpticalBlack(left_px=4, top_px=130))
STRIP_PX = WIDTH * 150  # strips of one band each


def shot_of(camera=BAYER, lens=SHARP, depth_m=2.0, **settings) -> Shot:
    return Shot(band_scene(PLANES, depth_m), lens, Exposure(0.01), camera, **settings)


SHOTS = {
    "sharp, a strip of optical black": shot_of(),
    "all of the truth": shot_of(truth=("variance", "depth", "blur", "rgb"), depth_m=SLOPE_M),
    "blurred": shot_of(depth_m=SLOPE_M),
    "distorted, with glare": shot_of(lens=replace(SHARP, veiling_glare=0.02, distortion=Distortion(k1=-0.01))),
    "an odd window": shot_of(small_camera(WIDTH, HEIGHT, "RGGB", window=Window(3, 7, 61, 390))),
    "charge of blocks": shot_of(
        small_camera(WIDTH, HEIGHT, "RGGB", binning=Binning(3, "charge"), crosstalk=Crosstalk(0.02, 0.01, 0.01, 0.005)),
        truth=("variance",),
    ),
    "codes of blocks, grey": shot_of(
        small_camera(WIDTH, HEIGHT, binning=Binning(2, "average"), window=Window(0, 6, 70, 260)), depth_m=SLOPE_M
    ),
}


def arrays_of(raw: Raw) -> dict[str, np.ndarray]:
    return {"dn": raw.dn, "mean_electrons": raw.mean_electrons, "noise_free_dn": raw.noise_free_dn, **raw.truth}


@pytest.mark.parametrize("name", SHOTS)
def test_strips_have_the_bits_of_the_whole_frame(name):
    whole, strips = (arrays_of(simulate(SHOTS[name], strip_px=px)) for px in (2**25, STRIP_PX))
    assert len(plan(SHOTS[name], STRIP_PX).strips) > 1
    assert list(whole) == list(strips)
    for key, array in whole.items():
        np.testing.assert_array_equal(strips[key], array, err_msg=key)


def test_files_from_disk_are_those_from_memory(tmp_path):
    shot = SHOTS["all of the truth"]
    (tmp_path / "memory").mkdir()
    save(simulate(shot), tmp_path / "memory")
    with simulate_on_disk(shot, tmp_path / "disk", strip_px=STRIP_PX) as raw:
        assert {path.name for path in (tmp_path / "disk").rglob("*")} >= {"dn", "mean_electrons", "variance", "rgb"}
        save(raw, tmp_path / "disk")
    files = sorted(path.name for path in (tmp_path / "memory").iterdir())
    assert sorted(path.name for path in (tmp_path / "disk").iterdir()) == files
    for name in (file for file in files if not file.endswith(".json")):
        assert (tmp_path / "disk" / name).read_bytes() == (tmp_path / "memory" / name).read_bytes()


def test_a_fault_leaves_nothing_on_the_disk(tmp_path):
    with pytest.raises(PhotositeError), simulate_on_disk(SHOTS["blurred"], tmp_path, strip_px=STRIP_PX):
        raise OSError("a full disk, say")
    assert not list(tmp_path.iterdir())


def test_the_plan_states_the_memory_of_a_strip():
    whole, strips = (plan(SHOTS["blurred"], px) for px in (2**25, STRIP_PX))
    assert [one.name for one in strips.passes if one.kept] == [*(one.name for one in whole.passes if one.kept), "strips"]
    assert strips.memory_bytes() < whole.memory_bytes()
    assert strips.by_strip()[0].strips == strips.strips[:1]


@settings(deadline=None)
@given(
    y=st.integers(0, 300),
    height=st.integers(30, 900),
    most_px=st.integers(1, 100_000),
    step_px=st.sampled_from([1, 16, 128]),
    factor=st.sampled_from([None, 2, 3]),
)
def test_strips_tile_the_frame(y, height, most_px, step_px, factor):
    binning = None if factor is None else Binning(factor, "charge")
    block = 1 if factor is None else 2 * factor
    camera = small_camera(WIDTH, 1200, "RGGB", binning=binning, window=Window(0, y // block * block, WIDTH, height))
    whole, strips = plan_readout(camera), split_readout(camera, most_px, step_px)
    bottom = camera.frame.y
    for strip in strips:
        assert strip.output.y == bottom
        assert (strip.output.x, strip.output.width) == (0, WIDTH)
        assert strip.rows >= 1
        bottom += strip.output.height
    assert bottom == camera.frame.y + height
    assert sum(strip.rows for strip in strips) == whole.rows
    assert all(strip.output.y % np.lcm(step_px, block) == 0 for strip in strips[1:])
    least_rows = np.lcm(step_px, block)
    assert all(strip.output.height <= max(most_px // WIDTH, least_rows) + block for strip in strips)
