"""WebDataset: a tar archive whose members of one sample share the name up to the first dot.

Convention: github.com/webdataset/webdataset; its decoder takes `.npy` and `.json` by the last part of the name, so a sample
arrives as {"noisy.npy": array, "clean.npy": array, "json": facts}. Members stand in the order of the samples.
"""

import tarfile
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

from data_gen.samples.sample import Sample
from data_gen.storage.writers.members import byte_count, from_members, members
from data_gen.storage.writers.writer import WriterOptions

_BLOCK_BYTES = tarfile.BLOCKSIZE


class WebDatasetWriter:
    """A tar archive (POSIX ustar) without times, owners or anything else that differs between runs."""

    format = "webdataset"
    suffix = ".tar"
    folder = False

    def write(self, path: Path, samples: Iterable[Sample], options: WriterOptions) -> None:
        """Write one archive; see `Writer`."""
        with open(path, "wb") as file:
            for sample in samples:
                for name, pieces in members(sample, options).items():
                    header = tarfile.TarInfo(name)  # time, user and group are 0, the mode is rw-r--r--
                    header.size = byte_count(pieces)
                    file.write(header.tobuf(tarfile.USTAR_FORMAT))
                    for piece in pieces:
                        file.write(piece)
                    file.write(bytes(-header.size % _BLOCK_BYTES))
            file.write(bytes(2 * _BLOCK_BYTES))  # the end of an archive
            file.write(bytes(-file.tell() % tarfile.RECORDSIZE))

    def read(self, path: Path, places: Iterable[int]) -> Iterator[Sample]:
        """Read samples by their places; see `Writer`."""
        state = path.stat()
        found = _positions(path, state.st_mtime_ns, state.st_size)
        with open(path, "rb") as file:
            for place in places:
                contents = {}
                for name, (offset, size) in found[place].items():
                    file.seek(offset)
                    contents[name] = file.read(size)
                yield from_members(contents)

    def bytes_per_sample(self, sample: Sample, options: WriterOptions) -> int:
        """Each member has a header of one block and is filled up to blocks; see `Writer`."""
        sizes = [byte_count(pieces) for pieces in members(sample, options).values()]
        return sum(_BLOCK_BYTES + one + -one % _BLOCK_BYTES for one in sizes)


WRITER = WebDatasetWriter()


@lru_cache(maxsize=256)
def _positions(path: Path, changed_ns: int, size_bytes: int) -> list[dict[str, tuple[int, int]]]:
    """Offset and size of each member by name, sample by sample. The arguments after the path make a new file a new entry."""
    found: dict[str, dict[str, tuple[int, int]]] = {}
    with tarfile.open(path, "r:") as archive:
        for member in archive:
            index, _, name = member.name.partition(".")
            found.setdefault(index, {})[name] = (member.offset_data, member.size)
    return list(found.values())
