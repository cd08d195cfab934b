"""The command `photosite` with all its commands: those of the simulator, and `dataset`.

It stands here because imports run one way: the simulator does not know that data sets are made with it.
"""

from pathlib import Path
from typing import Annotated

import typer

from simulator.command_line.commands import app
from simulator.command_line.main import main

__all__ = ["dataset", "main"]


def _complete_config(incomplete: str) -> list[str]:
    from simulator.command_line.completion import complete_name

    return complete_name("datasets", incomplete)


ConfigFile = Annotated[
    Path,
    typer.Argument(
        metavar="CONFIG", help="A data set file, or the name of one in configs/datasets.", autocompletion=_complete_config
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. count=100. Repeatable."),
]


@app.command(epilog="Example: photosite dataset sony_a7s2_drawings --out pairs --dry-run")
def dataset(
    config: ConfigFile,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the shards; made when it is missing.")],
    settings: Settings = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only show counts, cameras, disk and time, from a measured batch.")
    ] = False,
    verify: Annotated[bool, typer.Option("--verify", help="Only compare every byte with the manifest.")] = False,
    workers: Annotated[int, typer.Option(min=1, help="Processes on this machine.")] = 1,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="A dask.distributed scheduler, host:port.")] = None,
    device: Annotated[str | None, typer.Option(help="Part of an OpenCL device's name; see `photosite devices`.")] = None,
    cache_gb: Annotated[
        float, typer.Option("--cache-gb", metavar="GB", min=0, help="Size of the folder of decoded photographs; 0: none.")
    ] = 8.0,
    cache_folder: Annotated[
        Path | None,
        typer.Option("--cache-folder", metavar="DIR", help="That folder; default: $PHOTOSITE_CACHE, else ~/.cache/photosite."),
    ] = None,
) -> None:
    """Make a data set of clean and noisy raw pairs, in shards, with manifest and data card.

    Killed at any time, the same command goes on and ends with the same bytes, for any number of workers and machines.
    """
    from data_gen import dataset_command
    from data_gen.sources.decoded_pictures import DecodedPictures

    decoded = DecodedPictures(round(1e9 * cache_gb), None if cache_folder is None else cache_folder.absolute())
    if verify:
        dataset_command.verify_folder(out)
    elif dry_run:
        dataset_command.show_plan(config, settings or [], out, device, workers, decoded)
    else:
        dataset_command.make(config, settings or [], out, device, workers, scheduler, decoded)


if __name__ == "__main__":
    main()
