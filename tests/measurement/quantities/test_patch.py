"""Mean, noise and SNR of a patch are those of the light and of the camera's numbers, from the truth and from a file alone."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept, mean_p, variance_p
from helpers.raw_frame import random_frame
from helpers.scene_builders import band_scene
from scipy import stats

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.quantities import MeasuredFrame, Patch
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.save import save
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera_sections import IsoSetting
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.banding import Banding
from simulator.sensor.stages.color_bias import ColorBias
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

GAIN, READ_DN, BLACK_DN = 2.0, 6.0, 512.0


def flat_shot(cfa="RGGB", time_s=0.01, **camera) -> Shot:
    """An even field; K = 2 DN/e-, read noise 6 DN, and shot noise."""
    stages = {"photon_shot_noise": PhotonShotNoise()}
    fields = {"iso_table": {100: IsoSetting(GAIN, READ_DN)}, "black_level_dn": BLACK_DN, "stages": stages}
    body = small_camera(128, 96, cfa, **(fields | camera))
    scene = band_scene(np.full((96, 128, body.channels), 1.0), interpolation="nearest")
    return Shot(scene, ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(time_s), body)


def lit(share: float, **camera) -> Shot:
    """The field with a mean of this share of 30,000 electrons."""
    shot = flat_shot(**camera)
    electrons = float(simulate(shot).mean_electrons.max())
    return dataclasses.replace(shot, exposure=Exposure(0.01 * share * 30000.0 / electrons))


def test_the_truth_gives_mean_electrons_noise_and_snr():
    """Variance = K^2 n + sigma_read^2 + 1/12 (EMVA 1288 R4.0, eq. 9); SNR = K n / sigma."""
    shot = lit(0.1, cfa="MONO")
    raw = simulate(shot)
    found = Patch((8, 16, 64, 80)).measure(MeasuredFrame.from_raw(raw, shot)).figures
    electrons = float(raw.mean_electrons[20, 20])
    sigma_dn = math.sqrt(GAIN**2 * electrons + READ_DN**2 + 1 / 12)
    assert electrons == pytest.approx(3000.0, rel=1e-4)
    assert found["mean_e"].value == pytest.approx(electrons, rel=1e-5) and found["mean_e"].unit == "e-"
    assert found["noise_dn"].value == pytest.approx(sigma_dn, rel=1e-4)
    assert found["noise_e"].value == pytest.approx(sigma_dn / GAIN, rel=1e-4)
    accept({"mean": mean_p(raw.dn[8:72, 16:96] - BLACK_DN, GAIN * electrons, sigma_dn**2)})
    assert found["mean_dn"].value == (raw.dn[8:72, 16:96] - BLACK_DN).mean()
    assert found["mean_dn"].sigma == pytest.approx(sigma_dn / math.sqrt(64 * 80), rel=1e-4)
    assert found["snr"].value == pytest.approx(found["mean_dn"].value / sigma_dn, rel=1e-4)


ROWS = {
    "row_noise": {"iso_table": {100: IsoSetting(GAIN, READ_DN, row_noise_dn=20.0)}},
    "banding": {"stages": {"photon_shot_noise": PhotonShotNoise(), "banding": Banding(20.0, 37.0)}},
    "averaged": {"iso_table": {100: IsoSetting(GAIN, READ_DN, row_noise_dn=8.0)}, "binning": Binning(2, "average")},
}


@pytest.mark.parametrize(
    "kind, cfa, area",
    [("row_noise", "RGGB", (3, 4, 31, 33)), ("banding", "MONO", (8, 16, 31, 32)), ("averaged", "MONO", (4, 8, 15, 16))],
)
def test_means_scatter_by_their_standard_error_where_rows_share_noise(kind, cfa, area):
    """Chi-square of 50 frames: (mean - its mean)^2 / sigma^2. A sine of random phase scatters less than normal numbers."""
    shot = lit(0.01, cfa=cfa, **ROWS[kind])
    means = []
    for seed in range(50):
        one = dataclasses.replace(shot, seeds=Seeds(frame=seed))
        found = Patch(area).measure(MeasuredFrame.from_raw(simulate(one), one)).figures
        means.append(found["mean_dn"].value)
    sigma_dn = found["mean_dn"].sigma
    accept({"mean": variance_p(means, sigma_dn**2)})
    assert found["snr"].sigma == pytest.approx(sigma_dn / found["noise_dn"].value, rel=1e-12)


def test_rows_count_once_in_the_standard_error():
    """sigma^2 = (v - v_row) / N + v_row / rows, of both greens in as many rows as the area has."""
    shot = lit(0.1, iso_table={100: IsoSetting(GAIN, READ_DN, row_noise_dn=4.0)})
    found = Patch((8, 16, 20, 32)).measure(MeasuredFrame.from_raw(simulate(shot), shot)).figures
    alone_dn2 = found["noise_dn"].value ** 2 - 16.0
    assert found["mean_dn"].sigma == pytest.approx(math.sqrt(alone_dn2 / 320 + 16.0 / 20), rel=1e-9)


def test_dark_current_is_noise_and_no_signal():
    """6,000 dark electrons: SNR = K n / sigma of n photoelectrons, by EMVA 1288's mu_y - mu_y.dark."""
    shot = flat_shot(
        cfa="MONO", time_s=30.0, stages={"photon_shot_noise": PhotonShotNoise(), "dark_current": DarkCurrent(200.0)}
    )
    dim = dataclasses.replace(shot, scene=band_scene(np.full((96, 128, 1), 1e-9), interpolation="nearest"))
    raw = simulate(dim)
    electrons = float(raw.mean_electrons[20, 20])
    found = Patch().measure(MeasuredFrame.from_raw(raw, dim)).figures
    sigma_dn = math.sqrt(GAIN**2 * (electrons + 6000.0) + READ_DN**2 + 1 / 12)
    assert found["noise_dn"].value == pytest.approx(sigma_dn, rel=1e-4)
    z = (found["snr"].value * sigma_dn - GAIN * electrons) / found["mean_dn"].sigma
    accept({"signal": 2 * stats.norm.sf(abs(z))})


def test_electrons_of_binned_charge_are_those_of_its_photosites():
    shot = flat_shot(cfa="MONO", binning=Binning(2, "charge"))
    raw = simulate(shot)
    found = Patch().measure(MeasuredFrame.from_raw(raw, shot)).figures
    electrons = float(raw.mean_electrons[20, 20])
    assert found["mean_e"].value == pytest.approx(electrons, rel=1e-5)
    assert found["noise_e"].value == pytest.approx(math.sqrt(electrons + (READ_DN**2 + 1 / 12) / GAIN**2), rel=1e-4)


def test_a_file_alone_gives_the_same_numbers_without_electrons(tmp_path):
    """z-test of the single frame's noise against that of the truth, by its own standard error."""
    shot = lit(0.1, cfa="GBRG")
    raw = simulate(shot)
    save(raw, tmp_path)
    of_truth = Patch(plane="R").measure(MeasuredFrame.from_raw(raw, shot)).figures
    found = Patch(plane="R").measure(MeasuredFrame.from_file(next(tmp_path.glob("*.dng")))).figures
    assert set(found) == {"mean_dn", "noise_dn", "snr"}
    assert found["mean_dn"].value == pytest.approx(of_truth["mean_dn"].value, rel=1e-12)
    noise = found["noise_dn"]
    assert noise.sigma is not None and 0 < noise.sigma < 0.05 * noise.value
    accept({"noise": 2 * stats.norm.sf(abs(noise.value - of_truth["noise_dn"].value) / noise.sigma)})


def test_each_colour_has_its_own_black_level(tmp_path):
    offsets = (0.0, 30.0, -20.0, 50.0)
    shot = flat_shot(time_s=1e-12, stages={"color_bias": ColorBias(offsets)}, iso_table={100: IsoSetting(GAIN, 1.0)})
    raw = simulate(shot)
    for plane in ("R", "Gr", "Gb", "B"):
        found = Patch(plane=plane).measure(MeasuredFrame.from_raw(raw, shot)).figures["mean_dn"]
        accept({plane: 2 * stats.norm.sf(abs(found.value) / found.sigma)})


@pytest.mark.parametrize(
    ("plane", "places"), [("R", [(0, 1)]), ("Gr", [(0, 0)]), ("G", [(0, 0), (1, 1)]), (None, [(0, 0), (1, 1)])]
)
def test_an_area_at_odd_places_holds_the_photosites_of_its_colour(plane, places, tmp_path):
    raw = random_frame(cfa="GRBG")
    frame = MeasuredFrame(raw.dn, raw.cfa, np.zeros((2, 2)), raw.white_level_dn)
    y, x = np.mgrid[:96, :128]
    chosen = np.zeros(raw.dn.shape, bool)
    for row, column in places:
        chosen |= (y % 2 == row) & (x % 2 == column)
    chosen &= (y >= 5) & (y < 16) & (x >= 3) & (x < 20)
    found = Patch((5, 3, 11, 17), plane).measure(frame).figures["mean_dn"].value
    assert found == pytest.approx(raw.dn[chosen].mean(), rel=1e-12)


def test_noise_and_snr_of_a_clipped_patch_are_not_told():
    shot = lit(2.0, cfa="MONO")
    found = Patch().measure(MeasuredFrame.from_raw(simulate(shot), shot)).figures
    assert math.isnan(found["noise_dn"].value) and math.isnan(found["snr"].value)
    assert found["mean_dn"].value == pytest.approx(65535 - BLACK_DN, rel=1e-3)


def test_a_map_of_the_variance_in_the_truth_is_taken_and_demanded_of_several_exposures():
    shot = lit(0.1, cfa="MONO")
    with_map = dataclasses.replace(shot, truth=("variance",))
    maps, computed = (Patch().measure(MeasuredFrame.from_raw(simulate(one), one)) for one in (with_map, shot))
    assert maps.figures["noise_dn"] == computed.figures["noise_dn"]
    hdr = lit(0.1, cfa="MONO", bit_depth=12, hdr_readout=HdrReadout(exposures=(1.0, 1 / 16)))
    with pytest.raises(PhotositeError, match="truth = .*: the noise of a frame of several exposures .* add variance"):
        Patch().measure(MeasuredFrame.from_raw(simulate(hdr), hdr))


def test_a_map_of_the_variance_is_demanded_where_electrical_crosstalk_mixes_charges():
    """A colour's noise depends on the light of the others, which the mean electrons after crosstalk do not tell."""
    shot = lit(0.1, crosstalk=Crosstalk(electrical=0.02))
    with_map = dataclasses.replace(shot, truth=("variance",))
    assert Patch().measure(MeasuredFrame.from_raw(simulate(with_map), with_map)).figures["noise_dn"].value > 0.0
    with pytest.raises(PhotositeError, match="truth = .*: the noise of mixed charges needs .* add variance to truth"):
        Patch().measure(MeasuredFrame.from_raw(simulate(shot), shot))


def test_an_area_outside_and_a_colour_that_is_not_there_are_told():
    frame = MeasuredFrame(np.zeros((48, 64), np.uint16), "MONO", np.zeros((2, 2)), 4095, name="a.dng")
    with pytest.raises(
        PhotositeError, match=r"a\.dng: area = \[0, 0, 49, 1\]: \[top, left, height, width\] must lie inside .* 48 x 64"
    ):
        Patch((0, 0, 49, 1)).measure(frame)
    with pytest.raises(PhotositeError, match=r"plane = R: the frame has MONO"):
        Patch(plane="R").measure(frame)
    bayer = dataclasses.replace(frame, cfa="RGGB")
    with pytest.raises(PhotositeError, match=r"area = \[0, 0, 1, 1\]: holds no photosite of this colour"):
        Patch((0, 0, 1, 1), "B").measure(bayer)


def test_a_pattern_that_is_no_bayer_pattern_is_refused():
    frame = MeasuredFrame(np.zeros((48, 64), np.uint16), "GGRGGB" * 6, np.zeros((2, 2)), 4095, name="x.dng")
    with pytest.raises(PhotositeError, match=r"x\.dng: cfa = GGRGGB.*: only 2 x 2 Bayer patterns"):
        Patch().measure(frame)
