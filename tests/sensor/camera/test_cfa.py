"""A colour filter pattern of any size is data: what each photosite sees, what files and readers hold, and what is refused."""

import io
import math
import shutil
import subprocess

import numpy as np
import pytest
import rawpy
import tifffile
from helpers.camera_builders import small_camera
from helpers.fresh_reader import dcraw_codes
from helpers.raw_frame import COLOR_MATRIX, random_frame
from helpers.scene_builders import band_scene

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.raw.raw_reader import read_raw_file
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

X_TRANS = "GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG"
QUAD = "RRGG/RRGG/GGBB/GGBB"
PICTURE = np.random.default_rng(5).uniform(0.1, 1.0, (40, 60, 3))
DEPTH_M = np.linspace(1.6, 2.6, 60)[np.newaxis].repeat(40, axis=0)
SHARP, BLURRED = ThinLens(50.0, 8.0, cos4=False), ThinLens(50.0, 2.8, 2.0, veiling_glare=0.02)
WAYS = {
    "sharp": (SHARP, math.inf, {}),
    "out of focus": (BLURRED, DEPTH_M, {}),
    "moving": (SHARP, 1e6, {"motion": Motion(camera=SteadyMotion(pan_deg_per_s=30.0))}),
}


def letters_of(name: str, height: int, width: int, x: int = 0, y: int = 0) -> np.ndarray:
    """Letter of each photosite from (x, y) of the sensor on."""
    rows = name.split("/")
    return np.array([[rows[(y + i) % len(rows)][(x + j) % len(rows[0])] for j in range(width)] for i in range(height)])


def check_own_colors(raw, found) -> None:
    """A metric development holds each photosite's own signal."""
    dn = raw.dn[raw.active]
    own = np.array(["RGB".index(letter) for letter in letters_of(X_TRANS, *dn.shape).ravel()]).reshape(*dn.shape, 1)
    signal = (dn - np.float32(raw.black_level_dn)) / np.float32(raw.white_level_dn - raw.black_level_dn)
    np.testing.assert_allclose(np.take_along_axis(found, own, axis=2)[..., 0], signal, atol=1e-6)


def shot(cfa=X_TRANS, way="sharp", window=None, stages=None, **settings) -> Shot:
    lens, depth_m, options = WAYS[way]
    camera = small_camera(60, 40, cfa, window=window, stages=stages or {}, pixel_pitch_um=5.0, black_level_dn=64.0)
    return Shot(band_scene(PICTURE, depth_m), lens, Exposure(0.005), camera, **(options | settings))


@pytest.mark.parametrize(("cfa", "way"), [(QUAD, "sharp"), *((X_TRANS, way) for way in WAYS)])
def test_each_photosite_sees_what_a_sensor_of_its_colour_alone_sees(cfa, way):
    """The truth holds the signal in every colour; a photosite has the bits of its own one."""
    raw = simulate(shot(cfa, way, truth=("rgb",)))
    own = np.array(["RGB".index(letter) for letter in letters_of(cfa, 40, 60).ravel()]).reshape(40, 60)
    span_dn = raw.white_level_dn - raw.black_level_dn
    expected = np.take_along_axis(raw.truth["rgb"], own[..., np.newaxis], axis=2)[..., 0]
    assert np.array_equal((raw.noise_free_dn - np.float32(raw.black_level_dn)) / np.float32(span_dn), expected)
    assert raw.cfa == cfa and len({*np.round(raw.truth["rgb"][20, 30], 4)}) == 3


@pytest.mark.parametrize("way", ["sharp", "out of focus"])
def test_a_crop_is_the_part_of_the_whole_and_begins_with_its_own_colours(way):
    stages = {"photon_shot_noise": PhotonShotNoise()}
    whole, part = (simulate(shot(way=way, window=window, stages=stages)) for window in (None, Window(7, 4, 40, 30)))
    assert np.array_equal(part.dn, whole.dn[4:34, 7:47])
    assert part.cfa == "/".join("".join(row) for row in letters_of(X_TRANS, 6, 6, 7, 4))


def test_a_large_pattern_costs_one_blur_for_each_colour():
    bayer, large = ({one.name: one for one in plan(shot(cfa, "out of focus")).passes} for cfa in ("RGGB", X_TRANS))
    assert large["defocus"].cost_ms == pytest.approx(3 * bayer["defocus"].cost_ms)
    assert large["defocus"].method.endswith("once for each of 3 colours of a filter of 6 x 6")
    assert plan(shot()).passes[1] == plan(shot("RGGB")).passes[1]  # a sharp image takes each photosite's own colour at once


def test_a_pattern_has_one_name_whatever_is_written():
    assert Cfa.named("RGRG/GBGB/RGRG/GBGB") == Cfa.named("RG/GB") == Cfa.named("RGGB")
    assert Cfa.named(X_TRANS).name_at(0, 0) == Cfa.named(X_TRANS).name_at(6, 12) == X_TRANS
    assert Cfa.named(QUAD).name_at(1, 0) == "RGGR/RGGR/GBBG/GBBG"


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("RGBG", "give one of RGGB"),
        ("", "of 2 to 8 a side"),
        ("RG/GBX", "the rows differ in length"),
        ("RGGBRGGBR/GBRGGBRGG", "of 2 to 8 a side"),
        ("RG/RG", "give one of RGGB"),
        ("RRGG/RRGG/GGBB/GGB", "differ in length"),
        ("RRGG/RRGG/GGXX/GGXX", "give one of RGGB"),
    ],
)
def test_what_is_no_pattern_is_refused(name, rule):
    with pytest.raises(PhotositeError, match=f"camera.cfa = {name}: .*{rule}"):
        Cfa.named(name)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"binning": Binning(2)}, "camera.binning = with cfa GBG"),
        ({"optical_black": OpticalBlack(left_px=8)}, "optical_black.left = 8: give whole periods .* multiples of 6"),
        (
            {"optical_black": OpticalBlack(top_px=6), "window": Window(0, 3, 30, 30)},
            "camera.window.y = 3: give a multiple of 6",
        ),
        (
            {"iso_table": {100: IsoSetting(1.0, 0.0, color_bias_dn=(1.0, 0.0, 0.0, 1.0))}},
            "color_bias .* greens of a Bayer pattern",
        ),
    ],
)
def test_what_only_a_bayer_pattern_has_is_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        camera = small_camera(60, 40, X_TRANS, **settings)
        plan(Shot(band_scene(PICTURE), SHARP, Exposure(0.005), camera))


@pytest.mark.parametrize("cfa", [X_TRANS, "RGGR/RGGR/GBBG/GBBG"])
@pytest.mark.parametrize("active_area", [None, (12, 24, 90, 120)])
def test_the_file_tells_the_pattern_of_the_active_area(cfa, active_area):
    raw = random_frame(96, 128, cfa, active_area=active_area)
    with tifffile.TiffFile(io.BytesIO(dng_bytes(raw))) as file:
        found = {tag.code: tag.value for tag in file.pages[0].pages[0].tags.values()}
        stored = file.pages[0].pages[0].asarray()
    rows = cfa.split("/")
    assert found[Tag.CFA_REPEAT_PATTERN_DIM] == (len(rows), len(rows[0]))
    assert list(found[Tag.CFA_PATTERN]) == ["RGB".index(letter) for row in rows for letter in row]
    assert list(found[Tag.CFA_PLANE_COLOR]) == [0, 1, 2] and np.array_equal(stored, raw.dn)
    assert found[Tag.BLACK_LEVEL_REPEAT_DIM] == (1, 1) and found[Tag.BLACK_LEVEL] == raw.black_level_dn


@pytest.mark.parametrize("active_area", [None, (6, 6, 90, 120)])
def test_libraw_reads_x_trans_with_codes_colours_and_levels(active_area):
    raw = random_frame(96, 128, X_TRANS, active_area=active_area)
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        assert np.array_equal(frame.raw_image_visible, raw.dn[raw.active])
        letters = np.array(list(frame.color_desc.decode()))[frame.raw_colors_visible]
        assert np.array_equal(letters, letters_of(X_TRANS, *letters.shape))
        assert frame.black_level_per_channel == [raw.black_level_dn] * 4 and frame.white_level == raw.white_level_dn
        assert frame.camera_whitebalance[:3] == pytest.approx([1 / value for value in raw.as_shot_neutral])


def test_a_wide_margin_hides_the_pattern_of_x_trans_from_rawpy_but_not_from_libraw(tmp_path):
    """rawpy 0.28 reads past its table from 12 rows or columns of optical black on; the development is right."""
    raw = random_frame(540, 560, X_TRANS, active_area=(12, 24, 536, 556))
    write_dng(raw, tmp_path / "x.dng")
    with pytest.raises(PhotositeError, match="rawpy does not tell the pattern"):
        read_raw_file(tmp_path / "x.dng", any_pattern=True)
    check_own_colors(raw, develop(raw, output="metric"))


@pytest.mark.skipif(shutil.which("dcraw") is None, reason="dcraw is not installed (Debian: apt install dcraw)")
def test_dcraw_reads_every_code_and_the_pattern_of_x_trans(tmp_path):
    raw = random_frame(96, 128, X_TRANS)
    write_dng(raw, tmp_path / "x.dng")
    told = subprocess.run(["dcraw", "-i", "-v", tmp_path / "x.dng"], capture_output=True, text=True, check=True).stdout
    assert f"Filter pattern: {X_TRANS}" in told
    assert np.array_equal(dcraw_codes(tmp_path / "x.dng", raw.dn.shape), raw.dn)


def test_our_reader_takes_x_trans_where_it_is_asked_for(tmp_path):
    raw = random_frame(96, 128, X_TRANS)
    write_dng(raw, tmp_path / "x.dng")
    found = read_raw_file(tmp_path / "x.dng", any_pattern=True)
    assert found.cfa == X_TRANS and np.array_equal(found.mosaic, raw.dn) and (found.black_level_dn == raw.black_level_dn).all()
    with pytest.raises(PhotositeError, match="6 x 6 filter pattern: only 2 x 2 Bayer"):
        read_raw_file(tmp_path / "x.dng")


@pytest.mark.parametrize("demosaic", ["linear", "vng", "ahd"])
def test_libraw_develops_x_trans_and_keeps_each_photosites_own_colour(demosaic):
    """The metric output is the signal as measured; the three methods differ in the other colours alone."""
    raw = random_frame(512, 516, X_TRANS)
    check_own_colors(raw, develop(raw, output="metric", demosaic=demosaic))


def test_x_trans_develops_to_the_colours_of_even_patches():
    """Camera colours of four patches, to the weights of LibRaw, which are whole 256ths."""
    patches = np.array([[[0.8, 0.4, 0.2], [0.1, 0.6, 0.3]], [[0.3, 0.3, 0.9], [0.5, 0.5, 0.5]]])
    planes = patches.repeat(60, axis=0).repeat(60, axis=1)
    own = np.array(["RGB".index(letter) for letter in letters_of(X_TRANS, 120, 120).ravel()]).reshape(120, 120, 1)
    dn = np.rint(512 + 15871 * np.take_along_axis(planes, own, axis=2)[..., 0]).astype(np.uint16)
    raw = random_frame(120, 120, X_TRANS, dn=dn, black_level_dn=512, white_level_dn=16383, color_matrix=COLOR_MATRIX)
    for demosaic, half_size in (("linear", False), ("vng", False), ("ahd", True)):
        found = develop(raw, output="metric", demosaic=demosaic, half_size=half_size)
        side = found.shape[0] // 2
        cells = found.reshape(2, side, 2, side, 3)[:, 8:-8, :, 8:-8]
        np.testing.assert_allclose(cells.mean(axis=(1, 3)), patches, atol=2e-3, err_msg=demosaic)


def test_small_x_trans_frames_name_the_methods_that_develop_them():
    with pytest.raises(PhotositeError, match="develop.demosaic = ahd: LibRaw develops X-Trans frames of less than 512 px"):
        develop(random_frame(96, 128, X_TRANS))


def test_the_illustrative_camera_has_twenty_green_photosites_in_every_thirty_six():
    camera = load_camera("illustrative/x_trans")
    letters = letters_of(camera.cfa, 6, 6)
    assert [int((letters == letter).sum()) for letter in "RGB"] == [8, 20, 8]
    assert all({*line} == {*"RGB"} for line in (*letters, *letters.T))
    assert camera.make == "Photosite"
