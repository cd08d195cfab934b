"""Command line: `python -m data_gen motorcycle OUT.exr`, `python -m data_gen moving NAME FOLDER`."""

from pathlib import Path
from typing import Annotated

import typer

from data_gen.sources.motorcycle import motorcycle_scene
from data_gen.sources.moving_scenes import SCENES, moving_scene
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


@app.command()
def moving(
    name: Annotated[str, typer.Argument(help=f"Scene to draw: {', '.join(SCENES)}.")],
    folder: Annotated[Path, typer.Argument(help="Folder for the layers, NAME_LAYER.exr.")],
) -> None:
    """Draw a scene of things that move, one EXR for each layer."""
    try:
        paths = moving_scene(name, folder)
    except PhotositeError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(1) from None
    for path in paths:
        typer.echo(f"wrote {path}")


if __name__ == "__main__":
    app()
