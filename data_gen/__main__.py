"""Command line: `python -m data_gen motorcycle OUT.exr`, `moving NAME FOLDER`, `gallery TOPIC FOLDER`."""

from pathlib import Path
from typing import Annotated

import typer

from data_gen.sources.gallery_scenes import TOPICS, write_topic
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


@app.command()
def gallery(
    topic: Annotated[str, typer.Argument(help=f"Topic of docs/gallery.md: {', '.join(TOPICS)}.")],
    folder: Annotated[Path, typer.Argument(help="Folder for the scene's files and the shot file; made when it is missing.")],
) -> None:
    """Draw the scene of a topic of the gallery, and copy its shot file beside it."""
    try:
        path = write_topic(topic, folder)
    except PhotositeError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(1) from None
    typer.echo(f"wrote {path} and its scene; take it with: photosite simulate {path} --out {folder}")


if __name__ == "__main__":
    app()
