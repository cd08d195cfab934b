"""Shards: parts of a data set that are written whole, verified, and skipped when they are there.

A shard is a file or a folder. It appears under its name complete or not at all; then a small record appears beside it, and only
what has a record counts as finished. So a run killed at any time is continued by the next one, and ends with the same bytes.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from data_gen.samples.sample import Sample
from data_gen.storage.summary import Summary
from data_gen.storage.writers.writer import AS_IT_IS, Writer, WriterOptions
from simulator.atomic_files import atomic_folder, atomic_write
from simulator.errors import PhotositeError, reading, require

RECORD = ".record.json"


@dataclass(frozen=True)
class Shard:
    """Which samples a shard holds: `count` of them from index `first` on; it is shard `index` of `shards`."""

    index: int
    shards: int
    first: int
    count: int

    @property
    def indices(self) -> range:
        """Indices of its samples in the data set."""
        return range(self.first, self.first + self.count)


@dataclass(frozen=True)
class ShardRecord:
    """What is known of a finished shard; the record beside it holds this as JSON, and a summary of the samples.

    bytes: of all its files. sha256: hexadecimal, as `sha256_of` computes it. format: the writer's.
    dataset: hash of the configuration it was made from; "" when none was given.
    """

    name: str
    index: int
    first: int
    count: int
    bytes: int
    sha256: str
    format: str
    dataset: str = ""

    def __post_init__(self) -> None:
        numbers, texts = (self.index, self.first, self.count, self.bytes), (self.name, self.sha256, self.format, self.dataset)
        if not all(type(one) is int for one in numbers) or not all(type(one) is str for one in texts):
            raise TypeError("a record has whole numbers and texts")


def plan_shards(count: int, per_shard: int) -> tuple[Shard, ...]:
    """Split `count` samples into shards of `per_shard`; the last one may hold fewer. Raises PhotositeError below 1."""
    require(count >= 1, "count", count, "a data set has at least one sample")
    require(per_shard >= 1, "writer.samples_per_shard", per_shard, "a shard has at least one sample")
    starts = range(0, count, per_shard)
    return tuple(Shard(index, len(starts), first, min(per_shard, count - first)) for index, first in enumerate(starts))


def shard_name(index: int, shards: int, suffix: str) -> str:
    """Name of a shard, such as `shard-00003-of-00012.tar`; names sort by index."""
    digits = max(5, len(str(shards)))
    return f"shard-{index:0{digits}d}-of-{shards:0{digits}d}{suffix}"


def write_shard(
    folder: Path,
    shard: Shard,
    writer: Writer,
    samples: Iterable[Sample],
    options: WriterOptions = AS_IT_IS,
    dataset: str = "",
) -> ShardRecord:
    """Write one shard, then its record; an older shard of that name is replaced.

    samples: those of `shard.indices`, in order; they are taken one at a time. dataset: hash of the configuration.
    Raises PhotositeError when the samples are others, when the format cannot hold them, and when the disk is full or
    cannot be written to; then neither shard nor record is there.
    """
    path = folder / shard_name(shard.index, shard.shards, writer.suffix)
    # A record of another configuration is removed first; one of this configuration describes the same bytes and may stay.
    if (old := _read_record(record_path(path))) is None or old.dataset != dataset:
        with suppress(FileNotFoundError, NotADirectoryError):
            record_path(path).unlink()
    summary = Summary()
    with (atomic_folder if writer.folder else atomic_write)(path) as temporary:
        writer.write(temporary, _check_indices(shard, samples, path, summary), _with_digits(options, shard))
        size_bytes, sha256 = _size(temporary), sha256_of(temporary)
    record = ShardRecord(path.name, shard.index, shard.first, shard.count, size_bytes, sha256, writer.format, dataset)
    with atomic_write(record_path(path)) as temporary:
        content = asdict(record) | {"summary": summary.counts()}
        temporary.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    return record


def finished_shards(folder: Path, dataset: str | None = None, verify: bool = False) -> dict[int, ShardRecord]:
    """Return the records of shards that are complete, by index: shard and record are there and the sizes agree.

    dataset: hash of the configuration; other shards are refused. verify: compare the SHA-256 of every byte, too.
    Raises PhotositeError when a shard was made from another configuration, for it would be mixed up with the others.
    """
    found: dict[int, ShardRecord] = {}
    for path in sorted(folder.glob(f"*{RECORD}")):
        record = _read_record(path)
        if record is None:
            continue
        if dataset is not None and record.dataset != dataset:
            raise PhotositeError(
                f"was made from another configuration ({record.dataset or 'unnamed'}, "
                f"now {dataset}); choose an empty folder, or delete this one",
                file=folder / record.name,
            )
        if find_problem(folder, record, verify) is None:
            found[record.index] = record
    return found


def find_problem(folder: Path, record: ShardRecord, verify: bool) -> str | None:
    """Return a message about what is wrong with a shard; None when it is complete."""
    path = folder / record.name
    if not path.exists():
        return f"{path}: is missing"
    size_bytes = _size(path)
    if size_bytes != record.bytes:
        return f"{path}: has {size_bytes} bytes instead of {record.bytes}"
    if verify and sha256_of(path) != record.sha256:
        return f"{path}: its SHA-256 is not that of the record: bytes have changed"
    return None


def sha256_of(path: Path) -> str:
    """SHA-256 of a file, or of a folder.

    Of a folder it is that of the lines `SHA-256  relative/path` of its files, sorted by path, which
    `find . -type f -printf '%P\\n' | LC_ALL=C sort | xargs sha256sum | sha256sum` computes as well.
    """
    if path.is_file():
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    lines = (f"{sha256_of(one)}  {one.relative_to(path).as_posix()}\n" for one in _files(path))
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def read_summary(folder: Path, record: ShardRecord) -> dict[str, dict[str, int]]:
    """Counts of what a finished shard holds (`data_gen.storage.summary`), from the record beside it."""
    path = record_path(folder / record.name)
    with reading(path, "delete it and run the same command again"):
        return json.loads(path.read_text(encoding="utf-8"))["summary"]


def _with_digits(options: WriterOptions, shard: Shard) -> WriterOptions:
    """Return the options with as many digits in names as the last index of the shard has, so that its names sort."""
    return replace(options, index_digits=max(options.index_digits, len(str(shard.indices[-1]))))


def _check_indices(shard: Shard, samples: Iterable[Sample], path: Path, summary: Summary) -> Iterator[Sample]:
    """Pass the samples on and add them to the summary. Raises PhotositeError unless they are those of the shard, in order."""
    wanted = iter(shard.indices)
    for sample in samples:
        if sample.index != (index := next(wanted, None)):
            raise PhotositeError(f"sample {sample.index} came where {index} belongs", file=path)
        summary.add(sample)
        yield sample
    if (missing := next(wanted, None)) is not None:
        raise PhotositeError(f"the samples end before {missing}; {shard.count} belong into this shard", file=path)


def _files(path: Path) -> list[Path]:
    """List the files of a folder, sorted by the bytes of their relative paths."""
    return sorted((one for one in path.rglob("*") if one.is_file()), key=lambda one: one.relative_to(path).as_posix().encode())


def _size(path: Path) -> int:
    """Return the bytes of a file, or of all files of a folder."""
    return path.stat().st_size if path.is_file() else sum(one.stat().st_size for one in _files(path))


def record_path(path: Path) -> Path:
    """Where the record of a shard lies."""
    return path.with_name(path.name + RECORD)


def _read_record(path: Path) -> ShardRecord | None:
    """Read a record; None for a file that is no valid record, so that its shard is made again."""
    try:
        with reading(path, "its shard is made again"):
            content = json.loads(path.read_text(encoding="utf-8"))
            del content["summary"]
            return ShardRecord(**content)
    except PhotositeError:
        return None
