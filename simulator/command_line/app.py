"""The application, its groups of commands, and the options before a command."""

import os
from typing import Annotated

import typer

app = typer.Typer(
    name="photosite",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Raw-sensor image formation: a scene through lens, exposure, sensor and ADC into a DNG.",
    epilog="Try: photosite simulate color_checker --set exposure.iso=1600 --out frames",
)

validate = typer.Typer(
    no_args_is_help=True, rich_markup_mode="rich", help="Measure a camera back from the raw files it makes, and compare."
)

app.add_typer(validate, name="validate")

measure = typer.Typer(no_args_is_help=True, rich_markup_mode="rich", help="Measure a camera from a bench's own raw files.")

app.add_typer(measure, name="measure")


def _show_version(wanted: bool) -> None:
    if wanted:
        from simulator import __version__

        print(f"photosite {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", hidden=True)] = False,
) -> None:
    """Read the options that stand before the command."""
    if debug:
        os.environ["PHOTOSITE_DEBUG"] = "1"
    from simulator.command_line.screen import show_log

    show_log()
