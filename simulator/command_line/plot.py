"""`photosite plot`: curves of a camera, or of the camera and lens of a shot, as a figure and as numbers."""

from pathlib import Path

from simulator.color.color_tables import CONFIGS
from simulator.command_line.screen import show_waiting, tell
from simulator.config import load_camera, load_shot, named_file
from simulator.config.document import read_document
from simulator.config.emva_sheet import SUFFIXES
from simulator.errors import PhotositeError, require
from simulator.measurement.curves.subject import Subject, camera_subject, plots_of, shot_subject
from simulator.measurement.report.figures import check_format, plots_figure, write_figure
from simulator.measurement.report.plot import Plot, overlay, write_plots_csv


def draw_plots(subject: str, settings: list[str], names: list[str], isos: list[int], out: Path, table: Path | None) -> None:
    """Draw the plots of one camera or shot. Raises PhotositeError."""
    draw_subjects([find_subject(subject, settings, isos)], names, out, table)


def draw_subjects(subjects: list[Subject], names: list[str], out: Path, table: Path | None) -> None:
    """Draw plots of cameras and shots, those of one name together. Raises PhotositeError.

    names: of the plots, see PLOTS; none: all that a subject has. out: figure, its suffix says the format. table: CSV file of
    the numbers; None: none.
    """
    check_format(out, "--out")
    with show_waiting("curves"):
        plots = overlay([plot for subject in subjects for plot in plots_of(subject, names)])
        write_plots(plots, " and ".join(subject.name for subject in subjects), out, table)


def write_plots(plots: list[Plot], title: str, out: Path, table: Path | None) -> None:
    """Write the figure of plots, and their numbers; print the names of the files. Raises PhotositeError."""
    if table is not None:
        write_plots_csv(plots, table)
    write_figure(plots_figure(plots, title), out)
    for plot in plots:
        if plot.note:
            tell(f"note: {plot.title}: {plot.note}")
    for path in (out, table):
        if path is not None:
            print(path)


def find_subject(name: str, settings: list[str], isos: list[int]) -> Subject:
    """Return the camera or the shot of a name in configs/ or of a file; a file with a `scene` is a shot.

    settings: `path=value` texts of --set. Raises PhotositeError for neither.
    """
    if _is_camera(name):
        return camera_subject(load_camera(name, settings), isos)
    return shot_subject(load_shot(name, settings), isos)


def _is_camera(name: str) -> bool:
    """Whether a name or file is that of a camera. Raises PhotositeError with the nearest names for neither."""
    if Path(name).suffix.lower() in SUFFIXES:  # of a data sheet
        return True
    if not Path(name).is_file() and (CONFIGS / "cameras" / f"{name}.yaml").is_file():  # also of a folder of the library
        return True
    is_file = bool(Path(name).suffix) or "/" in name or Path(name).is_file()
    if not is_file:
        try:
            named_file("shots", name)
        except PhotositeError as error:
            cameras = ", ".join(sorted(path.stem for path in (CONFIGS / "cameras").glob("*.yaml")))
            raise error.replace(rule=f"{error.rule}; or name a camera: {cameras}") from None
        return False
    data = read_document(name).data
    require(isinstance(data, dict), "content", "no section", "give the file of a camera or of a shot", file=name)
    return "scene" not in data
