"""Commands that measure a camera: from frames that it makes, or from files of a bench.

What a command needs is imported inside it: `photosite --help` must not wait for OpenCL.
"""

from pathlib import Path
from typing import Annotated

import typer

from simulator.command_line.app import app, measure, validate
from simulator.command_line.arguments import (
    CameraName,
    CameraSettings,
    DeviceName,
    ReportFolder,
    complete_camera,
    complete_response,
)


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


@app.command(epilog="Example: photosite sheet sony_a7s2 --iso 1600 --wavelength 525nm --out a7s2.xml")
def sheet(
    camera: CameraName,
    settings: CameraSettings = None,
    iso: Annotated[int | None, typer.Option(help="The ISO; the lowest that was measured when left out.")] = None,
    wavelength: Annotated[
        str | None,
        typer.Option(metavar="QUANTITY", help="Of the light, e.g. 525nm; where the camera responds most when left out."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE.xml", help="Write it as the XML of EMVA 1288's reference implementation."),
    ] = None,
) -> None:
    """EMVA 1288 data sheet of a camera file: what its stages state, without a frame.

    `photosite validate emva` measures the same from simulated frames. The XML is a camera again: `camera: FILE.xml`.
    """
    from simulator.command_line.data_sheet import show_sheet

    show_sheet(camera, settings or [], iso, wavelength, out)


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
    high_pass: Annotated[
        bool, typer.Option("--high-pass", help="For uneven light: DSNU and PRNU behind the standard's high pass.")
    ] = False,
    out: MeasureFolder = None,
) -> None:
    """EMVA 1288 Release 4.0 of one ISO: K, dark noise, saturation, SNR, DSNU, PRNU, linearity per colour plane.

    Takes, at one ISO and in steady, even light: dark frames of one exposure time, 2 or more, 16 are good; pairs of flats at 5
    exposure times or more, 20 are good, from 5 % of saturation to beyond it; more flats of about half of saturation for the
    PRNU. Told apart as `photosite calibrate` does. In uneven light give --high-pass. Quantum efficiency takes the light in
    photons: --irradiance '12 uW/cm^2' --wavelength 525nm --pixel-pitch 3um.
    """
    from simulator.command_line.bench_measurement import measure_emva as run

    run(files, iso, irradiance, wavelength, pixel_pitch, out, high_pass)


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
            autocompletion=complete_camera,
        ),
    ] = None,
    pixel_pitch: Annotated[str | None, typer.Option(metavar="QUANTITY", help="Distance of the photosites, e.g. 4.3um.")] = None,
    response: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Spectral response: configs/responses, or a path.", autocompletion=complete_response),
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
