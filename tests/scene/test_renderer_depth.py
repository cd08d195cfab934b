"""Pictures as renderers write them: Mitsuba 3's own file, and files with the channels that Blender writes."""

from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.picture_files import write

from simulator.config.shot_file import load_shot
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.exposure.vector_maps import BlenderVectors
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.scene.pixel_file import read_pixels
from simulator.scene.renderer_depth import Mist, RendererDepth

MITSUBA = Path(__file__).parents[1] / "files" / "mitsuba.exr"  # made by render_mitsuba.py beside it
BLENDER = RendererDepth("blender")
SIZE = (16, 24)


def axis_cosines(fov_deg):
    """Distance along the axis over that along the ray, at the centres of pixels, in float64."""
    per_px = 2 * np.tan(np.radians(fov_deg / 2)) / SIZE[1]
    x, y = (np.arange(SIZE[1]) - 11.5) * per_px, (np.arange(SIZE[0]) - 7.5) * per_px
    return 1 / np.sqrt(1 + x**2 + y[:, None] ** 2)


def test_depth_of_mitsuba_is_that_of_its_positions():
    file = read_pixels(MITSUBA, "scene.image")
    hit = file.channel("A", "a")
    with np.errstate(invalid="ignore"):
        along_axis = file.channel("pos.Z", "z") / hit  # positions are means over samples, too
    scene = ImageScene(MITSUBA, 100.0, depth_m=RendererDepth("mitsuba", near_clip_m=0.5), field_of_view_deg=50.0).load()
    assert np.array_equal(scene.planes, file.pixels[..., :3])
    assert np.array_equal(np.isinf(scene.depth_m), hit == 0) and 20 < (hit == 0).sum() < 120
    np.testing.assert_allclose(scene.depth_m[hit > 0], along_axis[hit > 0], rtol=3e-3)
    wall = (along_axis > 3.9999) & (along_axis < 4.0001) & (hit == 1)
    assert wall.sum() > 150 and np.abs(scene.depth_m[wall] - 4).max() < 5e-4
    assert ((hit > 0) & (hit < 1)).sum() >= 16  # the wall's edge, whose rays that miss do not bring it nearer


def blender_channels(rng, view="ViewLayer."):
    """Channels of a view layer as Blender names them, and its distances along the axis; a quarter of it is background."""
    axis_m = 1 + 9 * rng.random(SIZE)
    axis_m[:, :6] = 1e10
    ray_m = axis_m / axis_cosines(40)
    with np.errstate(over="ignore"):
        mist = np.clip((ray_m - 0.5) / 20, 0, 1) ** 2
    planes = {f"{view}Combined.{letter}": rng.random(SIZE) for letter in "RGB"}
    planes[f"{view}Combined.A"] = (axis_m < 1e9).astype(float)
    planes |= {f"{view}CryptoObject00.{letter}": rng.random(SIZE) * 1e20 for letter in "rgba"}
    planes |= {f"{view}Depth.Z": axis_m, f"{view}Mist.Z": mist}
    planes |= {f"{view}Vector.{letter}": rng.normal(size=SIZE) for letter in "XYZW"}
    return planes, np.where(axis_m < 1e9, axis_m, np.inf)


def save(path, planes):
    return write(path, np.stack(list(planes.values()), axis=-1).astype(np.float32), tuple(planes))


@pytest.mark.parametrize("mist", [None, Mist(0.5, 20.0)])
def test_a_view_layer_of_blender_is_read_by_its_passes(tmp_path, mist):
    planes, axis_m = blender_channels(np.random.default_rng(1))
    file = save(tmp_path / "render.exr", planes)
    scene = ImageScene(file, 100.0, depth_m=RendererDepth("blender", mist), field_of_view_deg=40.0).load()
    stored = np.stack([planes[f"ViewLayer.Combined.{letter}"] for letter in "RGB"], axis=-1)
    np.testing.assert_allclose(scene.planes, stored, rtol=1e-6)
    np.testing.assert_allclose(scene.depth_m, axis_m, rtol=1e-5)
    assert np.isinf(scene.depth_m[:, :6]).all()
    layer = LayeredScene((PictureLayer(file, BLENDER),), 100.0).load()
    np.testing.assert_allclose(layer.coverage, planes["ViewLayer.Combined.A"], atol=1e-6)  # light of alpha 0 has 1e-6
    velocity = BlenderVectors(file, "ViewLayer.Vector").load(SIZE, 1.0)
    assert velocity.velocity.shape == (*SIZE, 2)


def fringed(path, edge, edge_alpha=0.5):
    """A subject at 2 m on the left, 12 columns wide, then a column in part covered whose depth is `edge`, then nothing."""
    alpha, axis_m = np.zeros(SIZE), np.full(SIZE, 1e10)
    alpha[:, :12], axis_m[:, :12] = 1.0, 2.0
    alpha[:, 12], axis_m[:, 12] = edge_alpha, edge
    return save(path, {"R": alpha, "G": alpha, "B": alpha, "A": alpha, "Z": axis_m})


@pytest.mark.parametrize("edge_alpha", [0.01, 0.5, 0.99])
def test_a_sample_of_depth_beside_a_layers_edge_is_not_its_depth(tmp_path, edge_alpha):
    """Blender takes one sample: it may meet the background in a pixel that the layer covers in part."""
    file = fringed(tmp_path / "a.exr", 1e10, edge_alpha)
    layer = LayeredScene((PictureLayer(file, BLENDER),), 100.0).load()
    assert (layer.depth_m == 2.0).all()


def test_a_layer_that_covers_the_background_is_infinitely_far_there(tmp_path):
    """A sky with alpha 1 is no edge; of a layer without any distance nothing else is known."""
    sky = LayeredScene((PictureLayer(fringed(tmp_path / "a.exr", 1e10, 1.0), BLENDER),), 100.0).load()
    assert (sky.depth_m[:, :12] == 2.0).all() and np.isinf(sky.depth_m[:, 12:]).all()
    smoke = {name: np.full(SIZE, 0.3) for name in "RGBA"} | {"Z": np.full(SIZE, 1e10)}
    assert np.isinf(LayeredScene((PictureLayer(save(tmp_path / "b.exr", smoke), BLENDER),), 100.0).load().depth_m).all()


def test_edges_of_a_layer_in_focus_are_sharp_wherever_samples_of_depth_fell(tmp_path):
    frames = []
    for edge in (2.0, 1e10):
        back = write(tmp_path / "back.exr", np.full((*SIZE, 3), 0.1, np.float32), ("R", "G", "B"))
        layers = PictureLayer(fringed(tmp_path / f"{edge:g}.exr", edge), BLENDER), PictureLayer(back, 4.0)
        shot = Shot(LayeredScene(layers, 100.0), ThinLens(50.0, 8.0, 2.0), Exposure(0.1), small_camera(24, 16), tolerance=0.1)
        frames.append(simulate(shot).mean_electrons)
    np.testing.assert_array_equal(*frames)


def test_parts_of_a_file_are_read_as_its_passes(tmp_path):
    """Blender 5 may write each pass as a part, whose channels have short names."""
    OpenEXR = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    planes, axis_m = blender_channels(np.random.default_rng(2))
    combined = {letter: planes[f"ViewLayer.Combined.{letter}"].astype(np.float16) for letter in "RGBA"}
    parts = [
        OpenEXR.Part({"type": OpenEXR.scanlineimage}, channels, f"ViewLayer.{name}")
        for name, channels in (("Depth", {"V": planes["ViewLayer.Depth.Z"].astype(np.float32)}), ("Combined", combined))
    ]
    OpenEXR.File(parts).write(str(tmp_path / "parts.exr"))
    scene = ImageScene(tmp_path / "parts.exr", 100.0, depth_m=BLENDER).load()
    np.testing.assert_allclose(scene.depth_m, axis_m, rtol=1e-6)
    assert np.array_equal(scene.planes[..., 1], planes["ViewLayer.Combined.G"].astype(np.float16))


@pytest.mark.parametrize("layer", [None, "rendered"])
def test_distances_of_mitsuba_are_over_the_alpha_of_the_colours(tmp_path, layer):
    """Half of a pixel's rays hit a wall 4 m away, so that their mean is 2 m; another layer has an alpha of its own."""
    colour = {f"{layer}.{letter}" if layer else letter: 0.5 for letter in "RGBA"}
    other = {f"{name}.A": 0.125 for name in ("first", "last")}
    values = {"first.A": other["first.A"], **colour, "depth.T": 2.0, "last.A": other["last.A"]}
    file = save(tmp_path / "m.exr", {name: np.full(SIZE, value) for name, value in values.items()})
    depth = RendererDepth("mitsuba", near_clip_m=0.0)
    scene = LayeredScene((PictureLayer(file, depth, layer=layer),), 100.0, field_of_view_deg=40.0).load()
    np.testing.assert_allclose(scene.depth_m, 4.0 * axis_cosines(40.0), rtol=1e-6)
    assert (scene.coverage == 0.5).all()


def test_one_of_several_view_layers_is_named(tmp_path):
    near, near_m = blender_channels(np.random.default_rng(3), "Near.")
    far, far_m = blender_channels(np.random.default_rng(4), "Far.")
    file = save(tmp_path / "render.exr", near | far)
    for layer, depth_m in (("Near", near_m), ("Far.Combined", far_m)):
        scene = ImageScene(file, 100.0, layer=layer, depth_m=BLENDER).load()
        np.testing.assert_allclose(scene.depth_m, depth_m, rtol=1e-6)
    with pytest.raises(PhotositeError, match="layer: and one of Far.Combined, Near.Combined"):
        ImageScene(file, 100.0, depth_m=BLENDER).load()


def test_a_file_of_one_layer_has_its_depth_in_z(tmp_path):
    planes, axis_m = blender_channels(np.random.default_rng(5))
    short = {name.removeprefix("ViewLayer.Combined."): plane for name, plane in planes.items() if "Combined" in name}
    file = save(tmp_path / "render.exr", short | {"Z": planes["ViewLayer.Depth.Z"]})
    scene = ImageScene(file, 100.0, depth_m=BLENDER).load()
    np.testing.assert_allclose(scene.depth_m, axis_m, rtol=1e-6)
    assert not any("channel Z is not used" in note for note in scene.notes)


def test_it_is_written_in_a_shot_file(tmp_path):
    planes, _ = blender_channels(np.random.default_rng(6))
    save(tmp_path / "render.exr", planes)
    (tmp_path / "shot.yaml").write_text(
        "scene: {image: render.exr, luminance: 100 cd/m^2, field_of_view: 40 deg,\n"
        "  depth: {renderer: blender, mist: {start: 50 cm, depth: 20 m}}}\n"
        "lens: {focal_length: 50 mm, f_number: f/2}\nexposure: {time: 1/100 s, iso: 100}\ncamera: ideal\nseeds: {frame: 1}\n"
    )
    shot = load_shot(tmp_path / "shot.yaml")
    assert shot.scene.depth_m == RendererDepth("blender", Mist(0.5, 20.0))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: RendererDepth("mitsuba", Mist(1.0, 2.0)), "scene.depth.mist.*only Blender"),
        (lambda: RendererDepth("blender", near_clip_m=0.1), "scene.depth.near_clip = 0.1 m: only Mitsuba"),
        (lambda: Mist(0.0, 0.0), "scene.depth.mist.depth = 0 m: give a length above 0 m"),
        (lambda: ImageScene(MITSUBA, 1.0, depth_m=RendererDepth("mitsuba")), "scene.depth.along = ray: needs the angles"),
        (lambda: ImageScene(MITSUBA, 1.0, depth_m=BLENDER).load(), "has no Depth pass; switch it on in Blender"),
    ],
)
def test_what_cannot_be_is_refused(make, says):
    with pytest.raises(PhotositeError, match=says):
        make()


def test_a_file_without_rays_is_none_of_mitsuba(tmp_path):
    file = save(tmp_path / "render.exr", blender_channels(np.random.default_rng(7))[0])
    with pytest.raises(PhotositeError, match="0 channels of depth.*aovs has one depth"):
        ImageScene(file, 1.0, depth_m=RendererDepth("mitsuba"), field_of_view_deg=40.0).load()
