"""`photosite plot`: curves of a camera, or of the camera and lens of a shot, as a figure and as numbers."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from simulator.color.color_tables import CONFIGS
from simulator.command_line.output_file import check_output
from simulator.command_line.screen import show_waiting, tell
from simulator.config import load_camera, load_shot, named_file
from simulator.config.document import read_document
from simulator.config.emva_sheet import SUFFIXES
from simulator.config.source_files import camera_files, shot_files
from simulator.errors import PhotositeError, require
from simulator.measurement.curves.subject import Subject, camera_subject, plots_of, shot_subject
from simulator.measurement.report.figures import FORMATS, plots_figure, write_figure
from simulator.measurement.report.plot import Plot, overlay, write_plots_csv


def draw_plots(subject: str, settings: list[str], names: list[str], isos: list[int], out: Path, table: Path | None) -> None:
    """Draw the plots of one camera or shot. Raises PhotositeError.

    names: of the plots, see PLOTS; none: all that the subject has. out: figure, its suffix says the format. table: CSV file of
    the numbers; None: none.
    """
    check_names(out, table, lambda: files_of(subject, settings))
    found = find_subject(subject, settings, isos)
    with show_waiting("curves"):
        write_plots(overlay(plots_of(found, names)), found.name, out, table)


def check_names(out: Path, table: Path | None, inputs: Callable[[], Iterable[Path]]) -> None:
    """Raise PhotositeError where figure or table cannot have these names. inputs: as of `check_output`."""
    check_output(out, "--out", FORMATS, inputs)
    if table is not None:
        check_output(table, "--csv", (".csv",), inputs)


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


def files_of(name: str, settings: list[str]) -> Iterator[Path]:
    """Yield the files that a subject as of `find_subject` is read from. Raises PhotositeError."""
    yield from camera_files(name, settings) if _is_camera(name) else shot_files(name, settings)


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
