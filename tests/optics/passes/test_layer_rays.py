"""What kernels by distance lack of layers that hide each other, which rays add on the reference path, against float64."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.green_frames import PITCH_UM
from helpers.kernels_alone import without_wings
from helpers.lens_error import statistics, z_scores
from helpers.psf_frames import BRIGHTEST_E, shot_of
from helpers.scene_builders import FixedScene
from scipy.signal import fftconvolve
from scipy.stats import qmc

from simulator.device import Device
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.kernel_split import gather_table
from simulator.pipeline.execution import execute
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.progress import silent
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera_sections import Window

SIDE, BORDER, CELLS = 48, 12, 6
RAY_ERROR = 0.04  # of photosites [standard deviations]
SHOWN = slice(BORDER, SIDE - BORDER)
LENS = ThinLens(50.0, 4.0, 2.0, cos4=False, aberrations=Aberrations(spherical_um=0.2))


def surfaces() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light times coverage and coverage of a layer of random holes, and light of what is behind it."""
    rng = np.random.default_rng(5)
    cover = (rng.random((SIDE, SIDE)) < 0.5).astype(np.float64)
    return cover * (0.2 + 0.8 * rng.random((SIDE, SIDE))), cover, rng.uniform(0.2, 1.0, (SIDE, SIDE))


def layered_shot(near_px: float, far_px: float, tolerance: float = 0.0) -> Shot:
    """The layers of `surfaces` at these signed blur radii [photosites], a pixel to a photosite."""
    light, cover, behind = surfaces()
    per_dioptre = float(LENS.blur_radius_um(math.inf) - LENS.blur_radius_um(1.0)) / PITCH_UM
    near_m, far_m = (1.0 / (0.5 - radius_px / per_dioptre) for radius_px in (near_px, far_px))
    shot = shot_of(behind, LENS, 2.0)
    wall, camera = shot.scene.load(), dataclasses.replace(shot.camera, width_px=SIDE, height_px=SIDE)
    scene = dataclasses.replace(
        wall,
        planes=light[..., None].astype(np.float32),
        depth_m=near_m,
        coverage=cover.astype(np.float32),
        behind=(Layer(wall.planes, far_m),),
    )
    return dataclasses.replace(shot, scene=FixedScene(scene), camera=camera, tolerance=tolerance)


def taken(planned: Plan, shot: Shot, device: Device) -> np.ndarray:
    """Mean electrons by kernels and few rays, (height, width) float64, without light from beyond the kernels."""
    optics = planned.optics
    few = dataclasses.replace(optics, accuracy=dataclasses.replace(optics.accuracy, ray_error=RAY_ERROR))
    own = without_wings(dataclasses.replace(planned, optics=few))
    return execute(own, shot, device, silent, Stopwatch()).mean_electrons.astype(np.float64)


def by_points(near_px: float, far_px: float) -> list[np.ndarray]:
    """Means over points of the pupil: of all layers seen together, and of `surfaces` one by one, float64.

    At places CELLS to a pixel and axis.
    """
    points = qmc.Sobol(2, seed=2).random_base2(11)
    radius, angle = np.sqrt(points[:, 0]), 2.0 * np.pi * points[:, 1]
    pupil = radius[:, None] * np.stack([np.sin(angle), np.cos(angle)], axis=-1)
    light, cover, behind = surfaces()
    found, place = [np.zeros(2 * [SIDE * CELLS]) for _ in range(4)], (np.arange(SIDE * CELLS) + 0.5) / CELLS
    for through in pupil:
        near, far = (
            np.ix_(*(np.clip(np.floor(place + one), 0, SIDE - 1).astype(int) for one in radius_px * through))
            for radius_px in (near_px, far_px)
        )
        seen = light[near], cover[near], behind[far]
        for mean, own in zip(found, (seen[0] + (1.0 - seen[1]) * seen[2], *seen), strict=True):
            mean += own / len(points)
    return found


def spread(plane: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Mean of a plane over a kernel of odd sides around each place; it goes on as it ends."""
    around = len(kernel) // 2
    return fftconvolve(np.pad(plane, around, mode="edge"), kernel[::-1, ::-1], mode="valid")


def at_photosites(plane: np.ndarray, psf: FieldPsf) -> np.ndarray:
    """Mean of a plane of CELLS to a pixel over the kernel in focus: its weight of each pixel, as finer kernels divide it."""
    whole, fine = (gather_table(dataclasses.replace(psf, over=over).kernel(0, 0, False, 0, 0)) for over in (1, CELLS))
    sums = fine.reshape(len(whole), CELLS, len(whole), CELLS).sum(axis=(1, 3))
    fine *= np.kron(whole / sums, np.ones((CELLS, CELLS)))
    around = (len(fine) - CELLS) // 2
    wide = np.pad(plane, around, mode="edge")
    return fftconvolve(wide, fine[::-1, ::-1] / fine.sum(), mode="valid")[::CELLS, ::CELLS]


@pytest.mark.parametrize(
    ("near_px", "far_px"), [(0.0, 0.9), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((-0.9, 0.0), (-1.3, 0.8)))]
)
def test_layers_that_hide_each_other_are_seen_together(device, near_px, far_px):
    """Kernels alone are off by 0.3 to 2 standard deviations."""
    shot = layered_shot(near_px, far_px)
    planned = plan(shot)
    psf = planned.optics.psf
    assert planned.optics.layer_rays and psf.by_distance and psf.over == 1
    at = [dataclasses.replace(psf, radii_px=(one,), core=None, seen=None) for one in (near_px, far_px, 0.0)]
    kernels = [one.kernel(0, 0, False, 0, 0)[0] for one in at[:2]]
    light, cover, behind = surfaces()
    alone = spread(light, kernels[0]) + (1.0 - spread(cover, kernels[0])) * spread(behind, kernels[1])
    together, *each = (at_photosites(one, at[2]) for one in by_points(near_px, far_px))
    truth = (alone + together - (each[0] + (1.0 - each[1]) * each[2]))[SHOWN, SHOWN]
    found = taken(planned, shot, device)[SHOWN, SHOWN]
    scale = truth.sum() / found.sum()

    def error(of: np.ndarray) -> float:
        return statistics(z_scores(of, truth, BRIGHTEST_E)).p99_9

    assert error(scale * found) < 5.0 * RAY_ERROR < 0.3 < error(alone[SHOWN, SHOWN])
    assert planned.error_budget.predicted_sigma < 0.2
    told = next(step for step in planned.passes if step.name == "point spread function")
    assert "rays for layers that hide each other" in told.method


@pytest.mark.slow
def test_layers_that_are_nearly_in_focus_are_seen_as_what_they_show_together(device):
    """Light from afar, too: kernels whose middle alone saw them together were off by 1 standard deviation beside wide edges."""
    shot = layered_shot(0.0, 1e-3)
    scene = shot.scene.load()
    cover, light = (
        np.where(np.arange(SIDE) < at, 0.0, most)[None].repeat(SIDE, axis=0) for at, most in ((24, 0.75), (26, 0.9))
    )
    wall = dataclasses.replace(scene.behind[0], planes=(1.0 - light)[..., None].astype(np.float32))
    edges = dataclasses.replace(
        scene, planes=(0.01 * cover)[..., None].astype(np.float32), coverage=cover.astype(np.float32), behind=(wall,)
    )
    apart = dataclasses.replace(shot, scene=FixedScene(edges))
    at_one_distance = dataclasses.replace(edges, behind=(dataclasses.replace(wall, depth_m=scene.depth_m),))
    whole = dataclasses.replace(shot, scene=FixedScene(at_one_distance))
    assert plan(apart).optics.layer_rays and plan(whole).optics.defocus is None
    found, seen = (taken(plan(one), one, device)[SHOWN, SHOWN] for one in (apart, whole))
    assert statistics((found - seen) / np.sqrt(seen)).p99_9 < 5.0 * RAY_ERROR


def test_a_crop_has_the_bits_of_the_whole_frame(device):
    shot = layered_shot(-1.3, 0.8)

    def of(window: Window) -> np.ndarray:
        part = dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, window=window))
        return taken(plan(part), part, device)

    assert np.array_equal(of(Window(13, 17, 9, 8)), of(Window(8, 10, 24, 20))[7:15, 5:14])


def test_a_tolerance_has_no_such_rays():
    assert not plan(layered_shot(-1.3, 0.8, tolerance=0.1)).optics.layer_rays
