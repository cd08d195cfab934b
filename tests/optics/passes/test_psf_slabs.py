"""Aberrations in a scene with depth, gathered on the device: against exact kernels in float64, and against tolerance 0."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.aberrated_walls import SPHERICAL, depth_map, thin_lens
from helpers.green_frames import PITCH_UM
from helpers.psf_frames import MARGIN, SIDE, contrasts, error, shot_of

from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.field_psf import FieldPsf
from simulator.pipeline.planner import plan
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window


@pytest.mark.parametrize(("f_number", "radius_px"), [(8.0, 2.2), pytest.param(5.6, -1.6, marks=pytest.mark.slow)])
def test_light_of_each_wall_is_convolved_with_its_exact_kernel(f_number, radius_px):
    """Away from the step between them, to a tenth of the noise in p99.9."""
    planes, through = contrasts(), thin_lens(f_number, SPHERICAL)
    shot = shot_of(planes, through, depth_map(through, radius_px, 0.3))
    psf = plan(shot).optics.psf
    assert psf is not None and psf.is_gathered_by_distance
    left, right = slice(0, SIDE // 2 - 24), slice(SIDE // 2 + 24, SIDE)
    for here_px, columns in ((radius_px, left), (0.3, right)):
        exact = dataclasses.replace(psf, radii_px=(here_px,), core=None).kernel(0, 0, False, 0, 0)[0]
        assert error(shot, planes, exact, (slice(None), columns)) < 0.1


def test_kernels_vary_over_the_field():
    """Coma, on a frame as wide as its field: photosites against exact kernels of their places; a window has the same bits."""
    planes = contrasts()
    through = thin_lens(8.0, Aberrations(spherical_um=0.2, coma_um=0.3))
    shot = shot_of(planes, through, depth_map(through, 1.0, 1.5))
    psf, found = plan(shot).optics.psf, simulate(shot).mean_electrons.astype(np.float64)
    assert psf.is_gathered_by_distance and psf.nodes != (1, 1)
    places = [(20, 20), (20, 110), (130, 40), (75, 120), (140, 140), (50, 10)]
    truth = np.array([photosite(planes, psf, row, column, 1.0 if column < SIDE // 2 else 1.5) for row, column in places])
    own = np.array([found[place] for place in places])
    mirrored = np.array([photosite(planes, psf, row, column, 1.25, -1.0) for row, column in places])
    scale = float(own @ truth / (truth @ truth))
    noise = np.sqrt(np.maximum(scale * truth, 1.0))
    assert np.abs((own - scale * truth) / noise).max() < 0.1
    assert np.abs((own - scale * mirrored) / noise).max() > 1.0  # the direction of the field matters
    window = Window(37, 51, 70, 46)
    part = simulate(dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, window=window))).mean_electrons
    np.testing.assert_array_equal(part, found[51:97, 37:107].astype(np.float32))


def photosite(planes: np.ndarray, psf: FieldPsf, row: int, column: int, radius_px: float, side: float = 1.0) -> float:
    """Light of one photosite with the kernel of its place; side -1: of the place on the other side of the centre."""
    half_diagonal = side * 0.5 * math.hypot(SIDE, SIDE)
    field_xy = (column + 0.5 - 0.5 * SIDE) / half_diagonal, (row + 0.5 - 0.5 * SIDE) / half_diagonal
    lens_psf = psf.fit_kernel(radius_px)
    cells = lens_psf.cell_kernel(0, radius_px, field_xy)
    kernel = psf.sampling.phases(cells / cells.sum(), lens_psf.cells, PITCH_UM, 1, True)[0][::-1, ::-1]
    half, lit = len(kernel) // 2, np.pad(planes, MARGIN, mode="edge")
    down, right = (slice(place + MARGIN - half, place + MARGIN + half + 1) for place in (row, column))
    return float((lit[down, right] * kernel).sum())


def test_surfaces_occlude_each_other_as_by_transforms():
    """A step between two walls, against transforms (tolerance 0), at 2,000 e-.

    Beside the step the wide tails are those of the sharp picture, which nothing occludes.
    """
    planes, through = 0.3 + 0.7 * contrasts(), thin_lens(8.0, SPHERICAL)
    shot = shot_of(planes, through, depth_map(through, 1.5, -1.0))
    found, truth = (simulate(dataclasses.replace(shot, tolerance=one)).mean_electrons.astype(float) for one in (0.1, 0.0))
    z = np.abs(found - truth) / np.sqrt(truth)
    assert np.quantile(z, 0.9) < 0.1 and np.quantile(z, 0.99) < 0.35
