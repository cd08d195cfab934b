"""Charge above the full well spills into neighbours: conserved, the same on both sides, and of no window, strip or seed."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.neighbors import bloomed
from helpers.scene_builders import band_scene

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.execution import execute, expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.pipeline.stopwatch import Stopwatch
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.readout import spill_charge
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

LENS = ThinLens(50.0, 8.0, cos4=False)
CAPACITY_E = 1000.0
WAYS = ("column", "four")


def shot(picture, blooming, time_s=0.005, stages=None, frame_seed=3, **settings) -> Shot:
    height, width = np.shape(picture)
    full_well = {"full_well": FullWell(CAPACITY_E)} | (stages or {})
    camera = small_camera(width, height, stages=full_well, blooming=blooming, **settings)
    return Shot(band_scene(picture, math.inf), LENS, Exposure(time_s), camera, Seeds(frame=frame_seed))


def spill(device, electrons, blooming) -> np.ndarray:
    """The charge of a sensor of this size after blooming."""
    planned = plan(shot(np.ones(electrons.shape), blooming)).sensor
    charge = device.upload(electrons.astype(np.float32))
    spill_charge(device, planned, charge)
    return device.download(charge, electrons.shape, np.float32)


def spilled(electrons, blooming) -> tuple[np.ndarray, float]:
    """Charge by the definition in float64, and what is drained."""
    return bloomed(electrons, CAPACITY_E, blooming.sides, blooming.reach)


@pytest.mark.parametrize("neighbours", WAYS)
@pytest.mark.parametrize("reach", [1, 5, 40])
def test_wells_fill_as_defined_and_charge_is_conserved(device, neighbours, reach):
    rng, blooming = np.random.default_rng(1), Blooming(neighbours, reach)
    electrons = rng.uniform(0.0, 900.0, (30, 40))
    electrons[rng.random((30, 40)) > 0.95] = 5000.0
    electrons[10:13, 20:24] = 2e4
    found, (expected, drained) = spill(device, electrons, blooming), spilled(electrons, blooming)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-3)
    assert found.max() == CAPACITY_E
    assert found.astype(float).sum() + drained == pytest.approx(electrons.sum(), rel=1e-6)
    assert (drained > 0) == (reach < 40 or neighbours == "four" or drained > 1e-6)


def test_a_column_takes_what_one_photosite_cannot_hold(device):
    """7 wells of charge over darkness fill 7 photosites; nothing leaves the column or is drained."""
    electrons = np.zeros((41, 9))
    electrons[20, 4] = 7 * CAPACITY_E
    found = spill(device, electrons, Blooming("column", 20))
    expected = np.zeros((41, 9))
    expected[17:24, 4] = CAPACITY_E
    assert np.array_equal(found, expected)


@pytest.mark.parametrize("neighbours", WAYS)
def test_it_is_the_same_on_both_sides(device, neighbours):
    electrons = np.random.default_rng(2).uniform(0.0, 1500.0, (24, 24))
    for turned in (lambda one: one[::-1], lambda one: one[:, ::-1]):
        found = [spill(device, one, Blooming(neighbours, 9)) for one in (electrons, turned(electrons))]
        np.testing.assert_allclose(turned(found[0]), found[1], rtol=1e-6)


def test_charge_that_no_well_can_take_is_drained(device):
    found = spill(device, np.full((8, 8), 3000.0), Blooming("four", 30))
    assert (found == CAPACITY_E).all()


def lights(height=64, width=80) -> np.ndarray:
    picture = np.random.default_rng(4).uniform(0.02, 0.1, (height, width))
    picture[20, 30] = picture[50, 10] = 20.0
    picture[40:44, 60:63] = 6.0
    return picture


@pytest.mark.parametrize("neighbours", WAYS)
@pytest.mark.parametrize("settings", [{}, {"crosstalk": Crosstalk(0.02, 0.0, 0.02)}, {"binning": Binning(2)}], ids=str)
def test_a_crop_is_the_part_of_the_whole(neighbours, settings):
    """Also where the light that blooms lies outside of it."""
    blooming, stages = Blooming(neighbours, 12), {"photon_shot_noise": PhotonShotNoise()}
    window = Window(26, 22, 34, 16)
    whole, part = (simulate(shot(lights(), blooming, stages=stages, window=one, **settings)) for one in (None, window))
    step = 2 if "binning" in settings else 1
    rows, columns = (slice(first // step, (first + size) // step) for first, size in ((22, 16), (26, 34)))
    assert np.array_equal(part.dn, whole.dn[rows, columns])
    assert np.array_equal(part.noise_free_dn, whole.noise_free_dn[rows, columns])
    drained = simulate(shot(lights(), None, stages=stages, window=window, **settings))
    assert (part.dn > drained.dn).any() and (part.dn >= drained.dn - 1).all()


def test_strips_have_the_bits_of_the_whole(device):
    picture = np.full((400, 32), 0.05)
    picture[[126, 130, 255], [3, 20, 9]] = 20.0
    taken = shot(picture, Blooming("column", 12), stages={"photon_shot_noise": PhotonShotNoise()})
    planned = plan(taken, strip_px=128 * 32)
    whole, strips = (execute(one, taken, device, lambda what, share: None, Stopwatch()).dn for one in (plan(taken), planned))
    assert len(planned.strips) > 2 and np.array_equal(whole, strips)


def test_where_no_well_is_full_nothing_changes():
    dim = np.minimum(lights(), 0.1)
    stages = {"photon_shot_noise": PhotonShotNoise()}
    plain, blooming = (simulate(shot(dim, one, stages=stages)) for one in (None, Blooming("four", 30)))
    assert np.array_equal(plain.dn, blooming.dn) and np.array_equal(plain.noise_free_dn, blooming.noise_free_dn)


def test_mean_electrons_are_those_of_the_light_and_the_noise_free_code_blooms(device):
    blooming = Blooming("column", 16)
    raw, plain = simulate(shot(lights(), blooming)), simulate(shot(lights(), None))
    assert np.array_equal(raw.mean_electrons, plain.mean_electrons)
    planned = measure(plan(shot(lights(), blooming)), device)
    assert expose(planned, device) is not None
    expected, _ = spilled(plain.mean_electrons.astype(float), blooming)
    np.testing.assert_allclose(raw.noise_free_dn, expected, rtol=1e-5, atol=1e-3)
    assert np.abs(raw.dn - expected).max() < 0.51


def test_the_plan_says_where_charge_goes():
    steps = {one.stage: one for one in plan(shot(lights(), Blooming("four", 30))).steps}
    assert steps["blooming"].kept and "1000 e- moves up, down, left and right, up to 30 photosites" in steps["blooming"].why


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Blooming("two"), "camera.blooming.neighbours = two"),
        (lambda: Blooming("four", 0), "camera.blooming.reach = 0: give 1 to 1024"),
        (lambda: small_camera(blooming=Blooming()), "camera.blooming = given: .* give stages.full_well.capacity"),
        (
            lambda: small_camera(
                blooming=Blooming(),
                stages={"full_well": FullWell(1e3)},
                hdr_readout=HdrReadout((), (1.0, 0.5)),
                iso_table={iso: IsoSetting(iso / 100, 1.0) for iso in (50, 100)},
            ),
            "camera.blooming = with hdr_readout",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(make, message):
    with pytest.raises(PhotositeError, match=message):
        make()


def test_the_variance_of_charge_that_blooms_is_not_told():
    taken = shot(lights(), Blooming())
    with pytest.raises(PhotositeError, match="truth = variance: is not known where charge blooms"):
        plan(Shot(taken.scene, taken.lens, taken.exposure, taken.camera, truth=("variance",)))


def test_the_illustrative_camera_blooms_along_its_columns():
    camera = load_camera("illustrative/blooming")
    assert camera.blooming == Blooming("column", 256) and camera.stages["full_well"] == FullWell(87000.0)
