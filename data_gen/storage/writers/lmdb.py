"""LMDB with the members of `data_gen/storage/writers/members.py` as its keys: codes with their pedestal, nothing clipped."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from data_gen.samples.sample import Sample
from data_gen.storage.writers.lmdb_file import new_lmdb, page_bytes, read_lmdb
from data_gen.storage.writers.members import byte_count, from_members, members
from data_gen.storage.writers.writer import WriterOptions


class LmdbWriter:
    """A folder with `data.mdb`; keys such as `000000012.noisy.npy`, values as files of those names would be."""

    format = "lmdb"
    suffix = ".lmdb"
    folder = True

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one database; see `Writer`."""
        with new_lmdb(path) as put:
            for sample in samples:
                for key, pieces in members(sample, options).items():
                    put(key, b"".join(pieces))

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read samples by their places; see `Writer`."""
        with read_lmdb(path) as transaction:
            with transaction.cursor() as cursor:
                cursor.first()
                digits = cursor.key().partition(b".")[0]
                for place in places:
                    start = f"{int(digits) + place:0{len(digits)}d}.".encode()
                    cursor.set_range(start)
                    contents: dict[str, bytes] = {}
                    for key, value in cursor:
                        if not key.startswith(start):
                            break
                        contents[key.decode("ascii").removeprefix(start.decode("ascii"))] = value
                    yield from_members(contents)

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Pages of one sample's values; see `Writer`."""
        return page_bytes({key: byte_count(pieces) for key, pieces in members(sample, options).items()})


WRITER = LmdbWriter()
