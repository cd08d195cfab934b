"""Which channels of a picture are its colour, and how their numbers become linear sRGB."""

from collections.abc import Sequence

import numpy as np

from simulator.color.colour_science import colour_science
from simulator.color.reproducible import nine_digits_each, ordered_product
from simulator.errors import PhotositeError
from simulator.scene.pixel_file import PixelFile, check_rgb, largest_code

REC709_CHROMATICITIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709-6, Table 1, item 1.3 and 1.4


def color_channels(file: PixelFile, layer: str | None = None, depth_channel: str = "Z", key: str = "scene.image") -> np.ndarray:
    """Pick the colour of a picture as stored, (height, width, 3) or (height, width, 1), a view where that can be.

    Alpha is left aside; colours stay as stored. For EXR, whose colours are multiplied by alpha by convention, that is
    the picture over black. An EXR is read by channel names: R, G, B, else those of its only pass Combined (Blender), or
    its only channel beside alpha and depth.
    Raises PhotositeError, which names `key`, for another number of channels, and for colours that are not R, G, B or grey.
    """
    check_rgb(file, key)
    chosen = _color_names(file, layer, depth_channel)
    if not chosen:
        raise _wrong_channels(file, layer, key)
    first, *others = indices = [file.channels.index(name) for name in chosen]
    beside = others == list(range(first + 1, first + len(indices)))
    return file.pixels[..., first : first + len(indices)] if beside else np.take(file.pixels, indices, axis=2)


def color_alpha(file: PixelFile, layer: str | None = None, depth_channel: str = "Z") -> np.ndarray | None:
    """Return the alpha of a picture's colours as stored, (height, width); None where they have none.

    It stands beside the colours that `color_channels` picks: that of another layer or part of an EXR is not theirs. A file
    without such colours, as a spectral cube is, has the one that it marks as alpha.
    """
    chosen, own = _color_names(file, layer, depth_channel), file.alpha
    if chosen:
        before = _layer_of(chosen[0])
        if f"{before}A" in file.channels:
            own = file.channels.index(f"{before}A")
        elif own is not None and _layer_of(file.channels[own]) != before:
            own = None
    return None if own is None else file.pixels[..., own]


def _layer_of(channel: str) -> str:
    """Return what stands before the last part of a channel's name, such as "ViewLayer.Combined."."""
    return channel[: channel.rfind(".") + 1]


def _color_names(file: PixelFile, layer: str | None, depth_channel: str) -> list[str]:
    """Return the channels of a picture's colour: three, or one of a grey one; [] where that is not clear."""
    rest = [name for index, name in enumerate(file.channels) if index != file.alpha and name not in ("Z", depth_channel)]
    wanted = [name for name in _color_layers(rest, layer) if all(f"{name}{letter}" in rest for letter in "RGB")]
    if len(wanted) == 1 and (file.is_exr or len(rest) == 3):
        return [f"{wanted[0]}{letter}" for letter in "RGB"]
    return rest if len(rest) == 1 and not layer else []


def _color_layers(channels: Sequence[str], layer: str | None) -> list[str]:
    """Return what may stand before the names R, G and B, such as "ViewLayer.Combined."; of a view layer, its pass Combined.

    channels: of the file. layer: that the user named. Without one, R, G, B are the colours where they are there, else
    all passes Combined (Blender names channels VIEWLAYER.PASS.CHANNEL) are.
    """
    if layer:
        return [f"{layer}."] if f"{layer}.R" in channels else [f"{layer}.Combined."]
    return [""] if "R" in channels else [name[:-1] for name in channels if name.endswith("Combined.R")]


def _wrong_channels(file: PixelFile, layer: str | None, key: str) -> PhotositeError:
    names = file.channels
    layers = sorted({name[:-2] for name in names if name.endswith(".R")})
    hint = f"; write layer: and one of {', '.join(layers)}" if layers else ""
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    where = f" of layer {layer}" if layer else ""
    return PhotositeError(
        f"has {len(names)} channels ({shown}), but the colour{where} must be "
        f"1 channel (grey) or R, G and B, with or without alpha{hint}",
        key=key,
        value=file.path,
    )


def to_linear(stored: np.ndarray, encoding: str, file: PixelFile, key: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Linear sRGB planes, float32, and notes; integers are divided by their largest code first.

    Raises PhotositeError that names `key` and the file for integers that are neither uint8 nor uint16.

    encoding: "srgb" undoes the curve of IEC 61966-2-1, "linear" does not, "auto" takes integers as sRGB, floats as linear.
    An EXR that states other chromaticities than BT.709 is converted (white adapted by CAT02).
    """
    name, is_integer = file.path.name, stored.dtype.kind in "ui"
    notes = []
    if encoding == "auto":
        encoding = "srgb" if is_integer else "linear"
        if is_integer:
            notes.append(f"{name}: taken as sRGB and linearised (IEC 61966-2-1); write encoding: linear if it is linear")
    planes = _decode(stored, encoding, largest_code(stored, key, file.path))
    primaries = file.chromaticities
    if primaries is not None and planes.shape[2] == 3 and not np.allclose(primaries, REC709_CHROMATICITIES, atol=1e-3):
        planes = ordered_product(planes, _to_rec709(primaries).T).astype(np.float32)
        notes.append(f"{name}: converted from its own primaries to those of sRGB")
    return np.ascontiguousarray(planes), tuple(notes)


def _decode(stored: np.ndarray, encoding: str, largest: int) -> np.ndarray:
    """Float32 of 0 to 1 for integers, as they are for floats; through the sRGB curve for "srgb"."""
    curve = srgb_to_linear if encoding == "srgb" else np.asarray
    if stored.dtype.kind == "u":  # a table of all codes is faster than a power per pixel
        return curve(np.arange(largest + 1, dtype=np.float64) / largest).astype(np.float32)[stored]
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes Inf, which is refused later
        return stored.astype(np.float32) if encoding == "linear" else curve(stored.astype(np.float64)).astype(np.float32)


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1: V / 12.92 up to 0.04045, else ((V + 0.055) / 1.055)^2.4."""
    encoded = np.asarray(encoded)
    curve = ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve)


def _to_rec709(chromaticities: tuple[float, ...]) -> np.ndarray:
    """Matrix from RGB of these primaries to linear sRGB, (3, 3), to nine digits."""
    colour = colour_science()
    own, rec709 = (np.reshape(values, (4, 2)) for values in (chromaticities, REC709_CHROMATICITIES))
    own_to_xyz, rec709_to_xyz = (colour.normalised_primary_matrix(values[:3], values[3]) for values in (own, rec709))
    white = (colour.xy_to_XYZ(values[3]) for values in (own, rec709))
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(*white, transform="CAT02")
    return nine_digits_each(np.linalg.inv(rec709_to_xyz) @ adapt @ own_to_xyz)
