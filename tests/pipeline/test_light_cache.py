"""Light that several shots share: the bits are those of each shot alone, and what changes the light changes its key."""

import copy
import os
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.linked_files import put_kernel, put_shot
from helpers.scene_builders import band_scene

from simulator.config import load_shot
from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import CurtainShutter, LeafShutter, RollingShutter
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.optics_planning import SENSOR_ONLY
from simulator.pipeline.execution import expose
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate, simulate_many
from simulator.raw.raw_image import Raw
from simulator.scene.charts import ChartScene
from simulator.scene.content_keys import freeze
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.scene.scene import Scene
from simulator.scene.spectral_cube import SpectralCubeScene
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import IsoSetting, SpectralResponse, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

STAGES = {"photon_shot_noise": PhotonShotNoise(), "full_well": FullWell(30000.0)}
ISOS = {100: IsoSetting(0.5, 2.0), 400: IsoSetting(2.0, 5.0), 1600: IsoSetting(8.0, 19.0)}
CAMERA = small_camera(40, 30, "RGGB", iso_table=ISOS, stages=STAGES)
GAINS = {iso: replace(one, gain_dn_per_e=1.01 * one.gain_dn_per_e) for iso, one in ISOS.items()}
LESS = SpectralResponse(CAMERA.response.wavelengths_nm, 0.9 * CAMERA.response.quantum_efficiency)
SHARP = ThinLens(50.0, 8.0, 2.0)
PICTURE = np.random.default_rng(1).uniform(0.1, 1.0, (24, 32, 3)).astype(np.float32)


@pytest.fixture
def picture(tmp_path) -> ImageScene:
    np.save(tmp_path / "a.npy", PICTURE)
    return ImageScene(tmp_path / "a.npy", 300.0, encoding="linear", depth_m=2.0)


def shot_of(scene: ImageScene, is_sharp: bool) -> Shot:
    """A shot of a picture in focus, or out of focus by some photosites."""
    return Shot(scene if is_sharp else replace(scene, depth_m=2.1), SHARP, Exposure(0.02), CAMERA)


def at_iso(shot: Shot, iso: int) -> Shot:
    return replace(shot, exposure=replace(shot.exposure, iso=iso))


def arrays(raw: Raw) -> list[np.ndarray]:
    return [raw.dn, raw.mean_electrons, raw.noise_free_dn, *raw.truth.values()]


def are_same(one: Raw, other: Raw) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(arrays(one), arrays(other), strict=True))


def test_another_kernel_in_a_list_gives_another_light(tmp_path):
    shot, cache = load_shot(put_shot(tmp_path)), LightCache()
    first = simulate(shot, cache=cache)
    assert are_same(simulate(shot, cache=cache), first) and cache.reused
    put_kernel(tmp_path, "green", 5)
    second = simulate(shot, cache=cache)
    assert second.mean_electrons.std() < 0.9 * first.mean_electrons.std()
    assert are_same(simulate(shot, cache=LightCache()), second)


def key_and_light(shot: Shot) -> tuple[object, np.ndarray]:
    """Key of the mosaic of a shot, and its bits, computed without what another shot left."""
    device, planned = open_device(), plan(shot, cache=LightCache())
    assert planned.key is not None
    frame = planned.optics.window
    mosaic = device.download(expose(measure(planned, device), device), (frame.height, frame.width), np.float32)
    return planned.key.of_mosaic(planned.optics, planned.sensor), mosaic


def with_camera(**settings) -> Callable[[Shot], Shot]:
    return lambda shot: replace(shot, camera=replace(shot.camera, **settings))


def with_lens(**settings) -> Callable[[Shot], Shot]:
    return lambda shot: replace(shot, lens=replace(shot.lens, **settings))


def with_scene(**settings) -> Callable[[Shot], Shot]:
    return lambda shot: replace(shot, scene=replace(shot.scene, **settings))


def with_exposure(**settings) -> Callable[[Shot], Shot]:
    return lambda shot: replace(shot, exposure=replace(shot.exposure, **settings))


SENSOR_CHANGES = {  # of all fields that are no part of the key
    "make": with_camera(make="other"),
    "model": with_camera(model="other"),
    "bit_depth": with_camera(bit_depth=15),
    "black_level_dn": with_camera(black_level_dn=64.0),
    "white_level_dn": with_camera(white_level_dn=65000.0),
    "iso_table": with_camera(
        iso_table={iso: replace(one, gain_dn_per_e=1.01 * one.gain_dn_per_e) for iso, one in ISOS.items()}
    ),
    "iso_range": with_camera(iso_range="extrapolate"),
    "read_noise_model": lambda shot: shot,  # stands for a table: in test_sensor_plan
    "read_noise_after_gain_dn": with_camera(read_noise_after_gain_dn=1.0),
    "read_noise_spread": with_camera(read_noise_spread=0.2),
    "conversion_gain": lambda shot: shot,  # needs another table
    "color_matrix": lambda shot: shot,  # of the file alone
    "readout_time_s": with_camera(readout_time_s=0.02),
    "stages": with_camera(stages={**STAGES, "dsnu": Dsnu(3.0)}),
}
OTHER_CHANGES = {
    "iso": lambda shot: at_iso(shot, 1600),
    "seeds": lambda shot: replace(shot, seeds=Seeds(7, 8)),
    "time": lambda shot: replace(shot, exposure=Exposure(0.01)),
    "start": with_exposure(start_s=0.003),
    "rolling": with_exposure(shutter=RollingShutter(0.01)),
    "leaf": with_exposure(shutter=LeafShutter(0.001, 0.001)),
    "flicker": with_exposure(flicker=MainsFlicker(70.0, 0.4)),
    "later flicker": with_exposure(flicker=MainsFlicker(70.0, 0.4), start_s=0.003),
    "rolling flicker": with_exposure(shutter=RollingShutter(0.01), flicker=MainsFlicker(70.0, 0.4)),
    "flash": with_exposure(flash=Flash(0.001, guide_number_m=1.0)),
    "flash under curtains": with_exposure(flash=Flash(0.001, guide_number_m=1.0), shutter=CurtainShutter(0.03)),
    "f-number": with_lens(f_number=5.6),
    "focal length": with_lens(focal_length_mm=51.0),
    "transmittance": with_lens(transmittance=0.5),
    "glare": with_lens(veiling_glare=0.05),
    "glare and f-number": with_lens(veiling_glare=0.05, f_number=5.6),
    "distortion": with_lens(distortion=Distortion(k1=-0.1)),
    "diffraction": with_lens(diffraction=True),
    "fill factor": with_camera(fill_factor=0.7),
    "low-pass filter": with_camera(low_pass_um=3.0),
    "pitch": with_camera(pixel_pitch_um=6.0),
    "colours": with_camera(cfa="GRBG"),
    "response": with_camera(
        response=SpectralResponse(CAMERA.response.wavelengths_nm, 0.9 * CAMERA.response.quantum_efficiency)
    ),
    "window": with_camera(window=Window(4, 2, 20, 16)),
    "other window": with_camera(window=Window(6, 2, 20, 16)),
    "size": with_camera(width_px=42),
    "crosstalk": with_camera(crosstalk=Crosstalk(optical=0.05)),
    "optical black": with_camera(optical_black=OpticalBlack(left_px=4)),
    "binning": with_camera(binning=Binning(2, "average")),
    "no lens": lambda shot: replace(shot, lens=BareSensor()),
    "luminance": with_scene(luminance_cd_m2=301.0),
    "illuminant": with_scene(illuminant="A"),
    "tolerance": lambda shot: replace(shot, tolerance=1.0),
}


@pytest.mark.parametrize("is_sharp", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_shots_with_equal_keys_have_the_same_light(picture, is_sharp):
    assert set(SENSOR_CHANGES) == SENSOR_ONLY
    base = shot_of(picture, is_sharp)
    found = {name: key_and_light(change(base)) for name, change in {**SENSOR_CHANGES, **OTHER_CHANGES}.items()}
    own_key, own = key_and_light(base)
    same = {name for name, (key, _) in found.items() if key == own_key}
    kept = {*SENSOR_CHANGES, "iso", "seeds", "start", "rolling"}
    if is_sharp:
        kept |= {"time", "f-number", "transmittance", "tolerance"}
        kept |= {"binning", "focal length", "pitch"}  # the picture fills the sensor
    assert same == kept
    for key, light in found.values():
        for other_key, other in found.values():
            assert key != other_key or np.array_equal(light, other)
    assert all(np.array_equal(found[name][1], own) for name in same)


def dummies(folder: Path) -> list[object]:
    """Sources of scenes and lenses of every kind, of files that are there."""
    path = folder / "a.npy"
    return [
        ImageScene(path, 100.0),
        SpectralCubeScene(path),
        ChartScene("flat_field", 100.0),
        LayeredScene((PictureLayer(path, 1.0), PictureLayer(path, 2.0)), 100.0),
        ThinLens(50.0, 2.0),
        Pinhole(0.2, 50.0),
        BareSensor(),
        Distortion(),
        Exposure(1.0),
    ]


def with_field(value: object, name: str) -> object:
    """A copy of a frozen dataclass in which a field has another value, which nothing checks."""
    other = copy.copy(value)
    object.__setattr__(other, name, "another value")
    return other


def test_every_field_of_scene_lens_and_camera_is_in_the_key_but_the_sensors(picture):
    for value in dummies(picture.image.parent):
        assert freeze(value) == freeze(copy.copy(value))
        for field in fields(value):
            assert freeze(with_field(value, field.name)) != freeze(value), (type(value).__name__, field.name)
    for field in fields(Camera):
        same = freeze(with_field(CAMERA, field.name), SENSOR_ONLY) == freeze(CAMERA, SENSOR_ONLY)
        assert same == (field.name in SENSOR_ONLY), field.name


@pytest.mark.parametrize("is_sharp", [True, False])
def test_isos_and_seeds_share_one_light_and_have_the_bits_of_each_shot_alone(picture, is_sharp):
    base = replace(shot_of(picture, is_sharp), truth=("variance", "rgb"))
    shots = [at_iso(replace(base, seeds=Seeds(frame=frame)), iso) for frame in (1, 2) for iso in (100, 200, 1600)]
    alone = [simulate(shot) for shot in shots]
    assert len({raw.dn.tobytes() for raw in alone}) == len(shots)
    for order in (range(6), (5, 3, 0, 4, 1, 2)):
        many = simulate_many([shots[index] for index in order])
        assert all(are_same(raw, alone[index]) for raw, index in zip(many, order, strict=True))


def test_frames_of_one_light_do_not_share_memory(picture):
    shots = [at_iso(shot_of(picture, True), iso) for iso in (100, 400)]
    first, second = simulate_many([*shots])
    electrons = second.mean_electrons.copy()
    for array in arrays(first):
        array.fill(0)
    assert np.array_equal(second.mean_electrons, electrons) and second.dn.any() and second.noise_free_dn.any()


def test_light_is_computed_once_for_isos_and_for_shutter_times_and_apertures_of_a_sharp_scene(picture):
    """Plan and mosaic are held: another ISO finds both, another shutter time of a sharp scene the mosaic."""
    sharp, blurred = (shot_of(picture, is_sharp) for is_sharp in (True, False))
    for base, changed, reused in (
        (sharp, at_iso(sharp, 400), 2),
        (blurred, at_iso(blurred, 400), 2),
        (sharp, replace(sharp, exposure=Exposure(0.005)), 1),
        (sharp, replace(sharp, lens=replace(SHARP, f_number=11.0)), 1),
        (blurred, replace(blurred, exposure=Exposure(0.005)), 0),
    ):
        cache = LightCache()
        simulate(base, cache=cache)
        assert cache.reused == 0
        raw = simulate(changed, cache=cache)
        assert cache.reused == reused
        assert are_same(raw, simulate(changed))


def test_a_file_that_changed_is_read_again(picture):
    shot, cache = shot_of(picture, True), LightCache()
    before = simulate(shot, cache=cache)
    np.save(picture.image, 0.5 * PICTURE)
    os.utime(picture.image, ns=(1, 1))
    after = simulate(shot, cache=cache)
    assert np.allclose(after.mean_electrons, 0.5 * before.mean_electrons)
    picture.image.unlink()
    with pytest.raises(PhotositeError, match=r"a\.npy"):
        simulate(shot, cache=cache)


def test_a_scene_of_arrays_is_itself_and_a_source_of_the_users_own_is_always_asked():
    class Flicker:
        """A source that gives another scene each time."""

        brightness = 0.0

        def load(self) -> Scene:
            self.brightness += 1.0
            return band_scene(np.full((4, 4), self.brightness)).load()

    cache, scene = LightCache(), band_scene(np.ones((4, 4))).load()
    shot = Shot(scene, SHARP, Exposure(0.01), small_camera())
    first, other = simulate(shot, cache=cache), replace(scene, planes=2.0 * scene.planes)
    assert np.allclose(simulate(replace(shot, scene=other), cache=cache).mean_electrons, 2.0 * first.mean_electrons)
    simulate(shot, cache=cache)
    assert cache.reused == 2  # its plan and its mosaic
    live = replace(shot, scene=Flicker())
    for times in (1.0, 2.0, 3.0):
        assert np.allclose(simulate(live, cache=cache).mean_electrons, times * first.mean_electrons)


def test_a_cache_holds_no_more_than_its_memory_and_forgets_the_oldest(picture):
    shots = [replace(shot_of(picture, False), exposure=Exposure(time_s)) for time_s in (0.01, 0.02, 0.03, 0.04)]
    roomy = LightCache()
    simulate(shots[0], cache=roomy)
    one = roomy.held_bytes
    assert one >= PICTURE.nbytes + 4 * CAMERA.width_px * CAMERA.height_px
    small = LightCache(one)
    for shot in shots:
        assert are_same(simulate(shot, cache=small), simulate(shot))
        assert 0 < small.held_bytes <= one
    before = small.reused
    simulate(at_iso(shots[3], 1600), cache=small)
    assert small.reused == before + 2
    simulate(shots[0], cache=small)
    assert small.reused == before + 2  # forgotten
    small.clear()
    assert small.held_bytes == 0
    none = LightCache(0)
    assert are_same(simulate(shots[0], cache=none), simulate(shots[0])) and none.held_bytes == none.reused == 0


def test_the_environment_sets_the_memory(monkeypatch):
    assert LightCache().memory_bytes == 2**30
    monkeypatch.setenv("PHOTOSITE_LIGHT_MB", "3")
    assert LightCache().memory_bytes == 3 * 2**20 and LightCache(5).memory_bytes == 5
    monkeypatch.setenv("PHOTOSITE_LIGHT_MB", "much")
    with pytest.raises(PhotositeError, match="PHOTOSITE_LIGHT_MB = much"):
        LightCache()
    with pytest.raises(PhotositeError, match="memory_bytes = -1"):
        LightCache(-1)


def test_a_process_has_one_cache_of_its_own_for_each_that_it_is_sent(picture):
    cache = LightCache(2**20)
    simulate(shot_of(picture, True), cache=cache)
    first, second = (pickle.loads(pickle.dumps(cache)) for _ in range(2))
    assert first is second and first is not cache
    assert first.held_bytes == 0 and first.memory_bytes == 2**20


def test_threads_share_a_cache(picture):
    shots = [
        at_iso(replace(shot_of(picture, False), seeds=Seeds(frame=frame)), iso) for frame in range(6) for iso in (100, 800)
    ]
    cache = LightCache()
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda shot: simulate(shot, cache=cache), shots))
    assert all(are_same(raw, simulate(shot)) for raw, shot in zip(found, shots, strict=True))
    assert cache.held_bytes > 0


def test_a_frame_in_strips_has_its_bits_with_a_cache(picture):
    """Its plan is held; its light is computed anew, strip by strip, so that memory stays that of one strip."""
    tall, cache = replace(CAMERA, height_px=600), LightCache()
    shot, strip_px = replace(shot_of(picture, False), camera=tall, truth=("variance",)), 40 * 200
    assert len(plan(shot, strip_px).strips) > 1
    for reused in (0, 1, 2):
        assert are_same(simulate(shot, strip_px=strip_px, cache=cache), simulate(shot))
        assert cache.reused == reused
