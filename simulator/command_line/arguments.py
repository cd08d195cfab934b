"""Arguments and options that several commands take, with what a shell completes for them."""

from pathlib import Path
from typing import Annotated

import typer


def complete_shot(incomplete: str) -> list[str]:
    """Return the shots of the library, and shot files that begin so."""
    from simulator.command_line.completion import complete_name

    return complete_name("shots", incomplete)


def complete_camera(incomplete: str) -> list[str]:
    """Return the cameras of the library, and camera files that begin so."""
    from simulator.command_line.completion import complete_name

    return complete_name("cameras", incomplete)


def complete_subject(incomplete: str) -> list[str]:
    """Return the cameras and the shots of the library, and files and folders that begin so."""
    return list(dict.fromkeys([*complete_camera(incomplete), *complete_shot(incomplete)]))


def complete_study(incomplete: str) -> list[str]:
    """Return the studies of the library, and study files that begin so."""
    from simulator.command_line.completion import complete_name

    return complete_name("studies", incomplete)


def complete_response(incomplete: str) -> list[str]:
    """Return the responses of the library, and their files that begin so."""
    from simulator.command_line.completion import complete_name

    return complete_name("responses", incomplete)


def complete_kind(incomplete: str) -> list[str]:
    """Return the kinds of files that `photosite new` writes that begin so."""
    from simulator.command_line.completion import complete_template

    return complete_template(incomplete)


ShotFile = Annotated[
    Path,
    typer.Argument(metavar="SHOT", help="A shot file, or the name of one in configs/shots.", autocompletion=complete_shot),
]


Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. lens.f_number=f/8. Repeatable."),
]


DeviceName = Annotated[str | None, typer.Option("--device", help="Part of an OpenCL device's name; see `photosite devices`.")]


CameraName = Annotated[
    str,
    typer.Argument(
        metavar="CAMERA", help="A camera of configs/cameras, or a path to a camera file.", autocompletion=complete_camera
    ),
]


CameraSettings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. camera.bit_depth=12. Repeatable."),
]


ReportFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Keep the frames and write the report here; else only the table.")
]
