"""Commands, options and their help."""

import json
import os
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="photosite",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Raw-sensor image formation: a scene through lens, exposure, sensor and ADC into a DNG.",
    epilog="Try: photosite simulate color_checker --set exposure.iso=1600 --out frames",
)

validate = typer.Typer(
    no_args_is_help=True, rich_markup_mode="rich", help="Measure a camera back from the raw files it makes, and compare."
)
app.add_typer(validate, name="validate")

ShotFile = Annotated[Path, typer.Argument(metavar="SHOT", help="A shot file, or the name of one in configs/shots.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. lens.f_number=f/8. Repeatable."),
]


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


@app.command(
    epilog="Example: photosite simulate color_checker --set lens.f_number=f/8 --set exposure.time='1/30 s' --out frames"
)
def simulate(
    shot: ShotFile,
    settings: Settings = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; made when it is missing.")] = Path(
        "."
    ),
    device: Annotated[str | None, typer.Option(help="Part of an OpenCL device's name; see `photosite devices`.")] = None,
    redo: Annotated[bool, typer.Option("--redo", help="Take the points of a sweep again even when their files stand.")] = False,
    no_truth: Annotated[bool, typer.Option("--no-truth", help="Write no NAME.truth.exr.")] = False,
    profile: Annotated[
        bool, typer.Option("--profile", help="Show where the time went: imports, builds, device, files.")
    ] = False,
) -> None:
    """Take the shot, or every point of its sweep: NAME.dng, NAME.truth.exr and NAME.json.

    A sweep also writes NAME.yaml for every point and a manifest.csv, and goes on where it was interrupted.
    """
    from simulator.progress import open_ledger

    ledger = open_ledger() if profile else None
    from simulator.command_line.simulation import simulate_file

    simulate_file(shot, settings or [], out, device, redo, not no_truth)
    if ledger is not None:
        from simulator.command_line.screen import tell

        tell(f"time: {ledger.text()}")


@app.command(epilog="Example: photosite resimulate frames/color_checker.dng --out again")
def resimulate(
    raw: Annotated[Path, typer.Argument(metavar="FILE.dng", help="A DNG that `photosite simulate` wrote.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Write the files here; else they are only compared.")
    ] = None,
    device: Annotated[str | None, typer.Option(help="Part of an OpenCL device's name; see `photosite devices`.")] = None,
) -> None:
    """Take the shot inside a DNG again, from that file alone, and compare the codes. Exit status 1 when one differs.

    Pictures the scene was read from must lie where they lay, or beside the DNG, unchanged.
    """
    from simulator.command_line.resimulation import resimulate_file

    resimulate_file(raw, out, device)


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
    """Open a page on which aperture, shutter, ISO, focal length, focus and sensor format are sliders.

    It is served to this machine alone.
    """
    from simulator.command_line.explore import explore_shot

    explore_shot(shot, settings or [], port, not no_browser, device)


@app.command(epilog="Example: photosite develop frames/color_checker.dng --out picture.png --exposure 1.5")
def develop(
    raw: Annotated[Path, typer.Argument(metavar="RAW", help="A raw file: DNG, or any that LibRaw reads.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="png, tiff, jpg or exr; default RAW.png (metric: .exr).")
    ] = None,
    output: Annotated[
        str, typer.Option(help="Colour space: srgb, linear_srgb, xyz, camera, or metric (measured signal).")
    ] = "srgb",
    demosaic: Annotated[str, typer.Option(help="Demosaicing method, e.g. ahd, dcb, linear.")] = "ahd",
    half_size: Annotated[bool, typer.Option("--half-size", help="One pixel per 2x2 block, without demosaicing.")] = False,
    white_balance: Annotated[
        str, typer.Option(help="camera, daylight, an illuminant (A, 3200 K), factors R,G,B, or a grey patch X,Y,WIDTH,HEIGHT.")
    ] = "camera",
    exposure: Annotated[float, typer.Option(metavar="EV", help="Lighten by 2^EV.")] = 0.0,
    sheet: Annotated[
        bool, typer.Option("--sheet", help="Truth, raw, developed and difference side by side: RAW.sheet.png.")
    ] = False,
    bits: Annotated[int | None, typer.Option(help="8 or 16 bits per channel; default 8 for jpg and png, else 16.")] = None,
) -> None:
    """Develop a raw file to a picture with LibRaw, or beside its truth with --sheet."""
    from simulator.command_line.development import develop_file, develop_sheet

    settings = {"output": output, "demosaic": demosaic, "half_size": half_size, "exposure_ev": exposure}
    print(develop_sheet(raw, out, settings, white_balance) if sheet else develop_file(raw, out, settings, white_balance, bits))


@app.command(epilog="Example: photosite inspect frames/color_checker.dng --json")
def inspect(
    raw: Annotated[Path, typer.Argument(metavar="RAW", help="A raw file of any camera that LibRaw reads.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Show what a raw file says and holds: camera, exposure, levels, histogram and noise of each colour."""
    from simulator.command_line.inspection import inspect_file

    inspect_file(raw, as_json)


@app.command()
def devices() -> None:
    """List the OpenCL devices, GPUs first; the first is used unless --device or $PHOTOSITE_DEVICE names another."""
    from simulator.command_line.explain import show_devices

    show_devices()


CameraName = Annotated[str, typer.Argument(metavar="CAMERA", help="A camera of configs/cameras, or a path to a camera file.")]
CameraSettings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. camera.bit_depth=12. Repeatable."),
]
ReportFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Keep the frames and write the report here; else only the table.")
]
DeviceName = Annotated[str | None, typer.Option("--device", help="Part of an OpenCL device's name; see `photosite devices`.")]


@validate.command(epilog="Example: photosite validate noise sony_a7s2 --iso 1600 --iso 2000 --out noise")
def noise(
    camera: CameraName,
    settings: CameraSettings = None,
    iso: Annotated[list[int] | None, typer.Option(help="An ISO; repeatable. All that were measured when left out.")] = None,
    out: ReportFolder = None,
    device: DeviceName = None,
) -> None:
    """Noise against ISO: K, read noise, full scale and dynamic range from dark frames and flat pairs.

    Simulates them as DNG files, measures the files alone, and compares with the camera file. Exit status 1 when a gate fails.
    """
    from simulator.command_line.validation import run_noise_validation

    run_noise_validation(camera, settings or [], iso or [], out, device)


@validate.command(epilog="Example: photosite validate emva sony_a7s2 --iso 1600 --out emva")
def emva(
    camera: CameraName,
    settings: CameraSettings = None,
    iso: Annotated[int | None, typer.Option(help="The ISO; the lowest that was measured when left out.")] = None,
    out: ReportFolder = None,
    device: DeviceName = None,
) -> None:
    """EMVA 1288 Release 4.0: quantum efficiency, K, dark noise, DSNU, PRNU, saturation, SNR, linearity per colour plane.

    Simulates the frames as DNG files, measures the files alone, and compares with the camera file.
    Exit status 1 when a gate fails.
    """
    from simulator.command_line.validation import run_emva_validation

    run_emva_validation(camera, settings or [], iso, out, device)


@validate.command(epilog="Example: photosite validate shutter sony_a7_iii --iso 100 --out shutter")
def shutter(
    camera: CameraName,
    settings: CameraSettings = None,
    readout_time: Annotated[
        str | None, typer.Option(metavar="TIME", help="Of a rolling shutter, e.g. 20ms; the camera's own when left out.")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--shutter",
            metavar="YAML",
            help="Keys as in exposure.shutter of a shot, e.g. '{travel_time: 3 ms, distance: 1 mm}'; rolling when left out.",
        ),
    ] = None,
    iso: Annotated[int | None, typer.Option(help="The ISO; the lowest that was measured when left out.")] = None,
    out: ReportFolder = None,
    device: DeviceName = None,
) -> None:
    """Shutter: read-out or travel time, flicker depth, flash band, efficiency, skew and blur of what moves.

    Simulates a lamp, a flash, steady light, a moving edge and a shake as DNG files, measures the files alone, and compares with
    what the shots state. Exit status 1 when a gate fails.
    """
    from simulator.command_line.validation import run_shutter_validation

    run_shutter_validation(camera, settings or [], readout_time, kind, iso, out, device)


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
) -> None:
    """Show what a shot amounts to.

    The plan: which steps run or are skipped and why; the passes with method, size, memory, predicted error and time; the
    lens and the exposure in numbers, with what the camera chose; where white lands; a grey patch from cd/m^2 over lux,
    photons and electrons to DN; and ISO by ISO the share of each source in the variance of its noise.
    """
    from simulator.command_line.explain import show_plan

    show_plan(shot, settings or [], patch, "exposure" if same_shutter else "brightness", device, measured)


@app.command(
    epilog="Example, with the frames of the example of `photosite validate noise`: "
    "photosite calibrate noise/frames --name 'Sony A7S II' --base sony_a7s2 --out mine.yaml"
)
def calibrate(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Raw files, or folders of them at any depth.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Camera file to write.")] = Path("camera.yaml"),
    name: Annotated[str, typer.Option(help="Maker and model, for the camera file.")] = "My Camera",
    base: Annotated[
        str | None, typer.Option(metavar="CAMERA", help="Takes from this camera what raw files cannot tell: pitch, response.")
    ] = None,
    pixel_pitch: Annotated[str | None, typer.Option(metavar="QUANTITY", help="Distance of the photosites, e.g. 4.3um.")] = None,
    response: Annotated[
        str | None, typer.Option(metavar="NAME", help="Spectral response: configs/responses, or a path.")
    ] = None,
    plots: Annotated[bool, typer.Option(help="Draw the fits into a PNG beside the camera file.")] = True,
) -> None:
    """Measure a camera from its raw files and write a camera file, every number with its 95 % interval.

    What to shoot, at each ISO, without noise reduction and with the same raw settings:
    1. dark frames: lens cap on, shortest time; 2 or more, 8 are good, 16 for fixed patterns.
    2. flat fields: an even, steady, out-of-focus white; 2 alike at each of 3 to 6 exposure times up to 70 % of white.
    3. once: 2 flats that clip, for the white level; dark frames of minutes, for the dark current.

    Dark frames and flats are told apart by a folder or file name that begins with dark, bias or flat, else by their level;
    ISO and time come from the files. docs/calibration.md says more, and which mistakes spoil the numbers.
    """
    from simulator.command_line.calibration import calibrate_files

    print(calibrate_files(files, out, name, base, pixel_pitch, response, plots))


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

    with atomic_write(out) as path:
        path.write_text(text + "\n", encoding="utf-8")
    print(out)
