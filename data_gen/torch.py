"""Pairs inside a PyTorch `DataLoader`: stored ones, and live ones whose noise is drawn when they are asked for.

A worker gets the indices of a whole batch (`__getitems__`, which DataLoader calls) and draws its noise there, in one launch for
up to 16 mosaics of 512 x 512 (`BATCH_PIXELS` of `data_gen/generate.py`).
What it draws is a function of the configuration, the epoch and the index alone. So the samples are the same in the main process
and in any number of workers, whatever the batches are. A worker opens its own OpenCL device when the first batch is asked for.
"""

import multiprocessing
import warnings
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any

from data_gen.generate import Generator, picture_window
from data_gen.recipe.dataset_config import DataSet, load_data_set
from data_gen.recipe.epoch_order import epoch_order
from data_gen.samples.packing import Channels
from data_gen.samples.sample import Sample
from data_gen.samples.tensors import TensorForm
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.storage.reading import SampleFolder
from simulator.config.random_streams import RandomStream
from simulator.device import open_device
from simulator.errors import require

try:
    import torch
    from torch.utils.data import DataLoader, Dataset, Sampler
except ImportError:
    raise ImportError("data_gen.torch needs PyTorch 2.4 or newer: pip install 'photosite[torch]'") from None

LARGEST_NUMBER = 2**63 - 1  # of a sample: what an int64 tensor holds


class Pairs(Dataset):
    """What both kinds of data sets have in common: an epoch that all workers see, and samples as tensors.

    A sample is a dictionary of tensors and words, see `TensorForm.of`. PyTorch's own collation makes batches of them.
    crops_per_picture, window: so many samples in a row share a picture, which an order that keeps so many pictures in use
    reads once; see `epoch_order`.
    """

    crops_per_picture, window = 1, 1

    def __init__(self, count: int, form: TensorForm) -> None:
        self.form, self._count = form, count
        # In shared memory, so that workers that live from epoch to epoch see the change.
        self._epoch = torch.zeros((), dtype=torch.int64).share_memory_()

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> dict[str, torch.Tensor | str]:
        return self.__getitems__([index])[0]

    def __getitems__(self, indices: Sequence[int]) -> list[dict[str, torch.Tensor | str]]:
        """Samples of a batch. Raises IndexError for an index that is not there."""
        places = [index + self._count if index < 0 else index for index in map(int, indices)]
        for index, place in zip(indices, places, strict=True):
            if not 0 <= place < self._count:
                raise IndexError(f"sample {index} of {self._count}")
        return [_tensors(self.form, sample) for sample in self.samples(places)]

    def samples(self, places: Sequence[int]) -> list[Sample]:
        """Samples by their numbers from 0 on, in this order."""
        raise NotImplementedError

    @property
    def epoch(self) -> int:
        """Number of the epoch, 0 at first."""
        return int(self._epoch)

    def set_epoch(self, epoch: int) -> None:
        """Go to an epoch, before the DataLoader is iterated. Workers that are there already follow.

        Raises PhotositeError for a negative number, and for one whose samples cannot be counted.
        """
        most = LARGEST_NUMBER // self._count - 1
        require(0 <= epoch <= most, "epoch", epoch, f"give a whole number from 0 to {most}")
        self._epoch.fill_(int(epoch))


class StoredPairs(Pairs):
    """The pairs of a data set's folder, in any of its formats; they are the same in every epoch.

    folder: as `photosite dataset --out` made it.
    channels, amplify: see `TensorForm`.
    Raises PhotositeError when the folder holds no data set.
    """

    def __init__(self, folder: str | Path, channels: Channels = "rggb", amplify: bool = True) -> None:
        self._folder = SampleFolder(folder)
        self._starts = list(accumulate((record.count for record in self._folder.records), initial=0))
        super().__init__(len(self._folder), TensorForm(channels, amplify))

    def samples(self, places: Sequence[int]) -> list[Sample]:
        """Read a batch, shard by shard."""
        order = sorted(range(len(places)), key=places.__getitem__)
        read = self._folder.read([self._index(places[one]) for one in order])
        found = dict(zip(order, read, strict=True))
        return [found[one] for one in range(len(places))]

    def _index(self, place: int) -> int:
        """Index in the data set; the two differ where shards are not made yet."""
        shard = bisect_right(self._starts, place) - 1
        return self._folder.records[shard].first + place - self._starts[shard]


class LivePairs(Pairs):
    """Pairs drawn when they are asked for, from a data set's configuration. Nothing is stored.

    Epoch e, index i is sample e * count + i of the configuration. So epoch 0 has the pairs that `photosite dataset` stores,
    and every later epoch has new pictures, places, cameras and noise, drawn in the same way.
    config: the configuration, its file, or the name of one in configs/datasets. channels, amplify: see `TensorForm`.
    device: part of an OpenCL device's name. decoded: where decoded photographs are kept, by default 8 GB in a folder of the
    user's; `DecodedPictures(0)` keeps none.
    A picture that cannot be used is replaced as in a stored data set, and a warning says so, or it is refused.
    """

    def __init__(
        self,
        config: DataSet | str | Path,
        channels: Channels = "rggb",
        amplify: bool = True,
        device: str | None = None,
        decoded: DecodedPictures | None = None,
    ):
        self.config = config if isinstance(config, DataSet) else load_data_set(config)
        self.decoded = DecodedPictures() if decoded is None else decoded
        self._device = device
        self.crops_per_picture, self.window = self.config.crops_per_picture, picture_window(self.config, self.decoded)
        self._generator: Generator | None = None
        self._warned: set[str] = set()  # messages of pictures that a warning was given for
        super().__init__(self.config.count, TensorForm(channels, amplify))

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_generator": None, "_warned": set()}  # an OpenCL device cannot be pickled

    def samples(self, places: Sequence[int]) -> list[Sample]:
        """Draw a batch; the noise of its frames is one launch for each kind of tile, up to `BATCH_PIXELS`."""
        if self._generator is None:
            self._generator = Generator(self.config, open_device(self._device), decoded=self.decoded)
        first = self.epoch * len(self)
        found = list(self._generator.samples(first + place for place in places))
        for message in self._generator.problems.keys() - self._warned:
            warnings.warn(f"another picture is taken in place of one that cannot be used: {message}", stacklevel=2)
            self._warned.add(message)
        return found


class EpochOrder(Sampler):
    """Indices in random order, a function of the seed, the data set's epoch, `crops_per_picture` and `window` alone."""

    def __init__(self, pairs: Pairs, seed: int = 0) -> None:
        self.pairs, self.seed = pairs, seed

    def __len__(self) -> int:
        return len(self.pairs)

    def __iter__(self) -> Iterator[int]:
        pairs, stream = self.pairs, RandomStream(self.seed, self.pairs.epoch)
        yield from epoch_order(stream, pairs.epoch * len(pairs), len(pairs), pairs.crops_per_picture, pairs.window)


def loader(
    pairs: Pairs, batch_size: int, *, num_workers: int = 0, shuffle: bool = True, seed: int = 0, **options: Any
) -> DataLoader:
    """`DataLoader` whose batches are the same for any number of workers, in a random order that is new in every epoch.

    Its workers are started by a fork server, on Windows anew, and live from epoch to epoch, so OpenCL may be used before. A
    script that uses workers needs `if __name__ == "__main__":`, as always with this method.
    seed: of the order. options: passed on to DataLoader, in place of what is said here.
    """
    if shuffle and "sampler" not in options:
        options["sampler"] = EpochOrder(pairs, seed)
    if num_workers:
        method = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
        context = multiprocessing.get_context(method)
        if method == "forkserver":
            context.set_forkserver_preload(
                ["__main__", __name__]
            )  # workers begin with all modules, which takes seconds to load
        options = {"multiprocessing_context": context, "persistent_workers": True} | options
    return DataLoader(pairs, batch_size, num_workers=num_workers, **options)


def _tensors(form: TensorForm, sample: Sample) -> dict[str, torch.Tensor | str]:
    return {name: value if isinstance(value, str) else torch.from_numpy(value) for name, value in form.of(sample).items()}
