"""The loop closes in colour: a noise-free ColorChecker, developed by LibRaw from our DNG, against colour-science."""

import dataclasses

import numpy as np
import pytest

from simulator import develop, load_shot, simulate
from simulator.color.colour_science import colour_science
from simulator.sensor.camera.camera import IsoSetting

SHOT = "configs/shots/color_checker.yaml"
NOISE_FREE = [
    "camera.stages.photon_shot_noise=null",
    "camera.stages.full_well=null",
    "camera.read_noise_after_gain=0 DN",
    "lens.cos4=false",
]


@pytest.fixture(scope="module")
def frame(request):
    """A noise-free frame of the chart and the chart's patch boxes."""
    shot = load_shot(request.config.rootpath / SHOT, NOISE_FREE)
    table = {iso: IsoSetting(setting.gain_dn_per_e, 0.0) for iso, setting in shot.camera.iso_table.items()}
    camera = dataclasses.replace(shot.camera, width_px=720, height_px=480, iso_table=table)
    raw = simulate(dataclasses.replace(shot, camera=camera))
    assert raw.dn.max() < raw.white_level_dn, "nothing may clip"
    return raw, shot.scene.patch_boxes()


@pytest.fixture(scope="module", params=["linear_srgb", "xyz"])
def patches(frame, request):
    """Measured and true XYZ of the 24 patches, D65 white with Y = 1, and their names; sRGB cuts cyan."""
    raw, boxes = frame
    colour = colour_science()
    picture = develop(raw, output=request.param, demosaic="linear", bits=16).astype(np.float64)
    if request.param == "linear_srgb":
        picture = picture @ colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ.T
    height, width = picture.shape[:2]
    corners = np.round(np.array(boxes) * [width, height, width, height]).astype(int)
    measured = np.array([picture[y0:y1, x0:x1].mean(axis=(0, 1)) for x0, y0, x1, y1 in corners])
    shape = colour.SpectralShape(380, 780, 5)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    light = colour.SDS_ILLUMINANTS["D65"].copy().align(shape)
    chart = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    true = np.array(
        [colour.sd_to_XYZ(patch.copy().align(shape), observer, light, method="Integration") / 100.0 for patch in chart.values()]
    )
    # one scale for the whole chart: exposure is not what is tested here
    return measured * (measured[:, 1] @ true[:, 1]) / (measured[:, 1] @ measured[:, 1]), true, list(chart)


def test_mean_color_difference_is_below_1_5(patches):
    measured, true, names = patches
    colour = colour_science()
    white = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]
    lab = [colour.XYZ_to_Lab(xyz, white) for xyz in (measured, true)]
    difference = colour.delta_E(*lab, method="CIE 2000")
    print(f"\n{'patch':16}{'L* a* b* developed':>26}{'L* a* b* true':>26}{'dE2000':>9}")
    for name, found, expected, value in zip(names, *lab, difference, strict=True):
        print(f"{name:16}{_triple(found):>26}{_triple(expected):>26}{value:9.2f}")
    print(f"{'mean':68}{difference.mean():9.2f}\n{'max':68}{difference.max():9.2f}")
    assert difference.mean() < 1.5
    assert difference.max() < 5.0


def test_grey_patches_stay_grey(patches):
    """White balance and colour matrix keep neutrals neutral: the six greys differ from the chart's own by little chroma."""
    measured, true, _ = patches
    colour = colour_science()
    white = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]
    found, expected = colour.XYZ_to_Lab(measured[18:], white), colour.XYZ_to_Lab(true[18:], white)
    assert np.abs(found[:, 1:] - expected[:, 1:]).max() < 1.0


def _triple(lab) -> str:
    return " ".join(f"{value:7.2f}" for value in lab)
