"""Distortion: polynomial and inverse, the rendered picture, truth maps, and the opcode that undoes it."""

import dataclasses
import io
import math
import shutil
import struct
import subprocess
import textwrap

import numpy as np
import pytest
import tifffile
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.optimize import root

from simulator.config import load_shot
from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project_planes
from simulator.optics.lens.distortion import Distortion, Warp, plan_warp
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes
from simulator.raw.raw_format import RawFormat
from simulator.sensor.camera.camera import Window

WIDTH, HEIGHT = 320, 240
BARREL = Distortion(k1=-0.12, k2=0.02, p1=0.004, p2=-0.003, unit="half_diagonal", lateral=(1.004, 1.0, 0.997))
LENSES = {
    "barrel": BARREL,
    "pincushion": Distortion(k1=0.08, k3=0.01, unit="half_diagonal"),
    "moustache": Distortion(k1=-0.256, k2=0.983, k3=-0.671, p1=0.0064, p2=-0.005),
    "lateral": Distortion(lateral=(1.005, 1.0, 0.996)),
}


def lens(distortion: Distortion | None) -> ThinLens:
    return ThinLens(1.6, 8.0, cos4=False, distortion=distortion)  # 320 photosites of 5 um are as wide as it is long


def written_out(distortion: Distortion, x, y, unit_px: float, channel: int):
    """Brown's polynomial about the centre of the sensor, in float64."""
    a, b, d = (x - WIDTH / 2) / unit_px, (y - HEIGHT / 2) / unit_px, distortion
    r2 = a**2 + b**2
    radial = 1 + d.k1 * r2 + d.k2 * r2**2 + d.k3 * r2**3
    far = unit_px * d.lateral[channel]
    return (
        WIDTH / 2 + far * (a * radial + 2 * d.p1 * a * b + d.p2 * (r2 + 2 * a**2)),
        HEIGHT / 2 + far * (b * radial + 2 * d.p2 * a * b + d.p1 * (r2 + 2 * b**2)),
    )


def unit_px(distortion: Distortion) -> float:
    return math.hypot(WIDTH, HEIGHT) / 2 if distortion.unit == "half_diagonal" else 320.0


@pytest.mark.parametrize("name", LENSES)
def test_the_inverse_leads_back(name):
    warp = plan_warp(LENSES[name], 320.0, WIDTH, HEIGHT, 3)
    x, y = np.random.default_rng(1).uniform(0, 1, (2, 500)) * np.array([[WIDTH], [HEIGHT]])
    for channel in range(3):
        seen = warp.distorted(*warp.undistorted(x, y, channel), channel)
        assert np.max(np.hypot(seen[0] - x, seen[1] - y)) < 1e-3
        expected = written_out(LENSES[name], x, y, unit_px(LENSES[name]), channel)
        assert np.allclose(warp.distorted(x, y, channel), expected, atol=1e-9)


def point_grid(per_photosite=3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scene of soft dots (sigma 1.5 photosites), and their centres in photosites of the undistorted picture."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(40, WIDTH - 30, 40), np.arange(40, HEIGHT - 30, 40)))
    lines = []  # the dots stand on a lattice, so that two sets of lines multiply to them
    for side, centres in ((HEIGHT, np.unique(y)), (WIDTH, np.unique(x))):
        places = (np.arange(side * per_photosite)[:, None] + 0.5) / per_photosite
        lines.append(np.exp(-((places - centres) ** 2) / (2 * 1.5**2)).sum(axis=1))
    planes = lines[0][:, None] * lines[1][None, :]
    return planes, x.astype(float), y.astype(float)


def centroids(picture, x, y, reach=9) -> tuple[np.ndarray, np.ndarray]:
    """Centres of the dots near these places, photosites from the upper left corner."""
    found = []
    for a, b in zip(np.rint(x).astype(int), np.rint(y).astype(int), strict=True):
        part = picture[b - reach : b + reach, a - reach : a + reach]
        rows, columns = np.mgrid[b - reach : b + reach, a - reach : a + reach] + 0.5
        found.append(((part * columns).sum() / part.sum(), (part * rows).sum() / part.sum()))
    return tuple(np.array(found).T)


@pytest.mark.parametrize("name", ["barrel", "lateral"])
def test_points_fall_where_the_polynomial_says(name):
    """Centroids of rendered dots in each colour against the polynomial; a dot's own stretch moves its centroid a little."""
    planes, x, y = point_grid()
    scene, camera = band_scene(np.repeat(planes[..., None], 3, 2), math.inf), small_camera(WIDTH, HEIGHT, "RGGB")
    picture = simulate(Shot(scene, lens(LENSES[name]), Exposure(0.01), camera, truth=("rgb",))).truth["rgb"].astype(float)
    for channel in range(3):
        expected = written_out(LENSES[name], x, y, unit_px(LENSES[name]), channel)
        found = centroids(picture[..., channel], *expected)
        assert np.max(np.hypot(found[0] - expected[0], found[1] - expected[1])) < 0.05


def inverse_by_roots(warp: Warp, x: float, y: float, channel: int) -> np.ndarray:
    """Undistorted place of a point of the distorted picture, found by MINPACK's search from that point."""
    found = root(lambda at: np.subtract(warp.distorted(*at, channel), (x, y)), (x, y), tol=1e-13)
    assert np.max(np.abs(found.fun)) < 1e-9
    return found.x


TANGENTIAL = Distortion(k1=-0.1, p1=0.006, p2=-0.005, unit="half_diagonal", lateral=(1.004, 1.0, 0.997))


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (3, 3), (40, 1), (1, 7), (300, 200)])
@pytest.mark.parametrize("distortion", [Distortion(k1=-0.1224, unit="half_diagonal"), TANGENTIAL])
def test_extent_and_tilt_are_those_of_the_inverse_on_the_sensor_however_small(distortion, size):
    """A whole photosite beyond the corner of 1 to 3 the polynomial folds, where photosites look 5,000 times as wide."""
    warp, (width, height), step = plan_warp(distortion, 1e4, *size, 3), size, 1e-4 * min(size)
    reach, sides = [[1.0, 1.0]], []
    for channel in range(3):
        for x, y in np.stack(np.meshgrid(np.linspace(0, width, 5), np.linspace(0, height, 5)), axis=-1).reshape(-1, 2):
            place = inverse_by_roots(warp, x, y, channel)
            reach.append(np.abs(2.0 * place / (width, height) - 1.0))
            ends = [
                [inverse_by_roots(warp, x + way * right, y + way * down, channel) for way in (-step, step)]
                for right, down in ((1, 0), (0, 1))
            ]
            sides.append([(last - first) / (2.0 * step) for first, last in ends])
    sides = np.abs(sides)
    stretch, widest = np.linalg.norm(sides, axis=2).max(), sides.sum(axis=1).max()
    assert warp.extent(*size) == pytest.approx([*np.max(reach, axis=0), max(stretch, 1.0), max(widest, 1.0)], rel=1e-3)
    assert warp.tilt(*size) == pytest.approx(max(sides[:, 0, 1].max(), sides[:, 1, 0].max()), rel=1e-3)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (3, 3)])
def test_a_sensor_of_few_photosites_takes_few_samples_of_each(size):
    """Of 5,000 per photosite and axis a shot took minutes."""
    deep = lens(Distortion(k1=-0.1224, unit="half_diagonal"))
    planned = plan(Shot(band_scene(np.ones((6, 6))), deep, Exposure(0.01), small_camera(*size)))
    assert planned.optics.projection.samples <= math.ceil(2.4 * planned.optics.projection.scale)


def test_no_distortion_has_the_bits_of_none():
    scene, camera = band_scene(np.random.default_rng(2).random((60, 80, 3)), math.inf), small_camera(WIDTH, HEIGHT, "RGGB")
    plain = simulate(Shot(scene, lens(None), Exposure(0.01), camera))
    still = simulate(Shot(scene, lens(Distortion()), Exposure(0.01), camera))
    assert np.array_equal(plain.mean_electrons, still.mean_electrons) and still.warp_rectilinear is None


def test_a_crop_of_a_distorted_frame_keeps_its_bits():
    scene = band_scene(np.random.default_rng(3).random((60, 80, 3)), np.linspace(1, 9, 4800, dtype=np.float32).reshape(60, 80))
    camera = small_camera(WIDTH, HEIGHT, "RGGB")
    for f_number in (1.4, 16.0):
        blurred = ThinLens(1.6, f_number, 0.002 if f_number < 2 else math.inf, distortion=BARREL)
        whole = simulate(Shot(scene, blurred, Exposure(0.01), camera))
        part = dataclasses.replace(camera, window=Window(31, 17, 90, 70))
        crop = simulate(Shot(scene, blurred, Exposure(0.01), part))
        assert np.array_equal(crop.mean_electrons, whole.mean_electrons[17:87, 31:121])


def test_the_depth_of_the_truth_is_warped_like_the_picture():
    """A scene whose light is its depth: sharp photosites hold the depth that the map tells."""
    values = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0])  # no mean of some is another
    steps = np.random.default_rng(4).choice(values, (24, 32)).repeat(10, axis=0).repeat(10, axis=1).astype(np.float32)
    shot = Shot(
        band_scene(steps, steps, interpolation="nearest"),
        lens(Distortion(k1=-0.12, unit="half_diagonal")),
        Exposure(0.01),
        small_camera(WIDTH, HEIGHT),
        truth=("depth",),
    )
    raw = simulate(shot)
    light = raw.mean_electrons / raw.mean_electrons.max() * steps.max()
    nearest = values[np.abs(light[..., None] - values).argmin(axis=-1)]
    whole = np.abs(light - nearest) < 1e-3  # not on a border
    agrees = np.abs(raw.truth["depth"][whole] - nearest[whole]) < 1e-3
    assert whole.mean() > 0.5 and agrees.mean() > 0.999


def opcode_of(data: bytes) -> tuple[np.ndarray, tuple[float, float]]:
    """Coefficients (planes, 6) and centre of the file's only opcode, decoded as DNG 1.4 chapter 7 lays it out."""
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        payload = bytes(file.pages[0].pages[0].tags[Tag.OPCODE_LIST_3].value)
    count, opcode, *version, flags, size, planes = struct.unpack(">II4BIII", payload[:24])
    assert (count, opcode, version, flags, size) == (1, 1, [1, 3, 0, 0], 1, len(payload) - 20)
    numbers = struct.unpack(f">{6 * planes + 2}d", payload[24:])
    return np.reshape(numbers[:-2], (planes, 6)), numbers[-2:]


def corrected(picture, coefficients, centre) -> np.ndarray:
    """WarpRectilinear of DNG 1.4, chapter 7, on one plane, in float64; pixels are at whole numbers."""
    height, width = picture.shape
    cx, cy = centre[0] * (width - 1), centre[1] * (height - 1)
    m = math.hypot(max(cx, width - 1 - cx), max(cy, height - 1 - cy))
    y, x = np.mgrid[:height, :width]
    dx, dy = (x - cx) / m, (y - cy) / m
    r2 = dx**2 + dy**2
    kr0, kr1, kr2, kr3, kt0, kt1 = coefficients
    f = kr0 + kr1 * r2 + kr2 * r2**2 + kr3 * r2**3
    there_x = cx + m * (f * dx + kt0 * 2 * dx * dy + kt1 * (r2 + 2 * dx**2))
    there_y = cy + m * (f * dy + kt1 * 2 * dx * dy + kt0 * (r2 + 2 * dy**2))
    return map_coordinates(picture, (there_y, there_x), order=3, mode="nearest")


PART = "barrel", Window(40, 30, 250, 180)
OPCODES = [pytest.param(name, None, marks=[pytest.mark.slow] if name in ("pincushion", "moustache") else []) for name in LENSES]


@pytest.mark.parametrize(("name", "window"), [*OPCODES, PART])
def test_the_opcode_of_the_dng_undoes_the_distortion(name, window):
    """Every colour of the distorted dots, corrected by the file's own opcode, lies on the undistorted grid to 0.05 px."""
    planes, x, y = point_grid()
    camera = small_camera(WIDTH, HEIGHT, "RGGB", window=window)
    shot = Shot(
        band_scene(np.repeat(planes[..., None], 3, 2), math.inf), lens(LENSES[name]), Exposure(0.01), camera, truth=("rgb",)
    )
    raw = simulate(shot)
    left, top = (0, 0) if window is None else (window.x, window.y)
    coefficients, centre = opcode_of(dng_bytes(raw))
    inside = (x > left + 12) & (y > top + 12) & (x < left + raw.dn.shape[1] - 12) & (y < top + raw.dn.shape[0] - 12)
    for channel in range(3):
        picture = corrected(raw.truth["rgb"][..., channel].astype(float), coefficients[channel], centre)
        found = centroids(picture, x[inside] - left, y[inside] - top)
        assert np.max(np.hypot(found[0] + left - x[inside], found[1] + top - y[inside])) < 0.05


def test_a_shot_may_leave_the_opcode_out_and_a_crop_beside_the_axis_has_none():
    scene, camera = band_scene(np.ones((24, 32, 3)), math.inf), small_camera(WIDTH, HEIGHT, "RGGB")
    shot = Shot(scene, lens(BARREL), Exposure(0.01), camera)
    beside = dataclasses.replace(shot, camera=dataclasses.replace(camera, window=Window(0, 0, 100, 100)))
    for other in (dataclasses.replace(shot, raw=RawFormat(opcodes=False)), beside):
        with tifffile.TiffFile(io.BytesIO(dng_bytes(simulate(other)))) as file:
            assert Tag.OPCODE_LIST_3 not in file.pages[0].pages[0].tags


@pytest.mark.skipif(
    shutil.which("exiftool") is None, reason="exiftool is missing; Debian and Ubuntu: apt install libimage-exiftool-perl"
)
def test_exiftool_finds_the_opcode_and_nothing_to_complain_about(tmp_path):
    scene, camera = band_scene(np.ones((24, 32, 3)), math.inf), small_camera(WIDTH, HEIGHT, "RGGB")
    (tmp_path / "warped.dng").write_bytes(dng_bytes(simulate(Shot(scene, lens(BARREL), Exposure(0.01), camera))))
    command = ["exiftool", "-validate", "-warning", "-a", "-OpcodeList3", str(tmp_path / "warped.dng")]
    told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    assert "Validate                        : OK" in told and "WarpRectilinear" in told


def test_a_shot_file_holds_a_distortion(tmp_path):
    text = """
    scene: {chart: flat_field, luminance: 100 cd/m^2}
    lens: {focal_length: 50 mm, f_number: f/8, distortion: {k1: -0.02, unit: half_diagonal, lateral: [1.0004, 1, 0.9997]}}
    exposure: {time: 1/100 s, iso: 100}
    camera: ideal
    raw: {opcodes: false}
    """
    (tmp_path / "shot.yaml").write_text(textwrap.dedent(text), encoding="utf-8")
    shot = load_shot(tmp_path / "shot.yaml")
    assert shot.lens.distortion == Distortion(k1=-0.02, unit="half_diagonal", lateral=(1.0004, 1.0, 0.9997))
    assert not shot.raw.opcodes
    with pytest.raises(PhotositeError, match="lens.distortion.k4"):
        load_shot(tmp_path / "shot.yaml", {"lens.distortion.k4": 0.1})


def test_distortions_that_no_lens_has_are_refused():
    with pytest.raises(
        PhotositeError, match=r"lens.distortion = .*: folds the picture over at 0.\d+ of the sensor's half diagonal"
    ):
        plan_warp(Distortion(k1=-0.6, unit="half_diagonal"), 320.0, WIDTH, HEIGHT, 3)
    with pytest.raises(PhotositeError, match="lens.distortion.k1 = nan: give a finite number"):
        Distortion(k1=math.nan)
    with pytest.raises(PhotositeError, match="lens.distortion.lateral = .*three magnifications"):
        Distortion(lateral=(1.0, 1.0, 2.0))
    scene = band_scene(np.ones((24, 32)), math.inf, field_of_view_deg=53.5)
    shot = Shot(scene, lens(None), Exposure(0.01), small_camera(WIDTH, HEIGHT))
    plan(shot)
    with pytest.raises(PhotositeError, match="scene.field_of_view = 53.5 deg: the camera sees"):
        plan(dataclasses.replace(shot, lens=lens(Distortion(k1=-0.1, unit="half_diagonal"))))


def test_samples_are_numbers_where_the_polynomial_folds():
    """A barrel far beyond the sensor, in the margins of a small frame: running sums take one that is not along."""
    warp = Warp(Distortion(k1=-0.0212, unit="half_diagonal"), 26.800186566514792, 16.0, 21.5, (1.0, 1.0, 1.0), steps=2)
    projection = Projection(4.0, 0.0, 0.0, 128, 172, 5, False, warp)
    device, layout = open_device(), InterleavedColumns(4, 544, 160)
    planes, sampled = device.upload(np.ones((1, 172, 128), np.float32)), device.empty(layout.shape(1), np.float32)
    project_planes(device, projection, planes, 1, sampled, 0, layout, (-160, -132))
    assert np.isfinite(device.download(sampled, layout.shape(1), np.float32)).all()


@pytest.mark.parametrize("terms", [(-0.115, 0.0, 0.0), (0.316, 0.140, -0.039), (0.208, 0.141, -0.024)])
def test_samples_far_beyond_a_fold_are_light_of_the_scene(terms):
    """A deep blur reads 200 photosites beside a sensor of 24 x 16, where squares are seen turned over, or any size."""
    k1, k2, k3 = terms
    warp = plan_warp(Distortion(k1=k1, k2=k2, k3=k3, unit="half_diagonal"), 6000.0, 24, 16, 3)
    stretch, extent = warp.extent(24, 16)[2:]
    device, layout = open_device(), InterleavedColumns(2, 832, 432)
    for scale in (0.7, 1.0, 2.0):
        width, height, samples = round(24 * scale), round(16 * scale), max(1, math.ceil(scale * stretch - 1e-6))
        is_coarse = scale <= 1.0
        projection = Projection(scale, 0.0, 0.0, width, height, samples, False, warp, stretch, extent, is_bilinear=is_coarse)
        pixels = np.random.default_rng(1).uniform(0.1, 1.0, (1, height, width)).astype(np.float32)
        planes, sampled = device.upload(pixels), device.empty(layout.shape(1), np.float32)
        project_planes(device, projection, planes, 1, sampled, 0, layout, (-204, -200))
        found = device.download(sampled, layout.shape(1), np.float32)
        assert np.isfinite(found).all() and 0.099 < found.min() and found.max() < 1.001


def test_a_deep_blur_behind_a_barrel_is_a_picture():
    """A blur circle of 142 photosites on 24 x 16: one sample that is no number would take the whole frame."""
    picture = np.random.default_rng(0).uniform(0.1, 1.0, (32, 48))
    deep = ThinLens(50.0, 1.0, 2.0, cos4=False, distortion=Distortion(k1=-0.115, unit="half_diagonal"))
    camera = small_camera(24, 16, pixel_pitch_um=8.4)
    shot = Shot(band_scene(picture, 0.7), deep, Exposure(0.01), camera)
    found, plain = (
        simulate(one).mean_electrons
        for one in (shot, dataclasses.replace(shot, lens=dataclasses.replace(deep, distortion=None)))
    )
    assert np.isfinite(found).all() and abs(found.mean() / plain.mean() - 1.0) < 0.2


@pytest.mark.parametrize("size", [(24, 1), (1, 16)])
def test_a_frame_of_one_row_or_column_has_no_opcode(size):
    shot = Shot(
        band_scene(np.ones((16, 24))), lens(Distortion(k1=-0.1, unit="half_diagonal")), Exposure(0.01), small_camera(24, 16)
    )
    camera = dataclasses.replace(shot.camera, window=Window(0, 0, *size))
    raw = simulate(dataclasses.replace(shot, camera=camera))
    assert raw.dn.shape == size[::-1] and raw.warp_rectilinear is None and np.isfinite(raw.mean_electrons).all()
