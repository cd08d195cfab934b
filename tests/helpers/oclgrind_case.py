"""Takes one small frame with every stage present, or takes one of the rarer ways to a mosaic: python oclgrind_case.py CASE."""

import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from helpers.camera_builders import every_stage, small_camera
from helpers.kernel_bench import Bench
from helpers.lens_frame import LENS, depth_of, with_accuracy
from helpers.scene_builders import band_scene
from simulator.device import devices, open_device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import PwmLamp
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.exposure.vector_maps import VectorMap
from simulator.optics.defocus.accuracy import LAMP_PEAK, Accuracy
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, Method
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.scene_part import ALIGNED_PX, ScenePart
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.pupil.pupil import Pupil, PupilStop
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.optics.ray_reference.deep_rays import DeepBlur, DeepPicture
from simulator.optics.ray_reference.height_field_rays import HeightField, sample_height_field
from simulator.optics.ray_reference.layered_rays import LayeredRays, ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.deep_pixels import DeepPixels
from simulator.scene.scene import Layer
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.camera.remosaic import Remosaic


def run(case: str) -> None:
    """Take one small frame with every stage present."""

    rng = np.random.default_rng(0)
    cfa = next((word for word in case.split() if word.isupper()), "RGGB")
    binning = Binning(2, "average" if "averaged" in case else "charge")
    neighbours = {"crosstalk": Crosstalk(0.02, 0.01, 0.01, 0.005), "binning": binning} if "near" in case else {}
    window = Window(32, 16, 50, 21) if neighbours else Window(31, 17, 50, 20)
    if "blooming" in case:
        neighbours = {"blooming": Blooming("four", 6)}
    if "remosaiced" in case:
        neighbours = {"remosaic": Remosaic()}
    camera = small_camera(
        90,
        40,
        cfa,
        iso_table={100: IsoSetting(0.5, 3.0)},
        read_noise_after_gain_dn=1.0,
        stages=every_stage(),
        window=window if "window" in case else None,
        optical_black=OpticalBlack(left_px=4, top_px=2) if "covered" in case else None,
        **neighbours,
    )
    if "readings" in case:
        table = {100: IsoSetting(0.5, 3.0), 400: IsoSetting(2.0, 3.0)}  # two gains, another photodiode, another exposure
        readout = HdrReadout((1.0, 1.0, 1.0, 0.25), (1.0, 0.25, 1.0, 0.25), light=(1.0, 1.0, 0.1, 1.0))
        camera = replace(camera, bit_depth=12, iso_table=table, hdr_readout=readout)
    depth = 2.0 if "sharp" in case else 5.0 if "one" in case else rng.uniform(1.7, 2.5, (20, 30)).astype(np.float32)
    settings = {}
    if "layers" in case:  # both out of focus, the nearer one with a soft edge
        light = rng.random((20, 30, camera.channels)).astype(np.float32)
        settings = {"coverage": np.clip(rng.random((20, 30)) * 2.0 - 0.5, 0.0, 1.0).astype(np.float32)}
        tilted_m = rng.uniform(2.3, 2.4) * np.ones((20, 30), np.float32) + 1e-3 * np.arange(30)
        settings["behind"] = (Layer(light, 2.35 if "pair" in case else tilted_m),)
        depth = 1.8
    scene = band_scene(rng.random((20, 30, camera.channels)), depth, **settings)
    exposure = Exposure(0.001, 400 if "readings" in case else 100)
    if "lines" in case:  # columns that collect different shares of two lamps
        flash = Flash(0.0005, guide_number_m=2.0)
        exposure = replace(exposure, shutter=RollingShutter(0.01, "left_to_right"), flicker=PwmLamp(300.0, 0.5), flash=flash)
        scene = replace(scene.load(), white=1e-3)
    rims = Vignetting(RoundStop(430.0, 10.2)) if "rims" in case else None  # cuts even on so small a sensor
    lens, motion = ThinLens(50.0, 4.0, 2.0, vignetting=rims, veiling_glare=0.02 if "veiled" in case else 0.0), None
    if "moving" in case:  # a pan reads spans of a row, a roll places one by one; layers need what covers them at each instant
        roll = 40000.0 if "rolling" in case else 0.0
        motion = Motion(
            camera=SteadyMotion(pan_deg_per_s=40.0, roll_deg_per_s=roll, right_m_per_s=0.1 if "layers" in case else 0.0)
        )
        lens = replace(lens, f_number=64.0) if "layers" in case else lens
        if "layers" in case:
            far = replace(scene.load().behind[0], depth_m=2.1)
            scene = replace(scene.load(), depth_m=1.9, behind=(far,))
    if "shifting" in case:  # without a turn, each line at its own time; a pixel for each photosite, fewer or more
        size = (30, 66) if "coarse" in case else (60, 135) if "finer" in case else (40, 90)
        near, far, behind = rng.random((*size, camera.channels)), rng.random((*size, camera.channels)), {}
        moves = {0: LayerMotion((Speed(4000.0, "px/s"), Speed(-1500.0, "px/s")))}
        near_m, far_m = (1.8, 2.3) if "layers" in case else (2.0, 2.001)
        if "apart" in case:  # two layers, each with a way of its own
            behind = {"coverage": np.round(rng.random(size)).astype(np.float32)}
            behind["behind"] = (Layer(far.astype(np.float32), far_m),)
            moves[1] = LayerMotion((Speed(-3000.0, "px/s"), Speed(2500.0, "px/s")))
        scene, exposure = band_scene(near, near_m, **behind), replace(exposure, shutter=RollingShutter(0.001))
        motion = Motion(layers=moves, camera=SteadyMotion(pan_deg_per_s=400.0) if "turning" in case else None)
    take_with_truth(Shot(scene, lens, exposure, camera, motion=motion, tolerance=2.0 if motion else 0.1))
    print("done", devices()[0].name)


def take_with_truth(shot: Shot) -> None:
    """Take a shot; its truth is computed when it is read."""
    raw = simulate(shot)
    assert raw.mean_electrons.shape == raw.noise_free_dn.shape


def take_fine() -> None:
    """A scene finer than the photosites, whose pixels no grid of samples divides, sharp and behind small blur circles."""
    rng, camera = np.random.default_rng(0), small_camera(30, 20, "RGGB")
    for depth_m in (2.0, 2.01):
        scene = band_scene(rng.random((54, 81, camera.channels)), depth_m)
        take_with_truth(Shot(scene, ThinLens(50.0, 4.0, 2.0), Exposure(0.001), camera))
    print("done", devices()[0].name)


def take_coarse() -> None:
    """Scenes in focus, coarser than the photosites behind a low-pass filter and diffraction, and finer behind both."""
    rng, camera = np.random.default_rng(0), small_camera(34, 12, "RGGB", low_pass_um=2.5)
    diffracting = ThinLens(50.0, 4.0, 2.0, diffraction=True)
    few = small_camera(10, 8, "MONO", low_pass_um=2.5)
    shots = ((7, 15), ThinLens(50.0, 4.0, 2.0), camera), ((7, 15), diffracting, camera), ((12, 14), diffracting, few)
    for shape, lens, own in shots:
        shot = Shot(band_scene(rng.random((*shape, own.channels)), 2.0), lens, Exposure(0.001), own)
        optics = plan(shot).optics
        assert optics.projection.footprints or (optics.psf is not None and optics.psf.footprints)
        take_with_truth(shot)
    print("done", devices()[0].name)


def sum_bands() -> None:
    """Cubes of more bands than a vector holds, of all of a scene and of a part of it."""
    rng, device = np.random.default_rng(0), open_device()
    for bands in (8, 13):
        layer, weights = Layer(rng.random((3, 2 * ALIGNED_PX, bands), np.float32), 1.0), rng.random((bands, 3), np.float32)
        for part in (None, ScenePart(ALIGNED_PX, 1, ALIGNED_PX, 2)):
            camera_planes(device, layer, weights, False, part)
    print("done", devices()[0].name)


def take_distorted() -> None:
    """A fine scene behind a small blur circle and a lens that distorts: photosites are parallelograms, gathered in parts.

    And a pan of one pixel per photosite, in focus.
    """
    rng, camera = np.random.default_rng(0), small_camera(18, 10, "RGGB")
    scene = band_scene(rng.random((27, 49, camera.channels)), 2.01)
    lens = ThinLens(50.0, 4.0, 2.0, distortion=Distortion(k1=-0.05, unit="half_diagonal"))
    planned = measure(plan(Shot(scene, lens, Exposure(0.001), camera)), open_device())
    assert planned.tiles is not None and not planned.tiles.chosen.sample_grids()
    assert planned.optics.projection.has_leaning(1)
    expose(planned, open_device())
    wide = small_camera(34, 10, "RGGB")
    pan = Motion(camera=SteadyMotion(pan_deg_per_s=20.0))
    moving = plan(Shot(band_scene(rng.random((10, 34, wide.channels)), 2.0), lens, Exposure(0.001), wide, motion=pan))
    assert moving.optics.motion is not None and not moving.optics.sweeps_rows
    expose(moving, open_device())
    print("done", devices()[0].name)


def take_steps() -> None:
    """Steps in depth behind diffraction, a lamp on one side: corrections of the blur that leave out the other surface."""
    light, camera = np.full((10, 18, 1), 0.05), small_camera(18, 10)
    light[4, 7] = 1e3
    depth_m = np.where(np.arange(18) < 9, 1.97, 2.05) * np.ones((10, 1))
    lens = ThinLens(50.0, 5.6, 2.0, diffraction=True)
    planned = measure(plan(Shot(band_scene(light, depth_m), lens, Exposure(0.01), camera, tolerance=1.0)), open_device())
    psf = planned.optics.psf
    assert psf is not None and psf.core is not None and psf.corrected_px and psf.has_ringing(0, 0)
    expose(planned, open_device())
    print("done", devices()[0].name)


def take_wide() -> None:
    """Steps in depth that are seen through wide circles alone, as small as the tolerance calls wide.

    Larger ones would be computed on photosites four times as wide, whose bands hold ten times the samples.
    """
    rng, camera = np.random.default_rng(0), small_camera(18, 10)
    depth_m = np.asarray(depth_of(np.array([[2.5, 5.0, 2.5], [5.0, 2.5, 5.0]])))
    scene = band_scene(rng.random((2, 3, camera.channels)), depth_m)
    planned = measure(plan(Shot(scene, LENS, Exposure(0.001), camera, tolerance=10.0)), open_device())
    assert planned.tiles is not None and planned.tiles.shares()[Method.WIDE] > 0.5
    expose(planned, open_device())
    print("done", devices()[0].name)


def take_joint(peak: float = 1.0) -> None:
    """Two layers that move apart behind a lens whose rims clip the pupil, and a map of distances behind a camera that moves.

    peak: of `Accuracy`; from LAMP_PEAK on rows and places are those beside lamps.
    """
    rng, camera = np.random.default_rng(0), small_camera(30, 20, "RGGB")
    light = rng.random((20, 30, camera.channels)).astype(np.float32)
    behind = {"coverage": rng.random((20, 30)).astype(np.float32), "behind": (Layer(light, 2.3),)}
    lens = ThinLens(50.0, 4.0, 2.0, vignetting=Vignetting(RoundStop(430.0, 10.2)))
    apart = Motion(layers={0: LayerMotion((Speed(5e3, "px/s"), Speed(-3e3, "px/s")))})
    aside = Motion(camera=SteadyMotion(right_m_per_s=2.0, roll_deg_per_s=300.0))
    at_once, by_rows = (
        Exposure(0.001),
        Exposure(0.001, shutter=RollingShutter(2e-4)),
    )  # whose points grow over the rows of a block
    layers, tilted = (1.8, behind, apart), (rng.uniform(1.8, 2.3, (20, 30)), {}, aside)
    turning = 1.8, behind, Motion(layers={0: LayerMotion(spin_deg_per_s=9e4)})
    found = set()
    for (depth_m, rest, motion), exposure in (
        (layers, at_once),
        (tilted, at_once),
        (layers, by_rows),
        (turning, by_rows),
    ):
        scene = band_scene(rng.random((20, 30, camera.channels)), depth_m, **rest)
        planned = plan(Shot(scene, lens, exposure, camera, tolerance=10.0, motion=motion))
        planned = with_accuracy(planned, Accuracy, peak=peak)
        assert planned.optics.joint is not None
        found.add(planned.optics.joint.cells(BLOCK_COLUMNS, BLOCK_ROWS).points)
        expose(planned, open_device())
    assert found == {"even", "rows", "places"}
    print("done", devices()[0].name)


def take_vectors() -> None:
    """Pixels that move by themselves, some of them far out of the picture, in a coarse and in a fine scene."""
    rng, camera = np.random.default_rng(0), small_camera(18, 10, "RGGB")
    for height, width in (8, 15), (20, 34):
        velocity = rng.normal(0.0, 2e3, (height, width, 2)).astype(np.float32)
        velocity[3:6, 5:9] = (2e4, -1e4)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "vectors.npy"
            np.save(file, velocity)
            scene = band_scene(rng.random((height, width, camera.channels)), rng.uniform(1e6, 2e6, (height, width)))
            lens, motion = ThinLens(50.0, 16.0), Motion(vectors=VectorMap(file, "px/s"))
            planned = plan(Shot(scene, lens, Exposure(0.001), camera, tolerance=10.0, motion=motion))
        assert planned.optics.motion is not None and planned.optics.motion.vectors is not None
        expose(planned, open_device())
    print("done", devices()[0].name)


def take_columns() -> None:
    """Every stage of the sensor on columns that a CPU computes at once, as those of larger frames, and some left over."""
    light = np.exp(np.random.default_rng(0).uniform(-3.0, 9.0, (5, 75)))
    Bench(open_device()).sensor(light, *every_stage().values(), x=31, y=17, few_px=0)
    print("done", devices()[0].name)


def take_lamp() -> None:
    """A lamp on a wall beside the edge of a nearer surface, both out of focus: its spot is computed apart."""
    rng, camera = np.random.default_rng(0), small_camera(30, 20, "RGGB")
    light = rng.random((20, 30, camera.channels)).astype(np.float32)
    light[10, 20] = 1e4
    coverage = np.broadcast_to(np.arange(30) < 15, (20, 30)).astype(np.float32)
    near = light * coverage[..., None] * (light < 2.0)
    scene = band_scene(near, 1.97, coverage=coverage, behind=(Layer(light, 2.05),))
    take_with_truth(Shot(scene, ThinLens(50.0, 4.0, 2.0), Exposure(0.001), camera, tolerance=2.0))
    print("done", devices()[0].name)


def take_far_spread() -> None:
    """Diffraction whose kernel has a wide smooth part, alone and behind layers out of focus.

    Layers at one distance each have kernels by distance; where one recedes, their blur is corrected to wave optics.
    """
    rng, camera = np.random.default_rng(0), small_camera(18, 10)
    light, coverage = rng.random((10, 18, 1)).astype(np.float32), rng.random((10, 18)).astype(np.float32)
    receding = np.linspace(2.08, 2.1, 180).reshape(10, 18).astype(np.float32)
    found = []
    for f_number, exposure, tolerance, far_m in (
        (32.0, Exposure(0.1), 0.1, None),
        (5.6, Exposure(0.01), 1.0, 2.1),
        (5.6, Exposure(0.01), 1.0, receding),
    ):
        lens = ThinLens(50.0, f_number, 2.0, diffraction=True)
        rest = {} if far_m is None else {"coverage": coverage, "behind": (Layer(light, far_m),)}
        scene = band_scene(light * coverage[..., None], 2.0, **rest)
        planned = measure(plan(Shot(scene, lens, exposure, camera, tolerance=tolerance)), open_device())
        psf = planned.optics.psf
        assert psf is not None and psf.core is not None and psf.core.has_tail
        found.append((psf.is_gathered_by_distance, bool(psf.corrected_px)))
        expose(planned, open_device())
    assert found == [(False, False), (True, False), (False, True)]
    print("done", devices()[0].name)


def take_spread() -> None:
    """Light that a low-pass filter and diffraction spread: in focus, beside a blur corrected to wave optics, and beside steps.

    All colours of these are blurred in one launch.
    """
    rng, camera = np.random.default_rng(0), small_camera(18, 10, "RGGB", low_pass_um=4.0)
    steps_m = np.where(np.arange(18) < 9, 1.97, 2.05) * np.ones((10, 1))
    for depth_m in (2.0, np.linspace(1.98, 2.03, 180).reshape(10, 18), steps_m):
        scene = band_scene(rng.random((10, 18, camera.channels)), depth_m)
        lens = ThinLens(50.0, 2.8, 2.0, diffraction=True)
        planned = measure(plan(Shot(scene, lens, Exposure(0.001), camera, tolerance=1.0)), open_device())
        assert planned.optics.psf is not None and planned.optics.psf.core is not None
        assert bool(planned.optics.psf.corrected_px) == isinstance(depth_m, np.ndarray)
        assert depth_m is not steps_m or (planned.tiles is not None and planned.tiles.shares()[Method.OCCLUSION] > 0.0)
        expose(planned, open_device())
    print("done", devices()[0].name)


def take_lamps() -> None:
    """Lamps that leave the picture before diffraction spreads it, and the wings of their light."""
    planes, camera = np.full((10, 18, 3), 0.01), small_camera(18, 10, "RGGB")
    planes[[0, 4, 5], [17, 4, 5]] = 1e4
    scene, lens = band_scene(planes, np.inf), ThinLens(50.0, 2.8, diffraction=True)
    planned = measure(plan(Shot(scene, lens, Exposure(0.001), camera, tolerance=1.0)), open_device())
    assert planned.optics.lamps is not None and planned.optics.lamps.count == 3 and planned.optics.wings is not None
    expose(planned, open_device())
    print("done", devices()[0].name)


def take_slabs() -> None:
    """Aberrations in a scene with depth: a wall that recedes behind a layer with partial coverage."""
    rng, camera = np.random.default_rng(0), small_camera(18, 10, "MONO")
    lens = ThinLens(50.0, 2.8, 2.0, aberrations=Aberrations(spherical_um=0.1))
    planes, cover = rng.random((2, 10, 18, camera.channels)).astype(np.float32), rng.random((10, 18)).astype(np.float32)
    cover[:, :6] = 0.0
    behind = Layer(planes[0], np.linspace(2.01, 2.03, 180).reshape(10, 18).astype(np.float32))
    scene = band_scene(planes[1] * cover[..., None], 1.98, coverage=cover, behind=(behind,))
    planned = measure(plan(Shot(scene, lens, Exposure(0.001), camera, tolerance=3.0)), open_device())
    assert planned.optics.psf is not None and planned.optics.psf.is_gathered_by_distance
    expose(planned, open_device())
    print("done", devices()[0].name)


def follow_rays() -> None:
    """Both reference blurs, all colours and a mosaic, with a margin too small for the blur."""

    rng, eyes = np.random.default_rng(0), CatsEyes(Pupil(stops=(PupilStop(1.1, 2.0), PupilStop(1.2, -1.0))), 0.05, 40, 30)
    device, points, frame = open_device(), ray_samples(8, patterns=3), Window(3, 5, 9, 7)
    colour, coverage = rng.random((2, 3, 22, 26)), rng.random((2, 22, 26))
    radius = np.stack([np.broadcast_to(0.05 * np.arange(26) - 2.0, (22, 26)), np.full((22, 26), 8.0)])
    surfaces = upload_surfaces(device, colour, coverage, radius, margin_px=2, oversampling=2)
    rough = np.where(rng.random((22, 26)) > 0.8, -3.0, 4.0)
    for cfa in (None, ((0, 1), (1, 2))):
        for cells in (True, False):
            sample_lens(device, surfaces, points, frame, cfa, cells, eyes if cells else None)
        sample_height_field(device, colour[0], rough, 2, points, frame, 2, cfa, eyes if cfa else None)
    moved = np.concatenate([points, rng.normal(0.0, 3.0, (*points.shape[:2], 32)).astype(np.float32)], axis=-1)
    sample_lens(device, surfaces, moved, frame, eyes=eyes)
    sample_height_field(device, colour[0], rough, 2, moved[..., :20], frame, 2, finer=3)
    lights = np.array([[9, 11, 1, 8.0, 0.0, 0.1], [0, 0, 1, -3.0, 0.0, 0.0]], np.float32)
    settings = device, 2, frame, 2, ((0, 1), (1, 2)), eyes
    for rays in (LayeredRays(surfaces, *settings), HeightField(colour[0], rough.astype(np.float32), *settings)):
        lost = rays.lights_lost(lights, Pupil(6))
        assert lost is not None
        lost(ray_samples(8, patterns=3, pupil=None), np.array([[0, 0], [62, 1]]))
    near = rng.uniform(-3.0, 3.0, 60)
    pixels = DeepPixels(np.arange(0, 61, 3), 5, rng.random((60, 3)), rng.random(60), np.ones(60), np.ones(60) + (near > 1.0))
    blur = DeepBlur(np.sort(near.reshape(20, 3)).ravel(), np.sort(near.reshape(20, 3)).ravel() + (near > 1.0), 8.0)
    picture = DeepPicture(device, pixels, blur, np.eye(3), Projection(0.7, -1.0, -0.5, 5, 4, 1, False))
    picture.sample(points, frame, ((0, 1), (1, 2)), np.arange(63), eyes)
    device.finish()
    print("done", devices()[0].name)


if __name__ == "__main__":
    others = {
        "rays": follow_rays,
        "fine": take_fine,
        "coarse": take_coarse,
        "bands": sum_bands,
        "distorted": take_distorted,
        "steps": take_steps,
        "wide": take_wide,
        "joint": take_joint,
    }
    others |= {"spread": take_spread, "slabs": take_slabs, "vectors": take_vectors, "lamp": take_lamp, "lamps": take_lamps}
    others |= {"far spread": take_far_spread, "columns": take_columns, "joint lamps": partial(take_joint, LAMP_PEAK)}
    others[sys.argv[1]]() if sys.argv[1] in others else run(sys.argv[1])
