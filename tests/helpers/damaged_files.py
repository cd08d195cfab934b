"""Small good files of every kind that users give, what reads each, and damage to their bytes."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_gen.sources.linear_images import LinearImages
from data_gen.sources.photographs import Photographs
from data_gen.storage.manifest import MANIFEST, read_manifest, write_manifest
from data_gen.storage.reading import read_samples
from data_gen.storage.shards import plan_shards, write_shard
from data_gen.storage.writers.writer import WriterOptions, find_writer
from helpers.bad_input import SHOT
from helpers.camera_builders import small_camera
from helpers.deep_files import deep_file
from helpers.picture_files import put, write
from helpers.raw_frame import random_frame
from helpers.toy_samples import toy_sample
from simulator.config import load_camera, load_shot, load_sweep
from simulator.measurement.statistics.inspection import inspect_raw
from simulator.optics.psf.psf_file import read_psf
from simulator.raw.development import develop
from simulator.raw.dng.writer import write_dng
from simulator.raw.dng.xmp import read_provenance
from simulator.raw.raw_reader import read_raw_file
from simulator.raw.truth_exr import read_twin, write_twin
from simulator.scene.deep import DeepScene
from simulator.scene.depth import DepthImage
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.scene.renderer_depth import RendererDepth
from simulator.scene.spectral_cube import SpectralCubeScene

FILES = Path(__file__).parents[1] / "files"
HEADER = 400  # bytes at the beginning that are damaged more often than the rest, since they say how to read it
CAMERA = """\
make: A
model: B
width: 64
height: 48
pixel_pitch: 4 um
cfa: RGGB
bit_depth: 12
black_level: 64 DN
response: {file: sony_a7s2}
color_matrix: {xyz_to_camera: [[0.58, -0.14, -0.02], [-0.35, 1.15, 0.23], [-0.07, 0.19, 0.58]]}
iso_table:
  100: {gain: 0.1 DN/e-, read_noise: 2 DN}
  "200": {gain: 0.2 DN/e-, read_noise: 3 DN, row_noise: 0.1 DN}
stages:
  full_well: {capacity: 20000 e-}
  dark_current: {rate: 0.1 e-/s}
"""

RESULTS = """\
<results model="B" iso="100">
  <info>
    <width><Value>64</Value></width><height><Value>48</Value></height>
    <bit_depth><Value>12</Value></bit_depth><pixel_size><Value>4</Value></pixel_size>
  </info>
  <sensitivity><K><Value>0.1</Value></K><QE><Value>50</Value></QE><sigma_d><Value>20</Value></sigma_d></sensitivity>
</results>
"""


@dataclass(frozen=True)
class Role:
    """A file in one of its uses. name: of the file in a folder. make: writes it, with what it needs beside. read: reads it."""

    name: str
    make: Callable[[Path], object]
    read: Callable[[Path], object]


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return the bytes of a file with one of five kinds of damage."""
    kind, size = rng.integers(5), len(content)
    place = int(rng.integers(min(size, HEADER) if rng.random() < 0.6 else size))
    some = rng.integers(1, 9)
    if kind == 0:
        return content[:place]
    if kind == 1:
        return content[:place] + rng.bytes(some) + content[place:]
    if kind == 2:
        return content[:place] + content[place + some :]
    if kind == 3:
        return content[:place] + bytes([rng.choice([0, 255])]) * some + content[place + some :]
    spoilt = bytearray(content)
    for _ in range(some):
        spoilt[place] = int(rng.integers(256))
        place = int(rng.integers(min(size, HEADER) if rng.random() < 0.6 else size))
    return bytes(spoilt)


def _exr(path: Path, channels: tuple[str, ...] = ("R", "G", "B"), **attributes: object) -> Path:
    pixels = np.random.default_rng(len(channels)).random((8, 12, len(channels))).astype(np.float32)
    return write(path, pixels, channels, **attributes)


def _good(path: Path) -> Path:
    """Write a good picture beside a file."""
    return _exr(path.with_name("good.exr"))


def _image(path: Path) -> object:
    return ImageScene(path, luminance_cd_m2=100.0).load()


def _depth(path: Path) -> object:
    return ImageScene(_good(path), luminance_cd_m2=100.0, depth_m=DepthImage(path)).load()


def _alpha(path: Path) -> object:
    layers = PictureLayer(_good(path), 1.0, alpha_image=path), PictureLayer(_good(path), 2.0)
    return LayeredScene(layers, luminance_cd_m2=100.0).load()


def _layer(path: Path) -> object:
    return LayeredScene((PictureLayer(path, 1.0), PictureLayer(_good(path), 2.0)), luminance_cd_m2=100.0).load()


def _wavelengths(path: Path) -> object:
    cube = path.with_name("cube.npy")
    np.save(cube, np.ones((4, 6, 3), np.float32))
    return SpectralCubeScene(cube, wavelengths=path, luminance_cd_m2=100.0).load()


def _dng(path: Path) -> None:
    shot = {"name": "a", "exposure": {"iso": 400}}
    write_dng(random_frame(24, 32, resolved={"shot": shot, "inputs": [], "versions": {}}), path)


def _shot(path: Path) -> None:
    _exr(path.with_name("good.exr"))
    path.write_text(SHOT)


def _sweep(path: Path) -> None:
    _exr(path.with_name("good.exr"))
    path.write_text(SHOT + "sweep: {vary: {exposure.time: {from: 1/60 s, to: 1/30 s, steps: 3}, exposure.iso: [100, 200]}}\n")


def _points(path: Path) -> list[object]:
    sweep = load_sweep(path)
    return [] if sweep is None else [point.shot() for point in sweep]


def _sidecar(path: Path) -> None:
    _shot(path.with_name("shot.yaml"))
    content = {"shot": load_shot(path.with_name("shot.yaml")).resolved, "versions": {"photosite": "0"}}
    path.write_text(json.dumps(content))


def _set_of(kind: str) -> Callable[[Path], None]:
    """Return what writes a data set of one shard into the folder of a file, which it is part of."""

    def make(path: Path) -> None:
        plan = plan_shards(2, 2)
        samples = [toy_sample(index, height=4, width=6) for index in range(2)]
        write_shard(path.parent, plan[0], find_writer(kind), samples, WriterOptions(), "abc")
        write_manifest(path.parent, plan, "abc", WriterOptions())

    return make


def _samples(path: Path) -> list[object]:
    return list(read_samples(path.parent))


def _linear(path: Path) -> object:
    return LinearImages(path.parent, small_camera()).read(path.name, np.random.default_rng(0))


def _photograph(path: Path) -> object:
    return Photographs(path.parent, small_camera(), "brooks2019").read(path.name, np.random.default_rng(0))


def _psf_npz(path: Path) -> None:
    kernels = np.full((2, 1, 1, 3, 3), 1 / 9)
    np.savez(path, kernels=kernels, blur_radii_px=[0.0, 1.0], fields=[0.0])


def _copied(name: str) -> Callable[[Path], None]:
    """Return what copies a file of tests/files."""

    def make(path: Path) -> None:
        path.write_bytes((FILES / name).read_bytes())

    return make


def _envi(path: Path) -> None:
    path.write_bytes((FILES / "envi.hdr").read_bytes())
    path.with_suffix(".img").write_bytes((FILES / "envi.img").read_bytes())


def _cube(path: Path) -> object:
    return SpectralCubeScene(path, luminance_cd_m2=100.0).load()


def _render(path: Path) -> object:
    return ImageScene(path, 100.0, depth_m=RendererDepth("mitsuba", near_clip_m=0.5), field_of_view_deg=50.0).load()


NAMED = {"photosite:note": "a text that says what this picture is", "Software": "somebody's renderer"}
ROLES = {
    "image, EXR": Role("a.exr", lambda path: _exr(path, ("R", "G", "B", "A", "Z"), **NAMED), _image),
    "image, npy": Role("a.npy", lambda path: np.save(path, np.ones((8, 12, 3), np.float32)), _image),
    "image, PNG": Role("a.png", lambda path: put(path, np.full((8, 12, 3), 200, np.uint8)), _image),
    "image, TIFF": Role("a.tif", lambda path: put(path, np.full((8, 12, 3), 200, np.uint16)), _image),
    "image, HDR": Role("a.hdr", lambda path: put(path, np.full((8, 12, 3), 0.5, np.float32)), _image),
    "depth, EXR": Role("z.exr", lambda path: _exr(path, ("Z",), **NAMED), _depth),
    "depth, npy": Role("z.npy", lambda path: np.save(path, np.ones((8, 12))), _depth),
    "alpha, EXR": Role("m.exr", lambda path: _exr(path, ("A",), **NAMED), _alpha),
    "layer, EXR": Role("l.exr", lambda path: _exr(path, ("R", "G", "B", "A"), **NAMED), _layer),
    "cube, EXR": Role(
        "c.exr",
        lambda path: _exr(path, ("450nm", "550nm", "650nm"), **NAMED),
        _cube,
    ),
    "cube, .mat": Role("c.mat", _copied("isetcam_linear.mat"), _cube),
    "cube, ENVI": Role("c.hdr", _envi, _cube),
    "render, EXR": Role("r.exr", _copied("mitsuba.exr"), _render),
    "wavelengths, npy": Role("w.npy", lambda path: np.save(path, np.array([450.0, 550.0, 650.0])), _wavelengths),
    "data sheet": Role("sheet.xml", lambda path: path.write_text(RESULTS), lambda path: load_camera(str(path))),
    "wavelengths, text": Role("w.csv", lambda path: path.write_text("wavelength\n450, 550\n650\n"), _wavelengths),
    "deep, EXR": Role(
        "d.exr",
        lambda path: deep_file(path, 3, [[(0.1, 0.2, 0.3, 0.5, 1.0 + n), (0.1, 0.1, 0.1, 1.0, 3.0)] for n in range(6)]),
        lambda path: DeepScene(path, luminance_cd_m2=100.0).load(),
    ),
    "PSF, npy": Role("p.npy", lambda path: np.save(path, np.full((3, 3), 1 / 9)), lambda path: read_psf(path, 4.0)),
    "PSF, npz": Role("p.npz", _psf_npz, lambda path: read_psf(path, 4.0)),
    "PSF, text": Role(
        "p.txt",
        lambda path: path.write_text("Data spacing is 1.00 um\nCenter point is: 2, 2\n" + "1 2 1\n" * 3),
        lambda path: read_psf(path, 4.0),
    ),
    "raw file": Role("a.dng", _dng, read_raw_file),
    "raw file, inspected": Role("b.dng", _dng, inspect_raw),
    "raw file, developed": Role("c.dng", _dng, lambda path: develop(path, output="linear_srgb", half_size=True)),
    "raw file, provenance": Role("d.dng", _dng, read_provenance),
    "truth twin": Role("a.truth.exr", lambda path: write_twin(random_frame(8, 12), path), read_twin),
    "shot, YAML": Role("s.yaml", _shot, load_shot),
    "sweep, YAML": Role("t.yaml", _sweep, _points),
    "shot, JSON": Role("s.json", _sidecar, load_shot),
    "camera, YAML": Role("c.yaml", lambda path: path.write_text(CAMERA), lambda path: load_camera(f"{path}")),
    "source, EXR": Role("e.exr", lambda path: _exr(path, **NAMED), _linear),
    "source, JPEG": Role("e.jpg", lambda path: put(path, np.full((8, 12, 3), 200, np.uint8)), _photograph),
    "data set, manifest": Role(MANIFEST, _set_of("webdataset"), lambda path: (read_manifest(path.parent), _samples(path))),
    "data set, tar": Role("shard-00000-of-00001.tar", _set_of("webdataset"), _samples),
    "data set, HDF5": Role("shard-00000-of-00001.h5", _set_of("hdf5"), _samples),
}
