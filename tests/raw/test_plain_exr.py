"""EXR files that are written without a library have the bytes that OpenImageIO writes, and the form is checked before."""

import dataclasses
import zlib

import numpy as np
import OpenEXR
import OpenImageIO
import pytest
from helpers.process_memory import reads_memory, resident_bytes
from helpers.raw_frame import random_frame

from simulator.raw.disk_arrays import map_array
from simulator.raw.image_files import PicturePart, put_parts
from simulator.raw.plain_exr import exr_pieces, is_plain
from simulator.raw.software import software
from simulator.raw.truth_exr import truth_parts

RANDOM = np.random.default_rng(1)


def parts_of(height: int, width: int, **changes) -> list[PicturePart]:
    frame = random_frame(height, width, **changes)
    truth = {"variance": RANDOM.uniform(0.0, 9.0, (height, width)).astype(np.float32)}
    return truth_parts(dataclasses.replace(frame, truth=truth))


def write_with_library(path, parts: list[PicturePart]) -> None:
    """The same parts through OpenImageIO's Python binding."""
    specs = []
    for part in parts:
        height, width, _ = part.pixels.shape
        spec = OpenImageIO.ImageSpec(width, height, 1, "float")
        spec.tile_width, spec.tile_height, spec.channelnames = width, min(part.tile_rows, height), part.channels
        for name, value in {"Software": software(), "DateTime": "", "oiio:subimagename": part.name, **part.attributes}.items():
            spec.attribute(name, value)
        specs.append(spec)
    output = OpenImageIO.ImageOutput.create(str(path))
    assert output.open(str(path), tuple(specs))
    for index, (spec, part) in enumerate(zip(specs, parts, strict=True)):
        assert index == 0 or output.open(str(path), spec, "AppendSubimage")
        assert output.write_image(part.pixels)
    assert output.close()


@pytest.mark.parametrize("size", [(96, 128), (64, 22), (130, 31), (22, 300)])
@pytest.mark.parametrize("cfa", ["RGGB", "MONO"])
def test_the_bytes_are_those_of_openimageio(tmp_path, size, cfa):
    parts = parts_of(*size, cfa=cfa, iso=102400)
    assert is_plain(parts)
    put_parts(tmp_path / "own.exr", parts)
    write_with_library(tmp_path / "library.exr", parts)
    assert (tmp_path / "own.exr").read_bytes() == (tmp_path / "library.exr").read_bytes()


def test_openexr_reads_every_part(tmp_path):
    parts = parts_of(70, 50)
    put_parts(tmp_path / "a.exr", parts)
    file = OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True)
    assert [one.name() for one in file.parts] == [part.name for part in parts]
    for one, part in zip(file.parts, parts, strict=True):
        np.testing.assert_array_equal(one.channels[part.channels[0]].pixels, part.pixels[..., 0])


def test_a_view_of_a_larger_array_is_written_as_it_is(tmp_path):
    large = RANDOM.uniform(0.0, 1.0, (80, 90, 1)).astype(np.float32)
    parts = [dataclasses.replace(part, pixels=large[5:75, 7:57]) for part in parts_of(70, 50)]
    put_parts(tmp_path / "view.exr", parts)
    copied = [dataclasses.replace(part, pixels=part.pixels.copy()) for part in parts]
    put_parts(tmp_path / "copy.exr", copied)
    assert (tmp_path / "view.exr").read_bytes() == (tmp_path / "copy.exr").read_bytes()


def test_what_has_another_form_is_left_to_the_library():
    parts = parts_of(30, 40)
    for changes in (
        {"pixels": np.zeros((30, 40, 1), np.uint16)},
        {"pixels": np.zeros((30, 40, 3), np.float32), "channels": ("R", "G", "B")},
        {"tile_rows": 0},
        {"attributes": {"compression": "zips"}},
        {"attributes": {}},
        {"attributes": {"compression": "none", "a" * 32: 1}},
        {"attributes": {"compression": "none", "numbers": (1, 2)}},
    ):
        assert not is_plain([parts[0], dataclasses.replace(parts[1], **changes)])
    assert not is_plain(parts[:1])


@reads_memory
def test_a_frame_that_lies_in_files_is_written_without_its_memory(tmp_path):
    shape = (1024, 8192)
    np.ones(shape, np.float32).tofile(tmp_path / "plane")
    plane = map_array(tmp_path / "plane", shape, np.float32)
    before = resident_bytes()
    parts = [PicturePart(name, plane[..., None], ("Y",), {"compression": "none"}, 64) for name in ("a", "b")]
    for piece in exr_pieces(parts, {}):
        assert zlib.crc32(piece)
    assert resident_bytes() - before < 0.5 * plane.nbytes
