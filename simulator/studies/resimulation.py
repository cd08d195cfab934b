"""Simulate the shot of a DNG again from the configuration in its XMP packet."""

import os
from pathlib import Path

from simulator.config import build_shot_from_data
from simulator.errors import PhotositeError
from simulator.pipeline.input_files import sha256_of
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.progress import Progress
from simulator.raw.dng.tag_reader import read_tag
from simulator.raw.dng.xmp import Provenance, read_provenance
from simulator.raw.raw_image import Raw
from simulator.raw.raw_reader import open_raw
from simulator.raw.software import OURS

SOFTWARE_TAG = 305  # TIFF 6.0, Software


def resimulate(
    path: str | os.PathLike[str],
    *,
    device: str | None = None,
    progress: Progress | None = None,
    cache: LightCache | None = None,
) -> Raw:
    """Take the shot of one of our DNG files again, from the file alone; the codes are the same, bit for bit.

    Files the scene was read from are looked for where they were, then beside the DNG.
    device, progress, cache: as `simulator.simulate` takes them.
    Raises PhotositeError for a file that is not ours, or whose scene is missing or has other content than it had.
    """
    return simulate(shot_of(path), device=device, progress=progress, cache=cache)


def shot_of(path: str | os.PathLike[str]) -> Shot:
    """Return the shot in a DNG's XMP packet. Raises PhotositeError as `resimulate` does."""
    provenance = provenance_of(path)
    found = [(recorded, str(_find_input(path, recorded))) for recorded in provenance.inputs]
    moved = {recorded["key"]: place for recorded, place in found if place != recorded["path"]}
    return build_shot_from_data(provenance.shot, f"{path} (XMP)", moved)


def provenance_of(path: str | os.PathLike[str]) -> Provenance:
    """Return the provenance in the XMP packet of a Photosite DNG. Raises PhotositeError for any other file."""
    provenance = read_provenance(path)
    if provenance is None and _is_ours(path):
        rule = "holds no shot, because it was simulated from objects in Python and not from a shot file; run that program again"
        raise PhotositeError(rule, file=path)
    if provenance is None:
        raise PhotositeError(
            "holds no shot of Photosite; give a DNG that `photosite simulate` wrote from a shot file", file=path
        )
    return provenance


def _is_ours(path: str | os.PathLike[str]) -> bool:
    """Return whether the Software tag of a TIFF file names Photosite."""
    return (read_tag(path, SOFTWARE_TAG) or b"").startswith(OURS.encode())


def differing_codes(path: str | os.PathLike[str], raw: Raw) -> int:
    """Return how many codes of a DNG, optical black included, differ from a frame's.

    Raises PhotositeError when it cannot be read.
    """
    with open_raw(os.fspath(path), os.fspath(path)) as frame:
        mosaic = frame.raw_image.copy()  # not the visible part alone
    return max(mosaic.size, raw.dn.size) if mosaic.shape != raw.dn.shape else int((mosaic != raw.dn).sum())


def _find_input(dng: str | os.PathLike[str], recorded: dict[str, str]) -> Path:
    """Return the path of a scene file whose SHA-256 is the recorded one: where it was, or beside the DNG."""
    written = Path(recorded["path"])
    beside = Path(dng).absolute().parent / written.name
    there = [place for place in dict.fromkeys((written, beside)) if place.is_file()]
    if not there:
        raise PhotositeError(
            f"no such file, nor {beside}; put the file back, or beside the DNG", file=dng, key=recorded["key"], value=written
        )
    for place in there:
        if _hash_file(dng, recorded["key"], place) == recorded["sha256"]:
            return place
    raise PhotositeError(
        "its content is not what it was when the frame was taken "
        f"(SHA-256 {recorded['sha256'][:12]}…, now {sha256_of(there[0])[:12]}…); put the old file back, or beside the DNG",
        file=dng,
        key=recorded["key"],
        value=there[0],
    )


def _hash_file(dng: str | os.PathLike[str], key: str, place: Path) -> str:
    try:
        return sha256_of(place)
    except OSError as error:
        raise PhotositeError(f"{error.strerror}; make the file readable", file=dng, key=key, value=place) from None
