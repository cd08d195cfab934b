"""The predicted time of a point spread function follows what is gathered or transformed."""

import dataclasses

import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.psf_cost import COST_NS, cost_ms, gathered_samples, psf_work
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot


def psf_of(lens, tolerance=0.1):
    scene = band_scene([[0.1, 1.0] * 16] * 24, 2.0)
    psf = plan(Shot(scene, lens, Exposure(0.01), small_camera(32, 24, "RGGB"), tolerance=tolerance)).optics.psf
    assert psf is not None
    return psf


def test_a_gathered_kernel_costs_its_samples_and_launches():
    psf = psf_of(dataclasses.replace(LENS, f_number=16.0, diffraction=True))
    assert psf.core is not None
    work = psf_work(psf, 32, 24, 3)
    assert gathered_samples(psf) >= (psf.over * (2 * psf.core.reach_px + 1)) ** 2
    assert work["taps"] == 32 * 24 * gathered_samples(psf) and work["light"] == 32 * 24
    assert cost_ms(work) > 1e-6 * COST_NS["gathers"]
    larger = psf_work(psf, 320, 240, 3)
    assert larger["taps"] == 100 * work["taps"] and larger["gathers"] == 1.0


def test_a_transform_costs_the_frame_with_its_margins_in_each_colour():
    psf = psf_of(dataclasses.replace(LENS, f_number=16.0, diffraction=True), tolerance=0.0)
    assert psf.core is None
    side = 2 * psf.reach_px
    samples = (32 + side) * (24 + side) * psf.over**2
    assert psf_work(psf, 32, 24, 3)["samples"] == pytest.approx(3 * samples * len(psf.radii_px))
    assert psf_work(psf, 32, 24, 1)["samples"] == pytest.approx(samples * len(psf.radii_px))


def test_kernels_of_wave_optics_out_of_focus_cost_more_launches():
    """Kernels that correct the blur are built for the frame, however small it is."""
    lens = dataclasses.replace(LENS, f_number=16.0, diffraction=True)
    sharp, aberrated = psf_of(lens), psf_of(dataclasses.replace(lens, aberrations=Aberrations(spherical_um=0.1)))
    assert psf_work(sharp, 32, 24, 3).get("corrections", 0.0) == 0.0
    assert cost_ms({"corrections": 1.0}) > cost_ms({"gathers": 1.0}) and aberrated.by_distance
