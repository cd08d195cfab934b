"""Clean pictures from a data set that was made before: pictures are read and cut once, noise is drawn anew each time."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np

from data_gen.sources.source import CleanImage
from data_gen.storage.reading import SampleFolder
from simulator.errors import PhotositeError, require

KEY = "data_set"


@dataclass(frozen=True)
class DataSetSamples:
    """Clean frames of a data set, of each sample the first: (code - black) / (white - black), as mosaics.

    They end at 1: what the clean frame lost above white does not come back.
    data_set: folder as `photosite dataset --out` made it, in any format.
    """

    data_set: Annotated[Path, "folder of a data set"]

    def names(self) -> tuple[str, ...]:
        """Return the samples' indices, nine digits or more, in order. Raises PhotositeError when there is no data set."""
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(f"{index:09d}" for index in self._samples.indices)

    @cached_property
    def _samples(self) -> SampleFolder:
        try:
            return SampleFolder(self.data_set)
        except PhotositeError as error:
            rule = f"{error.rule}; give the folder that `photosite dataset --out` made"
            raise error.replace(file=None, key=KEY, value=error.file, rule=rule) from None

    def fingerprints(self) -> Iterator[str]:
        """Yield name and SHA-256 of each shard, from its record."""
        for record in self._samples.records:
            yield f"{record.name} {record.sha256}"

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Read one sample; nothing is drawn. Raises PhotositeError for one that is not there or damaged."""
        require(name.isdecimal(), KEY, name, f"{self.data_set} has samples by number, such as {self._names[0]}")
        sample = self._samples[int(name)]
        span_dn = np.float32(sample.white_level_dn - sample.black_level_dn)
        signal = (sample.clean_dn[0] - np.float32(sample.black_level_dn)) / span_dn
        # A format may hold clean codes in steps of its own, and so a hair below black.
        return CleanImage(np.maximum(signal, np.float32(0)), sample.cfa, sample.white_balance, sample.color_matrix)
