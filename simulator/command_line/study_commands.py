"""Commands of many shots: studies, their reports, and curves beside each other.

What a command needs is imported inside it: `photosite --help` must not wait for OpenCL.
"""

from pathlib import Path
from typing import Annotated

import typer

from simulator.command_line.app import app
from simulator.command_line.arguments import DeviceName, Settings, complete_study, complete_subject


@app.command(epilog="Example: photosite study iso_and_aperture --out iso_and_aperture --dry-run")
def study(
    study: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY", help="A study file, or the name of one in configs/studies.", autocompletion=complete_study
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
    subject: Annotated[
        str,
        typer.Argument(
            metavar="CAMERA|SHOT",
            help="Name in configs/cameras or configs/shots, or a file.",
            autocompletion=complete_subject,
        ),
    ],
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
        typer.Argument(
            metavar="A B ...",
            help="Cameras or shots; folders of studies; or raw files, also with cameras.",
            autocompletion=complete_subject,
        ),
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
