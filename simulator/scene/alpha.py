"""Coverage of a picture: its alpha channel, or alpha in a picture of its own."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.scene.pixel_file import PixelFile, check_finite, check_window, first_fault, largest_code, read_pixels

Alpha = Annotated[
    Literal["auto", "associated", "straight"],
    "whether colours come multiplied by alpha; auto: as the kind of file has it (EXR associated, PNG straight)",
]
SLACK = 1e-3  # of renderers' filters and half floats beyond 0 and 1; more is an error
LEAST_COVERAGE = 1e-6  # of a pixel with light: blur looks for light where a layer covers something


def load_coverage(
    file: PixelFile, own: np.ndarray | None, alpha: Alpha, alpha_image: Path | None, key: str
) -> tuple[np.ndarray | None, bool, tuple[str, ...]]:
    """Coverage (height, width) float32 of 0 to 1, None when all is covered; whether the colours are straight; and notes.

    own: alpha of the file's colours as stored, (height, width); None: they have none.
    Colours with an alpha picture of their own are straight unless `alpha` says otherwise.
    key: section of the layer, for messages. Raises PhotositeError for alpha outside 0 to 1, NaN, or of another size.
    """
    straight = alpha == "straight" or alpha == "auto" and (file.straight_alpha or alpha_image is not None)
    notes: tuple[str, ...] = ()
    if alpha_image is not None:
        key, path = f"{key}.alpha_image", alpha_image
        other = read_pixels(path, key)
        stored, notes = _alpha_of(other, key), other.notes
        if stored.shape != file.size:
            raise PhotositeError(
                f"is {stored.shape[1]}x{stored.shape[0]} pixels, but its picture is "
                f"{file.size[1]}x{file.size[0]}; export both at one size",
                key=key,
                value=path,
            )
        check_window(path, key, other.window, file.window, "its picture")
    elif own is not None:
        key, path, stored = f"{key}.image", file.path, own
    else:
        require(
            alpha == "auto",
            f"{key}.alpha",
            alpha,
            f"the colours of {file.path} have no alpha; leave it out, or give alpha_image",
        )
        return None, straight, ()
    coverage = unit_range(stored, key, path)
    return (None if coverage.min() == 1.0 else coverage), straight, notes


def cover_light(planes: np.ndarray, coverage: np.ndarray | None) -> np.ndarray | None:
    """Return coverage of at least LEAST_COVERAGE wherever a plane is above 0: flames and glows may have light and alpha 0.

    planes: (height, width, bands) of a layer. coverage: (height, width) float32, or None; itself where all light has it.
    """
    if coverage is None:
        return None
    bare = coverage < LEAST_COVERAGE
    if not bare.any():
        return coverage
    lit = np.zeros_like(bare)
    for band in range(planes.shape[2]):  # one after the other: `any` over a short last axis takes six times as long
        lit |= planes[..., band] > 0
    bare &= lit
    return np.where(bare, np.float32(LEAST_COVERAGE), coverage) if bare.any() else coverage


def unit_range(stored: np.ndarray, key: str, path: Path) -> np.ndarray:
    """Alpha (height, width) as float32 of 0 to 1; integer codes are divided by their largest.

    Raises PhotositeError that names the file, the first pixel and its value, for NaN and for alpha outside 0 to 1; and as
    `largest_code` does.
    """
    coverage = stored.astype(np.float32)
    coverage /= np.float32(largest_code(stored, key, path))
    check_finite(coverage, key, path)
    fault = (coverage < -SLACK) | (coverage > 1 + SLACK)
    if fault.any():
        raise PhotositeError(
            f"alpha is {coverage[fault][0]:g} in {first_fault(fault)}; coverage is a share of the pixel, "
            "0 to 1: export it again",
            key=key,
            value=path,
        )
    return np.clip(coverage, 0.0, 1.0, out=coverage)


def _alpha_of(file: PixelFile, key: str) -> np.ndarray:
    if file.alpha is not None:
        return file.pixels[..., file.alpha]
    rule = f"has channels {', '.join(file.channels)}; give a picture of one channel, or one with alpha"
    require(len(file.channels) == 1, key, file.path, rule)
    return file.pixels[..., 0]
