"""Frames of a moving camera: blurred, skewed and displaced by one path, with the truth that leads from frame to frame."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.toy_dataset import ToyPictures, toy_camera, toy_config, toy_samples
from helpers.toy_samples import same
from scipy.spatial.transform import Rotation

from data_gen.generate import Generator
from data_gen.recipe.dataset_config import Burst, WriterChoice, load_data_set
from data_gen.recipe.moving_camera import CameraMotion
from data_gen.recipe.recipe import draw_recipe
from data_gen.run import run
from data_gen.samples.record import sample_arrays, sample_facts, sample_from
from data_gen.samples.tensors import TensorForm
from data_gen.storage.reading import read_samples
from simulator.config.distributions import Uniform
from simulator.errors import PhotositeError

FOCAL_PX = 400.0
ROLLING = CameraMotion(12.0, 0.05, focal_length_px=FOCAL_PX, gap_s=0.03, readout_time_s=0.04)


def wave(y, x):
    return 0.5 + 0.2 * np.sin(y / 4.0) + 0.2 * np.cos(x / 5.0)


class Waves(ToyPictures):
    """Pictures whose light is known between their pixels, too; 96 x 96."""

    def read(self, name, rng):
        rows, columns = np.indices((96, 96))
        return replace(super().read(name, rng), signal=np.repeat(wave(rows, columns)[..., None], 3, axis=2).astype(np.float32))


def moving(frames=3, motion=ROLLING, **settings):
    known = {"count": 2, "mode": "burst", "burst": Burst(frames), "augment": False, "exposure_ratio": 1.0}
    return toy_config(motion=motion, **known | settings)


def places_seen(camera, times_s):
    """Rows and columns (16, 24) of the crop that are seen at instants of its rows (16,), by rays through SciPy's rotations."""
    y, x = np.indices((16, 24)) - np.array([7.5, 11.5])[:, None, None]
    rays = np.stack([x, -y, np.full_like(x, -FOCAL_PX)], axis=-1)
    turns = Rotation.from_euler("xyz", np.repeat(camera.path.poses(times_s).rotation_rad, 24, axis=0))
    seen = turns.apply(rays.reshape(-1, 3)).reshape(16, 24, 3)
    return 7.5 - FOCAL_PX * seen[..., 1] / -seen[..., 2], 11.5 + FOCAL_PX * seen[..., 0] / -seen[..., 2]


def row_starts(recipe):
    return 0.04 * (recipe.window[1] + np.arange(16)) / 80  # of the 80 rows of the toy camera


@pytest.fixture(scope="module")
def burst(device):
    return toy_samples(device, moving(), source=Waves())[0]


def test_frames_are_the_mean_over_their_own_time_of_what_rows_see(burst):
    """In double precision, by Gauss's rule. The picture is read linearly between pixels: an error up to f'' / 8."""
    linear = 0.2 / 4**2 / 8 + 0.2 / 5**2 / 8
    noise = 0.1 * 0.05  # a tenth of a standard deviation at about 400 electrons, as a share of the light
    for sample in burst:
        recipe = draw_recipe(moving(), sample.index)
        camera, span = recipe.moving, sample.white_level_dn - sample.black_level_dn
        top, left = sample.crop
        for frame, start_s in enumerate(camera.starts_s):
            mean = np.zeros((16, 24))
            for node, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True):
                y, x = places_seen(camera, start_s + row_starts(recipe) + 0.025 * (1.0 + node))
                mean += 0.5 * weight * wave(top + y, left + x)
            found = (sample.clean_dn[frame] - sample.black_level_dn) / span
            assert np.abs(found - mean).max() < linear + noise
            y, x = places_seen(camera, np.full(16, sample.mid_exposure_s[frame]))
            sharp = (sample.sharp_dn[frame] - sample.black_level_dn) / span
            assert np.abs(sharp - wave(top + y, left + x)).max() < linear + 1e-4
    blurred = np.concatenate([np.ravel(sample.clean_dn - sample.sharp_dn) for sample in burst])
    assert np.abs(blurred).max() > 0.02 * span


def test_flow_leads_from_the_first_frame_to_the_same_light(burst):
    """What row r sees in the middle of its exposure in the first frame stands at the flow's end in the middle of that row's."""
    for sample in burst:
        recipe = draw_recipe(moving(), sample.index)
        camera = recipe.moving
        middles_s = camera.starts_s[0] + row_starts(recipe) + 0.025
        first_y, first_x = places_seen(camera, middles_s)
        rows, columns = np.indices((16, 24))
        for frame, start_s in enumerate(camera.starts_s):
            end_y, end_x = rows + sample.flow_px[frame, 0], columns + sample.flow_px[frame, 1]
            times_s = start_s + 0.025 + 0.04 * (recipe.window[1] + end_y) / 80
            rays = np.stack([end_x - 11.5, 7.5 - end_y, np.full(end_x.shape, -FOCAL_PX)], axis=-1).reshape(-1, 3)
            seen = Rotation.from_euler("xyz", camera.path.poses(times_s.ravel()).rotation_rad).apply(rays).reshape(16, 24, 3)
            np.testing.assert_allclose(7.5 - FOCAL_PX * seen[..., 1] / -seen[..., 2], first_y, atol=1e-3)
            np.testing.assert_allclose(11.5 + FOCAL_PX * seen[..., 0] / -seen[..., 2], first_x, atol=1e-3)
        assert not sample.flow_px[0].any() and np.abs(sample.flow_px[1:]).max() > 0.3
        assert sample.offsets_px[1] == tuple(map(float, sample.flow_px[1, :, 8, 12]))


def test_poses_and_times_are_those_of_the_path(burst):
    for sample in burst:
        recipe = draw_recipe(moving(), sample.index)
        middle_s = 0.025 + row_starts(recipe).mean() + np.array(recipe.moving.starts_s)
        np.testing.assert_allclose(sample.mid_exposure_s, middle_s, rtol=1e-8)
        np.testing.assert_allclose(
            sample.poses_deg, np.degrees(recipe.moving.path.poses(middle_s).rotation_rad), rtol=1e-6, atol=1e-8
        )
        assert (sample.exposure_time_s, sample.readout_time_s) == (0.05, 0.04)


def test_a_sample_does_not_depend_on_which_others_are_made(device, burst):
    alone, _ = toy_samples(device, moving(), [1], source=Waves())
    assert same(alone[0], burst[1])


def test_a_camera_that_hardly_moves_gives_the_picture(device):
    still = moving(motion=replace(ROLLING, rms_deg_per_s=1e-9))
    (sample, _), _ = toy_samples(device, still, source=Waves())
    plain = toy_samples(device, replace(still, mode="single", motion=None), source=Waves())[0]
    assert plain[0].sharp_dn is None and plain[0].mid_exposure_s is None
    top, left = sample.crop
    expected = wave(*(np.indices((16, 24)) + np.array([top, left])[:, None, None]))
    span = sample.white_level_dn - sample.black_level_dn
    for frames in (sample.clean_dn, sample.sharp_dn):
        np.testing.assert_allclose((frames - sample.black_level_dn) / span, np.broadcast_to(expected, frames.shape), atol=1e-5)
    assert np.abs(sample.flow_px).max() < 1e-3


@pytest.mark.parametrize("channels", ["mosaic", "rggb"])
def test_what_a_moving_sample_holds_comes_back_from_files(burst, channels):
    sample = burst[0]
    arrays = sample_arrays(sample, channels)
    assert arrays["flow"].shape == (3, 2, 16, 24) and arrays["sharp"].shape == arrays["clean"].shape
    assert same(sample_from(arrays, sample_facts(sample, channels)), sample)


def test_tensors_of_a_moving_sample_have_sharp_and_flow(burst):
    found = TensorForm("rggb").of(burst[0])
    assert found["sharp"].shape == found["clean"].shape == (3, 4, 8, 12)
    np.testing.assert_array_equal(found["flow"], burst[0].flow_px)


def test_a_single_frame_may_be_blurred_by_a_measured_clip(device):
    motion = replace(ROLLING, clips=("investigation", "the_closeup"))
    (sample, _), _ = toy_samples(device, moving(mode="single", motion=motion), source=Waves())
    assert sample.clean_dn.shape == sample.sharp_dn.shape == (1, 16, 24) and sample.offsets_px == ((0.0, 0.0),)
    assert TensorForm().of(sample)["flow"].shape == (2, 16, 24)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"writer": WriterChoice("dng")}, "writer.format = dng: has no place for sharp twins and flow; give one of webdataset"),
        ({"mode": "dark"}, "motion = given: there is no picture to move in mode dark"),
        (
            {"burst": Burst(3, Uniform((-1.0, 1.0)))},
            "burst.shift = .*: the camera's path moves the frames; leave",
        ),
    ],
)
def test_motion_where_it_cannot_be_is_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        moving(**settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"exposure_time_s": 0.0}, "motion.exposure_time_s = from 0: give numbers above 0"),
        ({"gap_s": -1.0}, "motion.gap_s = from -1: give numbers of 0 or above"),
        ({"lowest_hz": 20.0}, "motion.camera.highest = 12 Hz: give one above the lowest, 20 Hz"),
    ],
)
def test_numbers_that_cannot_be_are_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        CameraMotion(**settings)


def test_a_picture_that_moves_too_far_is_named(device):
    config = moving(motion=replace(ROLLING, rms_deg_per_s=2000.0), on_problem="refuse")
    with pytest.raises(PhotositeError, match="motion.rms_deg_per_s = 2000: the camera moves the picture by .* pixels within"):
        toy_samples(device, config, source=Waves())
    config = moving(motion=replace(ROLLING, rms_deg_per_s=400.0), on_problem="refuse")
    with pytest.raises(PhotositeError, match="96 x 96 pixels are too few for a patch of"):
        toy_samples(device, config, source=Waves())


def test_the_sensor_of_the_toy_camera_has_the_rows_that_these_tests_take():
    assert toy_camera().height_px == 80


@pytest.mark.parametrize("form", ["webdataset", "npz"])
def test_shards_of_a_data_set_hold_the_samples_of_its_moving_camera(tmp_path, form, device):
    """Two shards of drawings, from the configuration file to the samples that are read back; live they are the same."""
    (tmp_path / "moving.yaml").write_text(CONFIG.replace("FORM", form))
    if form == "npz":
        with pytest.raises(PhotositeError, match="moving.yaml:.* writer.format = npz: has no place for sharp twins and flow"):
            load_data_set(tmp_path / "moving.yaml")
        return
    config = load_data_set(tmp_path / "moving.yaml")
    run(config, tmp_path / "out")
    stored, live = list(read_samples(tmp_path / "out")), list(Generator(config, device).samples(range(3)))
    assert [same(one, other) for one, other in zip(stored, live, strict=True)] == [True] * 3
    assert stored[2].flow_px.shape == (2, 2, 32, 48) and stored[2].readout_time_s > 0.0


CONFIG = """\
count: 3
crop: [32, 48]
mode: burst
burst: {frames: 2}
motion:
  clips: [the_closeup, investigation]
  rms_deg_per_s: {uniform: [1, 2]}
  exposure_time_s: 0.02
  readout_time_s: {uniform: [0.01, 0.02]}
  focal_length: 1000
noise: {cameras: {sony_a7s2: {iso: 1600}}}
pictures: {drawn: {procedural: [dead_leaves], count: 4, width: 128, height: 128}}
writer: {format: FORM, samples_per_shard: 2}
"""
