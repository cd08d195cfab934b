"""Plots of a lens against closed forms and the lens's own limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.green_frames import GREEN_UM
from helpers.wave_optics import pupil_transfer

from simulator.measurement.curves.lens_plots import blur_plot, depth_of_field_plot, diffraction_transfer, mtf_plot
from simulator.measurement.curves.wavefront_transfer import wavefront_transfer
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations

LENS = ThinLens(50.0, 4.0, 2.0)
CAMERA = small_camera(7200, 4800, pixel_pitch_um=5.0, fill_factor=0.64, low_pass_um=4.0)


def test_diffraction_is_that_of_a_round_pupil():
    frequency = np.linspace(0.0, 1.2, 25)
    wanted = [pupil_transfer(one, 4.0) for one in frequency]
    assert diffraction_transfer(frequency, GREEN_UM, 4.0) == pytest.approx(wanted, abs=1e-15)


def test_the_transfer_is_the_product_of_what_the_shot_simulates():
    """Photosites 0.8 * 5 um wide, spots 4 um apart, and N_w = 4 (1 + 50 / 1950)."""
    per_px = np.linspace(0.0, 1.0, 241)
    photosites = np.abs(np.sinc(0.8 * per_px) * np.cos(math.pi * 0.8 * per_px))
    pupil = np.array([pupil_transfer(one / 5.0, 4.0 * (1.0 + 50.0 / 1950.0)) for one in per_px])
    for lens, wanted in ((None, photosites), (LENS, photosites), (replace(LENS, diffraction=True), photosites * pupil)):
        plot = mtf_plot(lens, CAMERA)
        assert plot.lines[0].curve.y == pytest.approx(wanted, abs=2e-5)  # 550 nm, GREEN_UM of the closed form
        assert [line.label for line in plot.lines[1:]] == ["photosite", "low-pass filter", "diffraction"][: len(plot.lines) - 1]
    assert "lens.diffraction is off" in mtf_plot(LENS, CAMERA).note


def test_aberrations_are_a_factor_of_the_product():
    """Spherical aberration is the same all over the frame; coma differs off the axis, along the radius and across it."""
    photosites = mtf_plot(None, CAMERA).lines[0].curve.y
    shifts = 2.0 * GREEN_UM * LENS.diffraction_f_number * np.linspace(0.0, 1.0, 241) / 5.0
    spherical = mtf_plot(replace(LENS, aberrations=Aberrations(spherical_um=0.5)), CAMERA)
    assert [line.label for line in spherical.lines] == ["centre", "photosite", "low-pass filter", "diffraction"]
    wanted = photosites * wavefront_transfer(lambda x, y: 0.5 * (x**2 + y**2) ** 2, GREEN_UM, shifts)
    assert spherical.lines[0].curve.y == pytest.approx(wanted, abs=2e-5) and "with the lens's aberrations" in spherical.note
    coma = mtf_plot(replace(LENS, aberrations=Aberrations(coma_um=1.0)), CAMERA).lines
    along, across = (line.curve.y for line in coma[1:3])
    assert coma[1].label.endswith("radially") and coma[2].label == "there, across the radius"
    plain = photosites * wavefront_transfer(lambda x, y: 0.0 * x, GREEN_UM, shifts)
    assert coma[0].curve.y == pytest.approx(plain, abs=2e-5)
    wanted = photosites * wavefront_transfer(lambda x, y: 0.7 * (x**2 + y**2) * x, GREEN_UM, shifts)
    assert along == pytest.approx(wanted, abs=2e-5)
    wanted = photosites * wavefront_transfer(lambda x, y: 0.7 * (x**2 + y**2) * y, GREEN_UM, shifts)
    assert across == pytest.approx(wanted, abs=2e-5) and abs(along - across).max() > 0.05


def test_stopping_down_keeps_the_inner_part_of_the_wavefront():
    """At twice the f-number r^4 is a sixteenth; N_w grows with the distance in both."""
    aberrations = Aberrations(spherical_um=2.0, at_f_number=4.0)
    stopped = mtf_plot(replace(LENS, f_number=8.0, aberrations=aberrations), CAMERA).lines[0].curve.y
    inner = replace(LENS, f_number=8.0, aberrations=Aberrations(spherical_um=2.0 / 16))
    assert stopped == pytest.approx(mtf_plot(inner, CAMERA).lines[0].curve.y, abs=1e-9)


def test_terms_fixed_to_the_picture_have_a_line_for_rows_and_for_columns():
    lines = mtf_plot(replace(LENS, aberrations=Aberrations(zernike_um={6: 0.1})), CAMERA).lines
    assert [line.label for line in lines[:2]] == ["centre, along rows", "centre, along columns"]


def test_blur_circles_are_those_of_similar_triangles():
    curve = blur_plot(LENS, CAMERA).lines[0].curve
    image_mm = 1.0 / (1.0 / 50.0 - 1.0 / 2000.0)
    behind_mm = 1.0 / (1.0 / 50.0 - 1e-3 / curve.x)  # where a point at this distance is sharp
    wanted_um = 1e3 * 12.5 * np.abs(image_mm - behind_mm) / behind_mm
    assert curve.y == pytest.approx(wanted_um, rel=1e-9, abs=1e-9)
    assert curve.x[0] == pytest.approx(0.2) and curve.x[-1] == pytest.approx(200.0)


def test_at_the_limits_of_the_depth_of_field_the_blur_is_the_circle_of_confusion():
    near, far = (line.curve for line in depth_of_field_plot(LENS, CAMERA).lines)
    circle_um = 1e3 * math.hypot(36.0, 24.0) / 1500.0
    for curve in (near, far):
        blur_um = [
            2.0 * abs(float(replace(LENS, focus_distance_m=x).blur_radius_um(y))) for x, y in zip(curve.x, curve.y, strict=True)
        ]
        assert blur_um == pytest.approx([circle_um] * len(blur_um), rel=1e-6)
    assert (near.y < near.x).all() and (far.y > far.x).all()
    assert far.x[-1] < LENS.hyperfocal_m(circle_um) < near.x[-1]


def test_a_pinhole_has_blur_alone():
    from simulator.measurement.curves.sensor_plots import CameraSetting
    from simulator.measurement.curves.subject import Subject, plots_of

    subject = Subject("hole", CameraSetting.of(CAMERA, 0.01), Pinhole(0.2, 50.0))
    names = [plot.name for plot in plots_of(subject)]
    assert names == ["snr", "noise", "photon_transfer", "dynamic_range", "blur"]
    assert not blur_plot(Pinhole(0.2, 50.0), CAMERA).marks[1:]
