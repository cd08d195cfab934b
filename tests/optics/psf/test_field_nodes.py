"""Places of kernels over the field: as many as the light between them needs, and what it has wrong is told."""

import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE
from helpers.scene_builders import band_scene
from scipy.signal import fftconvolve

from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

WIDTH, HEIGHT, DARK = 300, 200, 0.05
PIXELS = np.where(np.random.default_rng(2).random((HEIGHT // 4, WIDTH // 4)) < 0.5, 1.0, DARK)
PICTURE = np.kron(PIXELS, np.ones((4, 4)))


def planned(aberrations: Aberrations, f_number: float, **settings):
    """Plan of a lens whose image point moves or spreads over the field."""
    lens = ThinLens(50.0, f_number, cos4=False, aberrations=aberrations)
    return plan(
        Shot(band_scene(PICTURE, math.inf, interpolation="nearest"), lens, EXPOSURE, green_camera(WIDTH, HEIGHT), **settings)
    )


def lateral(shift_um: float) -> Aberrations:
    """Lateral colour that takes 550 nm so far outwards in the corner."""
    return Aberrations(chromatic=tuple(ChromaticShift(nm, 0.0, shift_um) for nm in (500.0, 600.0)))


@pytest.mark.parametrize(
    ("aberrations", "f_number"),
    [(lateral(4.0), 8.0), (lateral(15.0), 4.0), (Aberrations(coma_um=0.5), 4.0), (Aberrations(astigmatism_um=1.0), 4.0)],
)
def test_the_light_between_nodes_has_wrong_what_is_told(aberrations, f_number):
    """The mean of the kernels of four nodes against wave optics in their middle, over random squares, in float64."""
    found = planned(aberrations, f_number)
    psf, accuracy = found.optics.psf, found.optics.accuracy
    (told,) = (term.sigma for term in found.error_budget.terms if "between which spots move" in term.cause)
    worst, (rows, columns) = 0.0, psf.nodes
    for row, column in ((1, 1), (1, columns // 2), (rows // 2, 1)):
        four = [(row + down, column + across) for down in (0, 1) for across in (0, 1)]
        middle = np.mean([psf.field_xy(*node) for node in four], axis=0)
        exact = psf.computed_kernel(0, 0, (float(middle[0]), float(middle[1])))
        mixed = np.mean([psf.kernel(0, 0, False, *node).sum(axis=0) for node in four], axis=0)
        light, wrong = (accuracy.electrons * fftconvolve(PICTURE, one, "valid") for one in (exact, mixed - exact))
        noise_e = np.sqrt(np.maximum(light, 0.5 * DARK * accuracy.electrons) + accuracy.read_noise_e**2)
        worst = max(worst, float(np.quantile(np.abs(wrong) / noise_e, 0.999)))
    assert 0.2 * told < worst <= told


def test_nodes_lie_closer_where_spots_move_farther():
    """A weak change over the field takes few kernels, and stays within the share that it is allowed; a strong one is told."""
    weak, strong = planned(lateral(0.3), 4.0), planned(lateral(15.0), 4.0)
    assert math.prod(weak.optics.psf.nodes) < math.prod(strong.optics.psf.nodes)
    assert weak.error_budget.predicted_sigma < 0.1 and not weak.warnings()
    assert strong.error_budget.predicted_sigma > 0.1 and any("between which spots move" in line for line in strong.warnings())


def test_a_smaller_tolerance_has_no_wider_nodes():
    coarse, fine = (planned(lateral(1.0), 4.0, tolerance=one).optics.psf for one in (0.3, 0.05))
    assert math.prod(coarse.nodes) < math.prod(fine.nodes) and fine.field_error < coarse.field_error
