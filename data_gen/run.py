"""Making a data set: shard after shard, in this process or on a cluster, continued where an earlier run ended."""

import hashlib
import json
import logging
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path

from data_gen.generate import Generator, margin_px
from data_gen.recipe.dataset_config import DataSet
from data_gen.report.card import About, write_card
from data_gen.sources.check import check_sources
from data_gen.sources.collections import open_collection
from data_gen.sources.patches import AUGMENTATIONS
from data_gen.sources.procedural import Procedural
from data_gen.storage.manifest import write_manifest
from data_gen.storage.shards import Shard, finished, plan_shards, write_shard
from data_gen.storage.writers.writer import writer
from simulator import __version__
from simulator.atomic_files import atomic_write
from simulator.config import dump_yaml
from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.progress import Progress, Steps, silent

CONFIGURATION = "dataset.yaml"
SAMPLES = "samples"  # what progress is told of
IN_FLIGHT = 4  # shards handed to the cluster per worker: enough to keep it busy, few enough for a data set of any size


@dataclass(frozen=True)
class Task:
    """All that making shards needs; it travels to other machines.

    folder: where shards are written; on a cluster every machine sees it under this path.
    device: part of an OpenCL device's label, None for the default. fingerprint: hash of the configuration.
    """

    config: DataSet
    folder: Path
    device: str | None
    fingerprint: str


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
    """Hash of all that the samples follow from, 32 hexadecimal digits: configuration, names of the pictures, version."""
    digest = hashlib.sha256(f"{__version__}\n{json.dumps(config.resolved, sort_keys=True)}\n".encode())
    for collection in config.pictures:
        names = open_collection(config.pictures, collection, config.noise.seen_by()[0]).names()
        digest.update("\n".join((collection, *names, "")).encode())
    return digest.hexdigest()[:32]


def run(
    config: DataSet,
    folder: Path,
    *,
    device: str | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Outcome:
    """Make what is missing of a data set, then its manifest. Killed at any time, the next run ends with the same bytes.

    workers: processes of this machine. scheduler: address of a running dask.distributed cluster instead.
    progress: told of each picture that is looked at before the work, when the configuration refuses what cannot be used; then
        of the samples that are done, those found done first.
    Raises PhotositeError for a folder that holds another data set, for a full disk, and for what pictures or cluster lack.
    """
    task = Task(config, folder.absolute(), device, fingerprint(config))
    writer(config.writer.format)  # says so now when its library is missing
    plan = plan_shards(config.count, config.writer.samples_per_shard)
    found = finished(folder, task.fingerprint)
    with atomic_write(folder / CONFIGURATION) as path:
        path.write_text(dump_yaml(config.resolved), encoding="utf-8")
    missing = [shard for shard in plan if shard.index not in found]
    if missing and config.on_problem == "refuse":
        check_pictures(config, progress)
    steps = Steps(progress, config.count)
    steps.add(SAMPLES, sum(record.count for record in found.values()))
    if missing and (workers > 1 or scheduler):
        with cluster(workers, scheduler) as client:
            _on_cluster(client, task, missing, steps)
    else:
        for shard in missing:
            make_shard(task, shard, steps)
    problems = _all_problems(folder, plan)
    lines = [f"{message} (drawn for {count} samples)" for message, count in problems.items()]
    manifest = write_manifest(folder, plan, task.fingerprint, config.writer.options, lines)
    write_card(folder, _about(config))
    return Outcome(manifest, len(missing), len(found), problems)


def check_pictures(config: DataSet, progress: Progress = silent) -> None:
    """Read all pictures that lie in files once. Raises PhotositeError that lists those which cannot be used."""
    cfas = sorted({camera.cfa for camera in config.noise.seen_by()})
    for collection in config.pictures:
        source = open_collection(config.pictures, collection, config.noise.seen_by()[0])
        if not isinstance(source, Procedural):
            around = tuple(side + 2 * margin_px(config) for side in config.crop_px)
            symmetries = AUGMENTATIONS if config.augment else AUGMENTATIONS[:1]
            check_sources([source], around, cfas, symmetries, progress).refuse()


def make_shard(task: Task, shard: Shard, steps: Steps | None = None) -> int:
    """Write one shard with its record, before it what was wrong with pictures; return its number of samples."""
    generator = Generator(task.config, open_device(task.device), _sources(task))
    path = task.folder / _problems_name(shard)

    def samples() -> Iterator:
        for sample in generator.samples(shard.indices):
            yield sample
            if steps is not None:
                steps.add(SAMPLES)
        # The last sample is written behind this, and the record after it: a shard with a record has its problems listed.
        _write_problems(path, generator.problems)

    choice = task.config.writer
    write_shard(task.folder, shard, writer(choice.format), samples(), choice.options, task.fingerprint)
    return shard.count


def _made(task: Task, shard: Shard) -> int | PhotositeError:
    """Return what make_shard returns or raises: an error that is raised on a worker comes with dask's traceback."""
    try:
        return make_shard(task, shard)
    except PhotositeError as error:
        return error


@lru_cache(maxsize=4)
def _sources_of(_fingerprint: str) -> dict:
    return {}


def _sources(task: Task) -> dict:
    """Opened collections, kept by a process from shard to shard: listing a folder of a million pictures takes its time."""
    return _sources_of(task.fingerprint)


@contextmanager
def cluster(workers: int, scheduler: str | None) -> Iterator:
    """Yield a client of the cluster at an address, or of one of so many processes on this machine.

    Raises PhotositeError when dask.distributed is not installed or nobody answers.
    """
    try:
        from dask.distributed import Client, LocalCluster
    except ImportError:
        raise PhotositeError("several workers need dask.distributed: pip install 'photosite[cluster]'") from None
    if scheduler is None:
        # What goes wrong comes back as a result; dask's own log of workers that close is no news.
        quiet = logging.CRITICAL
        with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=quiet) as local:
            with Client(local) as client:
                yield client
        return
    try:
        client = Client(scheduler, timeout=20)
    except (OSError, ValueError) as error:
        raise PhotositeError(f"nobody answers there ({error}); give host:port", key="--scheduler", value=scheduler) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=60)
        except TimeoutError:
            raise PhotositeError(
                f"has no worker; start one with `dask worker {scheduler}`", key="--scheduler", value=scheduler
            ) from None
        yield client


def _on_cluster(client, task: Task, shards: Iterable[Shard], steps: Steps) -> None:
    """Make shards on a cluster. One whose worker dies is made by another; a shard is there whole or not at all.

    Raises PhotositeError when a shard's workers die again and again, and what making it raises.
    """
    from dask.distributed import KilledWorker, as_completed

    waiting = iter(shards)

    def handed(count: int) -> list:
        return [client.submit(_made, task, shard, pure=False) for shard in islice(waiting, count)]

    done = as_completed(handed(IN_FLIGHT * max(1, len(client.scheduler_info()["workers"]))))
    for future in done:
        try:
            made = future.result()
        except KilledWorker as error:
            raise PhotositeError(f"workers die again and again, most often of too little memory: {error}") from None
        if isinstance(made, PhotositeError):
            raise made
        steps.add(SAMPLES, made)
        for following in handed(1):
            done.add(following)


def _about(config: DataSet) -> About:
    """Return what the data card says of author and pictures."""
    known = config.resolved.get("pictures", {})
    kinds = {name: next(iter(section)) for name, section in known.items()}
    lines = tuple(
        f"{name}: {kind.replace('_', ' ')}, weight {config.picture_weights.get(name, 1.0):g}" for name, kind in kinds.items()
    )
    return About(config.name, config.description, config.license, lines)


def _problems_name(shard: Shard) -> str:
    digits = max(5, len(str(shard.shards)))
    return f"problems-{shard.index:0{digits}d}.json"


def _write_problems(path: Path, problems: dict[str, list[int]]) -> None:
    if not problems:
        path.unlink(missing_ok=True)
        return
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(problems, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _all_problems(folder: Path, plan: Iterable[Shard]) -> dict[str, int]:
    """Problems of all shards -> number of samples that met them."""
    found = Counter()
    for path in (folder / _problems_name(shard) for shard in plan):
        if path.is_file():
            for message, drew in json.loads(path.read_text(encoding="utf-8")).items():
                found[message] += len(drew)
    return dict(sorted(found.items()))
