"""The loop closes in colour under A, D50 and D65: noise-free ColorChecker, DNG, LibRaw, XYZ, against colour-science."""

import dataclasses

import numpy as np
import pytest

from simulator import develop, load_camera, load_shot, simulate
from simulator.color_correction import fit_color_correction
from simulator.colour_data import colour_science
from simulator.raw.dng import write_dng

SHOT = "configs/shots/color_checker.yaml"


def true_xyz(light):
    """XYZ of the 24 patches under a light, white Y = 1, and the names."""
    colour = colour_science()
    shape = colour.SpectralShape(380, 780, 5)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    power = colour.SDS_ILLUMINANTS[light].copy().align(shape)
    chart = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    patches = [colour.sd_to_XYZ(patch.copy().align(shape), observer, power, method="Integration") for patch in chart.values()]
    return np.array(patches) / 100.0, list(chart)


def color_differences(camera, light, folder, root):
    """Delta E 2000 of the 24 patches, one scale for the whole chart."""
    colour = colour_science()
    shot = load_shot(root / SHOT, [f"camera={camera}", f"scene.illuminant={light}", "lens.cos4=false", "exposure.time=1/60 s"])
    raw = simulate(dataclasses.replace(shot, camera=dataclasses.replace(shot.camera, width_px=720, height_px=480, window=None)))
    raw = dataclasses.replace(raw, dn=np.rint(raw.noise_free_dn).astype(np.uint16))
    assert raw.dn.max() < raw.white_level_dn, "nothing may clip"
    write_dng(raw, folder / "chart.dng")
    picture = develop(folder / "chart.dng", output="metric", demosaic="linear")
    response = shot.camera.response
    correction = fit_color_correction(response.wavelengths_nm, response.quantum_efficiency, light)
    corners = np.round(np.array(shot.scene.patch_boxes()) * [720, 480, 720, 480]).astype(int)
    measured = correction.xyz([picture[y0:y1, x0:x1].mean(axis=(0, 1), dtype=float) for x0, y0, x1, y1 in corners])
    true, names = true_xyz(light)
    measured *= (measured[:, 1] @ true[:, 1]) / (measured[:, 1] @ measured[:, 1])
    white = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"][light]
    return colour.delta_E(*(colour.XYZ_to_Lab(xyz, white) for xyz in (measured, true)), method="CIE 2000"), names


@pytest.mark.parametrize("camera", ["sony_a7_iii", "canon_5d_mark_iv"])
@pytest.mark.parametrize("light", ["A", "D50", "D65"])
def test_mean_color_difference_is_below_1_and_none_above_3(camera, light, tmp_path, request):
    difference, names = color_differences(camera, light, tmp_path, request.config.rootpath)
    print(f"\n{camera} {light}: mean {difference.mean():.2f}, max {difference.max():.2f} ({names[difference.argmax()]})")
    assert difference.mean() < 1.0 and difference.max() < 3.0


@pytest.mark.parametrize("light", ["A", "D65", "3200 K"])
def test_greys_stay_grey_and_exposure_only_scales(light):
    response = load_camera("sony_a7_iii").response
    correction = fit_color_correction(response.wavelengths_nm, response.quantum_efficiency, light)
    levels = np.array([1e-3, 0.1, 1.0])
    grey = correction.xyz(levels[:, None] * correction.neutral)
    np.testing.assert_allclose(grey, levels[:, None] * correction.white_xyz, rtol=1e-12)
    colour = np.array([0.3, 0.2, 0.05])
    np.testing.assert_allclose(correction.xyz(7.0 * colour), 7.0 * correction.xyz(colour), rtol=1e-12)
    assert np.isfinite(correction.xyz([-0.01, 0.02, 0.0])).all()


def test_a_camera_that_sees_as_the_eye_is_corrected_exactly():
    """Curves that are sums of the eye's (Luther condition): XYZ itself comes out, to rounding."""
    colour = colour_science()
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(colour.SpectralShape(380, 780, 5)).values
    wavelengths = np.arange(380.0, 781.0, 5.0)
    mix = np.array([[0.8, 0.3, 0.0], [0.1, 0.9, 0.1], [0.0, 0.1, 0.8]])
    efficiency = observer @ mix / wavelengths[:, None]  # per photon, so that per watt it is the eye's
    correction = fit_color_correction(wavelengths, efficiency, "D65")
    true, _ = true_xyz("D65")
    camera = true @ mix / (correction.white_xyz @ mix).max()
    np.testing.assert_allclose(correction.xyz(camera), true, atol=1e-4)
