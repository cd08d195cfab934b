"""Rims shape the spots: each photosite's own pupil, against areas, traced outlines and rays; without rims nothing changes."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_error import statistics, z_scores
from helpers.scene_builders import FixedScene, band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_kernel import clipped_weights, disk_weights
from simulator.optics.defocus.clipped_kernel import shape_weights
from simulator.optics.defocus.field_pupil import MOST_MOVED, middle_error, plan_cats_eyes, zone_error
from simulator.optics.defocus.photosite_area import WHOLE, PhotositeArea
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.device_tables import DeviceTables
from simulator.optics.pupil.convex_area import Disk, intersection_area
from simulator.optics.pupil.pupil import Aperture, Pupil, PupilStop
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.optics.ray_reference.height_field_rays import sample_height_field
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

RIMS = Vignetting(RoundStop(30.0, 44.0), RoundStop(20.0, 26.0))
CLOSE = ThinLens(50.0, 1.4, 0.4, vignetting=RIMS, cos4=False)  # its blur circles are large
LENS = ThinLens(50.0, 1.4, 2.0, vignetting=RIMS, cos4=False)
STOPS = (PupilStop(1.2, 2.0), PupilStop(1.3, -1.5))
COLUMNS, ROWS = 400, 280  # of a coarse sensor of 36 mm x 25 mm


def coarse_camera(**settings):
    return small_camera(COLUMNS, ROWS, pixel_pitch_um=90.0, **settings)


def fine_camera(**settings):
    return small_camera(1200, 800, pixel_pitch_um=30.0, **settings)


def depth_of(lens, radius_px: float, pitch_um: float) -> float:
    """Distance at which a lens blurs by this signed radius [m]."""
    per_dioptre = float(lens.blur_radius_um(math.inf)) * lens.focus_distance_m / pitch_um
    return 1.0 / (1.0 / lens.focus_distance_m - radius_px / per_dioptre)


@pytest.mark.parametrize("area", [PhotositeArea(), PhotositeArea(True, 1)])
def test_weights_of_an_image_do_not_depend_on_those_beside_it(area):
    """A window has fewer images than its frame; radii on both sides of each number of slices, and below a photosite."""
    random, pupil = np.random.default_rng(3), Pupil(5, stops=STOPS)
    radii = np.array([0.0, 0.01, -0.3, 1.0, -2.4, 2.6, 7.9, 8.1, -9.0, 33.0])
    fields = random.uniform(-0.2, 0.2, (len(radii), 2))
    together = clipped_weights(pupil, fields, radii, 1, area)
    for number, found in enumerate(together):
        (alone,) = clipped_weights(pupil, fields[[number]], radii[[number]], 1, area)
        assert np.array_equal(found, alone), radii[number]


@pytest.mark.parametrize("pupil", [Pupil(stops=STOPS), Pupil(5, 12.0, stops=STOPS), Pupil(6, 30.0), Pupil(7, 3.0, 0.8, STOPS)])
@pytest.mark.parametrize("radius", [2.2, -7.6])
def test_weights_are_the_areas_that_clipped_pupil_and_photosites_share(pupil, radius):
    """Truth: cells of a fine grid counted, which are off by about the edge's length over the number of cells."""
    fields = np.array([[0.2, 0.15], [-0.05, 0.3], [0.0, 0.0]])
    found, fine = shape_weights(pupil, fields, np.full(3, radius)), 60
    size = found.shape[1]
    place = (np.arange(size * fine) + 0.5) / fine - 0.5 * size
    points = np.stack(np.meshgrid(place, place), axis=-1) / radius
    for weights, field in zip(found, fields, strict=True):
        counted = pupil.contains(points, field).reshape(size, fine, size, fine).mean(axis=(1, 3))
        expected = counted / counted.sum()
        assert weights.sum() == pytest.approx(1.0, abs=1e-12)
        assert np.abs(weights - expected).max() < 0.015 * expected.max() and np.abs(weights - expected).sum() < 3e-3


def test_in_focus_a_photosite_sees_itself_whatever_its_pupil():
    sharp, wide = shape_weights(Pupil(5, stops=STOPS), np.array([[0.2, 0.15]] * 2), np.array([0.0, 40.0]))
    middle = sharp.shape[0] // 2
    assert sharp[middle, middle] == pytest.approx(1.0, abs=1e-9) and (wide > 0.0).sum() > 1000


def test_where_nothing_clips_the_weights_are_the_disk():
    exact = disk_weights(9.3)
    found = shape_weights(Pupil(stops=(PupilStop(1.5, 1.0),)), np.array([[0.1, 0.2]]), np.array([9.3]))[0]
    assert np.abs(found - exact).max() < 1e-3 * exact.max()


def seen_share(lens, x_px, y_px, light, radius_px, fine=8) -> np.ndarray:
    """Share of each photosite through which it sees a light at (x, y): its own pupil there, (X - x) / radius.

    Independent of tables and zones: `fine` x `fine` points of each photosite are tested against aperture and rims.
    """
    place = (np.arange(fine) + 0.5) / fine
    x = (x_px[:, None] + place).ravel()[None, :]
    y = (y_px[:, None] + place).ravel()[:, None]
    across, down = (light[0] - x) / radius_px, (light[1] - y) / radius_px
    inside = across**2 + down**2 <= 1.0
    for stop in lens.pupil.stops:
        tangent = stop.shift * 0.09 / lens.image_distance_mm
        inside = inside & (
            (across - tangent * (x - 0.5 * COLUMNS)) ** 2 + (down - tangent * (y - 0.5 * ROWS)) ** 2 <= stop.radius**2
        )
    return inside.reshape(len(y_px), fine, len(x_px), fine).mean(axis=(1, 3))


@pytest.mark.parametrize("radius", [19.0, -15.0])
@pytest.mark.parametrize("light", [(366, 250), (30, 140), (120, 40), (200, 140)])
def test_a_light_shows_the_pupil_of_its_field(radius, light):
    """Outline and centre of the spot, near and far, and its energy: the light that passes aperture and rims.

    A photosite at x sees the light through u = (X - x) / radius. So a rim of radius r that moves by k per photosite lets
    |u (1 + k radius) - k X| <= r pass: a disk again. The sum over the spot is the area that it shares with the aperture.
    """
    planes = np.zeros((ROWS, COLUMNS))
    planes[light[1], light[0]] = 1000.0
    shot = Shot(band_scene(planes, depth_of(CLOSE, radius, 90.0)), CLOSE, Exposure(1e-6), coarse_camera())
    found = simulate(shot).mean_electrons.astype(np.float64)
    lens = dataclasses.replace(CLOSE, vignetting=None)
    whole = simulate(dataclasses.replace(shot, lens=lens)).mean_electrons.astype(np.float64)
    assert whole.sum() == pytest.approx(whole[light[1], light[0]] * math.pi * radius**2, rel=1e-3)

    centre = np.array(light) + 0.5
    expected = seen_share(CLOSE, np.arange(COLUMNS), np.arange(ROWS), centre, radius)
    share = found / whole[light[1], light[0]]
    assert ((share > 0.5) == (expected > 0.5)).mean() > 0.9995 and np.abs(share - expected).sum() < 0.05 * expected.sum()
    y, x = np.mgrid[:ROWS, :COLUMNS] + 0.5
    for place in (x, y):
        assert (share * place).sum() / share.sum() == pytest.approx((expected * place).sum() / expected.sum(), abs=0.03)

    parts = [Disk(0.0, 0.0, 1.0)]
    for stop in CLOSE.pupil.stops:
        moved = stop.shift * 0.09 / CLOSE.image_distance_mm
        grown = 1.0 + moved * radius
        offset = moved * (centre - (0.5 * COLUMNS, 0.5 * ROWS)) / grown
        parts.append(Disk(float(offset[0]), float(offset[1]), stop.radius / grown))
    passing = intersection_area(tuple(parts)) / math.pi
    assert found.sum() / whole.sum() == pytest.approx(passing, abs=1.5e-3)  # zones are coarse on so few photosites


def test_every_photosite_has_its_own_pupil_and_no_step_between_zones():
    """Edges in all directions across a corner of zones: each photosite's own pupil in float64, at 2000 and 20,000 e-."""
    y, x = np.mgrid[:800, :1200]
    planes = np.where((x // 23 + y // 17 + (x + 2 * y) // 41) % 2 == 0, 1.0, 0.02)
    planned = plan(Shot(band_scene(planes, depth_of(LENS, 7.0, 30.0)), LENS, Exposure(1e-6), fine_camera()))
    eyes, frame = planned.optics.defocus.eyes, Window(1056, 690, 40, 30)
    assert eyes.zone_px == 16 and eyes.movement(16) < MOST_MOVED
    found = corner(planned, frame) / planned.optics.weights.sum()
    down, right = np.mgrid[:30, :40]
    fields = eyes.fields(frame.x + right.ravel() + 0.5, frame.y + down.ravel() + 0.5)
    own = shape_weights(LENS.pupil, fields, np.full(1200, 7.0))
    half = own.shape[1] // 2
    around = np.lib.stride_tricks.sliding_window_view(planes, own.shape[1:])
    seen = around[frame.y - half :, frame.x - half :][:30, :40]
    expected = np.einsum("nij,nij->n", own, seen.reshape(own.shape)).reshape(30, 40)
    axis = np.einsum("ij,nij->n", disk_weights(7.0), seen.reshape(own.shape)).reshape(30, 40)
    for electrons, limit in ((2000.0, 0.05), (20000.0, 0.15)):
        z = z_scores(found, expected, electrons)
        assert statistics(z).p99 < limit and np.abs(z).max() < 5.0 * limit, statistics(z)
    assert statistics(z_scores(axis, expected, 2000.0)).p99 > 2.0  # what a pupil without rims would give


def corner(planned, frame: Window) -> np.ndarray:
    """Mosaic of a window of a plan."""
    from simulator.device import open_device

    device = open_device()
    here = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=frame))
    mosaic = expose(measure(here, device), device)
    return device.download(mosaic, (frame.height, frame.width), np.float32).astype(np.float64)


def smooth(rng, shape) -> np.ndarray:
    """A texture without detail below three photosites."""
    noise = rng.normal(0.0, 1.0, shape)
    for axis in (0, 1):
        noise = sum(np.roll(noise, shift, axis) for shift in (-2, -1, 0, 1, 2)) / 5.0
    return np.clip(0.5 + 0.6 * noise, 0.05, None)


@pytest.mark.parametrize("radii", [pytest.param((6.5,), marks=pytest.mark.slow), (-6.0, 5.0)])
def test_the_reference_path_sees_the_same_cats_eyes(bench, radii):
    """Corner of a frame against rays that are tested one by one: one surface, and two that hide each other."""
    rng, frame, margin = np.random.default_rng(6), Window(1030, 660, 96, 80), 12
    y, x = np.mgrid[:800, :1200]
    disks = ((x - 1080) ** 2 + (y - 700) ** 2 < 18**2) * 1.0
    coverage = np.stack([*[disks] * (len(radii) - 1), np.ones(disks.shape)])
    colour = coverage * np.stack([smooth(rng, disks.shape) for _ in radii])
    scene = band_scene(colour[0], depth_of(LENS, radii[0], 30.0)).load()
    if len(radii) > 1:
        behind = Layer(colour[1].astype(np.float32)[..., None], depth_of(LENS, radii[1], 30.0))
        scene = dataclasses.replace(scene, coverage=disks.astype(np.float32), behind=(behind,))
    shot = Shot(FixedScene(scene), LENS, Exposure(1e-6), fine_camera())
    planned = plan(shot)
    found, part = corner(planned, frame), Window(frame.x, frame.y, 40, 32)
    traced = corner(plan(dataclasses.replace(shot, tolerance=0.0)), part)
    found, traced = found / planned.optics.weights.sum(), traced / planned.optics.weights.sum()

    part = slice(frame.y - margin, frame.y + 80 + margin), slice(frame.x - margin, frame.x + 96 + margin)
    colour, coverage = colour[:, *part], coverage[:, *part]
    radius = np.array(radii)[:, None, None] * np.ones(coverage.shape)
    points = ray_samples(4096)
    points[..., :2] = 0.5  # both read one value per photosite
    surfaces = upload_surfaces(bench.device, colour[:, None], coverage, radius, margin)
    settings = {"cells": len(radii) == 1}
    rays = {
        eyes: sample_lens(bench.device, surfaces, points, frame, eyes=eyes, **settings)
        for eyes in (planned.optics.defocus.eyes, None)
    }
    expected, full = (bench.device.download(light, (80, 96), np.float32) for light in rays.values())
    z = statistics(z_scores(found, expected, 2000.0))
    assert z.p99 < 0.2 and abs(z.mean) < 0.01
    assert statistics(z_scores(traced, expected[:32, :40], 2000.0)).p99 < 0.2
    assert statistics(z_scores(full, expected, 2000.0)).p99 > 1.0
    if len(radii) == 1:
        height = sample_height_field(bench.device, colour, radius[0], margin, points, frame, eyes=planned.optics.defocus.eyes)
        assert np.abs(z_scores(bench.device.download(height, (80, 96), np.float32), expected, 2000.0)).max() < 0.1


@pytest.mark.parametrize(
    ("tolerance", "frame"),
    [(0.1, Window(1040, 660, 90, 80)), pytest.param(0.0, Window(1070, 684, 40, 34), marks=pytest.mark.slow)],
)
def test_the_spots_of_small_lights_beside_an_edge_are_cut_too(tolerance, frame):
    """Lights leave what points of the aperture or rays sample: the spot of the light's field, behind a near half-plane."""
    light, edge, near_px, far_px = (700, 1090), 1080, -6.0, 7.0
    near, mosaics = np.broadcast_to(np.arange(1200) < edge, (800, 1200)), []
    for radiance in (500.0, 0.0):
        far = np.full((800, 1200, 1), 0.3, np.float32)
        far[light] += radiance
        scene = band_scene(0.5 * near, depth_of(LENS, near_px, 30.0)).load()
        behind = (Layer(far, depth_of(LENS, far_px, 30.0)),)
        scene = dataclasses.replace(scene, coverage=near.astype(np.float32), behind=behind)
        planned = plan(Shot(FixedScene(scene), LENS, Exposure(1e-6), fine_camera(), tolerance=tolerance))
        mosaics.append(corner(planned, frame) / planned.optics.weights.sum())
    images = [
        shape_weights(LENS.pupil, planned.optics.defocus.eyes.fields([light[1] + 0.5], [light[0] + 0.5]), np.array([far_px]))[0]
    ]
    images.append(disk_weights(far_px))
    half, spots = len(images[0]) // 2, []
    x = np.arange(frame.x, frame.x + frame.width) + 0.5
    open_ = np.clip(x + near_px * (light[1] + 0.5 - x) / far_px - edge + 0.5, 0.0, 1.0)  # the near side is read bilinearly
    for image in images:
        spot, down, right = np.zeros((frame.height, frame.width)), light[0] - frame.y - half, light[1] - frame.x - half
        spot[down : down + len(image), right : right + len(image)] = 500.0 * image[::-1, ::-1]
        spots.append(spot * open_)
    cut, full = (z_scores(mosaics[0], mosaics[1] + spot, 2000.0) for spot in spots)
    lit = spots[1] > 0
    assert np.sqrt(np.mean(cut[lit] ** 2)) < 0.05 * np.sqrt(np.mean(full[lit] ** 2))
    assert mosaics[0].sum() - mosaics[1].sum() == pytest.approx(spots[0].sum(), rel=0.01)


@pytest.mark.parametrize("aperture", [None, pytest.param(Aperture(6, 20.0, 0.5), marks=pytest.mark.slow)])
def test_a_flat_field_keeps_its_fall_off_and_a_crop_its_bits(aperture):
    """Under a rough depth map: every method and zone; the blur adds nothing to what the irradiance stage says."""
    rng = np.random.default_rng(8)
    depth = np.where(rng.random((70, 100)) > 0.97, 0.3, np.linspace(0.33, 0.8, 100)[None, :]).astype(np.float32)
    lens = dataclasses.replace(CLOSE, f_number=2.0, aperture=aperture)
    flat = simulate(Shot(band_scene(np.full((70, 100), 0.7), depth), lens, Exposure(1e-6), coarse_camera()))
    sharp = simulate(Shot(band_scene(np.full((70, 100), 0.7), 0.4), lens, Exposure(1e-6), coarse_camera()))
    assert np.abs(flat.mean_electrons / sharp.mean_electrons - 1.0).max() < 1e-6

    shot = Shot(band_scene(rng.random((70, 100, 3)), depth), lens, Exposure(1e-6), coarse_camera(cfa="GRBG"))
    whole = simulate(shot).mean_electrons
    for x, y, width, height in ((271, 177, 100, 90), (0, 0, 60, 50)):
        window = Window(x, y, width, height)
        crop = simulate(dataclasses.replace(shot, camera=coarse_camera(cfa="GRBG", window=window))).mean_electrons
        assert np.array_equal(crop, whole[y : y + height, x : x + width])


def test_the_tables_of_a_window_are_kept_for_its_next_frame(device):
    """A second frame asks no zones for the pupils at their corners; those of another window take their place."""
    rng = np.random.default_rng(8)
    depth = np.linspace(0.33, 0.8, 100)[None, :].repeat(70, axis=0).astype(np.float32)
    shot = Shot(
        band_scene(rng.random((70, 100)), depth), dataclasses.replace(CLOSE, f_number=2.0), Exposure(1e-6), coarse_camera()
    )
    tiles = measure(plan(shot), device).tiles
    kept = dataclasses.replace(tiles, zones=None)
    first, second = (DeviceTables(one, device, 1).of_tiles(True)[0] for one in (tiles, kept))
    for name, buffer in first.items():
        same = (device.download(one, (buffer.size,), np.uint8) for one in (buffer, second[name]))
        np.testing.assert_array_equal(*same)
    DeviceTables(dataclasses.replace(tiles, key="another window"), device, 1)
    with pytest.raises(AssertionError):
        DeviceTables(kept, device, 1).of_tiles(True)


def test_points_of_a_corner_are_made_once(device):
    """Blocks of all bands and frames share them, and have the bits of each block alone."""
    depth = np.linspace(0.33, 0.8, 100)[None, :].repeat(70, axis=0).astype(np.float32)
    shot = Shot(band_scene(np.ones((70, 100)), depth), CLOSE, Exposure(1e-6), coarse_camera())
    tiles = measure(plan(shot), device).tiles
    zones, tables = tiles.zones, DeviceTables(tiles, device, 1)
    corners, shares = tables.around_blocks(np.array([1, 1, 2]), np.array([1, 2, 1]))
    together, known = tables.points(64, (corners, shares)), {}
    for n, own in enumerate(together):
        assert np.array_equal(zones.points(corners[n : n + 1], shares[n : n + 1], 64, 1, WHOLE, known)[0], own)
    assert known.keys() == set(corners.ravel().tolist())
    dark = {corner: np.zeros_like(points) for corner, points in known.items()}
    assert not zones.points(corners, shares, 64, 1, WHOLE, dark)[..., :2].any()


def test_where_no_rim_reaches_the_bits_are_those_without_rims():
    rng = np.random.default_rng(9)
    scene = band_scene(rng.random((70, 100)), rng.uniform(0.35, 0.6, (70, 100)).astype(np.float32))
    lens = dataclasses.replace(CLOSE, f_number=2.0)
    without_rims = dataclasses.replace(lens, vignetting=None)
    plans = [plan(Shot(scene, one, Exposure(1e-6), coarse_camera())) for one in (lens, without_rims)]
    assert plans[0].optics.defocus.eyes is not None and plans[1].optics.defocus.eyes is None
    with_rims, without = (corner(planned, Window(130, 96, 120, 64)) for planned in plans)
    assert np.array_equal(with_rims, without)
    wide = dataclasses.replace(CLOSE, vignetting=Vignetting(RoundStop(30.0, 90.0)))
    assert plan(Shot(scene, wide, Exposure(1e-6), coarse_camera())).optics.defocus.eyes is None


def test_a_corner_that_no_ray_reaches_is_dark():
    """Two narrow rims far from the aperture: the outer corners are shut, and nothing there is NaN."""
    lens = dataclasses.replace(CLOSE, f_number=4.0, vignetting=Vignetting(RoundStop(60.0, 13.0), RoundStop(40.0, 6.0)))
    rng = np.random.default_rng(2)
    depth = np.where(rng.random((70, 100)) > 0.95, 0.3, 0.6).astype(np.float32)
    for scene in (band_scene(np.ones((70, 100)), 0.6), band_scene(np.ones((70, 100)), depth)):
        found = simulate(Shot(scene, lens, Exposure(1e-6), coarse_camera())).mean_electrons
        assert np.isfinite(found).all() and found[0, 0] == found[-1, -1] == 0.0 and found[140, 200] > 0.0


def test_zones_are_as_coarse_as_the_rims_allow():
    """A rim moves by no more than MOST_MOVED across a zone, but zones are no smaller than a quarter of the largest radius."""
    found = [plan_cats_eyes(LENS, 8.4, (4240, 2832), radius).zone_px for radius in (4.0, 300.0, 512.0)]
    assert found == [64, 64, 128]
    assert plan_cats_eyes(LENS, 4.2, (8480, 5664), 8.0).zone_px == 128
    assert plan_cats_eyes(dataclasses.replace(LENS, f_number=5.6), 8.4, (4240, 2832), 4.0) is None
    exact, loose = (plan_cats_eyes(LENS, 8.4, (4240, 2832), 4.0, allowed) for allowed in (1e-4, 1.0))
    assert exact.zone_px == 16 and loose.zone_px == 64  # a tolerance makes zones smaller, never larger


@pytest.mark.parametrize("zone_px", [32, 64, 128, 256])
@pytest.mark.parametrize("radius", [4.0, 16.0])
def test_the_law_of_zones_bounds_what_is_found(radius, zone_px):
    """In a corner of the frame, beside edges of 50 : 1 and in rough texture; own pupils of all photosites are the truth."""
    eyes = dataclasses.replace(plan_cats_eyes(LENS, 8.4, (4240, 2832), radius), zone_px=zone_px)
    first = np.array([zone_px * (3800 // zone_px), zone_px * (2500 // zone_px)])
    place = np.stack([np.arange(0, zone_px, zone_px // 8), np.full(8, zone_px // 2)])
    corner = zone_px * np.array([[0, 1, 0, 1], [0, 0, 1, 1]])
    own, corners, middle = (
        shape_weights(LENS.pupil, eyes.fields(*(first[:, None] + at)), np.full(at.shape[1], radius))
        for at in (place + 0.5, corner, np.full((2, 1), 0.5 * zone_px))
    )
    right, down = (place + 0.5) / zone_px
    shares = np.stack([(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right], axis=1)
    interpolated = np.einsum("nk,kij->nij", shares, corners)
    y, x = np.mgrid[: own.shape[1], : own.shape[1]] - own.shape[1] // 2
    light = [np.where(x * math.cos(a) + y * math.sin(a) > d * radius, 1.0, 0.02) for a in range(6) for d in (-0.7, 0.0, 0.7)]
    light += list(np.random.default_rng(5).random((10, *x.shape)))
    truth = np.einsum("nij,kij->nk", own, light)
    for found, law in ((interpolated, zone_error), (middle, middle_error)):
        error = np.abs(np.einsum("nij,kij->nk", found - own, light)) / np.sqrt(truth)  # counts by the noise at its own place
        assert np.quantile(error, 0.999) <= law(eyes.movement(zone_px)) + 3e-4  # the float32 of the sampled shapes
