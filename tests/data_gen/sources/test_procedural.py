"""Pictures without files: functions of their names, with colours of measured surfaces."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept
from scipy import ndimage, optimize, stats

from data_gen.sources import drawings
from data_gen.sources.drawings import DRAWINGS, LEAF_LAYERS, LEAF_RADII_PX
from data_gen.sources.paint import LAMP_TEMPERATURES_K, Paint, paint_for
from data_gen.sources.procedural import Procedural
from simulator.color.camera_matrices import chart_reflectances
from simulator.config import load_camera
from simulator.errors import PhotositeError

SMALL = {"width_px": 61, "height_px": 48}


class BlackAndWhite(Paint):
    """Every first surface is white, every second one black."""

    def __init__(self):
        super().__init__(np.ones((1, 3)), np.ones((1, 3)))

    def surfaces(self, draw, count):
        return np.repeat(np.arange(count) < (count + 1) // 2, 3).reshape(count, 3).astype(np.float32)


@pytest.fixture(scope="module")
def camera():
    return load_camera("sony_a7s2")


@pytest.fixture(scope="module")
def source(camera):
    return Procedural(tuple(DRAWINGS), camera, **SMALL)


def read(source, name, seed=0):
    return source.read(name, np.random.default_rng(seed))


@pytest.mark.parametrize("kind", DRAWINGS)
def test_a_picture_follows_from_its_name_alone(source, camera, kind):
    first = read(source, f"{kind}/000003")
    read(source, f"{kind}/000004")
    again = read(Procedural((kind,), camera, **SMALL), f"{kind}/000003", seed=9)
    np.testing.assert_array_equal(first.signal, again.signal)
    assert first.signal.shape == (48, 61, 3) and first.signal.dtype == np.float32 and first.cfa is None
    assert np.isfinite(first.signal).all() and first.signal.min() >= 0
    others = [read(source, f"{kind}/000004"), read(replace(source, seed=1), f"{kind}/000003")]
    assert all((other.signal != first.signal).any() for other in others)


def test_names_take_the_kinds_in_turn_and_go_on_without_end(source):
    short = replace(source, procedural=("text", "gradients"), count=5)
    assert tuple(short.names()) == ("text/000000", "gradients/000000", "text/000001", "gradients/000001", "text/000002")
    assert read(short, "text/123456789").signal.shape == (48, 61, 3)


def test_names_of_a_billion_drawings_take_no_memory(source):
    names = replace(source, procedural=("text", "gradients"), count=10**9).names()
    assert (len(names), names[0], names[-1]) == (10**9, "text/000000", "gradients/499999999")
    assert tuple(names[1_999_999:2_000_002]) == ("gradients/999999", "text/1000000", "gradients/1000000")
    with pytest.raises(IndexError):
        names[10**9]


def test_the_draw_chooses_the_light_and_white_balance_follows(camera):
    source = Procedural(("color_patches",), camera, illuminants=("D65", "A"), **SMALL)
    seen = {read(source, "color_patches/000000", seed).white_balance: seed for seed in range(20)}
    alone = {read(replace(source, illuminants=(light,)), "color_patches/000000").white_balance for light in ("D65", "A")}
    assert set(seen) == alone and len(alone) == 2


@pytest.mark.parametrize("light", ["D65", "A"])
def test_a_neutral_surface_is_neutral_after_white_balance(camera, light):
    paint = paint_for(camera, light)
    grey = paint.measured[20]  # neutral 6.5: its reflectance is even within 2 %
    balance = np.array(read(Procedural(("text",), camera, illuminants=(light,), **SMALL), "text/000000").white_balance)
    assert balance[1] == 1 and np.ptp(grey * balance) < 0.02 * grey[1]
    np.testing.assert_allclose(grey.max(), 0.36, atol=0.01)  # Y of neutral 6.5 is 0.36 (X-Rite)


def test_surfaces_are_mixtures_of_measured_reflectances(camera):
    """Found again by non-negative least squares over the integrals of reflectance, light and response, by trapezoids."""
    from simulator.color.spectra import WAVELENGTHS_NM, illuminant

    paint, fine = paint_for(camera, "D65"), np.linspace(380.0, 780.0, 40001)
    curves = [np.interp(fine, camera.response.wavelengths_nm, c, 0, 0) for c in camera.response.quantum_efficiency.T]
    photons = np.stack(curves, axis=-1) * fine[:, None]
    power = illuminant("D65")
    lit = [np.interp(fine, WAVELENGTHS_NM, row * power) for row in chart_reflectances(WAVELENGTHS_NM)]
    expected = np.stack(lit) @ photons / (np.interp(fine, WAVELENGTHS_NM, power) @ photons).max()
    np.testing.assert_allclose(paint.measured, expected, rtol=1e-5)
    surfaces = paint.surfaces(np.random.default_rng(1), 300).astype(np.float64)
    for surface in surfaces:
        shares, residual = optimize.nnls(expected.T, surface)
        assert residual < 1e-6 and shares.sum() < 1.0 / expected.max()
    assert np.ptp(surfaces[:, 0] / surfaces[:, 2]) > 1  # and they have many hues


def test_lamps_are_blackbodies_from_candle_to_sky(camera):
    assert LAMP_TEMPERATURES_K[0] == 10000 and 1880 < LAMP_TEMPERATURES_K[-1] < 1890
    lamps = paint_for(camera, "D65").lamps
    assert (np.diff(lamps[:, 0] / lamps[:, 2]) > 0).all() and np.allclose(lamps.max(axis=1), 1)


def test_radii_follow_the_law_of_scale_invariance():
    radii = drawings.leaf_radii(np.random.default_rng(5), 20000)
    low, high = (radius**-2.0 for radius in LEAF_RADII_PX)
    accept({"radius": stats.kstest(radii, lambda r: (low - r**-2.0) / (low - high)).pvalue})


class ScriptedDraws:
    """Random numbers that are known: radii with five borders of the sizes that are drawn together, and places."""

    def __init__(self):
        self.given, self.random_numbers = [], np.random.default_rng(7)

    def random(self, shape):
        self.given.append(self.random_numbers.random(shape))
        if len(self.given) == 1:
            least, largest = (radius**-2.0 for radius in LEAF_RADII_PX)
            self.given[0][:5] = [(least - px**-2.0) / (least - largest) for px in (96, 3, 6, 11.99, 12)]
        return self.given[-1]


def test_the_last_leaf_lies_on_top():
    """Leaf after leaf onto a picture of pixels, the places even over the picture and what reaches in."""
    height, width, draws = 90, 70, ScriptedDraws()
    found = drawings.leaf_numbers(draws, height, width)
    quantiles, places = draws.given
    (y, x), largest = places.T, LEAF_RADII_PX[1]
    y, x = y * (height + 2 * largest) - largest, x * (width + 2 * largest) - largest
    radius = (LEAF_RADII_PX[0] ** -2.0 - quantiles * (LEAF_RADII_PX[0] ** -2.0 - largest**-2.0)) ** -0.5
    expected = np.zeros((height, width), int)
    rows, columns = np.mgrid[:height, :width] + 0.5
    for leaf in range(len(radius)):
        expected[(rows - y[leaf]) ** 2 + (columns - x[leaf]) ** 2 <= radius[leaf] ** 2] = leaf + 1
    np.testing.assert_array_equal(found, expected)


def test_leaves_cover_every_place_alike():
    """Binomial tests of the share of bare ground, exp(-5), at a corner and at the centre of many pictures."""
    count, draw = 1200, np.random.default_rng(11)
    bare = np.array([drawings.leaf_numbers(draw, 9, 9)[[0, 4], [0, 4]] == 0 for _ in range(count)]).sum(axis=0)
    expected = np.exp(-LEAF_LAYERS)
    accept({place: stats.binomtest(int(found), count, expected).pvalue for place, found in enumerate(bare)})


def test_the_blur_is_binomial_and_keeps_a_flat_field_flat(camera):
    """Of the drawing that numbers of their own make, Philox with the SHA-256 of seed and name as its key."""
    source, name = Procedural(("color_patches",), camera, seed=3, **SMALL), "color_patches/000002"
    key = int.from_bytes(hashlib.sha256(f"3/{name}".encode()).digest()[:16], "little")
    draw = np.random.Generator(np.random.Philox(key=key))
    planes = DRAWINGS["color_patches"](draw, paint_for(camera, "D65"), SMALL["height_px"], SMALL["width_px"])
    found, white = read(source, name).signal, np.float32(source.white_signal)
    kernel = np.outer([1, 2, 1], [1, 2, 1])[..., None] / 16
    expected = ndimage.convolve(planes.astype(float), kernel, mode="nearest") * white
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    flat = ndimage.maximum_filter(planes, (3, 3, 1)) == ndimage.minimum_filter(planes, (3, 3, 1))
    assert 0.3 < flat.mean() < 1.0 and (found[flat] == (planes * white)[flat]).all()


def test_an_edge_is_straight_and_slanted():
    draw = np.random.default_rng(4)
    side = int(np.random.default_rng(4).integers(64, 129))
    planes = DRAWINGS["slanted_edges"](draw, BlackAndWhite(), side, side)[..., 0].astype(np.float64)
    along = planes if abs(np.diff(planes, axis=1)).sum() > abs(np.diff(planes, axis=0)).sum() else planes.T
    inner = along[(along[:, 0] != along[:, -1]) & (along[:, 0] % 1 == 0) & (along[:, -1] % 1 == 0)]
    place = np.abs(inner - inner[:, -1:]).sum(axis=1)  # pixels of the other colour in each line
    fit = stats.linregress(np.arange(len(place)), place)
    assert len(place) > 30 and np.tan(np.radians(2)) < abs(fit.slope) < np.tan(np.radians(43))
    assert np.abs(place - fit.intercept - fit.slope * np.arange(len(place))).max() < 0.1


def test_characters_are_dots_of_ink_on_paper():
    planes = DRAWINGS["text"](np.random.default_rng(6), BlackAndWhite(), 300, 200)
    assert set(np.unique(planes)) == {0.0, 1.0}
    assert 0.1 < 1 - planes.mean() < 0.4  # 0.85 * 0.45 * 7/10 * 5/6 = 0.22


def test_lamps_are_brighter_than_white_before_a_dim_ground(source):
    for seed in range(8):
        lights = DRAWINGS["point_lights"](np.random.default_rng(seed), BlackAndWhite(), 200, 200)
        assert lights.max() > 1 and lights.min() >= 0
        assert np.median(lights) < 0.05 + 0.01  # the ground is at most 5 % of white, halos add little


def test_a_gradient_passes_evenly_through_its_colours():
    planes = DRAWINGS["gradients"](np.random.default_rng(8), BlackAndWhite(), 31, 41)[..., 0].astype(np.float64)
    rows, columns = np.random.default_rng(8).integers(2, 7, 2)
    knots = np.repeat(np.arange(rows * columns) < (rows * columns + 1) // 2, 1).reshape(rows, columns).astype(float)
    position = np.meshgrid(np.linspace(0, rows - 1, 31), np.linspace(0, columns - 1, 41), indexing="ij")
    np.testing.assert_allclose(planes, ndimage.map_coordinates(knots, position, order=1, mode="nearest"), atol=1e-6)


def test_a_monochrome_camera_gets_its_one_plane(camera):
    picture = read(Procedural(("dead_leaves",), small_camera(cfa="MONO"), **SMALL), "dead_leaves/000000")
    assert picture.signal.shape == (48, 61) and picture.cfa == "MONO" and picture.white_balance == (1, 1, 1)
    assert picture.color_matrix is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"procedural": ("leaves",)}, "procedural = .*give one or more of dead_leaves"),
        ({"procedural": ()}, "give one or more"),
        ({"procedural": ("text", "text")}, "once"),
        ({"count": 0}, "count = 0"),
        ({"width_px": 4}, "width = 4: give 8 to"),
        ({"illuminants": ("D66",)}, "D66: no such illuminant; did you mean"),
        ({"illuminants": ()}, "name one light"),
        ({"white_signal": 0.0}, "white_signal"),
    ],
)
def test_wrong_settings_are_refused(source, changes, message):
    with pytest.raises(PhotositeError, match=message):
        replace(source, **changes)


@pytest.mark.parametrize("name", ["text/1", "text/0000001", "cats/000000", "text", "text/-00001", "text/000000.png"])
def test_a_name_without_a_drawing_is_refused(source, name):
    with pytest.raises(PhotositeError, match=r"no such drawing; give one of dead_leaves"):
        read(source, name)
