"""Motion as the sum of the planned optics at several instants: behind a defocused lens, a PSF, a distortion, and over lines."""

from dataclasses import replace

import numpy as np
import pytest
from audit.float64_truth import sum_rays
from audit.shot_truth import run, z_scores
from helpers.camera_builders import small_camera
from helpers.moving_frame import dense_mean, moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.posed_projection import posed
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

WIDTH, HEIGHT, PITCH_UM = 64, 32, 40.0
CAMERA = small_camera(WIDTH, HEIGHT, pixel_pitch_um=PITCH_UM)
SHARP = ThinLens(50.0, 8.0, cos4=False)
MOTION = SteadyMotion(pan_deg_per_s=15.0, roll_deg_per_s=60.0)
PICTURE = np.random.default_rng(3).random((HEIGHT, WIDTH))


def shot_of(lens, tolerance=0.5, scene=None) -> Shot:
    scene = band_scene(PICTURE, 1000.0) if scene is None else scene
    return Shot(scene, lens, Exposure(0.01), CAMERA, motion=Motion(camera=MOTION), tolerance=tolerance)


def as_instants(planned: Plan) -> Plan:
    """The plan of the same motion by the sum of instants."""
    motion = planned.optics.motion
    assert motion is not None
    return replace(planned, optics=replace(planned.optics, motion=replace(motion, method="instants")))


@pytest.mark.parametrize("row_s", [0.0, 2e-4])
def test_the_sum_of_instants_is_the_swept_image(row_s):
    """Both against dense instants of rays; the rolling rows share their instants."""
    planned = plan_moving(shot_of(SHARP, 0.1), rolling(HEIGHT, 0.01, row_s))
    found = moving_light(as_instants(planned))
    opens = row_s * np.arange(HEIGHT)
    distance_px = 1e3 * SHARP.image_distance_mm / PITCH_UM
    truth = dense_mean([(PICTURE, None, 1000.0)], MOTION, planned.optics.projection, found.shape, distance_px, opens, 0.01)
    error = planned.optics.motion.error
    assert np.quantile(np.abs(found - truth), 0.99) < 2.0 * error + 1e-4
    assert np.quantile(np.abs(moving_light(planned) - truth), 0.99) < 1.2 * error + 1e-4


def mean_of_poses(planned: Plan, motion: MotionPlan, count: int) -> np.ndarray:
    """Mean of the planned optics at rest, posed at dense instants."""
    instants = motion.path.instants(count)
    homographies = motion.path.motion.homographies(instants.pose_numbers[0], 0)
    still = []
    for homography in homographies:
        optics = replace(planned.optics, motion=None, projection=posed(planned.optics.projection, motion, homography))
        still.append(moving_light(replace(planned, optics=optics)))
    return np.average(still, axis=0, weights=instants.weights[0])


@pytest.mark.parametrize(
    "lens",
    [ThinLens(50.0, 2.0, 20.0, cos4=False), replace(SHARP, diffraction=True, f_number=64.0)],
    ids=["defocus", "diffraction"],
)
def test_motion_behind_a_lens_that_blurs_is_the_mean_of_blurred_images(lens):
    planned = as_instants(plan_moving(shot_of(lens, 1.0)))
    motion = planned.optics.motion
    assert 2 <= motion.count < 120
    truth = mean_of_poses(planned, motion, motion.count + 30)
    allowed = planned.optics.accuracy.allowed
    assert np.abs(moving_light(planned) - truth).max() < 1.5 * allowed
    assert np.abs(mean_of_poses(planned, motion, 1) - truth).max() > 3.0 * allowed  # that the motion is seen at all


def test_an_image_that_rolls_behind_a_defocused_lens_turns_about_the_axis():
    """A quarter turn: the posed frame is the frame turned by 90 degrees, counter to the camera."""
    lens, square = ThinLens(50.0, 2.0, 20.0, cos4=False), np.random.default_rng(4).random((32, 32))
    camera = small_camera(32, 32, pixel_pitch_um=PITCH_UM)
    motion = Motion(camera=SteadyMotion(roll_deg_per_s=90.0))
    shot = Shot(band_scene(square, 1000.0), lens, Exposure(1e-9, start_s=1.0), camera, motion=motion, tolerance=0.1)
    turned = moving_light(plan_moving(shot))
    still = moving_light(plan_moving(replace(shot, exposure=Exposure(1e-9, start_s=0.0))))
    assert np.abs(turned - np.rot90(still, -1)).max() < 2e-3
    assert np.abs(turned - still).max() > 0.1


def test_small_circles_keep_a_posed_scene_of_even_squares(device):
    """Photosites that turn over squares of half their side, which samples do not divide: the audit's seed 73, shot 31."""
    side, lens = 12, ThinLens(50.0, 2.0, 1000.0, cos4=False)
    squares = 0.02 + 0.98 * (np.random.default_rng(5).random((2 * side, 2 * side)) < 0.5)
    camera, motion = small_camera(side, side, pixel_pitch_um=PITCH_UM), Motion(camera=SteadyMotion(roll_deg_per_s=60.0))
    shot = Shot(band_scene(2e-4 * squares, 300.0), lens, Exposure(0.01), camera, motion=motion, tolerance=0.3)
    planned = measure(plan(shot), device)
    optics = planned.optics
    assert optics.motion.method == "instants" and 0.01 < optics.defocus.largest_px < 0.05
    truth = sum_rays(shot, planned, sets=2, points=2048)
    assert np.quantile(np.abs(z_scores(run(planned, shot, device), truth.electrons, planned)), 0.99) < shot.tolerance
    effects = {term.effect for term in plan(replace(shot, tolerance=0.0)).error_budget.terms}
    assert "lens blur" in effects  # rays meet samples, too


def test_distortion_comes_before_the_pose():
    """A rolling shutter behind a distorting lens: swept photosite by photosite as by the sum of instants."""
    from simulator.optics.lens.distortion import Distortion

    lens = replace(SHARP, distortion=Distortion(k1=-0.1, unit="half_diagonal"))
    planned = plan_moving(shot_of(lens, 0.1), rolling(HEIGHT, 0.01, 1e-4))
    assert not planned.optics.sweeps_rows
    assert np.abs(moving_light(planned) - moving_light(as_instants(planned))).max() < 3.0 * planned.optics.motion.error


def test_a_crop_has_the_bits_of_the_frame():
    planned = as_instants(plan_moving(shot_of(ThinLens(50.0, 2.0, 20.0, cos4=False), 5.0), rolling(HEIGHT, 0.01, 1e-3)))
    crop = replace(planned, optics=replace(planned.optics, window=Window(9, 5, 40, 17)))
    assert np.array_equal(moving_light(crop), moving_light(planned)[5:22, 9:49])


def test_layers_that_move_apart_behind_a_lens_that_blurs_are_no_sum_of_instants():
    coverage = np.zeros((HEIGHT, WIDTH), np.float32)
    coverage[8:20, 10:30] = 1.0
    far = (Layer(PICTURE[..., None].astype(np.float32), 40.0),)
    scene = band_scene(PICTURE * coverage, 10.0, coverage=coverage, behind=far)
    shot = replace(shot_of(ThinLens(50.0, 2.0, 20.0), scene=scene), motion=Motion(camera=SteadyMotion(right_m_per_s=9.0)))
    assert plan_moving(shot).optics.motion.method == "joint"
