"""The truth twin: what the raw frame would be without noise, in one float32 EXR beside it.

Not compressed: on 12 Mpixel of fine texture zip takes five times as long and saves 1 % (piz 8 times, 8 %).
"""

import os

import numpy as np

from simulator.errors import PhotositeError
from simulator.frame import Raw
from simulator.raw.picture import read_picture, write_picture

MEAN_ELECTRONS = "electrons.mean"  # mean photoelectrons per photosite, before any noise [e-]
NOISE_FREE_DN = "dn.noise_free"  # code without noise and rounding, pedestal included, clipped as the sensor clips [DN]


def write_twin(raw: Raw, path: str | os.PathLike) -> None:
    """Write the twin of a raw frame; the file appears complete or not at all.

    Raises PhotositeError when an array has another shape than the mosaic or the path cannot be written.
    """
    pixels, channels, attributes = twin_picture(raw)
    write_picture(path, pixels, channels, **attributes)


def twin_picture(raw: Raw) -> tuple[np.ndarray, tuple[str, ...], dict[str, object]]:
    """Return pixels (height, width, channel), channel names and attributes of a twin.

    Channels: electrons.mean [e-] and dn.noise_free [DN], both (height, width) like the mosaic.
    Attributes: Software, photosite:iso, :cfa, :black_level_dn, :white_level_dn and :gain_dn_per_e (K of EMVA 1288;
    left out of a frame without photon shot noise), and no compression.
    Raises PhotositeError when an array has another shape than the mosaic.
    """
    planes = {MEAN_ELECTRONS: raw.mean_electrons, NOISE_FREE_DN: raw.noise_free_dn}
    for name, plane in planes.items():
        if plane.shape != raw.dn.shape:
            raise PhotositeError(f"{raw.name}: {name} is {plane.shape} and the mosaic {raw.dn.shape}: they must agree")
    attributes = {"iso": raw.iso, "cfa": raw.cfa, "black_level_dn": float(raw.black_level_dn)}
    attributes["white_level_dn"] = raw.white_level_dn
    if gain_dn_per_e := _gain_dn_per_e(raw):
        attributes["gain_dn_per_e"] = gain_dn_per_e
    pixels = np.stack(tuple(planes.values()), axis=-1, dtype=np.float32, casting="same_kind")
    named = {f"photosite:{name}": value for name, value in attributes.items()}
    return pixels, tuple(planes), {"compression": "none", **named}


def read_twin(path: str | os.PathLike) -> dict[str, np.ndarray]:
    """Read a twin: channel name -> (height, width) float32.

    Raises PhotositeError when the file is missing, damaged, or lacks a channel.
    """
    pixels, channels = read_picture(path)
    if missing := {MEAN_ELECTRONS, NOISE_FREE_DN} - set(channels):
        raise PhotositeError(f"{path}: not a truth twin: it has no channel {sorted(missing)[0]}; give a .truth.exr file")
    return {name: np.ascontiguousarray(pixels[..., index]) for index, name in enumerate(channels)}


def _gain_dn_per_e(raw: Raw) -> float:
    """K from the noise profile, S = K / (white - black) (DNG 1.4, NoiseProfile); 0 where no shot noise tells it."""
    return float(raw.noise_profile[0][0]) * (raw.white_level_dn - raw.black_level_dn)
