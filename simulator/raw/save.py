"""One shot on disk: raw frame, truth twin, settings."""

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError
from simulator.frame import Raw
from simulator.raw.dng import dng_pieces, write_pieces
from simulator.raw.files import atomic_write
from simulator.raw.picture import put_parts
from simulator.raw.twin import twin_parts


@dataclass(frozen=True)
class SavedFiles:
    """Paths of one set. The sidecar is written last, so where it exists the set is complete."""

    dng: Path
    twin: Path
    sidecar: Path


def files_of(name: str, directory: str | os.PathLike) -> SavedFiles:
    """Name the three files of a shot. Raises PhotositeError for a name that is no plain file name."""
    if name in ("", ".", "..") or any(letter in name for letter in "/\\\0"):
        raise PhotositeError(f"shot.name = {name!r}: names the files, so it must be a plain file name; leave out slashes")
    folder = Path(directory)
    return SavedFiles(folder / f"{name}.dng", folder / f"{name}.truth.exr", folder / f"{name}.json")


def save(raw: Raw, directory: str | os.PathLike) -> SavedFiles:
    """Write `<name>.dng`, `<name>.truth.exr`, then `<name>.json` with the resolved settings.

    All three are written beside and then renamed, the sidecar last: a failure leaves nothing of the new set and all of
    an older one. An older sidecar goes before the first rename, so that a set which breaks off there does not look complete.
    Raises PhotositeError when the frame does not fit a DNG, the settings are not plain data, or a path cannot be written.
    """
    files = files_of(raw.name, directory)
    settings = sidecar_text(raw)
    mosaic, parts = dng_pieces(raw), twin_parts(raw)
    with atomic_write(files.sidecar) as sidecar:
        sidecar.write_text(settings, encoding="utf-8")
        with atomic_write(files.twin) as twin:
            put_parts(twin, parts)
            with atomic_write(files.dng) as dng:
                write_pieces(mosaic, dng)
                files.sidecar.unlink(missing_ok=True)
    return files


def sidecar_text(raw: Raw) -> str:
    """Return the settings as JSON with sorted keys. Raises PhotositeError for values JSON has no form for."""
    try:
        plain = _plain(raw.resolved)
    except TypeError as error:
        raise PhotositeError(f"{raw.name}: settings cannot be written as JSON: {error}; give plain values") from error
    return json.dumps(plain, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: object) -> object:
    """Turn numpy types into Python's; inf and nan, which JSON lacks, into the words."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{value!r} is a {type(value).__name__}")
