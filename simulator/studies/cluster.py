"""Work on several processes or machines by dask.distributed: the cluster, and a map whose results come as they are done."""

import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from simulator.errors import PhotositeError

if TYPE_CHECKING:
    from dask.distributed import Client

IN_FLIGHT = 4  # pieces of work handed to the cluster per worker: enough to keep it busy, few enough for any number of pieces
Item = TypeVar("Item")
Result = TypeVar("Result")


@contextmanager
def cluster(workers: int, scheduler: str | None) -> Iterator["Client"]:
    """Yield a client of the cluster at an address, or of one of so many processes on this machine.

    Raises PhotositeError when dask.distributed is not installed or nobody answers.
    """
    try:
        from dask.distributed import Client, LocalCluster
    except ImportError:
        raise PhotositeError("several workers need dask.distributed: pip install 'photosite[cluster]'") from None
    if scheduler is None:
        # Errors come back as results, so dask's log of workers that close is not shown.
        without_dashboard: dict[str, Any] = {"dashboard_address": None}  # allowed, but dask annotates it as str
        quiet = logging.CRITICAL
        with LocalCluster(n_workers=workers, threads_per_worker=1, silence_logs=quiet, **without_dashboard) as local:
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


def map_on_cluster(
    client: "Client", function: Callable[[Item], Result], items: Iterable[Item]
) -> Iterator[tuple[Item, Result | PhotositeError]]:
    """Yield each item with what the function returns for it, as they are done; items are taken when there is room for them.

    A worker that dies does not matter: another one does its work. A PhotositeError that the function raises comes in place of
    the result, and so does one for an item whose workers die again and again.
    """
    from dask.distributed import KilledWorker, as_completed

    waiting, running = iter(items), dict[Any, Item]()

    def submit(count: int) -> list[Any]:
        futures = [
            (client.submit(partial(_result_or_error, function), item, pure=False), item) for item in islice(waiting, count)
        ]
        running.update({future.key: item for future, item in futures})
        return [future for future, _ in futures]

    done = as_completed(submit(IN_FLIGHT * max(1, len(client.scheduler_info()["workers"]))))
    for future in done:
        try:
            made = future.result()
        except KilledWorker as error:
            made = PhotositeError(f"workers die again and again, most often of too little memory: {error}")
        yield running.pop(future.key), made
        for following in submit(1):
            done.add(following)


def _result_or_error(function: Callable[[Item], Result], item: Item) -> Result | PhotositeError:
    """Return what the function returns, or its error: dask would print a traceback of the worker."""
    try:
        return function(item)
    except PhotositeError as error:
        return error
