"""Patterns with clear or white photosites: what they see, what files hold, and what LibRaw makes of them."""

import io

import numpy as np
import pytest
import rawpy
import tifffile
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.raw_frame import COLOR_MATRIX, random_frame
from helpers.scene_builders import band_scene

from simulator.color.camera_matrices import as_shot_neutral, camera_response, chart_reflectances, color_matrix
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, tristimulus
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.noise_check.flat_bench import bench_camera
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes
from simulator.raw.truth_exr import truth_parts
from simulator.sensor.camera.camera import ColorMatrix, SpectralResponse
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

KODAK = "WGWR/GWRW/WBWG/BWGW"  # half white: US 8125546 B2
CFAS = {"RCCB": "RCB", "RGWB": "RGBW", "WBGR": "RGBW", KODAK: "RGBW"}
TWO = [cfa for cfa in CFAS if len(cfa) == 4]
WIDE = COLOR_MATRIX.sum(axis=0) * 0.8  # what a photosite without a filter sees of XYZ
MATRICES = {"RCB": np.stack([COLOR_MATRIX[0], WIDE, COLOR_MATRIX[2]]), "RGBW": np.vstack([COLOR_MATRIX, WIDE])}
# Linear sRGB to XYZ under D65 (IEC 61966-2-1), and patches inside the sRGB gamut.
SRGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
PATCHES = np.array(
    [[[0.8, 0.8, 0.8], [0.02, 0.02, 0.02], [0.6, 0.1, 0.05]], [[0.1, 0.4, 0.1], [0.05, 0.1, 0.5], [0.7, 0.5, 0.05]]]
)


def clear_camera(cfa, width=48, height=36, **settings):
    """Colours that see separate thirds of the spectrum, and a clear one that sees all of it."""
    grid = np.arange(400.0, 701.0, 10.0)
    curves = {"R": grid > 600, "G": (grid > 500) & (grid < 600), "B": grid < 500, "C": grid > 0, "W": grid > 0}
    table = np.stack([curves[letter] for letter in CFAS[cfa]], axis=-1).astype(float)
    return small_camera(width, height, cfa, response=SpectralResponse(grid, table), **settings)


def planes_of(cfa, height, width) -> np.ndarray:
    """Colour plane of each photosite, (height, width, 1)."""
    planes = np.array(Cfa.named(cfa).planes)
    return np.tile(planes, (height, width))[:height, :width, np.newaxis]


def frame_of(cfa, **changes):
    letters = CFAS[cfa]
    colors = {"color_matrix": MATRICES[letters], "as_shot_neutral": (0.5, 1.0, 0.625, 0.9)[: len(letters)]}
    return random_frame(96, 128, cfa, **({"noise_profile": ((2e-4, 3e-7),) * len(letters)} | colors | changes))


def chart(cfa):
    """Patches as a camera with the matrix above records them under D65, without noise."""
    matrix, planes = MATRICES[CFAS[cfa]] @ SRGB_TO_XYZ, PATCHES.repeat(64, axis=0).repeat(64, axis=1)
    neutral = matrix.sum(axis=1) / matrix.sum(axis=1).max()
    own = np.take_along_axis(planes @ matrix.T / matrix.sum(axis=1).max(), planes_of(cfa, *planes.shape[:2]), axis=2)[..., 0]
    dn = np.rint(512 + 15871 * own).astype(np.uint16)
    return frame_of(cfa, dn=dn, black_level_dn=512, white_level_dn=16383, as_shot_neutral=tuple(neutral))


@pytest.mark.parametrize("cfa", CFAS)
def test_clear_photosites_see_the_sum_of_all_colours(cfa):
    picture = np.random.default_rng(1).uniform(0.1, 1.0, (36, 48, 3))
    raw = simulate(
        Shot(band_scene(picture), ThinLens(50.0, 8.0, cos4=False), Exposure(0.002), clear_camera(cfa), truth=("rgb",))
    )
    own = np.take_along_axis(raw.truth["rgb"], planes_of(cfa, 36, 48), axis=2)[..., 0]
    assert raw.cfa == cfa and np.array_equal(raw.noise_free_dn / np.float32(raw.white_level_dn), own)
    colors = dict(zip(CFAS[cfa], np.moveaxis(raw.truth["rgb"].astype(float), 2, 0), strict=True))
    clear = colors.pop("W" if "W" in colors else "C")
    assert (clear > sum(colors.values())).all()
    names = [part.channels for part in truth_parts(raw) if part.name == "rgb"]
    assert names == [tuple(CFAS[cfa])]


def test_shot_noise_of_white_photosites_is_theirs():
    camera = clear_camera("RGWB", 300, 300, stages={"photon_shot_noise": PhotonShotNoise()}, black_level_dn=64.0)
    raw = simulate(Shot(band_scene(np.full((4, 4, 3), 0.5)), ThinLens(50.0, 8.0, cos4=False), Exposure(0.002), camera))
    checks = {}
    for name, y, x in (("R", 0, 0), ("W", 1, 0)):
        mean_e, codes = float(raw.mean_electrons[y, x]), raw.dn[y::2, x::2]
        checks[name, "mean"] = mean_p(codes, 64 + mean_e, mean_e + 1 / 12)
        checks[name, "variance"] = variance_p(codes, mean_e + 1 / 12)
    assert raw.mean_electrons[1, 0] > 2 * raw.mean_electrons[0, 0]
    accept(checks)


@pytest.mark.parametrize("cfa", CFAS)
def test_the_file_names_clear_photosites_white(cfa):
    raw = frame_of(cfa)
    with tifffile.TiffFile(io.BytesIO(dng_bytes(raw))) as file:
        main = {tag.code: tag.value for tag in file.pages[0].tags.values()}
        found = {tag.code: tag.value for tag in file.pages[0].pages[0].tags.values()}
    numbers = {"R": 0, "G": 1, "B": 2, "C": 6, "W": 6}  # TIFF/EP, CFAPattern
    assert list(found[Tag.CFA_PLANE_COLOR]) == [numbers[letter] for letter in CFAS[cfa]]
    assert list(found[Tag.CFA_PATTERN]) == [numbers[letter] for letter in cfa.replace("/", "")]
    assert len(main[Tag.COLOR_MATRIX_1]) == 2 * 3 * len(CFAS[cfa]) and len(main[Tag.AS_SHOT_NEUTRAL]) == 2 * len(CFAS[cfa])
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        assert np.array_equal(frame.raw_image_visible, raw.dn) and frame.num_colors == len(CFAS[cfa])
        if cfa in TWO:
            assert frame.black_level_per_channel == [raw.black_level_dn] * 4
            assert np.array_equal(frame.raw_pattern % 3 if CFAS[cfa] == "RCB" else frame.raw_pattern, _libraw_pattern(cfa))


def _libraw_pattern(cfa) -> np.ndarray:
    """Planes of RGBW as LibRaw counts them; of RCCB modulo 3: it counts the second clear as 3, red as 0."""
    planes = np.array(Cfa.named(cfa).planes)
    return np.array([[0, 1], [0, 2]]) if CFAS[cfa] == "RCB" else planes


@pytest.mark.parametrize("cfa", TWO)
@pytest.mark.parametrize(("demosaic", "half_size"), [("linear", False), ("ahd", False), ("ahd", True)])
def test_libraw_develops_two_by_two_patterns_to_the_right_colours(cfa, demosaic, half_size):
    """Through the matrix of all colours, within a thousandth."""
    found = develop(chart(cfa), output="linear_srgb", demosaic=demosaic, half_size=half_size) / 65535
    side = found.shape[0] // 2
    cells = found.reshape(2, side, 3, side, 3)[:, side // 4 : -side // 4, :, side // 4 : -side // 4]
    np.testing.assert_allclose(cells.mean(axis=(1, 3)), PATCHES, atol=1e-3)


def test_four_colours_develop_to_four_planes_of_their_own():
    raw = frame_of("RGWB")
    found = develop(raw, output="metric", demosaic="linear")
    assert found.shape == (96, 128, 4)
    signal = (raw.dn - np.float32(raw.black_level_dn)) / np.float32(raw.white_level_dn - raw.black_level_dn)
    np.testing.assert_allclose(np.take_along_axis(found, planes_of("RGWB", 96, 128), axis=2)[..., 0], signal, atol=1e-6)


def test_larger_patterns_and_other_white_balances_are_refused():
    with pytest.raises(PhotositeError, match="LibRaw misreads the pattern"):
        develop(frame_of(KODAK))
    with pytest.raises(PhotositeError, match="four colours, and LibRaw takes three multipliers; give camera or daylight"):
        develop(frame_of("RGWB"), white_balance="A")


def test_the_matrix_of_four_colours_is_that_of_least_squares_that_keeps_white():
    """The residual of white-balanced values is at right angles to all that rows adding up to 1 may change."""
    response = load_camera("illustrative/rgbw").response
    curves = response.wavelengths_nm, response.quantum_efficiency
    matrix, light = color_matrix(*curves, "D65"), illuminant("D65")
    white_xyz = tristimulus(light) / tristimulus(light)[1]
    neutral = as_shot_neutral(light, *curves, WAVELENGTHS_NM)
    assert matrix.shape == (4, 3)
    np.testing.assert_allclose(matrix @ white_xyz, neutral, rtol=1e-12)
    reflectances = chart_reflectances(WAVELENGTHS_NM)
    xyz = np.stack([tristimulus(one * light) for one in reflectances]) / tristimulus(light)
    white = camera_response(light, WAVELENGTHS_NM, *curves)
    seen = camera_response(reflectances * light, WAVELENGTHS_NM, *curves) / white
    residual = seen - xyz @ (matrix * white_xyz / neutral[:, np.newaxis]).T
    np.testing.assert_allclose((xyz[:, :2] - xyz[:, 2:]).T @ residual, 0.0, atol=1e-10)
    found = xyz - seen @ np.linalg.pinv(matrix * white_xyz / neutral[:, np.newaxis]).T
    assert np.sqrt(np.mean(found**2)) < 0.03


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Cfa.named("RCBC"), "camera.cfa = RCBC: give one of"),
        (lambda: Cfa.named("RGCB"), "of the colours RGB, RCB, RGBW"),
        (lambda: clear_camera("RCCB", color_matrix=ColorMatrix(((1, 0, 0), (0, 1, 0), (0, 0, 1)))), "of red, green and blue"),
        (lambda: bench_camera(clear_camera("RCCB"), 32, 32), "camera.cfa = RCCB: planes of a Bayer pattern"),
        (
            lambda: plan(
                Shot(
                    band_scene(np.ones((4, 4, 3))),
                    ThinLens(50.0, 8.0, distortion=Distortion(lateral=(1.001, 1.0, 0.999))),
                    Exposure(0.01),
                    clear_camera("RGWB"),
                )
            ),
            "lens.distortion.lateral .* the camera sees white, too",
        ),
    ],
)
def test_what_is_stated_for_red_green_and_blue_is_refused(make, message):
    with pytest.raises(PhotositeError, match=message):
        make()


@pytest.mark.parametrize(("name", "letters"), [("rccb", "RCB"), ("rgbw", "RGBW")])
def test_illustrative_cameras_see_most_without_a_filter(name, letters):
    camera = load_camera(f"illustrative/{name}")
    efficiency = dict(zip(letters, camera.response.quantum_efficiency.T, strict=True))
    clear = efficiency["C" if name == "rccb" else "W"]
    assert camera.filter.letters == letters and all((clear >= curve).all() for curve in efficiency.values())
