"""Making a data set: shard after shard, in this process or on a cluster, continued where an earlier run ended."""

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from data_gen.generate import Generator, margin_px
from data_gen.recipe.dataset_config import DataSet
from data_gen.report.card import About, write_card
from data_gen.samples.sample import Sample
from data_gen.sources.check import check_sources
from data_gen.sources.collections import open_collection
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.patches import AUGMENTATIONS
from data_gen.sources.procedural import Procedural
from data_gen.sources.source import PictureSource
from data_gen.storage.manifest import write_manifest
from data_gen.storage.shards import Shard, finished_shards, plan_shards, write_shard
from data_gen.storage.writers.writer import find_writer
from simulator import __version__
from simulator.atomic_files import atomic_write
from simulator.config import dump_yaml
from simulator.device import open_device
from simulator.errors import PhotositeError, reading
from simulator.progress import Progress, Steps, silent
from simulator.sensor.camera.cfa import CfaName
from simulator.studies.cluster import cluster, map_on_cluster

if TYPE_CHECKING:
    from dask.distributed import Client

CONFIGURATION = "dataset.yaml"
SAMPLES = "samples"  # unit of the progress


@dataclass(frozen=True)
class Task:
    """All that making shards needs; it travels to other machines.

    folder: where shards are written; on a cluster every machine sees it under this path.
    device: part of an OpenCL device's label, None for the default. fingerprint: hash of the configuration.
    decoded: where each machine keeps decoded pictures.
    """

    config: DataSet
    folder: Path
    device: str | None
    fingerprint: str
    decoded: DecodedPictures


@dataclass(frozen=True)
class Outcome:
    """What a run did.

    manifest: path of manifest.json. made, kept: shards written now, and those that were there.
    problems: what was wrong with pictures that were left out -> samples that had drawn them.
    """

    manifest: Path
    made: int
    kept: int
    problems: dict[str, int]


def fingerprint(config: DataSet) -> str:
    """Hash of all that the samples follow from, 32 hexadecimal digits: configuration, names and files of pictures, version.

    Of files of a folder of pictures it has the sizes. Raises PhotositeError for what a collection lacks.
    """
    digest = hashlib.sha256(f"{__version__}\n{json.dumps(config.resolved, sort_keys=True)}\n".encode())
    for collection in config.pictures:
        source = open_collection(config.pictures, collection, config.noise.list_cameras()[0])
        for text in chain([collection], source.names(), source.fingerprints()):
            digest.update(f"{text}\n".encode())
    return digest.hexdigest()[:32]


def run(
    config: DataSet,
    folder: Path,
    *,
    device: str | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
    decoded: DecodedPictures | None = None,
) -> Outcome:
    """Make what is missing of a data set, then its manifest. Killed at any time, the next run ends with the same bytes.

    workers: processes of this machine. scheduler: address of a running dask.distributed cluster instead.
    progress: called for each picture that is checked before the work, when the configuration refuses unusable ones; then for
        the samples that are done, beginning with those of finished shards.
    decoded: where decoded photographs are kept, by default 8 GB in a folder of the user's; it changes no byte.
    Raises PhotositeError for a folder that holds another data set, for a full disk, and for what pictures or cluster lack.
    """
    decoded = DecodedPictures() if decoded is None else decoded
    task = Task(config, folder.absolute(), device, fingerprint(config), decoded)
    find_writer(config.writer.format)  # raises here, before any work, when its library is missing
    plan = plan_shards(config.count, config.writer.samples_per_shard)
    found = finished_shards(folder, task.fingerprint)
    with atomic_write(folder / CONFIGURATION) as path:
        path.write_text(dump_yaml(config.resolved), encoding="utf-8")
    missing = [shard for shard in plan if shard.index not in found]
    if missing and config.on_problem == "refuse":
        check_pictures(config, progress, decoded, device)
    steps = Steps(progress, config.count)
    steps.add(SAMPLES, sum(record.count for record in found.values()))
    if missing and (workers > 1 or scheduler):
        with cluster(workers, scheduler) as client:
            _make_on_cluster(client, task, missing, steps)
    else:
        for shard in missing:
            make_shard(task, shard, steps)
    problems = _all_problems(folder, plan)
    lines = [f"{message} (drawn for {count} samples)" for message, count in problems.items()]
    manifest = write_manifest(folder, plan, task.fingerprint, config.writer.options, lines)
    write_card(folder, _describe(config))
    return Outcome(manifest, len(missing), len(found), problems)


def check_pictures(
    config: DataSet, progress: Progress = silent, decoded: DecodedPictures | None = None, device: str | None = None
) -> None:
    """Read all pictures that lie in files once. Raises PhotositeError that lists those which cannot be used."""
    cfas: list[CfaName] = sorted({camera.cfa for camera in config.noise.list_cameras()})
    for collection in config.pictures:
        source = open_collection(config.pictures, collection, config.noise.list_cameras()[0], decoded, device)
        if not isinstance(source, Procedural):
            (height, width), margin = config.crop_px, margin_px(config)
            around = height + 2 * margin, width + 2 * margin
            symmetries = AUGMENTATIONS if config.augment else AUGMENTATIONS[:1]
            check_sources([source], around, cfas, symmetries, progress).refuse()


def make_shard(task: Task, shard: Shard, steps: Steps | None = None) -> int:
    """Write one shard with its record, before it what was wrong with pictures; return its number of samples."""
    generator = Generator(task.config, open_device(task.device), _sources(task), task.decoded)
    path = task.folder / _problems_name(shard)

    def samples() -> Iterator[Sample]:
        for sample in generator.samples(shard.indices):
            yield sample
            if steps is not None:
                steps.add(SAMPLES)
        # The writer ends, and the record is written, after this: a shard with a record has its problems listed.
        _write_problems(path, generator.problems)

    choice = task.config.writer
    write_shard(task.folder, shard, find_writer(choice.format), samples(), choice.options, task.fingerprint)
    return shard.count


@lru_cache(maxsize=4)
def _sources_of(
    _fingerprint: str, _limit_bytes: int, _place: Path, _device: str | None
) -> dict[tuple[str, int], PictureSource]:
    """Return the dictionary of open collections of a configuration that keep decoded pictures there, empty at first."""
    return {}


def _sources(task: Task) -> dict[tuple[str, int], PictureSource]:
    """Return the open collections, which a process keeps between shards: listing a folder of a million pictures is slow."""
    return _sources_of(task.fingerprint, task.decoded.limit_bytes, task.decoded.place, task.device)


def _make_on_cluster(client: "Client", task: Task, shards: Iterable[Shard], steps: Steps) -> None:
    """Make shards on a cluster. One whose worker dies is made by another; a shard is there whole or not at all.

    Raises PhotositeError when a shard's workers die again and again, and what making it raises.
    """
    for _, made in map_on_cluster(client, partial(make_shard, task), shards):
        if isinstance(made, PhotositeError):
            raise made
        steps.add(SAMPLES, made)


def _describe(config: DataSet) -> About:
    """Return what the data card says of author and pictures."""
    known = config.resolved.get("pictures", {})
    kinds = {name: next(iter(section)) for name, section in known.items()}
    lines = tuple(
        f"{name}: {kind.replace('_', ' ')}, weight {config.picture_weights.get(name, 1.0):g}" for name, kind in kinds.items()
    )
    return About(config.name, config.description, config.license, lines, config.noise.warnings())


def _problems_name(shard: Shard) -> str:
    """Return the name of the file that lists the problems of a shard."""
    digits = max(5, len(str(shard.shards)))
    return f"problems-{shard.index:0{digits}d}.json"


def _write_problems(path: Path, problems: dict[str, list[int]]) -> None:
    """Write the problems of a shard; remove an older list when there are none."""
    if not problems:
        path.unlink(missing_ok=True)
        return
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(problems, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _all_problems(folder: Path, plan: Iterable[Shard]) -> dict[str, int]:
    """Read the problems of all shards; return how many samples met each."""
    found: Counter[str] = Counter()
    for path in (folder / _problems_name(shard) for shard in plan):
        if path.is_file():
            with reading(path, "delete it and its shard, and run the same command again"):
                found.update({message: len(drew) for message, drew in json.loads(path.read_text(encoding="utf-8")).items()})
    return dict(sorted(found.items()))
