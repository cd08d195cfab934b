"""Saving of one shot: raw frame (DNG), ground truth (EXR), settings (JSON)."""

import os
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from simulator.atomic_files import atomic_write, write_errors
from simulator.errors import PhotositeError
from simulator.progress import counted_as
from simulator.raw.canonical_json import json_text
from simulator.raw.dng.writer import dng_pieces, write_pieces
from simulator.raw.image_files import put_parts
from simulator.raw.raw_image import Raw
from simulator.raw.truth_exr import truth_parts


@dataclass(frozen=True)
class SavedFiles:
    """Paths of a shot's files. The sidecar is written last: where it exists, the set is complete."""

    dng: Path
    twin: Path
    sidecar: Path

    def there(self) -> list[Path]:
        """Return the files that exist; the truth twin may have been left out."""
        return [file for file in (self.dng, self.twin, self.sidecar) if file.exists()]


def files_of(name: str, directory: str | os.PathLike[str]) -> SavedFiles:
    """Return the paths of a shot's three files. Raises PhotositeError for a name that is not a plain file name."""
    if name in ("", ".", "..") or any(letter in name for letter in "/\\\0"):
        raise PhotositeError(
            "names the files, so it must be a plain file name; leave out slashes", key="shot.name", value=f"{name!r}"
        )
    folder = Path(directory)
    return SavedFiles(folder / f"{name}.dng", folder / f"{name}.truth.exr", folder / f"{name}.json")


@counted_as("files")
def save(raw: Raw, directory: str | os.PathLike[str], *, truth: bool = True) -> SavedFiles:
    """Write `<name>.dng`, `<name>.truth.exr`, then `<name>.json` with the resolved settings.

    truth: False leaves the truth twin out, which then need not be computed; an older one is removed with the older sidecar.

    All three are written to temporary files and then renamed, the sidecar last: a failure leaves nothing of the new set and
    all of an older one. An older sidecar is removed before the first rename, so that an interrupted set is not complete.
    Raises PhotositeError when the frame does not fit a DNG, the settings are not plain data, or a path cannot be written.
    """
    files = files_of(raw.name, directory)
    settings, mosaic = sidecar_text(raw), dng_pieces(raw)
    with atomic_write(files.sidecar) as sidecar:
        sidecar.write_text(settings, encoding="utf-8")
        with atomic_write(files.twin) if truth else nullcontext() as twin, atomic_write(files.dng) as dng:
            write_pieces(mosaic, dng)
            if twin is not None:
                with write_errors(files.twin):
                    put_parts(twin, truth_parts(raw))  # the truth is computed while the disk writes the mosaic
            files.sidecar.unlink(missing_ok=True)
            if not truth:
                files.twin.unlink(missing_ok=True)
    return files


def sidecar_text(raw: Raw) -> str:
    """Return the settings as JSON with sorted keys. Raises PhotositeError for values JSON has no form for."""
    return json_text(raw.name, raw.resolved, indent=2, ensure_ascii=False) + "\n"
