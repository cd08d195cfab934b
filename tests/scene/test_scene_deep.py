"""Deep pictures: layers over one another are OpenImageIO's own flattening, and every sample keeps its place in depth."""

import re
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from helpers.camera_builders import green_camera
from helpers.deep_files import deep_data, deep_file

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.compositing import composite_planes
from simulator.scene.deep import DeepDepth, DeepScene
from simulator.scene.image import ImageScene
from simulator.sensor.camera.camera import Window

SHARED_EXR = Path(__file__).parents[3] / "shared" / "data" / "openexr-images"
SURFACES, VOLUMES = ("R", "G", "B", "A", "Z"), ("R", "G", "B", "A", "Z", "ZBack")


def over(samples):
    """Front to back in float64: colours and alpha of samples (n, 4 or more) in this order."""
    transmittance, total = 1.0, np.zeros(4)
    for sample in np.asarray(samples, dtype=np.float64):
        total += transmittance * sample[:4]
        transmittance *= 1.0 - sample[3]
    return total


def load(path, **settings):
    return DeepScene(path, **({"luminance_cd_m2": 100.0} | settings)).load()


def composite(scene):
    planes, coverage = composite_planes(scene.layers)
    return np.dstack([planes, np.ones(planes.shape[:2]) if coverage is None else coverage])


def random_surfaces(rng, most):
    alpha = rng.choice([0.2, 0.7, 1.0], rng.integers(0, most + 1))
    return [(*(rng.random(3) * a), a, rng.uniform(1.0, 20.0)) for a in alpha]


@pytest.mark.parametrize("most", [1, 2, 4, 16])
def test_surfaces_in_any_order_compose_to_the_flattening_of_their_sorted_samples(tmp_path, most):
    rng = np.random.default_rng(1)
    pixels = [random_surfaces(rng, 6) for _ in range(60)]
    scene = load(deep_file(tmp_path / "a.exr", 10, pixels), most_layers=most)
    assert len(scene.layers) <= most
    expected = [over(sorted(samples, key=lambda sample: sample[4])) for samples in pixels]
    np.testing.assert_allclose(composite(scene).reshape(-1, 4), expected, atol=1e-6)


@pytest.mark.parametrize("tolerance", [0.1, 0.0])
def test_light_of_alpha_0_is_seen_out_of_focus(tmp_path, tolerance):
    """A glow of 0.5 at 1.2 m before a wall of 0.5 at 4 m is 1."""
    width, height = 48, 32
    glow = deep_file(tmp_path / "glow.exr", width, [[(0.5, 0.0, 1.2), (0.5, 1.0, 4.0)]] * (width * height), ("Y", "A", "Z"))
    white = deep_file(tmp_path / "white.exr", width, [[(1.0, 1.0, 4.0)]] * (width * height), ("Y", "A", "Z"))
    lens, camera = ThinLens(50.0, 32.0, 2.0), green_camera(width, height, window=Window(16, 12, 16, 8))
    frame, even = (
        simulate(Shot(DeepScene(file, 100.0), lens, Exposure(1e-3), camera, tolerance=tolerance)).mean_electrons
        for file in (glow, white)
    )
    np.testing.assert_allclose(frame / even, 1.0, atol=2e-3)


def test_a_deep_picture_of_pixels_that_are_not_square_is_refused(tmp_path):
    file = deep_file(tmp_path / "a.exr", 2, [[(1, 1, 1, 1, 2)]] * 4, PixelAspectRatio=2.0)
    with pytest.raises(PhotositeError, match=r"scene\.deep = .*a\.exr: its pixels are 2 times as wide as high"):
        load(file)


def samples_of(values):
    """(height, width) object array of one float32 sample per pixel."""
    found = np.empty(np.shape(values), dtype=object)
    for place, value in np.ndenumerate(values):
        found[place] = np.array([value], np.float32)
    return found


def test_the_first_deep_part_is_read_wherever_it_stands(tmp_path):
    """Renderers put a flat beauty before the deep part."""
    rng = np.random.default_rng(2)
    flat = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}, dict.fromkeys("RGB", np.ones((3, 4), "f4"))
    colours = {letter: rng.random((3, 4)).astype(np.float32) for letter in "RGB"}
    channels = {
        name: samples_of(values) for name, values in (colours | {"A": np.ones((3, 4)), "Z": np.full((3, 4), 2.0)}).items()
    }
    deep = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}, channels
    for number, order in enumerate(((flat, deep), (flat, flat, deep), (deep, flat))):
        parts = [OpenEXR.Part(dict(header), held, f"part{n}") for n, (header, held) in enumerate(order)]
        with OpenEXR.File(parts) as file:
            file.write(str(tmp_path / f"{number}.exr"))
        scene = load(tmp_path / f"{number}.exr")
        np.testing.assert_array_equal(scene.layers[0].planes, np.stack(list(colours.values()), axis=2))
        assert f"{number}.exr: has {len(order)} parts; only the first deep one is read" in scene.notes
    with OpenEXR.File([OpenEXR.Part(dict(flat[0]), flat[1], f"part{n}") for n in range(2)]) as file:
        file.write(str(tmp_path / "flat.exr"))
    with pytest.raises(PhotositeError, match=r"flat\.exr: is no deep picture, .* write image: instead of deep:"):
        load(tmp_path / "flat.exr")


def volume_pixels(rng):
    """Volumes that overlap, touch, hold surfaces, are opaque, or light without alpha."""
    pixels = []
    for _ in range(40):
        samples = []
        for _ in range(rng.integers(1, 6)):
            near, thickness = rng.integers(1, 9), rng.choice([0, 1, 2, 5])
            alpha = rng.choice([0.0, 0.3, 0.8, 1.0])
            near = near + 0.001 * len(samples) if thickness == 0 else near  # no two surfaces at one depth
            samples.append((*(rng.random(3) * max(alpha, 0.1)), alpha, near, near + thickness))
        pixels.append(samples)
    return pixels


def split_and_merged(pixels):
    """OpenImageIO's tidying of float samples, flattened in float64."""
    data = deep_data(pixels, VOLUMES)
    result = []
    for pixel, samples in enumerate(pixels):
        for depth in sorted({values[channel] for values in samples for channel in (4, 5)}):
            data.split(pixel, depth)
        data.sort(pixel)
        data.merge_overlaps(pixel)
        tidy = [[data.deep_value(pixel, c, s) for c in range(6)] for s in range(data.samples(pixel))]
        result.append(over(sorted(tidy, key=lambda values: values[4:])))
    return np.array(result)


@pytest.mark.parametrize("most", [1, 3, 8])
def test_volumes_are_split_and_merged_as_openimageio_does(tmp_path, most):
    pixels = volume_pixels(np.random.default_rng(2))
    scene = load(deep_file(tmp_path / "v.exr", 8, pixels, VOLUMES), most_layers=most)
    np.testing.assert_allclose(composite(scene).reshape(-1, 4), split_and_merged(pixels), atol=1e-5)


def test_a_part_of_a_fog_has_the_alpha_of_its_thickness(tmp_path):
    """By hand (Beer-Lambert): fog of transmittance 0.2 from 1 to 5 m, a wall in it at 2 m: a quarter of it is in front."""
    fog, wall = (0.4, 0.4, 0.4, 0.8, 1.0, 5.0), (0.0, 0.5, 0.0, 1.0, 2.0, 2.0)
    scene = load(deep_file(tmp_path / "fog.exr", 1, [[fog, wall]], VOLUMES), most_layers=1)
    front = 1.0 - 0.2**0.25
    colour = 0.5 * front + (1.0 - front) * np.array([0.0, 0.5, 0.0])
    np.testing.assert_allclose(scene.planes[0, 0], colour, rtol=1e-6)


def test_opaque_surfaces_keep_colour_and_depth_exactly_in_their_layers(tmp_path):
    """One sample per pixel: every pixel is in one layer, with its own depth; the others continue the nearest."""
    rng = np.random.default_rng(3)
    depth = np.concatenate([rng.uniform(1.0, 1.2, 30), rng.uniform(8.0, 9.0, 30), np.full(4, np.inf)]).astype(np.float32)
    rgb = rng.random((64, 3)).astype(np.float32)
    file = deep_file(tmp_path / "a.exr", 8, [[(*c, 1.0, z)] for c, z in zip(rgb, depth, strict=True)])
    scene = load(file, most_layers=3)
    own = np.stack([np.broadcast_to(1.0, (8, 8)) if la.coverage is None else la.coverage for la in scene.layers])
    assert set(np.unique(own)) <= {0.0, 1.0} and (own.sum(axis=0) == 1.0).all()
    at = own.argmax(axis=0)[None]
    np.testing.assert_array_equal(np.take_along_axis(np.stack([la.depth_m for la in scene.layers]), at, 0).ravel(), depth)
    np.testing.assert_array_equal(sum(la.planes for la in scene.layers).reshape(-1, 3), rgb)
    near = scene.layers[0]
    assert (near.coverage.ravel()[:30] == 1.0).all() and not near.coverage.ravel()[30:].any()  # the gap is the border
    assert near.depth_m.max() < 1.3  # also where it covers nothing


def test_layers_are_ordered_in_depth_at_every_pixel(tmp_path):
    rng = np.random.default_rng(4)
    pixels = [random_surfaces(rng, 6) or [(0.1, 0.1, 0.1, 1.0, 30.0)] for _ in range(60)]
    layers = load(deep_file(tmp_path / "a.exr", 10, pixels), most_layers=4).layers
    ranges = []
    for layer in layers:
        covered = layer.depth_m if layer.coverage is None else layer.depth_m[layer.coverage > 0]
        ranges.append((covered.min(), covered.max()))
    assert len(layers) == 4 and all(first[1] < second[0] for first, second in zip(ranges, ranges[1:], strict=False))


def test_units_scale_and_rays_apply_to_both_ends_of_a_volume(tmp_path):
    file = deep_file(tmp_path / "a.exr", 3, [[(0.1, 0.1, 0.1, 0.5, 100.0, 300.0)]] * 3, VOLUMES)
    scene = load(file, depth=DeepDepth("cm", 2.0, "ray"), field_of_view_deg=90.0, most_layers=1)
    mean_m = 1.0 / (0.5 / 2.0 + 0.5 / 6.0)  # the mean of 1/depth of a volume of 2 to 6 m
    cosine = 1.0 / np.sqrt(1.0 + (2.0 / 3.0) ** 2)  # of the centre of the outer third of tan 45 degrees
    np.testing.assert_allclose(scene.depth_m, [[mean_m * cosine, mean_m, mean_m * cosine]], rtol=1e-6)
    with pytest.raises(PhotositeError, match="scene.depth.along = ray: needs"):
        DeepScene(file, 100.0, depth=DeepDepth(along="ray"))


def test_the_display_window_is_the_picture(tmp_path):
    """Empty where there is no data; what lies outside is cut off and noted."""
    file = deep_file(tmp_path / "a.exr", 2, [[(1.0, 0.5, 0.2, 1.0, 2.0)]] * 4, window=(3, -1, 4, 3))
    scene = load(file)
    assert scene.planes.shape == (3, 4, 3) and scene.planes[0, 3].tolist() == pytest.approx([1.0, 0.5, 0.2])
    assert scene.coverage.sum() == 1.0 and any("3 samples outside the display window" in note for note in scene.notes)


def test_a_grey_deep_file_without_alpha_is_opaque(tmp_path):
    scene = load(deep_file(tmp_path / "a.exr", 2, [[(0.25, 3.0), (1.0, 5.0)], [(0.5, 4.0)]], ("Y", "Z")))
    assert composite_planes(scene.layers)[0].ravel().tolist() == [0.25, 0.5]


@pytest.mark.parametrize(
    ("sample", "says"),
    [
        ((np.nan, 0, 0, 1, 1), "NaN in 1 of 6 pixels, the first at x = 1, y = 1"),
        ((np.inf, 0, 0, 1, 1), "Inf in 1 of 6 pixels, the first at x = 1, y = 1"),
        ((0, 0, -0.5, 1, 1), "negative radiance in 1 of 6 pixels, the first at x = 1, y = 1 .*, down to -0.5"),
        ((0, 0, 0, 1.5, 1), "alpha outside 0 to 1 in 1 of 6 pixels, the first at x = 1, y = 1 .*, there 1.5"),
        ((0, 0, 0, 1, 0), "depth NaN, 0 or less in 1 of 6 pixels, the first at x = 1, y = 1"),
        ((0, 0, 0, 1, np.nan), "depth NaN, 0 or less in 1 of 6"),
    ],
)
def test_bad_samples_are_refused_with_place(tmp_path, sample, says):
    good = [(0.1, 0.1, 0.1, 1.0, 1.0)]
    file = deep_file(tmp_path / "bad.exr", 3, [good, good, good, good, [*good, sample], []])
    with pytest.raises(PhotositeError, match=f"scene.deep = .*bad.exr: {says}"):
        load(file)


def test_negative_samples_are_set_to_0_when_asked(tmp_path):
    scene = load(deep_file(tmp_path / "a.exr", 1, [[(-0.5, 0.5, 0.5, 1.0, 1.0)]]), negative="clip")
    assert scene.planes.ravel().tolist() == [0.0, 0.5, 0.5] and "set to 0 in 1 of 1 pixels" in " ".join(scene.notes)


def test_files_that_are_no_deep_picture_are_one_message(tmp_path):
    good = deep_file(tmp_path / "a.exr", 8, [[(0.1, 0.1, 0.1, 1.0, float(z))] for z in range(1, 65)])
    for name, content, says in [
        ("cut.exr", good.read_bytes()[:-200], "cannot be read"),
        ("text.exr", b"no picture", "cannot be read"),
    ]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(PhotositeError, match=f"scene.deep = .*{name}: {says}"):
            load(tmp_path / name)
    for names, says in [(("R", "G", "B", "A"), "has channels R, G, B, A; needs"), ((*SURFACES[:4], "AR", "Z"), "has channels")]:
        with pytest.raises(PhotositeError, match=says):
            load(deep_file(tmp_path / "c.exr", 1, [[(0.1,) * len(names)]], names))
    with pytest.raises(PhotositeError, match="holds no samples"):
        load(deep_file(tmp_path / "e.exr", 2, [[], []]))
    with pytest.raises(PhotositeError, match="no such file"):
        load(tmp_path / "none.exr")
    with pytest.raises(PhotositeError, match="write deep: instead of image:"):
        ImageScene(good, 100.0).load()
    flat = oiio.ImageBuf(oiio.ImageSpec(2, 2, 3, oiio.FLOAT))
    assert flat.write(str(tmp_path / "flat.exr"))
    with pytest.raises(PhotositeError, match="is no deep picture.*write image: instead of deep:"):
        load(tmp_path / "flat.exr")
    with pytest.raises(PhotositeError, match="scene.most_layers = 0: give 1 to 16"):
        DeepScene(good, 100.0, most_layers=0)


def test_a_deep_scene_in_a_shot_file(tmp_path):
    deep_file(tmp_path / "a.exr", 1, [[(0.1, 0.1, 0.1, 1.0, 150.0)]])
    (tmp_path / "shot.yaml").write_text(
        "scene: {deep: a.exr, luminance: 100 cd/m^2, depth: {unit: cm}, most_layers: 2}\n"
        "lens: {focal_length: 50 mm, f_number: f/4}\nexposure: {time: 1/100 s, iso: 100}\ncamera: ideal\n"
    )
    scene = load_shot(tmp_path / "shot.yaml").scene
    assert scene.deep == tmp_path / "a.exr" and scene.load().depth_m.item() == pytest.approx(1.5)


@pytest.mark.skipif(not SHARED_EXR.exists(), reason="no OpenEXR sample pictures beside the checkout")
@pytest.mark.parametrize("name", ["Balls", "Leaves", "Trunks"])
def test_the_deep_sample_pictures_compose_to_openimageios_flattening(name):
    file = SHARED_EXR / f"{name}.exr"
    scene = load(file)
    deep = oiio.ImageBuf(str(file))
    flat = oiio.ImageBufAlgo.flatten(deep).get_pixels()[..., :4]
    spec = deep.spec()
    window = slice(spec.y, spec.y + spec.height), slice(spec.x, spec.x + spec.width)
    expected = np.zeros((spec.full_height, spec.full_width, 4))
    expected[window] = flat
    assert len(scene.layers) == 4 and re.search(r"4 layers; in 0\.\d % of its pixels", scene.notes[-1])
    np.testing.assert_allclose(composite(scene), expected, atol=1e-5)
