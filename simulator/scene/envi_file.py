"""ENVI cubes: a text header beside raw numbers (NV5 Geospatial, ENVI Header Files)."""

import re
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError, reading, require
from simulator.progress import counted_as
from simulator.scene.pixel_file import PixelFile

DATA_TYPES = {1: "u1", 2: "i2", 3: "i4", 4: "f4", 5: "f8", 12: "u2", 13: "u4", 14: "i8", 15: "u8"}
DATA_SUFFIXES = ("", ".img", ".dat", ".raw", ".bsq", ".bil", ".bip", ".cube", ".bin")
INTERLEAVES = {"bsq": (2, 0, 1), "bil": (0, 2, 1), "bip": (0, 1, 2)}  # axes of the file: row 0, column 1, band 2
NM_PER_UNIT = {"nanometers": 1.0, "nm": 1.0, "micrometers": 1e3, "microns": 1e3, "um": 1e3, "angstroms": 0.1, "meters": 1e9}
SHORTEST_NM = 100.0  # wavelengths without a unit are micrometres where they are all smaller
FIX = "export the cube again as ENVI"


def find_envi_header(path: Path) -> Path | None:
    """Return the ENVI header that a path is, or that lies beside it; None where there is none."""
    if path.suffix.lower() == ".hdr":
        return path if _is_header(path) else None
    if path.suffix.lower() in (".exr", ".npy"):
        return None
    beside = (path.with_name(f"{path.name}.hdr"), path.with_suffix(".hdr"))
    return next((header for header in beside if header.is_file() and _is_header(header)), None)


def _is_header(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(16).lstrip(b"\xef\xbb\xbf").split()[:1] == [b"ENVI"]


def find_other_envi_file(path: Path) -> Path | None:
    """Return the data of a cube whose header a path is, or its header where it is the data; None where there is none."""
    header = find_envi_header(path)
    return _data_beside(path) if header == path else header


@counted_as("files")
def read_envi(header: Path, path: Path, key: str) -> PixelFile:
    """Read a cube as (height, width, bands), bands named by wavelength where the header tells it.

    header: the text. path: what the user named, the header or the data. Numbers are divided by `reflectance scale factor`, or
    get `data gain values` and `data offset values`, and are NaN where they hold `data ignore value`; bands that `bbl` marks
    are bad. Raises PhotositeError for a header that lacks what is needed, and data that are missing, compressed, complex or cut
    short.
    """
    with reading(header, FIX, key=key):
        fields = parse_header(header.read_text(encoding="utf-8-sig", errors="replace"))
    shape = tuple(_whole(fields, name, header, key) for name in ("lines", "samples", "bands"))
    height, width, bands = shape
    require(min(shape) > 0, key, header, f"is a cube of {height} x {width} x {bands}; {FIX}")
    stored = _read_data(_find_data(header, path, key), fields, shape, header, key)
    names, notes = _band_names(fields, bands, header, key)
    bad = _bad_bands(fields, bands, header, key)
    notes = (*notes, f"{header.name}: {len(bad)} bad bands (bbl) are left out") if bad else notes
    ignored = _numbers(fields, "data ignore value", header, key)[:1]
    pixels = _scaled(stored, fields, header, key)
    for value in ignored:
        pixels[stored == value] = np.nan
    no_data = "".join(f"data ignore value {value:g}" for value in ignored)
    has_scale = bool(_scale(fields, header, key) or _numbers(fields, "data gain values", header, key))
    is_unscaled = stored.dtype.kind in "ui" and not has_scale
    return PixelFile(path, pixels, names, notes=notes, bad=bad, no_data=no_data, is_unscaled=is_unscaled)


def parse_header(text: str) -> dict[str, str]:
    """Return the `name = value` lines of a header by lower-case name; a value in braces may run over lines."""
    pairs = re.findall(r"^[ \t]*([^=\n;{}]+?)[ \t]*=[ \t]*(\{[^}]*\}?|[^\n]*)", text, re.MULTILINE)
    return {" ".join(name.lower().split()): value.strip().strip("{}").strip() for name, value in pairs}


def _whole(fields: dict[str, str], name: str, header: Path, key: str, default: str | None = None) -> int:
    stated = fields.get(name, default)
    good = stated is not None and re.fullmatch(r"\d+", stated) is not None
    require(good, key, header, f"states `{name}` as {stated or 'nothing'}, which is no whole number; {FIX}")
    assert stated is not None
    return int(stated)


def _numbers(fields: dict[str, str], name: str, header: Path, key: str) -> list[float]:
    """Return the numbers of a list; [] where the header has none."""
    try:
        return [float(word) for word in re.split(r"[,\s]+", fields.get(name, "")) if word]
    except ValueError:
        rule = f"has words in its list `{name}`; {FIX}"
        raise PhotositeError(rule, key=key, value=header) from None


def _find_data(header: Path, path: Path, key: str) -> Path:
    if path != header:
        return path
    found = _data_beside(header)
    if found is None:
        names = ", ".join(data.name for data in _data_names(header)[:4])
        raise PhotositeError(f"is a header without data; put them beside it as one of {names}", key=key, value=header)
    return found


def _data_beside(header: Path) -> Path | None:
    return next((data for data in _data_names(header) if data.is_file()), None)


def _data_names(header: Path) -> list[Path]:
    stem = header.with_suffix("")
    return [stem.with_name(f"{stem.name}{suffix}") for suffix in DATA_SUFFIXES]


def _read_data(data: Path, fields: dict[str, str], shape: tuple[int, ...], header: Path, key: str) -> np.ndarray:
    """Return stored numbers as (height, width, bands), a view."""
    code = _whole(fields, "data type", header, key)
    known = ", ".join(map(str, DATA_TYPES))
    require(code in DATA_TYPES, key, header, f"has data type {code}; known are {known}: export it as one of these")
    order = fields.get("interleave", "bsq").lower()
    require(order in INTERLEAVES, key, header, f"has interleave {order}; known are {', '.join(INTERLEAVES)}")
    require(fields.get("file compression", "0") == "0", key, header, "is compressed; export it without")
    byte_order = _whole(fields, "byte order", header, key, "0")
    kind = np.dtype(DATA_TYPES[code]).newbyteorder(">" if byte_order else "<")
    offset, count = _whole(fields, "header offset", header, key, "0"), int(np.prod(shape))
    size, needed = data.stat().st_size, offset + count * kind.itemsize
    require(size >= needed, key, data, f"holds {size} bytes, but {header.name} tells of {needed}; the file is cut short")
    with reading(data, FIX, key=key):
        stored = np.fromfile(data, kind, count, offset=offset)
    axes = INTERLEAVES[order]
    return stored.reshape([shape[axis] for axis in axes]).transpose(np.argsort(axes))


def _scaled(stored: np.ndarray, fields: dict[str, str], header: Path, key: str) -> np.ndarray:
    """Return a copy as float32, in the unit that the header states."""
    pixels = stored.astype(np.float32)
    if factor := _scale(fields, header, key):
        return pixels / np.float32(factor)
    for name, apply in (("data gain values", np.multiply), ("data offset values", np.add)):
        if values := _numbers(fields, name, header, key):
            require(len(values) == stored.shape[2], key, header, f"has {len(values)} {name}; give one for each band")
            apply(pixels, np.array(values, np.float32), out=pixels)
    return pixels


def _scale(fields: dict[str, str], header: Path, key: str) -> float | None:
    """Return the number that stands for a reflectance of 1; None where the header has none above 0."""
    stated = _numbers(fields, "reflectance scale factor", header, key)
    return stated[0] if stated and stated[0] > 0 else None


def _band_names(fields: dict[str, str], bands: int, header: Path, key: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names of the channels, by wavelength where it is known, and notes."""
    names, notes = [f"band {index}" for index in range(bands)], []
    wavelengths = _numbers(fields, "wavelength", header, key)
    if wavelengths:
        rule = f"has {len(wavelengths)} wavelengths for {bands} bands; give one for each"
        require(len(wavelengths) == bands, key, header, rule)
        unit = fields.get("wavelength units", "unknown").lower()
        if unit == "unknown":
            unit = "micrometers" if max(wavelengths) < SHORTEST_NM else "nanometers"
            notes.append(f"{header.name}: wavelengths without a unit are taken as {unit}")
        rule = f"has wavelengths in {unit}; give them in nanometers or micrometers"
        require(unit in NM_PER_UNIT, key, header, rule)
        names = [f"{wavelength * NM_PER_UNIT[unit]:.9g}nm" for wavelength in wavelengths]
    return tuple(names), tuple(notes)


def _bad_bands(fields: dict[str, str], bands: int, header: Path, key: str) -> frozenset[int]:
    """Return the indices of the bands that the list `bbl` marks with 0. Raises PhotositeError unless all are marked or none."""
    good = _numbers(fields, "bbl", header, key)
    require(len(good) in (0, bands), key, header, f"has a list of {len(good)} bad bands (bbl) for {bands} bands")
    bad = frozenset(index for index, is_good in enumerate(good) if not is_good)
    require(len(bad) < bands, key, header, f"marks all of its {bands} bands as bad (bbl); mark those that can be used with 1")
    return bad
