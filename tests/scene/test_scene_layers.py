"""Layers are composited, alpha and depth mean what the file says, and each kind of fault has its message."""

from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.photometry import luminance_of_pixels
from helpers.picture_files import write
from helpers.scene_builders import FixedScene

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.input_files import fingerprints
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.color_channels import srgb_to_linear
from simulator.scene.compositing import flatten_layers
from simulator.scene.depth import DepthChannel, DepthImage
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.scene.pixel_file import DataWindow

MITSUBA = Path(__file__).parents[3] / "shared" / "data" / "mitsuba"
SIZE = 6, 8
STRAIGHT = {"oiio:UnassociatedAlpha": 1}  # as OpenImageIO is told that nothing is to be divided before writing


def colours(seed, alpha=None):
    """RGB (6, 8, 3), or RGBA with colours times alpha."""
    rgb = np.random.default_rng(seed).random((*SIZE, 3)).astype(np.float32)
    return rgb if alpha is None else np.dstack([rgb * alpha[..., None], alpha]).astype(np.float32)


def alphas(seed):
    return np.random.default_rng(seed).choice([0.0, 0.25, 0.6, 1.0], SIZE).astype(np.float32)


def exr(path, pixels, names=("R", "G", "B", "A")):
    return write(path, pixels, names[: pixels.shape[2]])


def scene_of(*layers, **settings):
    return LayeredScene(tuple(layers), **({"luminance_cd_m2": 100.0} | settings))


def test_layers_lie_over_one_another_front_to_back(tmp_path):
    """Three layers against the sum in float64: light of each times what those before let through."""
    a, b = alphas(1), alphas(2)
    one, two, wall = colours(3, a), colours(4, b), colours(5)
    layers = [PictureLayer(exr(tmp_path / f"{n}.exr", p), n + 1.0) for n, p in enumerate((one, two, wall))]
    scene = scene_of(*layers).load()
    assert len(scene.layers) == 3 and scene.layers[2].coverage is None
    flat = flatten_layers(scene)
    through = 1.0 - a[..., None].astype(np.float64)
    expected = one[..., :3] + through * two[..., :3] + through * (1.0 - b[..., None]) * wall
    np.testing.assert_allclose(flat.planes, expected, atol=1e-6)
    np.testing.assert_array_equal(scene.planes, one[..., :3])  # the scene itself is left alone


def test_the_depth_seen_is_where_more_than_half_is_covered(tmp_path):
    """By hand: 0.25 then 0.25 then 0.25 let 0.42 through at the third; 0.6 covers at once; nothing covers: infinity."""
    a = np.array([[0.25, 0.6, 0.0, 0.0, 0.5]], np.float32)
    b = np.array([[0.25, 1.0, 1.0, 0.0, 0.0]], np.float32)
    c = np.array([[0.25, 1.0, 1.0, 0.3, 0.25]], np.float32)
    files = [exr(tmp_path / f"{n}.exr", np.dstack([p, p, p, p])) for n, p in enumerate((a, b, c))]
    flat = flatten_layers(scene_of(*(PictureLayer(f, d) for f, d in zip(files, (1.0, 2.0, 3.0), strict=True))).load())
    np.testing.assert_array_equal(flat.depth_m, np.float32([[3, 1, 2, np.inf, 3]]))


def test_straight_and_associated_alpha_give_the_same_layer(tmp_path):
    a, rgb = alphas(1), colours(2)
    associated = exr(tmp_path / "a.exr", np.dstack([rgb * a[..., None], a]))
    straight = exr(tmp_path / "s.exr", np.dstack([rgb, a]))
    mask = exr(tmp_path / "m.exr", a[..., None], ("Y",))
    plain = exr(tmp_path / "p.exr", rgb)
    layers = [
        PictureLayer(associated, 1.0),
        PictureLayer(straight, 1.0, alpha="straight"),
        PictureLayer(plain, 1.0, alpha_image=mask),
        PictureLayer(exr(tmp_path / "q.exr", rgb * a[..., None]), 1.0, alpha="associated", alpha_image=mask),
    ]
    for layer in layers:
        scene = scene_of(layer).load()
        np.testing.assert_allclose(scene.planes, rgb * a[..., None], rtol=1e-6)
        np.testing.assert_array_equal(scene.coverage, a)


@pytest.mark.parametrize("other", ["", "ground."])
def test_alpha_of_another_layer_of_an_exr_is_not_that_of_the_colours(tmp_path, other):
    """OpenImageIO marks the first alpha of a file, whatever layer it is of."""
    a, rgb = alphas(1), colours(2)
    names = tuple(f"{other}{letter}" for letter in "RGBA") + tuple(f"leaf.{letter}" for letter in "RGB")
    file = exr(tmp_path / "l.exr", np.dstack([colours(3, a), rgb]), names)
    covered, bare = (scene_of(PictureLayer(file, 1.0, layer=name)).load() for name in (other[:-1] or None, "leaf"))
    np.testing.assert_array_equal(covered.coverage, a)
    assert bare.coverage is None
    np.testing.assert_array_equal(bare.planes, rgb)
    dropped = [
        any("alpha dropped" in note for note in ImageScene(file, 1.0, layer=name).load().notes)
        for name in (other[:-1] or None, "leaf")
    ]
    assert dropped == [True, False]
    with pytest.raises(PhotositeError, match="alpha = straight: the colours of .*l.exr have no alpha"):
        scene_of(PictureLayer(file, 1.0, layer="leaf", alpha="straight")).load()


def test_a_png_is_straight_and_its_alpha_is_no_srgb(tmp_path):
    codes = np.random.default_rng(1).integers(0, 256, (*SIZE, 4)).astype(np.uint8)
    scene = scene_of(PictureLayer(write(tmp_path / "a.png", codes, **STRAIGHT), 1.0)).load()
    alpha = codes[..., 3] / 255.0
    np.testing.assert_allclose(scene.coverage, alpha, atol=1e-7)
    np.testing.assert_allclose(scene.planes, srgb_to_linear(codes[..., :3] / 255.0) * alpha[..., None], atol=1e-6)


def test_alpha_in_integers_whose_largest_nothing_tells_is_refused(tmp_path):
    np.save(tmp_path / "m.npy", np.full(SIZE, 255))
    layer = PictureLayer(exr(tmp_path / "p.exr", np.ones((*SIZE, 3), np.float32)), 1.0, alpha_image=tmp_path / "m.npy")
    with pytest.raises(PhotositeError, match="alpha_image = .*m.npy: holds int64, .* give uint8, uint16 or floats"):
        scene_of(layer).load()


def test_srgb_codes_times_alpha_are_refused(tmp_path):
    file = write(tmp_path / "a.png", np.full((*SIZE, 4), 100, np.uint8), **STRAIGHT)
    with pytest.raises(PhotositeError, match="scene.layers.0.alpha = associated: .*not in proportion to light"):
        scene_of(PictureLayer(file, 1.0, alpha="associated")).load()
    assert scene_of(PictureLayer(file, 1.0, alpha="associated"), encoding="linear").load().planes.max() < 0.4


def test_the_mean_anchor_is_the_mean_of_what_a_pinhole_sees(tmp_path):
    files = exr(tmp_path / "a.exr", colours(1, alphas(2))), exr(tmp_path / "b.exr", colours(3))
    scene = scene_of(PictureLayer(files[0], 1.0), PictureLayer(files[1], 2.0), luminance_of="mean", illuminant="A").load()
    assert luminance_of_pixels(flatten_layers(scene)).mean() == pytest.approx(100.0, rel=1e-4)


def test_a_grey_layer_among_colours_is_grey_light(tmp_path):
    grey = exr(tmp_path / "g.exr", np.dstack([np.full(SIZE, 0.5), np.full(SIZE, 0.5)]).astype(np.float32), ("Y", "A"))
    scene = scene_of(PictureLayer(grey, 1.0), PictureLayer(exr(tmp_path / "b.exr", 0 * colours(1)), 2.0)).load()
    np.testing.assert_allclose(luminance_of_pixels(flatten_layers(scene)), 50.0, rtol=1e-4)


def test_depth_counts_only_where_a_layer_covers(tmp_path):
    """Renderers write 0 or infinity where nothing stands; there the depth of the nearest covered pixel goes on."""
    alpha, depth = np.zeros(SIZE, np.float32), np.zeros(SIZE, np.float32)
    alpha[2:4, 3:5], depth[2:4, 3:5] = 1.0, [[1.0, 2.0], [3.0, 4.0]]
    pixels = np.dstack([colours(1, alpha), depth]).astype(np.float32)
    file = write(tmp_path / "a.exr", pixels, ("R", "G", "B", "A", "Z"))
    back = PictureLayer(exr(tmp_path / "b.exr", colours(2)), 3.5)
    scene = scene_of(PictureLayer(file, DepthChannel()), back).load()
    np.testing.assert_array_equal(scene.depth_m[2:4, 3:5], depth[2:4, 3:5])
    assert scene.depth_m[0, 0] == 1.0 and scene.depth_m[5, 7] == 4.0
    pixels[3, 4, 4] = np.nan
    write(file, pixels, ("R", "G", "B", "A", "Z"))
    with pytest.raises(PhotositeError, match="scene.layers.0.depth = .* in 1 of 48 pixels, the first at x = 4, y = 3"):
        scene_of(PictureLayer(file, DepthChannel())).load()


@pytest.mark.parametrize("covered", [True, False])
def test_light_of_alpha_0_has_its_own_depth(tmp_path, covered):
    """A flame at 1.2 m, beside what covers at 3.9 m or in a layer without any alpha; what is empty takes another's depth."""
    alpha, depth = np.zeros(SIZE, np.float32), np.full(SIZE, 3.9, np.float32)
    alpha[:, 6:] = covered
    flame = np.dstack([colours(1, alpha), depth]).astype(np.float32)
    flame[:, :3, 1], flame[:, :4, 4] = 0.5, [1.2, 1.2, 1.2, 0.0]
    file = write(tmp_path / "a.exr", flame, ("R", "G", "B", "A", "Z"))
    scene = scene_of(PictureLayer(file, DepthChannel())).load()
    np.testing.assert_array_equal(scene.planes, flame[..., :3])
    np.testing.assert_array_equal(
        scene.depth_m[0], np.float32([1.2] * 4 + [1.2 if not covered else x for x in (1.2, 3.9, 3.9, 3.9)])
    )
    lit = flame[..., :3].any(axis=2)
    np.testing.assert_array_equal(scene.coverage, np.where(lit & (alpha == 0.0), np.float32(1e-6), alpha))
    back = PictureLayer(exr(tmp_path / "b.exr", colours(2)), 1.0)
    with pytest.raises(PhotositeError, match="scene.layers.1.depth = up to 1 m: stands wholly before layer 0.*1.2 m"):
        scene_of(PictureLayer(file, DepthChannel()), back).load()


@pytest.mark.parametrize(
    ("width", "lens", "depths_m"),
    [
        (400, ThinLens(50.0, 32.0, 2.0), (1.2, 4.0)),
        (400, ThinLens(50.0, 500.0, 2.0), (1.2, 4.0)),
        (32, ThinLens(50.0, 16.0, 2.0, diffraction=True), (1.6, 2.0)),
    ],
)
def test_light_of_alpha_0_is_added_to_what_lies_behind(tmp_path, width, lens, depths_m):
    """A glow of 0.5 before a wall of 0.5 is 1, wherever a core with alpha lies: in columns that see nothing of it."""
    glow, one = np.full((24, width, 2), 0.5, np.float32), np.ones((24, width, 1), np.float32)
    glow[..., 1] = 0.0
    glow[:, 84:92, 1] = 0.5
    files = [exr(tmp_path / f"{n}.exr", pixels, ("Y", "A")) for n, pixels in enumerate((glow, 0.5 * one, one))]
    front, wall, bright = (PictureLayer(f, d) for f, d in zip(files, (*depths_m, depths_m[1]), strict=True))
    frame, even = (
        simulate(Shot(scene_of(*layers), lens, Exposure(0.1), green_camera(width, 24), tolerance=0.1)).mean_electrons
        for layers in ((front, wall), (bright,))
    )
    seen = (frame.astype(np.float64) / even)[8:-8, 8:-8]
    np.testing.assert_allclose(np.delete(seen, np.s_[32:132], axis=1), 1.0, atol=2e-3)


def test_a_layer_before_an_earlier_one_is_refused_and_one_that_passes_through_is_not(tmp_path):
    files = [exr(tmp_path / f"{n}.exr", colours(n, alphas(n))) for n in range(3)]
    with pytest.raises(PhotositeError, match="scene.layers.2.depth = up to 1 m: stands wholly before layer 0.*2 m"):
        scene_of(*(PictureLayer(f, d) for f, d in zip(files, (2.0, 3.0, 1.0), strict=True))).load()
    np.save(tmp_path / "slant.npy", np.linspace(1.0, 3.0, 48).reshape(SIZE))
    slant = DepthImage(tmp_path / "slant.npy")
    assert scene_of(PictureLayer(files[0], 2.0), PictureLayer(files[1], slant)).load().behind


def test_a_layer_that_hides_all_is_told_in_a_note(tmp_path):
    files = [exr(tmp_path / f"{n}.exr", colours(n)) for n in range(2)]
    scene = scene_of(PictureLayer(files[0], 1.0), PictureLayer(files[1], 2.0)).load()
    assert any("scene.layers.0 (0.exr) covers all" in note for note in scene.notes)


@pytest.mark.parametrize(
    ("value", "says"),
    [(1.5, "alpha is 1.5 in 1 of 48"), (-0.25, "alpha is -0.25 in 1 of 48"), (np.nan, "NaN in 1 of 48")],
)
def test_alpha_outside_0_to_1_is_refused_with_file_place_and_value(tmp_path, value, says):
    alpha = alphas(1)
    alpha[4, 2] = value
    mask = exr(tmp_path / "m.exr", alpha[..., None], ("Y",))
    with pytest.raises(PhotositeError, match=f"scene.layers.0.alpha_image = .*m.exr: {says} pixels, the first at x = 2, y = 4"):
        scene_of(PictureLayer(exr(tmp_path / "a.exr", colours(1)), 1.0, alpha_image=mask)).load()


WINDOW = (20, 15, 32, 24)


def test_layers_and_alpha_of_other_data_windows_are_refused(tmp_path):
    """Pixels of other parts of a picture do not lie behind one another; files that know no window are taken as they are."""
    a = alphas(1)
    near = write(tmp_path / "near.exr", colours(1, a), tuple("RGBA"), WINDOW)
    beside = write(tmp_path / "beside.exr", colours(2), tuple("RGB"), WINDOW)
    wall = write(tmp_path / "wall.exr", colours(3), tuple("RGB"), (0, 0, 32, 24))
    mask = write(tmp_path / "mask.exr", a[..., None], ("Y",))
    told = "its pixels begin at x = 0, y = 0 of a display window of {}, but those of {} at x = 20, y = 15 of .*32x24; write"
    with pytest.raises(PhotositeError, match=f"scene.layers.1.image = .*wall.exr: {told.format('32x24', 'layer 0')}"):
        scene_of(PictureLayer(near, 1.0), PictureLayer(wall, 2.0)).load()
    with pytest.raises(PhotositeError, match=f"scene.layers.0.alpha_image = .*mask.exr: {told.format('8x6', 'its picture')}"):
        scene_of(PictureLayer(near, 1.0, alpha_image=mask)).load()
    np.save(tmp_path / "wall.npy", colours(3))
    for other in (beside, tmp_path / "wall.npy"):
        scene = scene_of(PictureLayer(near, 1.0), PictureLayer(other, 2.0)).load()
        assert scene.window == DataWindow(*WINDOW)


def test_notes_of_an_alpha_picture_are_passed_on(tmp_path):
    mask = write(tmp_path / "mask.exr", alphas(1)[..., None], ("Y",), WINDOW)
    picture = write(tmp_path / "p.exr", colours(1), tuple("RGB"), WINDOW)
    notes = scene_of(PictureLayer(picture, 1.0, alpha_image=mask)).load().notes
    assert "mask.exr: the data window (8x6) is read, not the display window" in notes


def test_mistakes_name_the_layer(tmp_path):
    good, small = exr(tmp_path / "a.exr", colours(1)), exr(tmp_path / "b.exr", colours(1)[:3, :4])
    negative, bad = exr(tmp_path / "n.exr", -colours(1)), exr(tmp_path / "nan.exr", colours(1) * np.float32(np.nan))
    one = PictureLayer(good, 1.0)
    for other, says in [
        (PictureLayer(small, 1.0), "scene.layers.1.image = .*b.exr: is 4x3 pixels, but the first layer is 8x6"),
        (PictureLayer(negative, 1.0), "scene.layers.1.image = .*n.exr: negative radiance in 48 of 48"),
        (PictureLayer(bad, 1.0), "scene.layers.1.image = .*nan.exr: NaN in 48 of 48"),
        (PictureLayer(tmp_path / "none.exr", 1.0), "scene.layers.1.image = .*none.exr: no such file"),
        (PictureLayer(good, DepthChannel("depth")), "scene.layers.1.depth.channel = depth: no such channel"),
        (PictureLayer(good, 1.0, alpha="straight"), "scene.layers.1.alpha = straight: .*have no alpha"),
        (PictureLayer(good, 1.0, layer="leaf"), "scene.layers.1.image = .*the colour of layer leaf must be"),
        (PictureLayer(good, 1.0, alpha_image=good), "scene.layers.1.alpha_image = .*has channels R, G, B; give"),
        (PictureLayer(good, 1.0, alpha_image=exr(tmp_path / "s.exr", alphas(1)[:2, :, None], ("Y",))), "is 8x2 pixels"),
    ]:
        with pytest.raises(PhotositeError, match=says):
            scene_of(one, other).load()
    with pytest.raises(PhotositeError, match="scene.layers = .*give one layer or more"):
        LayeredScene((), 100.0)
    with pytest.raises(PhotositeError, match="scene.layers.1.depth.along = ray: needs"):
        scene_of(one, PictureLayer(good, DepthChannel(along="ray")))


SHOT = """
scene:
  layers:
    - {image: front.exr, depth: 2.9 m}
    - {image: back.exr, depth: {image: far.npy, unit: mm}}
  luminance: 100 cd/m^2
lens: {focal_length: 50 mm, f_number: f/64, focus_distance: 3 m}
exposure: {time: 1/10 s, iso: 100}
camera: {base: ideal, width: 40, height: 30}
truth: [depth]
"""


def shot_files(tmp_path):
    exr(tmp_path / "front.exr", colours(1, alphas(2)))
    exr(tmp_path / "back.exr", colours(3))
    np.save(tmp_path / "far.npy", np.full(SIZE, 3100.0))
    (tmp_path / "shot.yaml").write_text(SHOT)
    return tmp_path / "shot.yaml"


def test_layers_in_a_shot_file_have_paths_lines_overrides_and_fingerprints(tmp_path):
    path = shot_files(tmp_path)
    shot = load_shot(path, ["scene.layers.0.depth=1.5 m", "scene.layers.1.depth.unit=cm"])
    assert shot.scene.layers[0].image == tmp_path / "front.exr" and shot.scene.layers[0].depth_m == 1.5
    assert shot.scene.load().behind[0].depth_m[0, 0] == pytest.approx(31.0)
    keys = [found["key"] for found in fingerprints(shot.scene)]
    assert keys == ["scene.layers.0.image", "scene.layers.1.image", "scene.layers.1.depth.image"]
    for old, new, says in [
        ("depth: 2.9 m", "depth: 1", "bad.yaml:4: scene.layers.0.depth = 1: has no unit"),
        ("depth: 2.9 m", "depth: -1 m", "bad.yaml:4: scene.layers.0.depth = -1"),
        ("depth: 2.9 m", "dept: 1 m", "bad.yaml:4: scene.layers.0.dept: unknown key; did you mean `depth`"),
        ("luminance: 100 cd/m^2", "chart: flat_field", "keep one of"),
    ]:
        (tmp_path / "bad.yaml").write_text(SHOT.replace(old, new))
        with pytest.raises(PhotositeError, match=says):
            load_shot(tmp_path / "bad.yaml")
    for override in ("scene.layers.2.depth=1 m", "scene.layers.first.depth=1 m"):
        with pytest.raises(PhotositeError, match="the list there has 2 items"):
            load_shot(path, [override])


def test_a_frame_of_layers_is_the_frame_of_their_composite(tmp_path):
    """f/64 blurs nothing here, so the same electrons as of a scene that is flattened in float64 beforehand."""
    shot = load_shot(shot_files(tmp_path))
    assert not {step.stage: step.kept for step in plan(shot).steps}["defocus"]
    raw = simulate(shot)
    scene = shot.scene.load()
    front, back = scene.layers
    over = front.planes.astype(np.float64) + (1.0 - front.coverage[..., None].astype(np.float64)) * back.planes
    flat = type(scene)(over.astype(np.float32), scene.spectra_w_m2_sr_nm, scene.wavelengths_nm, scene.illuminant, 3.0)
    expected = simulate(Shot(FixedScene(flat), shot.lens, shot.exposure, shot.camera)).mean_electrons
    np.testing.assert_allclose(raw.mean_electrons, expected, rtol=1e-5)
    np.testing.assert_allclose(np.unique(raw.truth["depth"]), [2.9, 3.1], rtol=1e-6)


@pytest.mark.skipif(not MITSUBA.exists(), reason="no Mitsuba renders beside the checkout")
@pytest.mark.parametrize("name", ["near_occluder", "both_defocused"])
def test_composed_layers_are_what_mitsuba_renders_through_a_pinhole(tmp_path, name):
    """Its surfaces rendered apart and composed here, against one render of all of them."""
    renders = np.load(MITSUBA / f"{name}.npz")
    layers = []
    for number in (1, 0):  # 1 is the nearer one
        colour, alpha = renders[f"layer{number}_rgb"], renders[f"layer{number}_alpha"]
        file = exr(tmp_path / f"{number}.exr", np.dstack([colour, alpha]), ("Y", "A"))
        np.save(tmp_path / f"{number}.npy", renders[f"layer{number}_depth"])
        layers.append(PictureLayer(file, DepthImage(tmp_path / f"{number}.npy"), alpha="associated"))
    flat = flatten_layers(scene_of(*layers).load())
    truth = renders["pinhole_wide"]
    error = np.abs(flat.planes[..., 0] - truth) / np.maximum(truth, 0.1)
    assert np.median(error) < 1e-3 and np.percentile(error, 95) < 0.05
    covered = np.minimum(renders["layer1_alpha"], 1 - renders["layer1_alpha"]) == 0
    np.testing.assert_allclose(flat.depth_m[covered], renders["depth_wide"][covered], rtol=1e-4)


def test_a_scene_of_one_surface_is_not_copied(tmp_path):
    scene = scene_of(PictureLayer(exr(tmp_path / "a.exr", colours(1)), 1.0)).load()
    camera = small_camera(8, 6)
    planned = plan(Shot(FixedScene(scene), ThinLens(50.0, 8.0, 1.0), Exposure(0.01), camera))
    assert planned.optics.scene is scene
