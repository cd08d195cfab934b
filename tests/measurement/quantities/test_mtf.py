"""MTF50, curve and rise of an edge are those of its closed form, on a file's photosites of one colour."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene, distances
from scipy.special import erf

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.quantities import MeasuredFrame, Mtf
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate

SIGMA_PX = 1.0
MTF50 = math.sqrt(math.log(2.0) / 2.0) / (math.pi * SIGMA_PX)  # of exp(-2 (pi sigma nu)^2)


def gaussian_frame(cfa: str = "MONO", height: int = 120, width: int = 80, level: float = 20000.0) -> MeasuredFrame:
    """A blurred edge with a black level of its own in each place of the 2x2 block."""
    black = np.array([[500.0, 600.0], [700.0, 800.0]])
    edge = level * 0.5 * (1.0 + erf(distances(width, height, 5.7) / (SIGMA_PX * math.sqrt(2.0)))) + 1000.0
    tiled = np.tile(black, (height // 2, width // 2))
    return MeasuredFrame(np.rint(edge + tiled).astype(np.uint16), cfa, black, 65535, name="edge.dng")


@pytest.mark.parametrize(("cfa", "plane"), [("RGGB", None), ("RGGB", "R"), ("GBRG", "G"), ("GRBG", "Gb")])
def test_figures_and_curves_of_a_gaussian_edge_are_those_of_the_gaussian(cfa, plane):
    found = Mtf((10, 8, 100, 64), plane).measure(gaussian_frame(cfa, 240 if plane in ("R", "Gb") else 120))
    figures = found.figures
    assert figures["mtf50"].value == pytest.approx(MTF50, rel=0.015) and figures["mtf50"].unit == "cycles/px"
    assert figures["nyquist"].value == pytest.approx(math.exp(-2.0 * (math.pi * 0.5) ** 2), abs=0.01)
    assert figures["rise_px"].value == pytest.approx(2.0 * 1.28155 * SIGMA_PX, rel=0.02)
    assert figures["angle_deg"].value == pytest.approx(5.7, abs=0.05)
    assert figures["step_dn"].value == pytest.approx(20000.0, rel=1e-3)
    curve, frequency = found.curves["transfer"], np.linspace(0.02, 0.5, 25)
    error = np.interp(frequency, curve.x, curve.y) - np.exp(-2.0 * (math.pi * SIGMA_PX * frequency) ** 2)
    assert np.abs(error).max() < 0.012 and (curve.x_unit, curve.y_unit) == ("cycles/px", "")
    profile = found.curves["edge"]
    assert np.interp(0.0, profile.x, profile.y) == pytest.approx(11000.0, rel=0.01)


def test_line_widths_count_the_frame_and_cycles_per_millimetre_the_pitch():
    """A sharp frame of a simulated camera: sinc of the photosite of 5 um, whose half is at 0.6034 cycles/px."""
    camera = small_camera(96, 128)
    planes = 0.2 + 0.8 * (distances(96 * 8, 128 * 8, 5.7) > 0)
    shot = Shot(band_scene(planes, interpolation="nearest"), ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(0.01), camera)
    light = simulate(shot).mean_electrons.max()
    shot = dataclasses.replace(shot, exposure=Exposure(0.01 * 50000.0 / light))
    found = Mtf().measure(MeasuredFrame.from_raw(simulate(shot), shot)).figures
    assert found["mtf50"].value == pytest.approx(0.6034, rel=0.02)
    assert found["mtf50_lw_ph"].value == pytest.approx(2.0 * 128 * found["mtf50"].value, rel=1e-12)
    assert found["mtf50_cy_mm"].value == pytest.approx(200.0 * found["mtf50"].value, rel=1e-12)


def test_an_area_without_an_edge_names_the_file():
    with pytest.raises(PhotositeError, match=r"edge\.dng: no (single )?edge"):
        Mtf((0, 0, 30, 20)).measure(gaussian_frame())


@pytest.mark.parametrize("plane", ["R", "G"])
def test_an_edge_whose_bright_side_clips_is_refused_with_the_count_of_its_colour(plane):
    frame = gaussian_frame("RGGB", 240)
    clipped = dataclasses.replace(frame, dn=np.minimum(frame.dn, 8000), white_level_dn=8000)
    count = sum(int((part == 8000).sum()) for part in frame.planes(clipped.dn, plane, None))
    photosites = 240 * 80 // (4 if plane == "R" else 2)
    message = rf"edge\.dng: {count} at or above the white level of 8000 DN of {photosites} photosites.*; expose it less"
    with pytest.raises(PhotositeError, match=message):
        Mtf(plane=plane).measure(clipped)


def test_an_edge_whose_dark_side_lies_at_code_0_is_refused():
    """Noise about the code 0 of a camera without pedestal: half of it is cut off."""
    share = 0.5 * (1.0 + erf(distances(80, 120, 5.7) / (SIGMA_PX * math.sqrt(2.0))))
    noise = np.random.default_rng(5).normal(0.0, 5.0, share.shape)
    dn = np.clip(np.rint(50.0 * share + noise), 0, 4095).astype(np.uint16)
    with pytest.raises(PhotositeError, match=rf"{(dn == 0).sum()} at code 0 of 9600 photosites.*; expose it more"):
        Mtf().measure(MeasuredFrame(dn, "MONO", np.zeros((2, 2)), 4095))


def test_up_to_1_percent_of_clipped_photosites_are_measured():
    frame = gaussian_frame()
    dn = frame.dn.copy()
    dn[:, 79][: 120 * 80 // 100] = 65535  # of 9600
    found = Mtf().measure(dataclasses.replace(frame, dn=np.minimum(dn, 30000), white_level_dn=30000)).figures
    assert found["mtf50"].value == pytest.approx(MTF50, rel=0.03)
