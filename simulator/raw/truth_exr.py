"""Truth EXR: the noise-free frame and other ground truth of a raw frame, in one multi-part EXR beside it.

Each quantity is a separate part, so that a reader loads only what it needs. float32, not compressed: on 12 Mpixel of fine
texture, zip takes five times as long and saves 1 % (piz: 8 times, 8 %). Depth and circle of confusion are smooth and use
zip. Parts are tiled, since OpenEXR processes single rows otherwise: tiles of 64 rows take a quarter less time.
"""

import os
from dataclasses import replace

import numpy as np

from simulator.atomic_files import atomic_write
from simulator.errors import PhotositeError
from simulator.raw.image_files import PicturePart, put_parts, read_parts
from simulator.raw.plain_exr import LARGEST_INT
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa

MEAN_ELECTRONS = "electrons.mean"  # mean photoelectrons per photosite, before any noise [e-]
NOISE_FREE_DN = "dn.noise_free"  # code without noise and rounding, pedestal included, clipped as the sensor clips [DN]
_TILE_ROWS = 64
# Parts of Raw.truth: channels, unit, compression. docs/raw_files.md defines them.
PARTS = {
    "variance": (("dn.variance",), "DN^2", "none"),
    "depth": (("Z",), "m", "zips"),
    "blur": (("blur.radius",), "px", "zips"),
    "flow": (("flow.x", "flow.y"), "px", "zips"),
    "rgb": (("R", "G", "B"), "1", "none"),
}


def write_twin(raw: Raw, path: str | os.PathLike) -> None:
    """Write the truth EXR of a raw frame; the file appears complete or not at all.

    Raises PhotositeError when an array has another shape than the mosaic or the path cannot be written.
    """
    parts = truth_parts(raw)
    with atomic_write(path) as temporary:
        put_parts(temporary, parts)


def truth_parts(raw: Raw) -> list[PicturePart]:
    """Return the parts of a truth EXR, each (height, width, channels) float32, as large as the mosaic.

    Always: part "electrons", channel electrons.mean [e-]; part "noise_free", channel dn.noise_free [DN]; then those of
    `Raw.truth`, as PARTS lists them. The clean signal of a MONO frame has the one channel Y instead of R, G, B; that of
    other filters the letters of their colours.
    Attributes of each: Software, photosite:unit; of the first also photosite:iso, :cfa, :black_level_dn, :white_level_dn
    and :gain_dn_per_e (K of EMVA 1288: codes for each of `electrons.mean`; absent where it is not known). An ISO above
    2^31 - 1, which EXR has no whole number for, is left out.
    Raises PhotositeError when an array has another shape than the mosaic.
    """
    parts = [
        _part(raw, "electrons", raw.mean_electrons, (MEAN_ELECTRONS,), "e-", "none"),
        _part(raw, "noise_free", raw.noise_free_dn, (NOISE_FREE_DN,), "DN", "none"),
    ]
    for name, (channels, unit, compression) in PARTS.items():
        if name in raw.truth:
            if name == "rgb":
                channels = ("Y",) if raw.cfa == "MONO" else tuple(Cfa.named(raw.cfa).letters)
            parts.append(_part(raw, name, raw.truth[name], channels, unit, compression))
    facts: dict[str, object] = {} if raw.iso > LARGEST_INT else {"iso": raw.iso}
    facts |= {"cfa": raw.cfa, "black_level_dn": float(raw.black_level_dn), "white_level_dn": raw.white_level_dn}
    if raw.gain_dn_per_e > 0.0:
        facts["gain_dn_per_e"] = raw.gain_dn_per_e
    attributes = parts[0].attributes | {f"photosite:{name}": value for name, value in facts.items()}
    return [replace(parts[0], attributes=attributes), *parts[1:]]


def read_twin(path: str | os.PathLike) -> dict[str, np.ndarray]:
    """Read a truth EXR: channel name -> (height, width) float32, for the channels of all parts.

    Raises PhotositeError when the file is missing, damaged, or lacks a channel.
    """
    found: dict[str, np.ndarray] = {}
    for part in read_parts(path):
        found |= {name: np.ascontiguousarray(part.pixels[..., index]) for index, name in enumerate(part.channels)}
    if missing := {MEAN_ELECTRONS, NOISE_FREE_DN} - set(found):
        raise PhotositeError(f"not a truth twin: it has no channel {sorted(missing)[0]}; give a .truth.exr file", file=path)
    return found


def _part(raw: Raw, name: str, plane: np.ndarray, channels: tuple[str, ...], unit: str, compression: str) -> PicturePart:
    """Make a part of one array. Raises PhotositeError when its size is not that of the mosaic."""
    pixels = plane[..., np.newaxis] if plane.ndim == 2 else plane
    if pixels.shape != (*raw.dn.shape, len(channels)):
        shown = channels[0] if len(channels) == 1 else name
        raise PhotositeError(
            f"is {plane.shape} and the mosaic {raw.dn.shape}: they must agree", part=raw.name, key=shown, joint=" "
        )
    attributes: dict[str, object] = {"compression": compression, "photosite:unit": unit}
    return PicturePart(name, pixels.astype(np.float32, casting="same_kind", copy=False), channels, attributes, _TILE_ROWS)
