"""Inspection of one raw file of any camera: metadata, levels, filter pattern, histogram and noise of each colour."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simulator.errors import PhotositeError, reading
from simulator.measurement.statistics.single_frame_noise import LevelNoise, single_frame_noise
from simulator.raw.dng.xmp import SettingsChanged, read_provenance
from simulator.raw.filter_pattern import color_index
from simulator.raw.raw_reader import open_raw, plane_places, positive_or_none
from simulator.raw.software import OURS

if TYPE_CHECKING:
    from simulator.raw.raw_reader import OpenRaw

BINS = 64


@dataclass(frozen=True)
class Channel:
    """Codes of one colour [DN].

    at_black: how many photosites lie at or below the black level; at_white: at the white level or above.
    histogram: counts in BINS equal bins from 0 to the white level; the last holds what lies above, too.
    noise: at several levels; () where every block is clipped.
    """

    name: str
    photosites: int
    black_level_dn: float
    least_dn: int
    median_dn: float
    mean_dn: float
    largest_dn: int
    at_black: int
    at_white: int
    histogram: tuple[int, ...]
    noise: tuple[LevelNoise, ...]


@dataclass(frozen=True)
class Inspection:
    """Contents of a raw file; None for what its metadata do not say.

    ours: whether Photosite wrote it: its XMP packet holds a shot of ours, or, from Python without settings, its Software tag
        says so.
    config_sha256: of the shot it was simulated from, where the packet holds one that still has this hash.
    config_changed: whether the packet holds a shot that was changed after it was written.
    pattern: colours of the repeating block, row by row, rows apart by "/"; "MONO"; "full colour" where each pixel has all.
    make, model and software are read from files that are built like TIFF (DNG, NEF, ARW, CR2, PEF and others).
    """

    path: str
    size_bytes: int
    ours: bool
    config_sha256: str | None
    config_changed: bool
    software: str | None
    make: str | None
    model: str | None
    lens: str | None
    taken: str | None
    iso: float | None
    exposure_time_s: float | None
    f_number: float | None
    focal_length_mm: float | None
    width_px: int
    height_px: int
    pattern: str
    white_level_dn: int
    channels: tuple[Channel, ...]


def inspect_raw(path: str | os.PathLike[str]) -> Inspection:
    """Inspect any raw file that LibRaw reads. Raises PhotositeError when it is missing, no raw file or damaged."""
    label = os.fspath(path)
    with open_raw(label, label) as frame:
        image = frame.raw_image_visible
        if image is None or image.dtype != np.uint16:
            raise PhotositeError("holds no integer codes; give a raw file of 16-bit codes", file=label)
        black, white = np.asarray(frame.black_level_per_channel, dtype=np.float64), int(frame.white_level)
        pattern, places = _places(frame, image, label)
        channels = tuple(_channel(name, planes, float(black[index].mean()), white) for name, planes, index in places)
        other, lens = frame.other, frame.lens
        named, (config_sha256, changed) = _names(label), _origin(label)
        taken = other.timestamp if other.timestamp is not None and other.timestamp.year > 1970 else None
        return Inspection(
            path=label,
            size_bytes=os.path.getsize(label),
            ours=bool(config_sha256) or changed or str(named.get("Software", "")).startswith(OURS),
            config_sha256=config_sha256,
            config_changed=changed,
            software=named.get("Software"),
            make=named.get("Make"),
            model=named.get("Model"),
            lens=lens.model or None,
            taken=None if taken is None else taken.isoformat(sep=" "),
            iso=positive_or_none(other.iso_speed),
            exposure_time_s=positive_or_none(other.shutter_speed),
            f_number=positive_or_none(other.aperture),
            focal_length_mm=positive_or_none(other.focal_length),
            width_px=image.shape[1],
            height_px=image.shape[0],
            pattern=pattern,
            white_level_dn=white,
            channels=channels,
        )


def _places(frame: "OpenRaw", image: np.ndarray, label: str) -> tuple[str, list[tuple[str, list[np.ndarray], list[int]]]]:
    """Return the filter pattern, and for each colour its name, its planes (one per place), and LibRaw's colour indices."""
    letters = frame.color_desc.decode("ascii", "replace")
    if image.ndim == 3:
        count = min(frame.num_colors, image.shape[2])
        return "full colour", [(letters[index], [image[..., index]], [index]) for index in range(count)]
    if frame.num_colors == 1:  # rawpy gives a meaningless pattern then
        return "MONO", [("MONO", [image], [0])]
    index = color_index(frame, label)
    assert index is not None  # a mosaic of several colours has a pattern
    tall, wide = index.shape
    rows = ["".join(letters[place] for place in row) for row in index]
    flat = "".join(rows)
    if flat in ("RGGB", "BGGR", "GRBG", "GBRG"):
        names = {place: name for name, place in plane_places(flat).items()}
    else:
        names = {(y, x): rows[y][x] for y in range(tall) for x in range(wide)}
    order = {name: rank for rank, name in enumerate(("R", "Gr", "Gb", "G", "B"))}
    found = []
    for name in sorted(set(names.values()), key=lambda name: (order.get(name, 99), name)):
        mine = [place for place, other in names.items() if other == name]
        found.append((name, [image[y::tall, x::wide] for y, x in mine], [int(index[place]) for place in mine]))
    return "/".join(rows) if (tall, wide) != (2, 2) else flat, found


def _channel(name: str, planes: Sequence[np.ndarray], black_level_dn: float, white_level_dn: int) -> Channel:
    counts = np.zeros(2**16, dtype=np.int64)
    for plane in planes:
        counts += np.bincount(plane.ravel(), minlength=2**16)
    codes, photosites = np.arange(counts.size), int(counts.sum())
    there = np.flatnonzero(counts)
    edges = np.linspace(0.0, white_level_dn + 1.0, BINS + 1)
    histogram = np.bincount(np.clip(np.searchsorted(edges, codes, side="right") - 1, 0, BINS - 1), counts, minlength=BINS)
    return Channel(
        name=name,
        photosites=photosites,
        black_level_dn=black_level_dn,
        least_dn=int(there[0]),
        median_dn=float(np.searchsorted(np.cumsum(counts), photosites / 2)),
        mean_dn=float(counts @ codes) / photosites,
        largest_dn=int(there[-1]),
        at_black=int(counts[codes <= black_level_dn].sum()),
        at_white=int(counts[codes >= white_level_dn].sum()),
        histogram=tuple(int(count) for count in histogram),
        noise=single_frame_noise(planes, white_level_dn),
    )


def _names(path: str) -> dict[str, str]:
    """Make, Model and Software of the first TIFF directory, without blanks at their ends; {} of a file not built like TIFF."""
    import OpenImageIO

    try:
        with reading(path, "give a raw file built like TIFF"):
            source = OpenImageIO.ImageInput.open(path)
            if source is None:
                OpenImageIO.geterror()  # read, or it is printed when the program ends
                return {}
            texts = {name: str(source.spec().getattribute(name) or "").strip() for name in ("Make", "Model", "Software")}
            source.close()
    except PhotositeError:  # damaged names are not told; LibRaw reads the rest
        return {}
    return {name: text for name, text in texts.items() if text}


def _origin(path: str) -> tuple[str | None, bool]:
    """Return the SHA-256 of the shot in the file's XMP packet, None without an intact one, and whether one was changed."""
    try:
        found = read_provenance(path)
    except SettingsChanged:
        return None, True
    except PhotositeError:  # a raw file that is not built like TIFF
        return None, False
    return None if found is None else found.config_sha256, False
