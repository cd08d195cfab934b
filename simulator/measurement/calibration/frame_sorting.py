"""Sorting of raw files into dark frames and flat fields by ISO, and pairing of flats with equal exposure time."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.statistics.clipping import MOST_CLIPPED, find_clipped_code
from simulator.progress import Progress, Steps, silent
from simulator.raw.raw_reader import RawFile, read_raw_file

LARGEST_SIDE_PX = 2048  # side of the central crop that is measured: 4 million photosites give K to 0.1 %
DARK_SHARE = 0.01  # of the range above black: a frame of lower mean counts as dark where no file or folder name says its kind
HIGH_SHARE = 1e-4  # of codes near white: up to here they are defects, above it the frame clips
ZERO_SHARE = 1e-3  # of codes 0 in a frame; above it the lower tail of its noise is clipped
LARGEST_SIGNAL_SHARE = 0.7  # of saturation, as in EMVA 1288; brighter pairs do not count for K
_KIND = re.compile(r"(dark|bias|flat)(s|[ _-]?frames?|[ _-]?fields?)?(?![a-z])")  # not "darktable"
_ISO = re.compile(r"(?<![a-z])iso[ _-]?(\d{2,7})(?!\d)")
_LARGEST_SHORT = 65535  # value of Exif's ISO tag and of LibRaw for every ISO from here on


@dataclass(frozen=True)
class Frame:
    """Kind, exposure and levels of one raw file, without its pixels.

    kind: "dark" or "flat". size: (height, width) of the visible part. mean_dn, white_level_dn, black_level_dn: levels [DN].
    clipped_dn: code at which photosites pile up, None where they do not. high_share: share of codes
    at it, or within 2 % of the white level. zero_share: share of codes 0.
    """

    path: str
    kind: str
    iso: int
    time_s: float
    cfa: str
    size: tuple[int, int]
    mean_dn: float
    black_level_dn: float
    white_level_dn: int
    clipped_dn: int | None
    high_share: float
    zero_share: float

    @property
    def clips(self) -> bool:
        """Whether more codes lie near the white level than defects explain."""
        return self.high_share > HIGH_SHARE

    @property
    def ends_at_zero(self) -> bool:
        """Whether the lower end of the noise is clipped at code 0, as in the dark of a camera without pedestal."""
        return self.zero_share > ZERO_SHARE


@dataclass(frozen=True)
class IsoFrames:
    """The frames of one ISO: darks by exposure time [s], pairs of flats, and flats without a partner."""

    iso: int
    darks: dict[float, list[Frame]]
    flat_pairs: list[tuple[Frame, Frame]]
    lone_flats: list[Frame] = field(default_factory=list)

    @property
    def short_darks(self) -> list[Frame]:
        """Dark frames of the shortest exposure time that has two or more; where none has, of the shortest."""
        times = [time for time, frames in self.darks.items() if len(frames) > 1] or list(self.darks)
        return self.darks[min(times)] if times else []

    @property
    def usable_pairs(self) -> list[tuple[Frame, Frame]]:
        """Pairs of flats from which K is measured: clipped at neither end, and not above LARGEST_SIGNAL_SHARE."""
        return [pair for pair in self.flat_pairs if not any(map(_is_unfit_for_gain, pair))]

    @property
    def unclipped_darks(self) -> dict[float, list[Frame]]:
        """Dark frames by exposure time [s] whose means tell the dark current: clipped at neither end, beside hot photosites."""
        kept = {
            time_s: [frame for frame in frames if not frame.ends_at_zero and frame.high_share <= MOST_CLIPPED]
            for time_s, frames in self.darks.items()
        }
        return {time_s: frames for time_s, frames in kept.items() if frames}

    @property
    def is_clipped_at_zero(self) -> bool:
        """Whether the noise of the dark frames is clipped at code 0, as in a camera without pedestal."""
        return any(frame.ends_at_zero for frame in self.short_darks)


def _is_unfit_for_gain(frame: Frame) -> bool:
    range_dn = frame.white_level_dn - frame.black_level_dn
    return frame.clips or frame.ends_at_zero or frame.mean_dn - frame.black_level_dn > LARGEST_SIGNAL_SHARE * range_dn


def raw_files(paths: Iterable[Path]) -> list[Path]:
    """Return files, and the files in folders at any depth, sorted by name, without hidden files and known sidecars.

    Raises PhotositeError for a path that is not there and when nothing is left.
    """
    side_files = {".json", ".yaml", ".csv", ".exr", ".xmp", ".txt", ".png", ".jpg", ".jpeg", ".pp3", ".md"}
    found = []
    for path in map(Path, paths):
        if not path.exists():
            raise PhotositeError("no such file or folder; check the path", file=path)
        inside = sorted(path.rglob("*")) if path.is_dir() else [path]
        found += [file for file in inside if file.is_file() and not file.name.startswith(".")]
    kept = list(dict.fromkeys(file for file in found if file.suffix.lower() not in side_files))
    if not kept:
        raise PhotositeError("no raw files there; give dark frames and flat fields", file=", ".join(map(str, paths)))
    return kept


def read_frames(paths: Sequence[Path], progress: Progress = silent) -> list[Frame]:
    """Read every file once and say what it is. progress: told of each file.

    Raises PhotositeError for a file that is no raw file, that states no ISO, and for files of different cameras.
    """
    frames, steps = [], Steps(progress, len(paths))
    for path in paths:
        frames.append(frame_of(read_raw_file(path)))
        steps.add(f"reading {path.name}")
        first, last = frames[0], frames[-1]
        if (first.size, first.cfa) != (last.size, last.cfa):
            shapes = [f"{frame.size[1]} x {frame.size[0]} {frame.cfa}" for frame in (first, last)]
            raise PhotositeError(
                f"is {shapes[1]}, but {first.path} is {shapes[0]}; calibrate one camera at a time", file=last.path
            )
    return frames


def frame_of(raw: RawFile) -> Frame:
    """Sort one file: by a folder or file name that begins with dark, bias or flat, else by its level."""
    codes = middle(raw.mosaic)
    black_dn, mean_dn = float(raw.black_level_dn.mean()), float(codes.mean(dtype=np.float64))
    # A dark frame may lie at one code, too, and clips nothing.
    clipped_dn = find_clipped_code(codes) if codes.max() > 0.5 * raw.white_level_dn else None
    high_dn = min(0.98 * raw.white_level_dn, clipped_dn or raw.white_level_dn)
    by_level = "dark" if mean_dn - black_dn < DARK_SHARE * (raw.white_level_dn - black_dn) else "flat"
    return Frame(
        path=raw.path,
        kind=_kind_by_name(raw.path) or by_level,
        iso=_iso(raw),
        time_s=raw.exposure_time_s or 0.0,
        cfa=raw.cfa,
        size=raw.mosaic.shape,
        mean_dn=mean_dn,
        black_level_dn=black_dn,
        white_level_dn=raw.white_level_dn,
        clipped_dn=clipped_dn,
        high_share=float(np.mean(codes >= high_dn)),
        zero_share=float(np.mean(codes == 0)),
    )


def middle(mosaic: np.ndarray) -> np.ndarray:
    """Return the central crop of a mosaic, at most LARGEST_SIDE_PX a side, made of whole 2x2 blocks."""
    starts = [2 * (max(0, side - LARGEST_SIDE_PX) // 4) for side in mosaic.shape]
    sides = [min(LARGEST_SIDE_PX, side // 2 * 2) for side in mosaic.shape]
    return mosaic[starts[0] : starts[0] + sides[0], starts[1] : starts[1] + sides[1]]


def by_iso(frames: list[Frame]) -> list[IsoFrames]:
    """Group frames by ISO, ascending; flats of one exposure time are paired in order of name."""
    groups = []
    for iso in sorted({frame.iso for frame in frames}):
        darks: dict[float, list[Frame]] = {}
        for frame in frames:
            if frame.iso == iso and frame.kind == "dark":
                darks.setdefault(frame.time_s, []).append(frame)
        flats = sorted((frame for frame in frames if (frame.iso, frame.kind) == (iso, "flat")), key=_time_and_name)
        pairs, lone = [], []
        for _, same in groupby(flats, key=lambda frame: frame.time_s):
            members = list(same)
            pairs += list(zip(members[0::2], members[1::2], strict=False))
            lone += members[len(members) // 2 * 2 :]
        groups.append(IsoFrames(iso, dict(sorted(darks.items())), pairs, lone))
    return groups


def _time_and_name(frame: Frame) -> tuple:
    # Numbers count as numbers: IMG_9 stands before IMG_10.
    parts = re.split(r"(\d+)", frame.path)
    return frame.time_s, [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def _kind_by_name(path: str) -> str | None:
    """Return the kind by the file's name, or by the name of the nearest folder that has one; None where none has."""
    for part in reversed(Path(path).parts):
        if word := _KIND.match(part.lower()):
            return "flat" if word[1] == "flat" else "dark"
    return None


def _iso(raw: RawFile) -> int:
    """ISO of the Exif data; where it is missing or at the 16-bit tag's maximum, that of a name such as iso102400."""
    if raw.iso is not None and raw.iso < _LARGEST_SHORT:
        return round(raw.iso)
    named = _ISO.findall(raw.path.lower())
    if named:
        return int(named[-1])
    if raw.iso is None:
        raise PhotositeError("tells no ISO; put it into a folder named after it, such as iso1600", file=raw.path)
    return round(raw.iso)
