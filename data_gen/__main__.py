"""Command line: `python -m data_gen motorcycle OUT.exr`."""

from pathlib import Path
from typing import Annotated

import typer

from data_gen.sources.motorcycle import motorcycle_scene
from simulator.errors import PhotositeError

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Make scenes for the simulator.")


@app.callback()
def _commands() -> None:
    """Make scenes for the simulator."""


@app.command()
def motorcycle(out: Annotated[Path, typer.Argument(help="EXR to write, such as motorcycle.exr")]) -> None:
    """Write the Middlebury Motorcycle as an EXR with R, G, B and depth Z in metres."""
    try:
        path = motorcycle_scene(out)
    except PhotositeError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(1) from None
    typer.echo(f"wrote {path}")


if __name__ == "__main__":
    app()
