"""Commands of one frame: take it, take it again, develop it, look into it.

What a command needs is imported inside it: `photosite --help` must not wait for OpenCL.
"""

from pathlib import Path
from typing import Annotated

import typer

from simulator.command_line.app import app
from simulator.command_line.arguments import Settings, ShotFile
from simulator.command_line.garbage import without_search


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
    with without_search():
        from simulator.device.programs_ahead import ProgramsAhead

        ahead = ProgramsAhead(f"simulate {shot}", device)  # beside the imports
        from simulator.command_line.simulation import simulate_file

    with ahead:
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
