"""Patches of clean pictures: crops, flips and transposition that keep the colour filter's phase, and mosaicing.

A flipped or transposed Bayer mosaic begins with another colour. Moving the crop by one photosite puts the wanted colour back
in the corner without touching a value (Liu et al., "Learning Raw Image Denoising with Bayer Pattern Unification and Bayer
Preserving Augmentation", CVPR Workshops 2019). Nothing here is random: every patch is a function of numbers in [0, 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from data_gen.sources.source import Picture
from simulator.errors import PhotositeError
from simulator.sensor.camera.cfa import CfaName


@dataclass(frozen=True)
class Augmentation:
    """One of the eight symmetries of the square. Rows and columns are exchanged first, then the patch is flipped."""

    transpose: bool = False
    flip_y: bool = False
    flip_x: bool = False

    @property
    def name(self) -> str:
        """Return "none", or what is done, in order, such as "transpose+flip_x"."""
        return "+".join(step for step in ("transpose", "flip_y", "flip_x") if getattr(self, step)) or "none"

    def of(self, picture: np.ndarray) -> np.ndarray:
        """Apply to a (height, width[, channels]) array; the result is a view."""
        if self.transpose:
            picture = picture.swapaxes(0, 1)
        return picture[:: -1 if self.flip_y else 1, :: -1 if self.flip_x else 1]


AUGMENTATIONS = tuple(Augmentation(bool(code & 4), bool(code & 2), bool(code & 1)) for code in range(8))


@dataclass(frozen=True)
class Crop:
    """Where a patch lies in its picture, and what is done to it after it was cut out.

    top, left, height, width: in pixels of the picture, before the augmentation.
    """

    top: int
    left: int
    height: int
    width: int
    augmentation: Augmentation

    def of(self, picture: Picture) -> np.ndarray:
        """Cut the patch (height, width[, channels]) and augment it."""
        return self.augmentation.of(picture.cut(self.top, self.left, self.height, self.width))


def choose_crop(
    picture: Picture,
    size: tuple[int, int],
    cfa: CfaName,
    place: tuple[float, float] = (0.0, 0.0),
    augmentation: Augmentation = AUGMENTATIONS[0],
    name: str = "picture",
    others: Sequence[Augmentation] = (),
) -> Crop:
    """Return the crop that gives a patch of this height and width whose mosaic begins with `cfa`.

    others: augmentations of which one is taken where the picture has no room for the wanted one, such as for a flip of a mosaic
        that is no larger than the patch.
    place: two numbers in [0, 1): how far down and right, over all places that fit; even draws give even places.
    name: of the picture, for messages.
    Raises PhotositeError when the picture is too small, or when its mosaic cannot begin with `cfa`.
    """
    (first_y, first_x, step), places = _places(picture, size, cfa, augmentation, name)
    if min(places) < 1:
        fitting = [other for other in others if min(_places(picture, size, cfa, other, name)[1]) >= 1]
        if fitting:  # which of them follows from the wanted one, so that it is as random as that is
            return choose_crop(picture, size, cfa, place, fitting[AUGMENTATIONS.index(augmentation) % len(fitting)], name)
        (rows, columns), (height, width) = picture.size, size[::-1] if augmentation.transpose else size
        raise PhotositeError(
            f"{columns} x {rows} pixels are too few for a patch of {width} x {height} that begins with {cfa}; "
            "give a larger picture or ask for smaller patches",
            part=name,
        )
    top, left = (
        first + step * min(int(share * count), count - 1)
        for first, share, count in zip((first_y, first_x), place, places, strict=True)
    )
    height, width = size[::-1] if augmentation.transpose else size
    return Crop(top, left, height, width, augmentation)


def cut_patch(picture: Picture, crop: Crop, cfa: CfaName) -> np.ndarray:
    """Return the mosaic (height, width) float32 of a crop that `choose_crop` gave for the same picture and `cfa`."""
    if picture.cfa is not None:
        return np.ascontiguousarray(crop.of(picture))
    letters = _letters_before(crop, cfa)
    return np.ascontiguousarray(crop.augmentation.of(picture.mosaic(crop.top, crop.left, crop.height, crop.width, letters)))


def _letters_before(crop: Crop, cfa: CfaName) -> str:
    """Return the colours of the 2x2 block at the corner of a crop whose mosaic begins with `cfa` after the augmentation."""
    height, width = 2 + crop.height % 2, 2 + crop.width % 2  # parity alone decides
    places = crop.augmentation.of(np.arange(height * width).reshape(height, width))
    wanted = np.tile(np.array(list(cfa)).reshape(2, 2), (2, 2))[: places.shape[0], : places.shape[1]]
    letters = np.empty(height * width, wanted.dtype)
    letters[places.ravel()] = wanted.ravel()
    return "".join(letters.reshape(height, width)[:2, :2].ravel())


def _places(
    picture: Picture, size: tuple[int, int], cfa: CfaName, augmentation: Augmentation, name: str
) -> tuple[tuple[int, int, int], tuple[int, int]]:
    """Return row, column and step of `_first_place`, and how many places there are down and right; below 1: no room."""
    height, width = size[::-1] if augmentation.transpose else size
    first_y, first_x, step = _first_place(picture, size, cfa, augmentation, name)
    rows, columns = picture.size
    return (first_y, first_x, step), ((rows - height - first_y) // step + 1, (columns - width - first_x) // step + 1)


def _first_place(
    picture: Picture, size: tuple[int, int], cfa: CfaName, augmentation: Augmentation, name: str
) -> tuple[int, int, int]:
    """Return row and column of the first crop whose mosaic begins with `cfa`, and the step to the next one [px]."""
    own = picture.cfa
    if (own == "MONO") != (cfa == "MONO"):
        held = f"a {own} mosaic" if own else "R, G, B planes"
        raise PhotositeError(f"holds {held}, which a {cfa} sensor does not see; choose another camera or source", part=name)
    if own is None or own == "MONO":
        return 0, 0, 1
    height, width = (2 + side % 2 for side in (size[::-1] if augmentation.transpose else size))  # parity alone decides
    letters = np.tile(np.array(list(own)).reshape(2, 2), (2, 2))
    for y, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        seen = augmentation.of(letters[y : y + height, x : x + width])
        if "".join(seen[:2, :2].ravel()) == cfa:
            return y, x, 2
    raise PhotositeError(f"a {own} mosaic never begins with {cfa}; only R, G, G, B patterns can be turned", part=name)
