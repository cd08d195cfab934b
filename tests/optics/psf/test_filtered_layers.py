"""Layers that a low-pass filter sees apart have an image for each of its spots; what means of layers lack else is stated."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from helpers.green_frames import PITCH_UM
from helpers.kernels_alone import electrons_by_kernels
from helpers.lens_error import statistics, z_scores
from helpers.psf_frames import BRIGHTEST_E, shot_of
from helpers.scene_builders import FixedScene
from scipy.ndimage import convolve, shift
from scipy.signal import fftconvolve

from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.kernel_split import gather_table
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer

SIDE, SHOWN = 160, slice(32, 128)
NEAR_PX, APART_PX = 0.9, 2.0  # blur radius of the nearer layer; distance of the spots, two pixels
LENS = ThinLens(50.0, 4.0, 2.0, cos4=False, aberrations=Aberrations(spherical_um=0.2))


def holes(kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coverage and light of a layer of random holes, and light of what is behind it, more or less even."""
    rng = np.random.default_rng(5)
    cover = (rng.random((SIDE, SIDE)) < 0.5).astype(np.float64)
    depth = {"random": 0.8, "faint": 0.004, "even": 0.0}[kind]  # of what is behind
    behind = 0.6 + depth * (rng.random((SIDE, SIDE)) - 0.5)
    return cover, cover * (0.2 + 0.8 * rng.random((SIDE, SIDE))), behind


def layered_shot(kind: str, apart_px: float = APART_PX) -> Shot:
    cover, front, behind = holes(kind)
    per_dioptre = float(LENS.blur_radius_um(math.inf) - LENS.blur_radius_um(1.0)) / PITCH_UM
    shot = shot_of(behind, LENS, 2.0, low_pass_um=apart_px * PITCH_UM)
    wall = shot.scene.load()
    near = Layer(wall.planes, wall.depth_m)
    scene = dataclasses.replace(
        wall,
        planes=front[..., None].astype(np.float32),
        depth_m=1.0 / (0.5 - -NEAR_PX / per_dioptre),
        coverage=cover.astype(np.float32),
        behind=(near,),
    )
    return dataclasses.replace(shot, scene=FixedScene(scene))


def seen_through_spots(kind: str, kernels: list[np.ndarray]) -> np.ndarray:
    """Mean over the spots of the layers behind the lens, in float64. kernels: of the nearer and of the farther layer."""
    cover, front, behind = holes(kind)
    cover, front = (
        fftconvolve(np.pad(one, 48, mode="edge"), kernels[0], mode="same")[48:-48, 48:-48] for one in (cover, front)
    )
    behind = fftconvolve(np.pad(behind, 48, mode="edge"), kernels[1], mode="same")[48:-48, 48:-48]
    image = front + (1.0 - cover) * behind
    away = round(0.5 * APART_PX)
    spots = itertools.product((-away, away), repeat=2)
    return np.mean([shift(image, spot, order=0, mode="nearest") for spot in spots], axis=0)


def error_of(shot: Shot, kind: str) -> float:
    """p99.9 of the error [standard deviations], against what the spots see."""
    optics = plan(shot).optics
    bare = dataclasses.replace(optics.psf, sampling=Sampling(), core=None, seen=None)
    at = (dataclasses.replace(bare, radii_px=(float(one),)) for one in optics.defocus.radii_px)
    truth = seen_through_spots(kind, [one.kernel(0, 0, False, 0, 0)[0] for one in at])[SHOWN, SHOWN]
    found = electrons_by_kernels(shot)[SHOWN, SHOWN]
    scale = found.sum() / truth.sum() / BRIGHTEST_E
    return statistics(z_scores(found / (scale * BRIGHTEST_E), truth, BRIGHTEST_E)).p99_9


@pytest.mark.parametrize("kind", ["random", "faint"])
def test_what_kernels_lack_that_spread_each_layer_by_itself_is_stated(kind):
    """Layers behind the images of the aperture, seen together and then spread, against each spread by itself.

    On 4 x 4 squares to a photosite.
    """
    planned, over = plan(layered_shot(kind, apart_px=0.0)), 4
    psf = dataclasses.replace(planned.optics.psf, radii_px=(0.0,), core=None, seen=None, over=over)
    assert psf.by_distance and planned.optics.psf.over == 1
    table, beside = gather_table(psf.kernel(0, 0, False, 0, 0)), over * 48

    def spread(fine: np.ndarray) -> np.ndarray:
        around = fftconvolve(np.pad(fine, beside, mode="edge"), table, mode="same")
        return around[beside:-beside:over, beside:-beside:over]

    cover, front, behind = (np.kron(one, np.ones((over, over))) for one in holes(kind))
    cover, front = (convolve(one, disk_weights(over * NEAR_PX), mode="nearest") for one in (cover, front))
    apart, together = spread(front) + (1.0 - spread(cover)) * spread(behind), spread(front + (1.0 - cover) * behind)
    error = statistics(z_scores(apart[SHOWN, SHOWN], together[SHOWN, SHOWN], BRIGHTEST_E)).p99_9
    (told,) = (one.sigma for one in planned.error_budget.terms if "each layer by itself" in one.cause)
    assert error < told < 2.5 * error
    assert error > 2.0 or kind == "faint"


@pytest.mark.parametrize(("tolerance", "allowed"), [pytest.param(0.03, 0.1, marks=pytest.mark.slow), (0.0, 1e-4)])
def test_each_spot_of_a_filter_sees_layers_of_its_own(tolerance, allowed):
    """Kernels that hold the filter left 4.5 sigma, at any tolerance."""
    shot = dataclasses.replace(layered_shot("random"), tolerance=tolerance)
    optics = plan(shot).optics
    assert optics.psf.by_distance and optics.sees_spots and optics.psf.sampling.low_pass_um == 0.0
    assert error_of(shot, "random") < allowed


@pytest.mark.parametrize("kind", ["even", pytest.param("faint", marks=pytest.mark.slow)])
def test_kernels_hold_the_filter_where_layers_hardly_differ_over_its_spots(kind):
    shot = layered_shot(kind)
    optics = plan(shot).optics
    assert optics.psf.by_distance and not optics.sees_spots and optics.psf.sampling.low_pass_um > 0.0
    assert optics.spots_error <= optics.accuracy.allowed and (optics.spots_error > 1e-6) == (kind == "faint")
    assert error_of(shot, kind) < plan(shot).error_budget.predicted_sigma
