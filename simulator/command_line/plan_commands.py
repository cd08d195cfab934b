"""Commands before a frame: the plan of a shot, a lens in numbers, the page of sliders, files to start from.

What a command needs is imported inside it: `photosite --help` must not wait for OpenCL.
"""

import json
from pathlib import Path
from typing import Annotated

import typer

from simulator.command_line.app import app
from simulator.command_line.arguments import DeviceName, Settings, ShotFile, complete_camera, complete_kind, complete_shot


@app.command(epilog="Example: photosite explain color_checker --set lens.f_number=f/1.4 --patch 0.05")
def explain(
    shot: ShotFile,
    settings: Settings = None,
    patch: Annotated[float, typer.Option(metavar="REFLECTANCE", help="Of a grey patch, 0 to 1.")] = 0.18,
    same_shutter: Annotated[
        bool, typer.Option("--same-shutter", help="Keep the shutter over the ISO range, instead of the brightness.")
    ] = False,
    measured: Annotated[
        bool, typer.Option("--measure", help="Take the shot, too, and show each pass's time beside the predicted one.")
    ] = False,
    device: DeviceName = None,
    form: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="table, json, csv (a line for each value) or html (one page).")
    ] = "table",
) -> None:
    """Show what a shot amounts to.

    The plan: which steps run or are skipped and why; the passes with method, size, memory, predicted error and time; the
    lens and the exposure in numbers, with what the camera chose; where white lands; a grey patch from cd/m^2 over lux,
    photons and electrons to DN; and ISO by ISO the share of each source in the variance of its noise.
    """
    from simulator.command_line.explain import show_plan

    show_plan(shot, settings or [], patch, "exposure" if same_shutter else "brightness", device, measured, form)


@app.command(epilog="Example: photosite lens --focal-length 50mm --f-number f/1.8 --focus-distance 2m --plot lens.png")
def lens(
    shot: Annotated[
        str | None,
        typer.Argument(
            metavar="[SHOT]",
            help="Its lens, camera and exposure; options replace single values.",
            autocompletion=complete_shot,
        ),
    ] = None,
    focal_length: Annotated[str | None, typer.Option(metavar="LENGTH", help="Such as 50mm.")] = None,
    f_number: Annotated[str | None, typer.Option(metavar="F/N", help="Such as f/1.8.")] = None,
    focus_distance: Annotated[
        str | None, typer.Option(metavar="DISTANCE", help="Lens to the plane in focus, such as 2m; infinity when left out.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(metavar="CAMERA", help="Of configs/cameras, or a camera file.", autocompletion=complete_camera),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="SIZE", help="Such as 23.6mm x 15.6mm, or a format, see docs/lens.md; 36 mm x 24 mm when left out."
        ),
    ] = None,
    circle_of_confusion: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Largest blur circle that counts as sharp; diagonal / 1500 when left out."),
    ] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", metavar="DISTANCE", help="Blur circle of a point there, such as 4m. Repeatable.")
    ] = None,
    time: Annotated[str | None, typer.Option(metavar="TIME", help="Exposure time for the EV, such as 1/125s.")] = None,
    iso: Annotated[int | None, typer.Option(min=1, help="ISO for the EV; 100 when left out.")] = None,
    settings: Settings = None,
    layout: Annotated[str, typer.Option("--format", metavar="FORMAT", help="table, json or csv.")] = "table",
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="FILE", help="Draw blur against distance and the rays, to scale: png, svg, pdf."),
    ] = None,
) -> None:
    """Show a lens in numbers: field of view, 35 mm equivalents, depth of field, blur circles, Airy disk, EV.

    Without SHOT, --focal-length and --f-number are needed.
    """
    from simulator.command_line.lens import Choice, show_lens

    wanted = Choice(focal_length, f_number, focus_distance, circle_of_confusion, camera, sensor, at or [], time, iso)
    show_lens(shot, wanted, settings or [], layout, plot)


@app.command(epilog="Example: photosite explore color_checker")
def explore(
    shot: Annotated[Path, typer.Argument(metavar="SHOT", help="A shot file, or the name of one in configs/shots.")] = Path(
        "color_checker"
    ),
    settings: Settings = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0 takes a free one.")] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
    device: Annotated[str | None, typer.Option(help="Part of an OpenCL device's name; see `photosite devices`.")] = None,
) -> None:
    """Open a page on which aperture, shutter, ISO, focal length, focus, sensor format, scene and camera are chosen.

    It is served to this machine alone.
    """
    from simulator.command_line.explore import explore_shot

    explore_shot(shot, settings or [], port, not no_browser, device)


@app.command()
def devices() -> None:
    """List the OpenCL devices, GPUs first; the first is used unless --device or $PHOTOSITE_DEVICE names another."""
    from simulator.command_line.explain import show_devices

    show_devices()


@app.command(epilog="Example: photosite new shot portrait")
def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="shot, camera, study or dataset.", autocompletion=complete_kind)],
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Of the file, e.g. portrait; KIND when left out.")
    ] = None,
) -> None:
    """Write a commented file to start from, NAME.yaml, valid as it is. A file that is there is never overwritten."""
    from simulator.command_line.new import write_new_file
    from simulator.command_line.screen import tell

    path, command = write_new_file(kind, name)
    print(path)
    tell(f"use it: {command}")


@app.command(epilog="Example: photosite schema --out photosite.schema.json")
def schema(
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write here instead of to the screen.")] = None,
) -> None:
    """Print the JSON Schema of a shot file, for editors that complete and check YAML."""
    from simulator.config import schema as shot_schema

    text = json.dumps(shot_schema(), indent=2, ensure_ascii=False)
    if out is None:
        print(text)
        return
    from simulator.atomic_files import atomic_write
    from simulator.command_line.output_file import check_output

    check_output(out, "--out", (".json",))
    with atomic_write(out) as path:
        path.write_text(text + "\n", encoding="utf-8")
    print(out)
