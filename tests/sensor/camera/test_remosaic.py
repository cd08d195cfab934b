"""A pattern of groups as a camera gives it out: as it is, binned to a Bayer pattern, or remosaiced to one of the same size."""

import dataclasses
import io
import math

import numpy as np
import pytest
import rawpy
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.raw_frame import random_frame
from helpers.scene_builders import band_scene

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.raw.raw_reader import read_raw_file
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.camera.remosaic import Remosaic, remosaic_weights
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.row_noise import RowNoise

QUAD, NONA = "RRGG/RRGG/GGBB/GGBB", "GGGRRR/GGGRRR/GGGRRR/BBBGGG/BBBGGG/BBBGGG"
GROUPS = {QUAD: 2, NONA: 3}
LENS = ThinLens(50.0, 8.0, cos4=False)
NOISE = {"photon_shot_noise": PhotonShotNoise()}
QUIET = {"iso_table": {100: IsoSetting(1.0, 0.0)}}


def shot(cfa, picture, time_s=0.005, truth=(), frame_seed=4, **settings) -> Shot:
    height, width = np.shape(picture)[:2]
    camera = small_camera(width, height, cfa, **({"black_level_dn": 500.0} | settings))
    return Shot(band_scene(picture, math.inf), LENS, Exposure(time_s), camera, Seeds(frame=frame_seed), truth=truth)


def random_picture(height=36, width=48):
    return np.random.default_rng(2).uniform(0.1, 1.0, (height, width, 3))


def groups_of(signal, side) -> np.ndarray:
    """Photosites by group: (rows of groups, columns of groups, side * side)."""
    rows, columns = np.shape(signal)[0] // side, np.shape(signal)[1] // side
    return np.swapaxes(np.reshape(signal, (rows, side, columns, side)), 1, 2).reshape(rows, columns, side * side)


@pytest.mark.parametrize("cfa", GROUPS)
def test_groups_are_summed_or_averaged_to_a_bayer_pattern(cfa):
    picture, side = random_picture(), GROUPS[cfa]
    plain = simulate(shot(cfa, picture))
    charge, average = (simulate(shot(cfa, picture, binning=Binning(side, mode))) for mode in ("charge", "average"))
    assert charge.cfa == average.cfa == Cfa.named(cfa).of_groups().name_at(0, 0)
    sums = groups_of(plain.mean_electrons.astype(float), side).sum(axis=2)
    assert charge.dn.shape == sums.shape and np.abs(charge.mean_electrons / sums - 1).max() < 1e-6
    assert np.abs(charge.dn - 500 - sums).max() < 0.51
    assert np.array_equal(average.dn, np.rint(groups_of(plain.dn.astype(float), side).mean(axis=2)))


def test_read_noise_counts_once_for_the_charge_of_a_group_and_is_averaged_for_codes():
    checks = {}
    for mode in ("charge", "average"):
        settings = {"iso_table": {100: IsoSetting(1.0, 20.0)}, "stages": NOISE}
        taken = shot(QUAD, np.full((400, 400, 3), 0.5), binning=Binning(2, mode), **settings)
        raw = simulate(taken)
        red_dn, red_e = raw.dn[::2, ::2], float(raw.mean_electrons[0, 0])
        mean_e = red_e / (4 if mode == "charge" else 1)
        expected = 4 * mean_e + 400 + 1 / 12 if mode == "charge" else (mean_e + 400 + 1 / 12) / 4 + 1 / 12
        assert plan(taken).sensor.moments(mean_e).variance == pytest.approx(expected)
        checks[mode, "mean"] = mean_p(red_dn, 500 + red_e, expected)
        checks[mode, "variance"] = variance_p(red_dn, expected)
    accept(checks)


@pytest.mark.parametrize("cfa", GROUPS)
def test_remosaic_keeps_photosites_that_have_the_right_colour_and_fits_planes_elsewhere(cfa):
    """Against the least squares of NumPy in float64, photosite by photosite."""
    picture, side = random_picture(), GROUPS[cfa]
    plain, raw = simulate(shot(cfa, picture)), simulate(shot(cfa, picture, remosaic=Remosaic()))
    pattern, bayer = Cfa.named(cfa), Cfa.named(raw.cfa)
    assert bayer == pattern.of_groups() and raw.dn.shape == plain.dn.shape
    height, width = plain.dn.shape
    own = np.array([[pattern.planes[y % (2 * side)][x % (2 * side)] for x in range(width)] for y in range(height)])
    wanted = np.array([[bayer.planes[y % 2][x % 2] for x in range(width)] for y in range(height)])
    assert np.array_equal(raw.dn[own == wanted], plain.dn[own == wanted]) and 0.3 < (own == wanted).mean() < 0.6
    offsets = np.arange(-side, side + 1)
    down, right = np.meshgrid(offsets, offsets, indexing="ij")
    roots = np.exp(-(down**2 + right**2) / side**2)  # of the weights
    for y in range(side, height - side):
        for x in range(side, width - side):
            part = slice(y - side, y + side + 1), slice(x - side, x + side + 1)
            same = own[part] == wanted[y, x]
            terms = np.stack([np.ones(same.sum()), right[same], down[same]], axis=-1) * roots[same][:, np.newaxis]
            fitted = np.linalg.lstsq(terms, plain.noise_free_dn[part][same] * roots[same], rcond=None)[0][0]
            if own[y, x] != wanted[y, x]:
                assert raw.noise_free_dn[y, x] == pytest.approx(np.clip(fitted, 0, 65535), rel=3e-6)
                assert abs(raw.dn[y, x] - fitted) < 2.0  # codes were rounded, and their sum is


@pytest.mark.parametrize("cfa", GROUPS)
def test_remosaic_keeps_slopes(cfa):
    """A plane of light, as a sensor of each colour alone sees it, but for the rim, where photosites are repeated."""
    y, x = np.mgrid[:48, :60]
    picture = (0.2 + 0.008 * x + 0.005 * y)[..., np.newaxis] * [1.0, 0.7, 0.4]
    raw = simulate(shot(cfa, picture, remosaic=Remosaic(), truth=("rgb",)))
    plane = np.array([[Cfa.named(raw.cfa).planes[j % 2][i % 2] for i in range(60)] for j in range(48)])[..., np.newaxis]
    clean = np.take_along_axis(raw.truth["rgb"], plane, axis=2)[..., 0] * (raw.white_level_dn - 500) + 500
    inner = slice(3, -3), slice(3, -3)
    np.testing.assert_allclose(raw.noise_free_dn[inner], clean[inner], rtol=3e-6)


@pytest.mark.parametrize("cfa", GROUPS)
def test_variance_after_remosaic_is_that_of_frames(cfa):
    """Each place of the pattern has its own; the truth tells it."""
    settings = {"iso_table": {100: IsoSetting(1.0, 6.0)}, "stages": NOISE, "remosaic": Remosaic()}
    raw = simulate(shot(cfa, np.full((480, 480, 3), 0.3), truth=("variance",), **settings))
    period, checks = 2 * GROUPS[cfa], {}
    squares = (remosaic_weights(Cfa.named(cfa)).astype(float) ** 2).sum(axis=(2, 3))
    inner = raw.dn[24:456, 24:456].astype(float), raw.truth["variance"][24:456, 24:456]
    for y, x in ((0, 0), (0, 1), (1, 1), (2, 1), (0, period - 1)):
        codes, variance = (one[y::period, x::period] for one in inner)
        assert np.ptp(variance) < 1e-3 * variance[0, 0]
        checks[y, x, "variance"] = variance_p(
            codes[::2, ::2], float(variance[0, 0])
        )  # fits of places a period apart share codes
        checks[y, x, "mean"] = mean_p(codes[::2, ::2], float(raw.noise_free_dn[24 + y, 24 + x]), float(variance[0, 0]))
        single = raw.mean_electrons[24 + y, 24 + x] + 36 + 1 / 12
        again = 0.0 if squares[y, x] == 1.0 else 1 / 12
        assert variance[0, 0] == pytest.approx(squares[y, x] * single + again, rel=1e-4)
    accept(checks)


def test_rows_share_their_noise_after_remosaic():
    """Of 60 frames one photosite each in rows too far apart to share a code."""
    stages = {**NOISE, "row_noise": RowNoise(20.0)}
    settings = {"iso_table": {100: IsoSetting(1.0, 6.0)}, "stages": stages, "remosaic": Remosaic()}
    cfa = next(iter(GROUPS))
    period, checks = 2 * GROUPS[cfa], {}
    taken = shot(cfa, np.full((240, 64, 3), 0.3), truth=("variance",), **settings)
    frames = [simulate(dataclasses.replace(taken, seeds=Seeds(frame=frame))) for frame in range(60)]
    for y, x in ((0, 0), (0, 1), (1, 1), (2, 1)):
        places = slice(24 + y, -24, 2 * period), slice(24 + x, 25 + x)
        codes, variance = np.stack([raw.dn[places] for raw in frames]), frames[0].truth["variance"][places]
        assert np.ptp(variance) < 1e-3 * variance[0, 0]
        checks[y, x] = variance_p(codes, float(variance[0, 0]))
    accept(checks)


@pytest.mark.parametrize("cfa", GROUPS)
@pytest.mark.parametrize("window", [Window(5, 7, 30, 22), Window(0, 3, 41, 33), Window(11, 0, 37, 36)])
def test_a_remosaiced_crop_is_the_part_of_the_whole(cfa, window):
    settings = {"stages": NOISE, "remosaic": Remosaic(), "truth": ("variance", "rgb")}
    whole, part = (simulate(shot(cfa, random_picture(), window=one, **settings)) for one in (None, window))
    rows, columns = slice(window.y, window.y + window.height), slice(window.x, window.x + window.width)
    assert np.array_equal(part.dn, whole.dn[rows, columns])
    assert np.array_equal(part.mean_electrons, whole.mean_electrons[rows, columns])
    assert np.array_equal(part.noise_free_dn, whole.noise_free_dn[rows, columns])
    assert all(np.array_equal(part.truth[name], whole.truth[name][rows, columns]) for name in ("variance", "rgb"))
    assert part.cfa == Cfa.named(whole.cfa).name_at(window.x, window.y)


def test_readers_take_a_binned_or_remosaiced_frame_for_a_bayer_one(tmp_path):
    for settings in ({"binning": Binning(2)}, {"remosaic": Remosaic()}):
        raw = simulate(shot(QUAD, random_picture(80, 96), **settings))
        write_dng(raw, tmp_path / "frame.dng")
        found = read_raw_file(tmp_path / "frame.dng")
        assert found.cfa == "RGGB" and np.array_equal(found.mosaic, raw.dn)
        assert develop(raw, output="metric").shape == (*raw.dn.shape, 3)


def test_what_readers_make_of_groups_that_stay_as_they_are(tmp_path):
    """LibRaw has every code. It takes 4 x 4 for a pattern two wide, and 3 x 3 groups for X-Trans."""
    for cfa in (QUAD, "RRRGGG/RRRGGG/RRRGGG/GGGBBB/GGGBBB/GGGBBB"):
        raw = random_frame(528, 540, cfa)
        write_dng(raw, tmp_path / "frame.dng")
        with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
            assert np.array_equal(frame.raw_image_visible, raw.dn)
            letters = np.array(list(frame.color_desc.decode()))[frame.raw_colors_visible]
        rows = cfa.split("/")
        true = np.array([[rows[y % len(rows)][x % len(rows)] for x in range(540)] for y in range(528)])
        assert np.array_equal(letters, true) == (cfa != QUAD)
    assert read_raw_file(tmp_path / "frame.dng", any_pattern=True).cfa == cfa
    plain = develop(raw, output="metric", demosaic="linear")
    own = np.array(["RGB".index(letter) for letter in true.ravel()]).reshape(528, 540, 1)
    signal = (raw.dn - np.float32(raw.black_level_dn)) / np.float32(raw.white_level_dn - raw.black_level_dn)
    np.testing.assert_allclose(np.take_along_axis(plain, own, axis=2)[..., 0], signal, atol=1e-6)
    with pytest.raises(PhotositeError, match="demosaic = ahd: LibRaw takes this pattern for X-Trans; give linear or vng"):
        develop(raw)
    with pytest.raises(PhotositeError, match="half_size = True: LibRaw does not halve this pattern"):
        develop(raw, half_size=True)


def test_what_libraw_misreads_is_refused(tmp_path):
    raw = random_frame(96, 128, QUAD)
    write_dng(raw, tmp_path / "frame.dng")
    for read in (develop, lambda path: read_raw_file(path, any_pattern=True)):
        with pytest.raises(PhotositeError, match="LibRaw misreads the pattern.*camera.remosaic or camera.binning"):
            read(tmp_path / "frame.dng")
    with pytest.raises(PhotositeError, match="LibRaw misreads the pattern"):
        develop(raw)


@pytest.mark.parametrize(
    ("cfa", "settings", "message"),
    [
        ("RGGB", {"remosaic": Remosaic()}, "camera.remosaic = with cfa RGGB: needs a pattern of groups"),
        ("RGGR/RGGR/GBBG/GBBG", {"remosaic": Remosaic()}, "camera.remosaic = with cfa RGGR.*begin at the sensor's corner"),
        ("RGGR/RGGR/GBBG/GBBG", {"binning": Binning(2)}, "camera.binning = with cfa RGGR"),
        (QUAD, {"binning": Binning(3)}, "camera.binning.factor = 3: give 2, the side of the groups"),
        (QUAD, {"binning": Binning(2), "remosaic": Remosaic()}, "remosaic = with binning"),
        (QUAD, {"optical_black": OpticalBlack(4, 4), "remosaic": Remosaic()}, "remosaic = with optical_black"),
        (QUAD, {"hdr_readout": HdrReadout((), (1.0, 0.5)), "remosaic": Remosaic()}, "remosaic = with hdr_readout"),
        (NONA, {"binning": Binning(3), "window": Window(1, 0, 30, 30)}, "camera.window.x = 1: give a multiple of 3"),
    ],
)
def test_what_does_not_go_together_is_refused(cfa, settings, message):
    table = {iso: IsoSetting(iso / 100, 1.0) for iso in (50, 100)}
    with pytest.raises(PhotositeError, match=message):
        plan(shot(cfa, random_picture(), **({"iso_table": table} | settings)))


@pytest.mark.parametrize(("name", "group"), [("quad_bayer", 2), ("nona_bayer", 3)])
def test_illustrative_cameras_bin_or_remosaic(name, group):
    camera = load_camera(f"illustrative/{name}")
    assert camera.filter.group == group and camera.binning == Binning(group, "charge") and camera.remosaic is None
    full = load_camera(f"illustrative/{name}", ["camera.binning=null", "camera.remosaic={}"])
    assert full.remosaic == Remosaic() and full.frame_cfa() == camera.frame_cfa()
