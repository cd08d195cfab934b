"""Simulate the shot of a DNG again from the configuration in its XMP packet."""

import os
from pathlib import Path

from simulator.config import build_shot_from_data
from simulator.errors import PhotositeError
from simulator.pipeline.input_files import files_of_parts, sha256_of
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

    Files the scene was read from are looked for where they were, then beside the DNG; those that such a file leads to, such as
    the data of an ENVI header, beside it.
    device, progress, cache: as `simulator.simulate` takes them.
    Raises PhotositeError for a file that is not ours, or whose scene is missing or has other content than it had.
    """
    return simulate(shot_of(path), device=device, progress=progress, cache=cache)


def shot_of(path: str | os.PathLike[str]) -> Shot:
    """Return the shot in a DNG's XMP packet. Raises PhotositeError as `resimulate` does."""
    provenance = provenance_of(path)
    named: dict[str, dict[str, str]] = {}
    led_to: dict[str, list[dict[str, str]]] = {}
    for recorded in provenance.inputs:
        if named.setdefault(recorded["key"], recorded) is not recorded:
            led_to.setdefault(recorded["key"], []).append(recorded)
    there = {key: _find_input(path, recorded) for key, recorded in named.items()}
    faults = []
    for places in ({key: found[end] for key, found in there.items()} for end in (0, -1)):
        moved = {key: str(place) for key, place in places.items() if str(place) != named[key]["path"]}
        shot = build_shot_from_data(provenance.shot, f"{path} (XMP)", moved)
        if (fault := _find_fault(path, shot, led_to)) is None:
            return shot
        faults.append(fault)
    raise faults[0]


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


def _find_input(dng: str | os.PathLike[str], recorded: dict[str, str]) -> list[Path]:
    """Return the paths of a file that the shot names and whose SHA-256 is the recorded one: where it was, beside the DNG.

    Raises PhotositeError where there is none.
    """
    written = Path(recorded["path"])
    there = [place for place in dict.fromkeys((written, _beside(dng, written))) if place.is_file()]
    if not there:
        raise _missing(dng, recorded, f", nor {_beside(dng, written)}", "beside the DNG")
    same = [place for place in there if _hash_file(dng, recorded["key"], place) == recorded["sha256"]]
    if not same:
        raise _changed(dng, recorded, there[0], "beside the DNG")
    return same


def _find_fault(dng: str | os.PathLike[str], shot: Shot, led_to: dict[str, list[dict[str, str]]]) -> PhotositeError | None:
    """Return the fault of the first file that is missing or has other content, of those that the named files lead to.

    led_to: such files as recorded, by key; older DNG files have none.
    """
    found: dict[str, list[Path]] = {}
    for keys, place in files_of_parts(shot.scene, shot.lens, shot.motion) if led_to else ():
        found.setdefault(".".join(keys), []).append(place)
    for key, files in led_to.items():
        named, *places = found.get(key, [Path(key)])
        fix = f"with {named.name} beside the DNG"
        for index, recorded in enumerate(files):
            if index >= len(places) or not places[index].is_file():
                return _missing(dng, recorded, "", fix)
            if _hash_file(dng, key, places[index]) != recorded["sha256"]:
                return _changed(dng, recorded, places[index], fix)
    return None


def _beside(dng: str | os.PathLike[str], written: Path) -> Path:
    return Path(dng).absolute().parent / written.name


def _missing(dng: str | os.PathLike[str], recorded: dict[str, str], elsewhere: str, fix: str) -> PhotositeError:
    rule = f"no such file{elsewhere}; put the file back, or {fix}"
    return PhotositeError(rule, file=dng, key=recorded["key"], value=recorded["path"])


def _changed(dng: str | os.PathLike[str], recorded: dict[str, str], place: Path, fix: str) -> PhotositeError:
    was, now = recorded["sha256"][:12], sha256_of(place)[:12]
    rule = (
        f"its content is not what it was when the frame was taken (SHA-256 {was}…, now {now}…); put the old file back, or {fix}"
    )
    return PhotositeError(rule, file=dng, key=recorded["key"], value=place)


def _hash_file(dng: str | os.PathLike[str], key: str, place: Path) -> str:
    try:
        return sha256_of(place)
    except OSError as error:
        raise PhotositeError(f"{error.strerror}; make the file readable", file=dng, key=key, value=place) from None
