"""Kernels by distance: surfaces that hide each other, against rays through the lens; what wave optics and geometry share."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.green_frames import EXPOSURE, electrons
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import FixedScene, band_scene
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve

from simulator.device import open_device
from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.defocused_psf import DefocusedPsf
from simulator.optics.psf.field_psf import FAR_AIRY, FieldPsf, airy_radius_px, slab_radii_px
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.pupil.pupil import Aperture, Pupil
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Window

MARGIN, FRAME = 20, Window(0, 0, 96, 64)
SIZE = FRAME.height + 2 * MARGIN, FRAME.width + 2 * MARGIN
CELLS = 5


def textures() -> tuple[np.ndarray, np.ndarray]:
    """Two smooth pictures from 0.2 to 1."""
    found = (gaussian_filter(np.random.default_rng(seed).random(SIZE), 2.0, mode="wrap") for seed in (1, 2))
    return tuple(0.2 + 0.8 * (one - one.min()) / np.ptp(one) for one in found)


def coverage() -> np.ndarray:
    found = np.zeros(SIZE)
    found[SIZE[0] // 4 : 3 * SIZE[0] // 4, SIZE[1] // 3 : 2 * SIZE[1] // 3] = 1.0
    return found


def rays(near_px: float, far_px: float) -> np.ndarray:
    """Radiance of a near rectangle before a far wall, 4,096 points of the lens at every photosite's centre."""
    (near, far), cover = textures(), coverage()
    radius = np.stack([np.full(SIZE, near_px), np.full(SIZE, far_px)])
    surfaces = upload_surfaces(
        open_device(), np.stack([near * cover, far])[:, None], np.stack([cover, np.ones(SIZE)]), radius, MARGIN
    )
    points = ray_samples(4096)
    points[..., :2] = 0.5  # the pictures hold the photosites' means already
    light = sample_lens(open_device(), surfaces, points, FRAME)
    return open_device().download(light, (1, FRAME.height, FRAME.width), np.float32)[0]


def disks(radii) -> np.ndarray:
    """Areas of disks on cells, (radii, 1, 1, size, size)."""
    found = np.zeros((len(radii), 1, 1, 25 * CELLS, 25 * CELLS))
    for kernel, radius in zip(found, radii, strict=True):
        disk = aperture_weights(Pupil(), abs(radius) * CELLS) if abs(radius) > 0.05 else np.ones((1, 1))
        first = (25 * CELLS - len(disk)) // 2
        kernel[0, 0, first : first + len(disk), first : first + len(disk)] = disk / disk.sum()
    return found


def frame_of(planned: Plan) -> np.ndarray:
    found = open_device().download(expose(measure(planned, open_device()), open_device()), SIZE, np.float32)
    return found[MARGIN:-MARGIN, MARGIN:-MARGIN] / planned.optics.weights.sum()


def planned_scene(near_px: float, far_px: float, layers: bool) -> Plan:
    """Rectangle and wall as two layers, or as one picture with depth; photosites and scene pixels are one."""
    (near, far), cover = (one.astype(np.float32) for one in textures()), coverage().astype(np.float32)
    light = 1e-3 * np.ones((1, 31)), np.arange(400.0, 701.0, 10.0), np.ones(31)
    if layers:
        wall = Layer(far[..., None], depth_of(far_px))
        scene = Scene((near * cover)[..., None], *light, depth_of(near_px), coverage=cover, behind=(wall,))
    else:
        depth = np.where(cover > 0, depth_of(near_px), depth_of(far_px)).astype(np.float32)
        scene = Scene(np.where(cover > 0, near, far)[..., None], *light, depth)
    scene = dataclasses.replace(scene, interpolation="nearest")
    return plan(Shot(FixedScene(scene), LENS, EXPOSURE, small_camera(*SIZE[::-1])))


def by_slabs(planned: Plan) -> np.ndarray:
    """The frame with a table of disks in place of the blur."""
    radii = sorted({float(one) for radius in planned.optics.defocus.radii_px for one in np.unique(radius)})
    table = PsfTable(disks(radii), np.array(radii), np.zeros(1), CELLS, 5.0)
    psf = FieldPsf(table, Pupil(), Sampling(), 5.0, 1, tuple(radii), True, SIZE[::-1], (1, 1))
    return frame_of(dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, psf=psf)))


# p99 of abs(z) at 2,000 e- of two layers: one in focus; both out of focus.
TWO_PLANES = {(-8.0, 0.0): 0.05, (-5.1, 6.0): 0.1}


@pytest.mark.parametrize("radii", TWO_PLANES)
def test_two_planes_of_disks_meet_rays_as_the_geometric_blur_does(radii):
    truth, layers = rays(*radii), TWO_PLANES[radii]
    assert statistics(z_scores(by_slabs(planned_scene(*radii, layers=True)), truth, 2000.0)).p99 < layers
    planned = planned_scene(*radii, layers=False)
    found, geometric = (statistics(z_scores(frame, truth, 2000.0)) for frame in (by_slabs(planned), frame_of(planned)))
    assert found.rms < 1.1 * geometric.rms  # what the picture does not show is the error


@pytest.mark.slow
def test_nothing_of_the_wall_comes_onto_a_dark_thing_in_focus():
    """The fault of slabs that are blurred and added: half of the wall's light along the edge."""
    dark = np.arange(160) < 80
    depth = np.where(dark, 2.0, 8.0)[None, :].repeat(96, 0).astype(np.float32)
    planes = np.where(dark, 0.0, 1.0)[None, :].repeat(96, 0)
    through = ThinLens(50.0, 2.0, 2.0, cos4=False, diffraction=True)
    found = electrons(planes, small_camera(160, 96), through, depth)
    assert found[:, :76].max() < 0.01 * found.max()  # what diffraction brings
    assert found[:, 84:].min() > 0.98 * found.max()


def test_slabs_in_between_make_a_smooth_tilt():
    """A wall that tilts, as slabs half a photosite apart: the geometric blur of each photosite's own radius, to 3 %."""
    radius = np.linspace(-6.0, 6.0, SIZE[1])[None, :].repeat(SIZE[0], 0)
    scene = band_scene(textures()[0], depth_of(radius).astype(np.float32), interpolation="nearest")
    planned = plan(Shot(scene, LENS, EXPOSURE, small_camera(*SIZE[::-1])))
    radii = slab_radii_px(-6.0, 6.0)
    table = PsfTable(disks(radii), np.array(radii), np.zeros(1), CELLS, 5.0)
    psf = FieldPsf(table, Pupil(), Sampling(), 5.0, 1, tuple(radii), True, SIZE[::-1], (1, 1))
    found, geometric = (
        frame_of(dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, psf=psf))),
        frame_of(planned),
    )
    assert np.abs(found / geometric - 1.0).max() < 0.03 and np.abs(found / geometric - 1.0).mean() < 0.004


def test_the_reference_has_the_kernel_of_each_radius_of_a_tilt():
    """A wall from the focus to R = 0.4 behind spherical aberration: kernels half a photosite apart left 1.5 % of its light."""
    light, per_dioptre = np.random.default_rng(3).random(SIZE), float(LENS.blur_radius_um(math.inf) - LENS.blur_radius_um(1.0))
    steps_px = np.linspace(0.0, 0.4, SIZE[1] // 4).repeat(4)
    dioptres = 1.0 / LENS.focus_distance_m - steps_px * 5.0 / per_dioptre
    depth = (1.0 / dioptres).astype(np.float32)[None, :].repeat(SIZE[0], 0)
    lens = dataclasses.replace(LENS, aberrations=Aberrations(spherical_um=0.3))
    shot = Shot(band_scene(light, depth), lens, EXPOSURE, green_camera(*SIZE[::-1]), tolerance=0.0)
    planned = plan(shot)
    (radius_px,) = planned.optics.defocus.radii_px
    true, covered = np.zeros(SIZE), np.zeros(SIZE)
    for own_px in np.unique(radius_px):
        kernel, own = planned.optics.psf.of_one_radius(float(own_px)).kernel(0, 0, False, 0, 0)[0], radius_px == own_px
        true += fftconvolve(light * own, kernel, mode="same")
        covered += fftconvolve(np.ones(SIZE) * own, kernel, mode="same")
    true = (true / covered)[MARGIN:-MARGIN, MARGIN:-MARGIN]
    found = frame_of(planned)
    assert np.abs(radius_px).max() == pytest.approx(0.4, rel=0.01)
    assert np.abs(found / found.mean() - true / true.mean()).max() < 4e-3


def test_slabs_reach_from_end_to_end_and_join():
    radii = slab_radii_px(-40.0, 12.3)
    psf = FieldPsf(None, Pupil(), Sampling(), 5.0, 1, tuple(radii), True, (9, 9), (1, 1))
    assert radii[0] == -40.0 and radii[-1] == 12.3 and np.diff(radii).max() <= 2.5 + 1e-9
    assert all(psf.is_continuous(slab) for slab in range(1, len(radii))) and not psf.is_continuous(0)
    apart = dataclasses.replace(psf, radii_px=(-8.0, 0.0, 0.5))
    assert [apart.is_continuous(slab) for slab in range(3)] == [False, False, True]


@pytest.mark.parametrize("radius_px", [-5.0, 5.0])
def test_blades_show_in_the_spot_of_wave_optics_the_right_way_round(radius_px):
    """Against the geometric spot, which turns over where the blur changes sides."""
    blades = dataclasses.replace(LENS, f_number=5.6, aperture=Aperture(3, rotation_deg=20.0))
    per_dioptre = float(blades.blur_radius_um(math.inf) - blades.blur_radius_um(1.0)) / 5.0
    planes, depth = np.zeros((122, 122)), 1.0 / (0.5 - radius_px / per_dioptre)
    planes[60:62, 60:62] = 1000.0  # as large as a photosite
    wave = dataclasses.replace(blades, diffraction=True)
    assert plan(Shot(band_scene(planes, depth), wave, EXPOSURE, green_camera(61, 61))).optics.psf.by_distance
    waves, geometric = (electrons(planes, green_camera(61, 61), one, depth) for one in (wave, blades))
    assert np.corrcoef(waves.ravel(), geometric.ravel())[0, 1] > 0.9
    assert np.corrcoef(waves[::-1, ::-1].ravel(), geometric.ravel())[0, 1] < 0.8
    assert waves.sum() == pytest.approx(geometric.sum(), rel=6e-3)  # some falls beyond the frame


@pytest.mark.parametrize("radius_px", [-12.0, 12.0])
def test_far_blur_has_its_blades_as_wave_optics_has_them(radius_px):
    blades = ThinLens(50.0, 8.0, 2.0, cos4=False, diffraction=True, aperture=Aperture(3, rotation_deg=20.0))
    psf = plan(Shot(band_scene(np.eye(8), 2.0), blades, EXPOSURE, green_camera(8, 8))).optics.psf
    waves = dataclasses.replace(psf, radii_px=(radius_px,)).kernel(0, 0, False, 0, 0)[0]
    far = DefocusedPsf(dataclasses.replace(psf.lens_psf, size_px=41, cells=1), psf.pupil, radius_px).cell_kernel(
        0, 0.0, (0.0, 0.0)
    )
    half = min(len(waves), len(far)) // 2
    inner = [
        one[len(one) // 2 - half : len(one) // 2 + half + 1, len(one) // 2 - half : len(one) // 2 + half + 1]
        for one in (waves, far)
    ]
    assert np.corrcoef(inner[0].ravel(), inner[1].ravel())[0, 1] > 0.9
    assert np.corrcoef(inner[0][::-1, ::-1].ravel(), inner[1].ravel())[0, 1] < 0.8


def test_far_blur_continues_what_wave_optics_gives():
    """Line transfer of both kernels where one takes over: at most 0.05 apart, and not the same, docs/lens_aberrations.md."""
    scene = band_scene(np.eye(8), 2.0)
    through = ThinLens(50.0, 4.0, 2.0, cos4=False, diffraction=True)
    psf = plan(Shot(scene, through, EXPOSURE, green_camera(8, 8))).optics.psf
    kernels = psf.far_kernels(FAR_AIRY * airy_radius_px(psf.lens_psf), 0)
    lines = [np.abs(np.fft.rfft(kernel.sum(axis=0), 256)) for kernel in kernels]
    assert 0.01 < np.max(np.abs(lines[0] - lines[1])) < 0.05
