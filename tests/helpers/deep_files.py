"""Deep picture files."""

from collections.abc import Sequence
from pathlib import Path

import OpenImageIO as oiio

SURFACES, VOLUMES = ("R", "G", "B", "A", "Z"), ("R", "G", "B", "A", "Z", "ZBack")
Pixels = Sequence[Sequence[tuple[float, ...]]]  # for each pixel its samples, values in the order of the names


def deep_data(pixels: Pixels, names: Sequence[str]) -> oiio.DeepData:
    """Float samples; pixels: for each, a list of tuples in the order of the names."""
    data = oiio.DeepData()
    data.init(len(pixels), len(names), [oiio.TypeFloat] * len(names), list(names))
    for pixel, samples in enumerate(pixels):
        data.set_samples(pixel, len(samples))
    for pixel, samples in enumerate(pixels):
        for number, values in enumerate(samples):
            for channel, value in enumerate(values):
                data.set_deep_value(pixel, channel, number, float(value))
    return data


def deep_file(
    path: Path,
    width: int,
    pixels: Pixels,
    names: Sequence[str] = SURFACES,
    window: tuple[int, int, int, int] | None = None,
    **attributes: float,
) -> Path:
    """Write pixels in rows of `width`; window: (x, y, full width, full height). attributes: of OpenImageIO."""
    spec = oiio.ImageSpec(width, len(pixels) // width, len(names), oiio.FLOAT)
    spec.channelnames, spec.deep = names, True
    if window:
        spec.x, spec.y, spec.full_width, spec.full_height = window
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec) and output.write_deep_image(deep_data(pixels, names)) and output.close()
    return path
