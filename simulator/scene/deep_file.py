"""Deep EXR files: any number of samples per pixel, each with colour, alpha and the depth, or range of depths, that it fills."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simulator.errors import PhotositeError, check_file, reading
from simulator.progress import counted_as
from simulator.scene.alpha import SLACK
from simulator.scene.camera_raw import refuse_raw
from simulator.scene.pixel_file import DAMAGED, check_square_pixels, first_fault, opened_picture, unreadable

if TYPE_CHECKING:
    import OpenImageIO as oiio

KEY = "scene.deep"


@dataclass(frozen=True)
class DeepSamples:
    """Samples of a picture, in any order.

    size: (height, width) of the display window. pixel: (n,) int64, row * width + column.
    colour: (n, 1 or 3) float64, times alpha. alpha: (n,) float64, 0 to 1.
    near, far: (n,) float64, depths between which a sample lies, in the file's unit; equal for a surface.
    """

    size: tuple[int, int]
    pixel: np.ndarray
    colour: np.ndarray
    alpha: np.ndarray
    near: np.ndarray
    far: np.ndarray

    def where(self, chosen: np.ndarray) -> np.ndarray:
        """Return the pixels that hold any of the chosen samples, (height, width) bool."""
        pixels = np.zeros(self.size, dtype=bool)
        pixels.ravel()[self.pixel[chosen]] = True
        return pixels


@counted_as("files")
def read_deep(path: Path) -> tuple[DeepSamples, tuple[float, ...] | None, tuple[str, ...]]:
    """Samples, the chromaticities that the file states, and notes for the log.

    Of a file of several parts the first deep one is read. A file without alpha holds opaque samples, one without ZBack surfaces
    (OpenEXR, "Interpreting OpenEXR Deep Pixels").
    Raises PhotositeError for a file that is missing, damaged, raw or not deep, pixels that are not square, channels other than
    R, G, B or Y with Z, NaN, Inf, alpha outside 0 to 1, depth of 0 or less, and a ZBack that is infinite behind a finite Z.
    """
    check_file(path, KEY)
    refuse_raw(path, KEY)
    with reading(path, DAMAGED, key=KEY), opened_picture(path, KEY) as source:
        parts = source.spec().get_int_attribute("oiio:subimages", 1)
        part = _first_deep_part(source, parts, path)
        spec = source.spec()
        check_square_pixels(spec, KEY, path)
        data = source.read_native_deep_image(part, 0)
        if data is None or source.has_error:
            raise unreadable(KEY, path, source.geterror())
        samples, notes = _samples(data, spec, path)
        _check(samples, path)
        np.clip(samples.alpha, 0.0, 1.0, out=samples.alpha)
        notes += (f"{path.name}: has {parts} parts; only the first deep one is read",) if parts > 1 else ()
        return samples, spec.getattribute("chromaticities"), notes


def _first_deep_part(source: "oiio.ImageInput", parts: int, path: Path) -> int:
    """Go to the first deep part of the file and return its number. Raises PhotositeError where there is none."""
    for part in range(parts):
        if not source.seek_subimage(part, 0):
            raise unreadable(KEY, path, source.geterror())
        if source.spec().deep:
            return part
    raise PhotositeError("is no deep picture, it has one colour per pixel; write image: instead of deep:", key=KEY, value=path)


def _samples(data: "oiio.DeepData", spec: "oiio.ImageSpec", path: Path) -> tuple[DeepSamples, tuple[str, ...]]:
    names = list(spec.channelnames)
    colours = ["R", "G", "B"] if {"R", "G", "B"} <= set(names) else ["Y"]
    known = {*colours, "A", "Z", "ZBack"}
    if not {*colours, "Z"} <= set(names) or not set(names) <= known:
        raise PhotositeError(
            f"has channels {', '.join(names)}; needs R, G, B or Y, with Z, and may have A, ZBack", key=KEY, value=path
        )
    count = np.fromiter((data.samples(pixel) for pixel in range(data.pixels)), np.int64, data.pixels)
    occupied = [(pixel, range(samples)) for pixel, samples in enumerate(count.tolist()) if samples]

    def values(name: str) -> np.ndarray:
        channel, value = names.index(name), data.deep_value
        read = (value(pixel, channel, sample) for pixel, samples in occupied for sample in samples)
        return np.fromiter(read, np.float64, int(count.sum()))

    row, column = np.divmod(np.repeat(np.arange(data.pixels), count), spec.width)
    row, column = row + spec.y - spec.full_y, column + spec.x - spec.full_x
    inside = (row >= 0) & (row < spec.full_height) & (column >= 0) & (column < spec.full_width)
    near = values("Z")
    samples = DeepSamples(
        (spec.full_height, spec.full_width),
        (row * spec.full_width + column)[inside],
        np.stack([values(name) for name in colours], axis=1)[inside],
        (values("A") if "A" in names else np.ones(len(near)))[inside],
        near[inside],
        (np.maximum(values("ZBack"), near) if "ZBack" in names else near)[inside],
    )
    cut = int((~inside).sum())
    return samples, ((f"{path.name}: {cut} samples outside the display window are cut off",) if cut else ())


def _check(samples: DeepSamples, path: Path) -> None:
    alpha = samples.alpha
    for fault, what, fix in (
        (np.isnan(samples.colour).any(axis=1) | np.isnan(alpha), "NaN", "render it again without NaN"),
        (np.isinf(samples.colour).any(axis=1) | np.isinf(alpha), "Inf", "render it again without Inf"),
        ((alpha < -SLACK) | (alpha > 1 + SLACK), "alpha outside 0 to 1", "coverage is a share of the pixel: export it again"),
        (~(samples.near > 0) | ~(samples.far > 0), "depth NaN, 0 or less", "give every sample a distance (inf is allowed)"),
        (np.isinf(samples.far) & np.isfinite(samples.near), "ZBack infinite", "end volumes at a finite distance"),
    ):
        if fault.any():
            shown = f", there {alpha[fault][0]:g}" if what.startswith("alpha") else ""
            raise PhotositeError(f"{what} in {first_fault(samples.where(fault))}{shown}; {fix}", key=KEY, value=path)
