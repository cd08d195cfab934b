"""A data set's file: what it says is what is built, and what is wrong with it is named with file, line and fix."""

from pathlib import Path

import pytest

from data_gen.recipe.dataset_config import DataSet
from data_gen.sources.collections import open_collection
from data_gen.sources.data_set import DataSetSamples
from data_gen.sources.linear_images import LinearImages
from data_gen.sources.photographs import Photographs
from data_gen.sources.procedural import Procedural
from data_gen.sources.raw_files import RawFiles
from data_gen.sources.shots import Shots
from data_gen.sources.spectral_cubes import SpectralCubes
from simulator.config import dump_yaml, load_file
from simulator.config.distributions import LogUniform, Normal
from simulator.errors import PhotositeError

ROOT = Path(__file__).parents[3]
SHIPPED = sorted((ROOT / "configs" / "datasets").glob("*.yaml"))

TEXT = """\
count: 10
crop: [64, 96]
pictures:
  leaves: {procedural: [dead_leaves], count: 30}
  photos: {photographs: pictures, illuminants: [A]}
picture_weights: {leaves: 2}
noise:
  exposure_time: 1/60 s
  cameras:
    sony_a7s2: {iso: {measured: [1600, 6400]}, weight: 3}
    cropped:
      camera: {base: imx385, bit_depth: 12}
      iso: {log_uniform: [1600, 3200]}
exposure_ratio: {log_uniform: [1, 300]}
mode: burst
burst: {frames: 4, shift: {normal: [0, 2], within: [-3, 3]}}
writer: {format: hdf5, channels: rggb, samples_per_shard: 5}
"""


def loaded(tmp_path, text: str = TEXT, *settings: str) -> DataSet:
    path = tmp_path / "set.yaml"
    path.write_text(text, encoding="utf-8")
    return load_file(DataSet, path, settings)


def test_a_file_says_what_is_built(tmp_path):
    config = loaded(tmp_path)
    assert config.crop_px == (64, 96) and config.frames == 4 and config.weights == (2.0, 1.0)
    assert config.exposure_ratio == LogUniform((1.0, 300.0)) and config.burst.shift_px == Normal((0.0, 2.0), (-3.0, 3.0))
    choices = config.noise.cameras
    assert choices["sony_a7s2"].camera.model == "ILCE-7SM2" and choices["sony_a7s2"].weight == 3
    assert choices["sony_a7s2"].range() == (1600, 2000, 2500, 3200, 4000, 5000, 6400)
    assert choices["cropped"].range() == (1600, 3200) and config.noise.exposure_time_s == pytest.approx(1 / 60)
    photos = config.pictures["photos"](camera=choices["cropped"].camera)
    assert photos.photographs == tmp_path / "pictures" and photos.illuminants == ("A",)


def test_the_resolved_configuration_loads_again_as_the_same(tmp_path):
    config = loaded(tmp_path)
    again = loaded(tmp_path, dump_yaml(config.resolved))
    assert again.resolved == config.resolved
    assert again.noise.cameras["cropped"].camera.iso_table == config.noise.cameras["cropped"].camera.iso_table


def test_single_values_are_set_after_another_camera_is_chosen(tmp_path):
    settings = ("noise.cameras.cropped.camera.black_level=250 DN", "noise.cameras.cropped.camera=imx385", "count=3")
    config = loaded(tmp_path, TEXT, *settings)
    assert config.noise.cameras["cropped"].camera.black_level_dn == 250 and config.count == 3


def test_a_prior_brings_its_ratio_of_light(tmp_path):
    text = "count: 1\ncrop: [64, 64]\nmode: dark\nnoise: {prior: eld, camera: sony_a7s2}\n"
    assert loaded(tmp_path, text).ratio_distribution.uniform == (100.0, 300.0)
    assert loaded(tmp_path, text + "exposure_ratio: 2\n").ratio_distribution == 2.0


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_configurations_load(path):
    assert load_file(DataSet, path).count >= 1


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("crop:", "corp:", r"set.yaml:2: corp: unknown key; did you mean `crop`"),
        ("count: 30", "cuont: 30", r"set.yaml:4: pictures.leaves.cuont: unknown key; did you mean `count`"),
        ("dead_leaves", "dead_leafs", r"set.yaml:4: pictures.leaves.procedural.0 = dead_leafs.*dead_leaves"),
        ("[A]", "[B9]", r"pictures.photos.*B9"),
        ("leaves: 2", "leafs: 2", r"set.yaml:6: picture_weights = leafs: no such collection"),
        ("sony_a7s2:", "sony_a7s3:", r"set.yaml:10: camera = sony_a7s3.*did you mean `sony_a7s2`"),
        ("[1600, 6400]", "[6401, 7000]", r"set.yaml:10: noise.cameras.sony_a7s2.measured = .*not measured between them"),
        (
            "[1600, 6400]",
            "[1600, 819200]",
            r"set.yaml:10: .*measured = .*was measured from ISO 50 to 25600; give a range within",
        ),
        ("[1600, 6400]", "[25, 6400]", r"set.yaml:10: .*measured = .*was measured from ISO 50 to 25600; give a range within"),
        (
            "log_uniform: [1600, 3200]",
            "uniform: [100, 3200]",
            r"set.yaml:13: noise.cameras.cropped.iso = 100: .*not measured there, but at 1600",
        ),
        (
            "{measured: [1600, 6400]}",
            "{log_uniform: [100, 6400]}",
            r"set.yaml:10: noise.cameras.sony_a7s2.iso = 1789: .*not measured there, but at 50 to 1600 and 2000",
        ),
        ("{base: imx385, bit_depth: 12}", "ideal", r"set.yaml:1\d: .*MONO.*2x2 colour filter"),
        (
            "{base: imx385, bit_depth: 12}",
            "{base: imx385, hdr_readout: {exposures: [1, 0.25]}}",
            r"hdr_readout = given: .*each photosite out alone, and once",
        ),
        ("[1, 300]", "[0, 300]", r"set.yaml:14: exposure_ratio.log_uniform = .*above 0"),
        ("frames: 4", "frames: 1", r"set.yaml:16: burst.frames = 1: give 2 to 64"),
        ("[64, 96]", "[64, 97]", r"set.yaml:2: crop = \[64, 97\]: give height and width, even"),
        ("format: hdf5", "format: hdf6", r"set.yaml:17: writer.format = hdf6: give one of .*hdf5"),
        (
            "format: hdf5, channels: rggb, samples_per_shard: 5",
            "format: eld, channels: rgbg, samples_per_shard: 100000001",
            r"writer.samples_per_shard = 100000001: give 1 to 100000000",
        ),
        ("mode: burst", "mode: bursts", r"set.yaml:15: mode = bursts: did you mean `burst`"),
        (
            "mode: burst",
            "mode: {burst: {frames: 4}}",
            r"set.yaml:15: mode is a section: write `mode: burst`, and its .*`burst:`",
        ),
        ("1/60 s", "1/60", r"set.yaml:8: noise.exposure_time = 1/60: has no unit"),
        ("count: 10", "count: 0", r"set.yaml:1: count = 0"),
    ],
)
def test_what_is_wrong_is_named_with_file_line_and_fix(tmp_path, old, new, message):
    assert TEXT.count(old) == 1 or old.endswith(":")
    with pytest.raises(PhotositeError, match=message):
        loaded(tmp_path, TEXT.replace(old, new, 1))


@pytest.mark.parametrize(
    "section, kind",
    [
        ("{procedural: [text], illuminants: [A]}", Procedural),
        ("{photographs: p, inverse_isp: brooks2019}", Photographs),
        ("{linear_images: p, negative: clip}", LinearImages),
        ("{spectral_cubes: p, quantity: radiance}", SpectralCubes),
        ("{raw_files: p}", RawFiles),
        ("{shot: p.yaml}", Shots),
        ("{data_set: p}", DataSetSamples),
    ],
)
def test_the_key_of_a_collection_says_its_kind(tmp_path, section, kind):
    config = loaded(tmp_path, f"count: 1\ncrop: [64, 64]\npictures: {{c: {section}}}\nnoise: {{cameras: {{imx385: {{}}}}}}\n")
    assert isinstance(open_collection(config.pictures, "c", config.noise.list_cameras()[0]), kind)
    assert loaded(tmp_path, dump_yaml(config.resolved)).resolved == config.resolved


def test_samples_of_pictures_need_pictures(tmp_path):
    with pytest.raises(PhotositeError, match="pictures = {}: this mode cuts samples from pictures"):
        loaded(tmp_path, "count: 1\ncrop: [64, 64]\nnoise: {cameras: {sony_a7s2: {}}}\n")
