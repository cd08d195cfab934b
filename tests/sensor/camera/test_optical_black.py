"""The covered edge of a sensor sees no light and all the rest; files tell it, and converters take the black level from it."""

import dataclasses
import io
import math
import shutil
import subprocess

import numpy as np
import pytest
import rawpy
import tifffile
from helpers.camera_builders import small_camera
from helpers.fresh_reader import dcraw_codes, libraw_codes
from helpers.randomness import accept, mean_p, variance_p
from helpers.raw_frame import random_frame
from helpers.scene_builders import band_scene

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.dng.areas import masked_areas
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.studies.resimulation import differing_codes, resimulate

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")
EDGE = OpticalBlack(left_px=16, top_px=8, right_px=4, bottom_px=6)


def take(optical_black=EDGE, cfa="MONO", size=(64, 48), **settings):
    camera = small_camera(*size, cfa, optical_black=optical_black, **settings)
    planes = np.ones((4, 4)) if cfa == "MONO" else np.ones((4, 4, 3))
    return simulate(Shot(band_scene(planes, math.inf), ThinLens(50.0, 8.0, cos4=False), Exposure(0.02), camera, Seeds(frame=3)))


def raw_tags(raw) -> dict:
    with tifffile.TiffFile(io.BytesIO(dng_bytes(raw))) as file:
        return {tag.code: tag.value for tag in file.pages[0].pages[0].tags.values()}


@pytest.mark.parametrize("cfa", ["MONO", "GBRG"])
def test_light_reaches_all_but_the_edge_and_changes_nothing_elsewhere(cfa):
    dark, lit = take(cfa=cfa), take(None, cfa=cfa)
    expected = np.zeros((48, 64), bool)
    expected[8:42, 16:60] = True
    np.testing.assert_array_equal(dark.mean_electrons, lit.mean_electrons * expected)
    np.testing.assert_array_equal(dark.dn, lit.dn * expected)
    assert lit.mean_electrons.min() > 0
    assert (dark.active_area, lit.active_area) == ((8, 16, 42, 60), None)


@pytest.mark.parametrize(
    ("window", "active"),
    [
        (Window(0, 0, 30, 20), (8, 16, 20, 30)),
        (Window(10, 2, 40, 30), (6, 6, 30, 40)),
        (Window(16, 8, 44, 34), None),
        (Window(17, 9, 40, 30), None),
        (Window(21, 9, 43, 39), (0, 0, 33, 39)),
    ],
)
def test_a_window_shows_the_part_of_the_edge_that_lies_in_it(window, active):
    whole, part = take(cfa="GBRG"), take(cfa="GBRG", window=window)
    inside = slice(window.y, window.y + window.height), slice(window.x, window.x + window.width)
    np.testing.assert_array_equal(part.dn, whole.dn[inside])
    assert part.active_area == active


def test_the_edge_has_the_noise_of_the_dark():
    stages = {"photon_shot_noise": PhotonShotNoise(), "dark_current": DarkCurrent(1500.0)}
    iso_table = {100: IsoSetting(1.0, 8.0)}
    edge = OpticalBlack(top_px=200)
    raw = take(edge, size=(400, 300), stages=stages, iso_table=iso_table, black_level_dn=512.0)
    dark = raw.dn[:200]
    # Dark current 1500 e-/s for 0.02 s: Poisson of mean and variance 30 e- at 1 DN/e-; read noise 8 DN; rounding 1/12 DN^2.
    variance = 30.0 + 64.0 + 1.0 / 12.0
    accept({"mean": mean_p(dark, 542.0, variance), "variance": variance_p(dark, variance)})


def test_optical_crosstalk_ends_at_the_metal_and_charge_creeps_one_photosite_under_it():
    optical, electrical = take(crosstalk=Crosstalk(optical=0.05)), take(crosstalk=Crosstalk(electrical=0.05))
    assert not optical.mean_electrons[:8].any() and not optical.dn[:8].any()
    assert electrical.dn[7, 20] > 0 and not electrical.dn[:7].any()


@pytest.mark.parametrize("cfa", CFAS)
@pytest.mark.parametrize("size", [(96, 128), (97, 131)])
def test_readers_see_the_active_area_and_its_pattern(tmp_path, cfa, size):
    active = (8, 16, size[0] - 4, size[1])
    raw = random_frame(*size, cfa, active_area=active)
    write_dng(raw, tmp_path / "a.dng")
    visible = raw.dn[8 : size[0] - 4, 16:]
    np.testing.assert_array_equal(libraw_codes([tmp_path / "a.dng"], tmp_path)[str(tmp_path / "a.dng")], visible)
    if shutil.which("dcraw"):
        np.testing.assert_array_equal(dcraw_codes(tmp_path / "a.dng", visible.shape), visible)
    if cfa != "MONO":
        with rawpy.imread(str(tmp_path / "a.dng")) as frame:
            assert "".join("RGBG"[index] for index in frame.raw_pattern.ravel()) == cfa
            np.testing.assert_array_equal(frame.raw_image, raw.dn)


def test_active_and_masked_areas_have_the_corners_of_the_standard():
    found = raw_tags(random_frame(96, 128, active_area=(8, 16, 90, 124)))
    assert found[Tag.ACTIVE_AREA] == (8, 16, 90, 124)
    # Two photosites beside the lit ones are left out: above, below, left, right.
    assert found[Tag.MASKED_AREAS] == (0, 0, 6, 128, 92, 0, 96, 128, 8, 0, 90, 14, 8, 126, 90, 128)
    assert (found[Tag.DEFAULT_CROP_ORIGIN], found[Tag.DEFAULT_CROP_SIZE]) == ((8, 8), (92, 66))
    thin = raw_tags(random_frame(96, 128, active_area=(2, 2, 96, 128)))
    assert Tag.ACTIVE_AREA in thin and Tag.MASKED_AREAS not in thin
    assert not {Tag.ACTIVE_AREA, Tag.MASKED_AREAS} & set(raw_tags(random_frame()))


@pytest.mark.parametrize(
    ("blooming", "masked"),
    [
        (None, [(0, 0, 62, 96), (64, 0, 96, 14)]),
        (Blooming("column", 20), [(0, 0, 42, 96), (64, 0, 96, 14)]),
        (Blooming("column", 64), [(64, 0, 96, 14)]),
        (Blooming("four", 9), [(0, 0, 54, 96), (64, 0, 96, 6)]),
        (Blooming("four", 64), []),
    ],
)
def test_readers_take_black_from_photosites_that_no_blooming_reaches(blooming, masked):
    """A lamp near two covered edges fills them from the lit side; black stays the pedestal."""
    picture = np.full((96, 96), 0.02)
    picture[66:70, 20:60] = picture[80:90, 18:22] = 60.0
    edge = OpticalBlack(left_px=16, top_px=64)
    stages = {"full_well": FullWell(1000.0)}
    camera = small_camera(96, 96, "RGGB", optical_black=edge, stages=stages, blooming=blooming, black_level_dn=512.0)
    raw = simulate(Shot(band_scene(picture, math.inf), ThinLens(50.0, 8.0, cos4=False), Exposure(0.02), camera))
    assert (raw.dn[:64] > 512).any() == (blooming is not None)
    assert masked_areas(raw) == masked
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        assert frame.black_level_per_channel == [512] * 4


@pytest.mark.parametrize("cfa", CFAS[:4])
def test_libraw_takes_black_from_the_edge(cfa):
    dn = np.full((96, 128), 3000, np.uint16)
    dn[:16] = np.tile([[600, 610], [620, 630]], (8, 64))
    raw = dataclasses.replace(random_frame(96, 128, cfa, active_area=(16, 0, 96, 128)), dn=dn)
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        picture = frame.postprocess(no_auto_scale=True, output_color=rawpy.ColorSpace.raw, gamma=(1, 1), no_auto_bright=True,
                                    output_bps=16, half_size=True, user_flip=0)  # fmt: skip
    black = dict(zip(((0, 0), (0, 1), (1, 0), (1, 1)), (600, 610, 620, 630), strict=True))
    place = {letter: [divmod(index, 2) for index in range(4) if cfa[index] == letter] for letter in "RGB"}
    expected = [3000 - np.mean([black[where] for where in place[letter]]) for letter in "RGB"]
    np.testing.assert_array_equal(picture, np.broadcast_to(np.array(expected, np.uint16), picture.shape))


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
def test_exiftool_validates_without_a_warning(tmp_path):
    for cfa in CFAS:
        write_dng(random_frame(97, 131, cfa, active_area=(8, 16, 93, 131)), tmp_path / f"{cfa}.dng")
    paths = sorted(map(str, tmp_path.iterdir()))
    done = subprocess.run(["exiftool", "-validate", "-warning", "-error", "-a", "-q", *paths], capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if not line.startswith("========")]
    assert (done.stderr, lines) == ("", ["Validate                        : OK"] * 5)


@pytest.mark.parametrize("area", [(8, 15, 96, 128), (7, 16, 96, 128), (8, 16, 97, 128), (8, 16, 96, 129)])
def test_an_active_area_that_readers_would_move_is_refused(area):
    with pytest.raises(PhotositeError, match="active_area = .*begins at even rows and columns"):
        dng_bytes(random_frame(96, 128, active_area=area))


REFUSED = {
    "camera.optical_black = no light at 64 px left.*covers the whole sensor": dict(optical_black=OpticalBlack(left_px=64)),
    "camera.optical_black = .*does not go together with binning": dict(binning=Binning(2)),
    "camera.window.x = 3: give an even number": dict(window=Window(3, 10, 40, 30)),
    "camera.window.y = 0: the window lies in the optical black": dict(window=Window(16, 0, 30, 8)),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_camera_whose_edge_makes_no_sense_is_refused(message):
    with pytest.raises(PhotositeError, match=message):
        take(**REFUSED[message])


def test_a_camera_file_gives_the_edge_by_its_sides_and_a_dng_gives_it_again(tmp_path):
    text = "scene: {chart: grey_ramp, luminance: 100 cd/m^2}\nlens: {focal_length: 50 mm, f_number: 4}\n"
    text += "exposure: {time: 1/100 s, iso: 100}\ncamera: {base: ideal, optical_black: "
    (tmp_path / "a.yaml").write_text(text + "{left: 16, top: 8}}\n")
    assert load_shot(tmp_path / "a.yaml").camera.optical_black == OpticalBlack(left_px=16, top_px=8)
    raw = simulate(load_shot(tmp_path / "a.yaml", ["camera.width=64", "camera.height=48"]))
    write_dng(raw, tmp_path / "a.dng")
    again = resimulate(tmp_path / "a.dng")
    assert again.active_area == (8, 16, 48, 64) and differing_codes(tmp_path / "a.dng", again) == 0
    again.dn[0, 0] += 1
    assert differing_codes(tmp_path / "a.dng", again) == 1
    (tmp_path / "b.yaml").write_text(text + "{left: 15}}\n")
    with pytest.raises(PhotositeError, match=r"b\.yaml:4.*camera\.optical_black\.left = 15: give an even number"):
        load_shot(tmp_path / "b.yaml")


def test_the_edge_of_a_long_exposure_has_its_dark_current_until_the_wells_are_full():
    """100 e-/s: 100 e- after a second, 6000 e- after a minute; after an hour the wells of 30,000 e- are full everywhere."""
    stages = {"photon_shot_noise": PhotonShotNoise(), "dark_current": DarkCurrent(100.0), "full_well": FullWell(30000.0)}
    camera = small_camera(64, 64, "RGGB", black_level_dn=500.0, optical_black=OpticalBlack(top_px=32), stages=stages)
    scene, checks = band_scene(np.full((4, 4, 3), 1e-9), math.inf), {}
    for time_s in (1.0, 60.0, 3600.0):
        shot = Shot(scene, ThinLens(50.0, 8.0, cos4=False), Exposure(time_s), camera, Seeds(frame=4), truth=("variance",))
        raw = simulate(shot)
        edge, dark_e = raw.dn[:32].astype(float), 100.0 * time_s
        if time_s == 3600.0:
            assert (raw.dn == 30500).all() and raw.white_level_dn == 30500
            np.testing.assert_allclose(raw.truth["variance"], 1 / 12, rtol=1e-6)  # rounding, which the truth takes for noise
            continue
        np.testing.assert_allclose(raw.noise_free_dn[:32], 500.0 + dark_e)
        np.testing.assert_allclose(raw.truth["variance"][:32], dark_e + 1 / 12, rtol=1e-3)
        checks[time_s, "mean"] = mean_p(edge, 500.0 + dark_e, dark_e + 1 / 12)
        checks[time_s, "variance"] = variance_p(edge, dark_e + 1 / 12, 1.0 / dark_e)
        with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:  # from the masked area
            assert abs(frame.black_level_per_channel[0] - 500.0 - dark_e) < 1.0 + 4.0 * math.sqrt(4.0 * dark_e / edge.size)
    accept(checks)
