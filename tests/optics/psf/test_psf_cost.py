"""The predicted time of a point spread function follows what is gathered or transformed."""

import dataclasses

import numpy as np
import pytest
from helpers.aberrated_walls import depth_map, thin_lens
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS
from helpers.psf_frames import contrasts, shot_of
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.passes.psf_work import gathered_work, transformed_work
from simulator.optics.psf.psf_cost import (
    COST_NS,
    core_bytes,
    core_taps,
    cost_ms,
    gather_work,
    gathered_samples,
    kernel_work,
    transform_work,
)
from simulator.optics.psf.slab_kernels import slab_kernels_of
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot


def optics_of(lens, tolerance=0.1, per_photosite=1):
    scene = band_scene([[0.1, 1.0] * 16 * per_photosite] * 24 * per_photosite, 2.0)
    return plan(Shot(scene, lens, Exposure(0.01), small_camera(32, 24, "RGGB"), tolerance=tolerance)).optics


def psf_of(lens, tolerance=0.1):
    psf = optics_of(lens, tolerance).psf
    assert psf is not None
    return psf


DIFFRACTING = dataclasses.replace(LENS, f_number=16.0, diffraction=True)


def test_a_gathered_kernel_costs_its_samples_and_launches():
    psf = psf_of(DIFFRACTING)
    assert psf.core is not None
    work = gather_work(psf, 32 * 24)
    assert gathered_samples(psf) >= (psf.over * (2 * psf.core.reach_px + 1)) ** 2
    assert work["taps"] == 32 * 24 * gathered_samples(psf) and work["light"] == 32 * 24
    assert cost_ms(work) > 1e-6 * COST_NS["gathers"]
    larger = gather_work(psf, 320 * 240)
    assert larger["taps"] == 100 * work["taps"] and larger["gathers"] == 1.0


def test_a_small_frame_costs_its_bands_with_their_margins():
    """A frame of 32 x 24 projects 384 x 288 photosites and more, in each colour, however few of them it gathers."""
    optics = optics_of(DIFFRACTING)
    assert optics.psf is not None
    work = gathered_work(optics, optics.psf)
    assert work["copied samples"] >= 3 * 384 * 288 and work["light"] == 2 * 16 * 128


def test_one_kernel_of_all_distances_gathers_the_projected_scene():
    """Where it includes the blur no blur comes first, whose mosaic would be copied."""
    optics = optics_of(DIFFRACTING)
    assert optics.psf is not None
    blur = plan(Shot(band_scene(np.ones((24, 32)), 1.6), LENS, Exposure(0.01), small_camera(32, 24, "RGGB"))).optics.defocus
    after, instead = (dataclasses.replace(optics.psf, by_distance=is_own) for is_own in (False, True))
    found = [gathered_work(dataclasses.replace(optics, psf=psf, defocus=blur), psf) for psf in (after, instead)]
    assert found[0]["copied samples"] == 0.0 < found[0]["copies"]
    assert found[1]["copied samples"] == gathered_work(optics, optics.psf)["copied samples"]


def test_samples_of_a_finer_scene_cost_the_pixels_that_they_cross():
    """Light of a scene of 3 x 3 pixels per photosite takes longer than that of 1 x 1."""
    costs = []
    for per_photosite in (1, 3):
        optics = optics_of(DIFFRACTING, per_photosite=per_photosite)
        assert optics.psf is not None
        costs.append(cost_ms(gathered_work(optics, optics.psf)))
    assert costs[1] > 1.5 * costs[0]


def test_a_transform_costs_the_frame_with_its_margins_in_each_colour():
    psf = psf_of(DIFFRACTING, tolerance=0.0)
    assert psf.core is None
    side = 2 * psf.reach_px
    samples = (32 + side) * (24 + side) * psf.over**2
    assert transform_work(psf, 32, 24, 3)["samples"] == pytest.approx(3 * samples * len(psf.radii_px))
    assert transform_work(psf, 32, 24, 1)["samples"] == pytest.approx(samples * len(psf.radii_px))


COMA = dataclasses.replace(LENS, f_number=4.0, aberrations=Aberrations(coma_um=0.5))


@pytest.mark.parametrize("tolerance", [0.1, 0.0])
def test_kernels_over_the_field_cost_their_cells_at_all_nodes(tolerance):
    """A frame of 32 x 24 takes longer for its kernels than for its light, whether the device gathers or the host transforms."""
    optics = optics_of(COMA, tolerance)
    psf = optics.psf
    assert psf is not None and psf.nodes != (1, 1) and (psf.core is None) == (tolerance == 0.0)
    cells = len(psf.point_cells(0, 0, 0)[0]) ** 2
    work = kernel_work(psf, 3)
    assert work["kernel cells"] == cells * psf.nodes[0] * psf.nodes[1] * 3 * psf.over
    assert work["wave cells"] % (cells * sum(len(row) for row in psf.lens_psf.wavelengths_nm)) == 0
    told = (transformed_work if psf.core is None else gathered_work)(optics, psf)
    assert {name: told[name] for name in work} == work
    assert cost_ms(work) > 0.5 * cost_ms(told)


def test_a_table_over_the_field_costs_its_turns(tmp_path):
    np.savez(tmp_path / "lens.npz", kernels=np.full((1, 2, 1, 9, 9), 1 / 81), fields=[0.0, 1.0])
    psf = psf_of(dataclasses.replace(LENS, psf=tmp_path / "lens.npz"))
    cells = 81 * psf.nodes[0] * psf.nodes[1] * 3
    assert kernel_work(psf, 3) == {"kernel cells": cells * psf.over, "turned cells": cells}


def test_one_kernel_for_the_whole_field_costs_no_nodes():
    assert kernel_work(psf_of(DIFFRACTING), 3) == {}


def test_kernels_of_wave_optics_out_of_focus_cost_more_launches():
    """Kernels that correct the blur are built for the frame, however small it is."""
    sharp, aberrated = psf_of(DIFFRACTING), psf_of(dataclasses.replace(DIFFRACTING, aberrations=Aberrations(spherical_um=0.1)))
    assert gather_work(sharp, 32 * 24).get("corrections", 0.0) == 0.0
    assert cost_ms({"corrections": 1.0}) > cost_ms({"gathers": 1.0}) and aberrated.by_distance


@pytest.mark.parametrize("coma_um", [0.0, pytest.param(0.3, marks=pytest.mark.slow)])
def test_kernels_by_distance_cost_the_taps_that_they_have(coma_um):
    """Cores end where they do not show: before the margin of diffraction for which their tables are made."""
    through = thin_lens(8.0, Aberrations(spherical_um=0.4, coma_um=coma_um))
    planned = plan(shot_of(contrasts(), through, depth_map(through, 1.0, -1.5))).optics
    psf = planned.psf
    assert psf is not None and psf.core is not None and psf.is_gathered_by_distance
    kernels = slab_kernels_of(psf, planned.channels)
    made = float(np.mean((2 * kernels.reach_px + 1) ** 2))
    assert made / 3.0 < core_taps(psf) < 1.5 * made < (2 * psf.core.reach_px + 1) ** 2
    held = sum(core[0].nbytes for core in kernels.cores.values()) + kernels.lines(slice(0, 1))[0][0].nbytes
    assert held / 4.0 < core_bytes(psf, planned.channels, 1) < 1.5 * held
    columns = 1 if psf.nodes == (1, 1) else 2
    assert gather_work(psf, 1000)["distance taps"] == 1000 * columns * core_taps(psf) * len(psf.radii_px)
