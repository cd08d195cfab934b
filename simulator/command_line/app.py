"""Commands, options and their help."""

import json
import os
from pathlib import Path
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


def _complete_shot(incomplete: str) -> list[str]:
    from simulator.command_line.completion import complete_name

    return complete_name("shots", incomplete)


def _complete_camera(incomplete: str) -> list[str]:
    from simulator.command_line.completion import complete_name

    return complete_name("cameras", incomplete)


def _complete_study(incomplete: str) -> list[str]:
    from simulator.command_line.completion import complete_name

    return complete_name("studies", incomplete)


def _complete_response(incomplete: str) -> list[str]:
    from simulator.command_line.completion import complete_name

    return complete_name("responses", incomplete)


def _complete_kind(incomplete: str) -> list[str]:
    from simulator.command_line.completion import complete_template

    return complete_template(incomplete)


ShotFile = Annotated[
    Path,
    typer.Argument(metavar="SHOT", help="A shot file, or the name of one in configs/shots.", autocompletion=_complete_shot),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. lens.f_number=f/8. Repeatable."),
]


DeviceName = Annotated[str | None, typer.Option("--device", help="Part of an OpenCL device's name; see `photosite devices`.")]


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


@app.command(epilog="Example: photosite study iso_and_aperture --out iso_and_aperture --dry-run")
def study(
    study: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY", help="A study file, or the name of one in configs/studies.", autocompletion=_complete_study
        ),
    ],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PATH=VALUE", help="Set one value of the shot at every point, by its dotted path."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results; named as the study when left out.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only show the points, and the time and disk they take.")] = False,
    workers: Annotated[int, typer.Option(min=1, help="Processes on this machine.")] = 1,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="A dask.distributed scheduler, host:port.")] = None,
    redo: Annotated[bool, typer.Option("--redo", help="Take points again that are done.")] = False,
    parquet: Annotated[
        bool, typer.Option("--parquet", help="Refuse to run without pyarrow, which writes the table as Parquet, too.")
    ] = False,
    device: DeviceName = None,
) -> None:
    """Take a shot at many points, measure each, and write a table of all varied, resolved and measured values.

    A point is done, failed, stale or missing by the hash of its shot, its input files, what is measured and the version. Killed
    at any time, the same command goes on with what is missing or stale, and ends with the same results for any number of
    workers and machines. A point that fails is told at once, and the others go on; the exit status is then 1.
    """
    from simulator.command_line.study import show_study, take_study

    if dry_run:
        show_study(study, settings or [], out, device, workers, redo)
    else:
        take_study(study, settings or [], out, device, workers, scheduler, redo, parquet)


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


@app.command(
    epilog="Example: photosite simulate slanted_edge --out frames; photosite mtf frames/slanted_edge.dng --plot edge.png"
)
def mtf(
    raw: Annotated[Path, typer.Argument(metavar="RAW", help="A raw file of any camera that LibRaw reads.")],
    area: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TOP,LEFT,HEIGHT,WIDTH",
            help="Photosites with one slanted edge and nothing else; repeatable. Looked for when left out.",
        ),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="Areas to look for, when none is given.")] = 4,
    pixel_pitch: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="Distance of the photosites, e.g. 4.3um: tells cycles/mm, too.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw curves and edges: png, svg or pdf.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with the curves instead of a table.")] = False,
) -> None:
    """Sharpness: modulation transfer of slanted edges (e-SFR of ISO 12233) in each colour of a raw file, not demosaiced.

    Finds areas with one straight edge, 2 to 43 degrees off the photosites' axes, or takes those of --area. MTF50 in cycles per
    pixel and line widths per picture height, the transfer at the Nyquist frequency, and the rise from 10 % to 90 %.
    """
    from simulator.command_line.measurement import measure_edges

    measure_edges(raw, area or [], most, pixel_pitch, plot, as_json)


@app.command()
def devices() -> None:
    """List the OpenCL devices, GPUs first; the first is used unless --device or $PHOTOSITE_DEVICE names another."""
    from simulator.command_line.explain import show_devices

    show_devices()


CameraName = Annotated[
    str,
    typer.Argument(
        metavar="CAMERA", help="A camera of configs/cameras, or a path to a camera file.", autocompletion=_complete_camera
    ),
]
CameraSettings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set one value by its dotted path, e.g. camera.bit_depth=12. Repeatable."),
]
ReportFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Keep the frames and write the report here; else only the table.")
]


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


BenchFiles = Annotated[list[Path], typer.Argument(metavar="FILES...", help="Raw files, or folders of them at any depth.")]
PixelPitch = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Distance of the photosites, e.g. 4.3um.")]
MeasureFolder = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write JSON and plots here, too.")]


@measure.command("noise", epilog="Example: photosite measure noise noise/frames --pixel-pitch 8.4um --out measured")
def measure_noise(
    files: BenchFiles,
    pixel_pitch: PixelPitch = None,
    circle_of_confusion: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="On the sensor, for the PDR; diagonal / 1291 when left out.")
    ] = None,
    out: MeasureFolder = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Noise against ISO: K, read and row noise, PRNU, full scale, dynamic range, and PDR where the pixel pitch is given.

    Takes dark frames and pairs of flats at each ISO, as `photosite calibrate` does, whose help says how to shoot them.
    """
    from simulator.command_line.bench_measurement import measure_noise as run

    run(files, pixel_pitch, circle_of_confusion, out, as_json)


@measure.command("emva")
def measure_emva(
    files: BenchFiles,
    iso: Annotated[int | None, typer.Option(help="The ISO, when the files are of several.")] = None,
    irradiance: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="Of the flats, on the sensor, e.g. '0.1 W/m^2'; for the photons.")
    ] = None,
    wavelength: Annotated[str | None, typer.Option(metavar="QUANTITY", help="Of the flats' light, e.g. 525nm.")] = None,
    pixel_pitch: PixelPitch = None,
    out: MeasureFolder = None,
) -> None:
    """EMVA 1288 Release 4.0 of one ISO: K, dark noise, saturation, SNR, DSNU, PRNU, linearity per colour plane.

    Takes, at one ISO and in steady, even light: dark frames of one exposure time, 2 or more, 16 are good; pairs of flats at 5
    exposure times or more, 20 are good, from 5 % of saturation to beyond it; more flats of about half of saturation for the
    PRNU. Told apart as `photosite calibrate` does. Quantum efficiency takes the light in photons:
    --irradiance '12 uW/cm^2' --wavelength 525nm --pixel-pitch 3um.
    """
    from simulator.command_line.bench_measurement import measure_emva as run

    run(files, iso, irradiance, wavelength, pixel_pitch, out)


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
            autocompletion=_complete_shot,
        ),
    ] = None,
    focal_length: Annotated[str | None, typer.Option(metavar="LENGTH", help="Such as 50mm.")] = None,
    f_number: Annotated[str | None, typer.Option(metavar="F/N", help="Such as f/1.8.")] = None,
    focus_distance: Annotated[
        str | None, typer.Option(metavar="DISTANCE", help="Lens to the plane in focus, such as 2m; infinity when left out.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(metavar="CAMERA", help="Of configs/cameras, or a camera file.", autocompletion=_complete_camera),
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


@app.command(
    epilog="Example, with the frames of the example of `photosite validate noise`: "
    "photosite calibrate noise/frames --name 'Sony A7S II' --base sony_a7s2 --out mine.yaml"
)
def calibrate(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Raw files, or folders of them at any depth.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Camera file to write.")] = Path("camera.yaml"),
    name: Annotated[str, typer.Option(help="Maker and model, for the camera file.")] = "My Camera",
    base: Annotated[
        str | None,
        typer.Option(
            metavar="CAMERA",
            help="Takes from this camera what raw files cannot tell: pitch, response.",
            autocompletion=_complete_camera,
        ),
    ] = None,
    pixel_pitch: Annotated[str | None, typer.Option(metavar="QUANTITY", help="Distance of the photosites, e.g. 4.3um.")] = None,
    response: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Spectral response: configs/responses, or a path.", autocompletion=_complete_response
        ),
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


@app.command(epilog="Example: photosite new shot portrait")
def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="shot, camera, study or dataset.", autocompletion=_complete_kind)],
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


PlotNames = Annotated[
    list[str] | None,
    typer.Option(
        "--only",
        metavar="PLOT",
        help="snr, noise, photon_transfer, dynamic_range, mtf, blur or depth_of_field; repeatable. All when left out.",
    ),
]
PlotFile = Annotated[Path, typer.Option("--out", metavar="FILE", help="Figure to write: .svg, .png or .pdf.")]
PlotNumbers = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write the numbers of the lines, too.")]
PlotIsos = Annotated[list[int] | None, typer.Option("--iso", help="ISO of the curves over the signal; repeatable.")]


@app.command(epilog="Example: photosite plot sony_a7s2 --only snr --only noise --out plots.svg --csv plots.csv")
def plot(
    subject: Annotated[str, typer.Argument(metavar="CAMERA|SHOT", help="Name in configs/cameras or configs/shots, or a file.")],
    settings: Settings = None,
    only: PlotNames = None,
    iso: PlotIsos = None,
    out: PlotFile = Path("plots.svg"),
    csv: PlotNumbers = None,
) -> None:
    """Draw curves of a camera, or of the camera and lens of a shot, from their own models.

    SNR against exposure, noise and dynamic range against ISO, photon transfer, modulation transfer; with the lens of a shot
    also blur circle and depth of field against distance.
    """
    from simulator.command_line.plot import draw_plots

    draw_plots(subject, settings or [], only or [], iso or [], out, csv)


@app.command(epilog="Example: photosite compare sony_a7s2 nikon_d850 --out cameras.svg")
def compare(
    subjects: Annotated[
        list[str],
        typer.Argument(metavar="A B ...", help="Cameras or shots; folders of studies; or raw files, also with cameras."),
    ],
    settings: Settings = None,
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="PLOT", help="One plot; repeatable. All when left out.")
    ] = None,
    iso: PlotIsos = None,
    out: PlotFile = Path("compared.svg"),
    csv: PlotNumbers = None,
) -> None:
    """Draw two or more in the same plots: cameras, shots, studies or raw files.

    A camera beside raw files is its model at their ISO and exposure time: noise and SNR against the signal.
    """
    from simulator.command_line.compare import compare as compare_subjects

    compare_subjects(subjects, settings or [], only or [], iso or [], out, csv)


@app.command(epilog="Example: photosite report iso_and_aperture --out report.html")
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `photosite study` wrote.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="HTML page to write; DIR/report.html when left out.")
    ] = None,
    pdf: Annotated[
        Path | None, typer.Option("--pdf", metavar="FILE", help="Print a PDF, too; needs Chromium, Chrome or Edge.")
    ] = None,
) -> None:
    """Write the report of a study: one HTML page that needs nothing else.

    Summary, the plots that the axes suggest, worst points, contact sheet, the table of all points, and provenance.
    """
    from simulator.command_line.report import write_report

    write_report(folder, out, pdf)


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
