"""`photosite compare`: cameras and shots, studies, raw files, or raw files and models of cameras, in the same plots."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from simulator.command_line.plot import check_names, files_of, find_subject, write_plots
from simulator.command_line.screen import show_waiting
from simulator.config.emva_sheet import SUFFIXES
from simulator.errors import PhotositeError, require
from simulator.measurement.curves.lens_plots import mtf_on_sensor
from simulator.measurement.curves.raw_plots import model_plots, raw_plots, wanted_plots
from simulator.measurement.curves.subject import Subject, plots_of
from simulator.measurement.report.plot import Plot, overlay
from simulator.raw.raw_reader import read_raw_file
from simulator.studies.study_folder import TABLE

MODEL_FILES = (".yaml", ".yml", ".json", *SUFFIXES)  # of shots, cameras and data sheets
COMPARED_ISOS = (100, 1600)  # of cameras, where none is given: the nearest that they have


def compare(subjects: list[str], settings: list[str], names: list[str], isos: list[int], out: Path, table: Path | None) -> None:
    """Draw the subjects in the same plots. Raises PhotositeError.

    subjects: two or more names or files of cameras and shots, or folders of studies, or raw files, with or without cameras.
    settings: of cameras and shots. names: of plots; none: all. isos: of the curves over the signal, and of models where raw
    files do not say theirs. out: figure. table: CSV file of the numbers; None: none.
    """
    require(len(subjects) > 1, "subjects", subjects[0] if subjects else "", "give two or more to compare")
    kinds = [_kind_of(one) for one in subjects]
    check_names(out, table, lambda: _inputs(subjects, kinds, settings))
    with show_waiting("curves"):
        if "study" in kinds:
            others = [one for one, kind in zip(subjects, kinds, strict=True) if kind != "study"]
            require(not others, "subjects", ", ".join(others), "is no folder of a study; compare studies with studies")
            plots = _study_plots(subjects, names)
        elif "raw" in kinds:
            plots = _raw_plots(subjects, kinds, settings, names, isos)
        else:
            found = [_compared(one, settings, isos) for one in subjects]
            told = _distinct([one.name for one in found], subjects)
            named = [replace(one, name=name) for one, name in zip(found, told, strict=True)]
            plots = [_on_sensor(plot, subject) for subject in named for plot in plots_of(subject, names)]
        write_plots(overlay(plots), ", ".join(dict.fromkeys(_subjects_of(plots))), out, table)


def _on_sensor(plot: Plot, subject: Subject) -> Plot:
    return mtf_on_sensor(plot, subject.setting.camera) if plot.name == "mtf" else plot


def _subjects_of(plots: Sequence[Plot]) -> list[str]:
    return [line.subject for plot in plots for line in plot.lines]


def _kind_of(subject: str) -> str:
    """Return study, raw or model: a camera or a shot."""
    path = Path(subject)
    if path.is_dir():
        return "study"
    return "raw" if path.suffix and path.suffix.lower() not in MODEL_FILES else "model"


def _inputs(subjects: list[str], kinds: list[str], settings: list[str]) -> Iterator[Path]:
    """Yield the files that the subjects are read from."""
    for one, kind in zip(subjects, kinds, strict=True):
        if kind == "model":
            yield from files_of(one, settings)
        else:
            yield Path(one) / TABLE if kind == "study" else Path(one)


def _compared(name: str, settings: list[str], isos: list[int]) -> Subject:
    """Return a camera or shot, at ISOs that others are likely to have, too."""
    subject = find_subject(name, settings, isos)
    if isos or subject.lens is not None:
        return subject
    known = subject.setting.camera.isos
    nearest = {min(known, key=lambda one: abs(one - wanted)) for wanted in COMPARED_ISOS}
    return replace(subject, setting=replace(subject.setting, isos=tuple(sorted(nearest))))


def _distinct(names: Sequence[str], subjects: Sequence[str]) -> list[str]:
    """Return names that differ: those alike give way to the subjects as they were given; of one given twice, a number tells.

    subjects: the name or path of each, as the command has it.
    """
    shown = [str(Path(subject)) if names.count(name) > 1 else name for name, subject in zip(names, subjects, strict=True)]
    before = [shown[:index].count(name) for index, name in enumerate(shown)]
    return [f"{name} ({count + 1})" if count else name for name, count in zip(shown, before, strict=True)]


def _raw_plots(subjects: list[str], kinds: list[str], settings: list[str], names: list[str], isos: list[int]) -> list[Plot]:
    """Plots of raw files, and of each camera at the ISO and time of each file."""
    files = [one for one, kind in zip(subjects, kinds, strict=True) if kind == "raw"]
    cameras = [one for one, kind in zip(subjects, kinds, strict=True) if kind != "raw"]
    raws = [read_raw_file(one, any_pattern=True) for one in files]
    exposures = dict.fromkeys((iso, raw.exposure_time_s) for raw in raws for iso in isos or (raw.iso,))
    found = [raw_plots(raw) for raw in raws]
    for one in cameras:
        camera = find_subject(one, settings, []).setting.camera
        found.append([plot for iso, time_s in exposures for plot in model_plots(camera, iso, time_s)])
    told = _distinct([plots[0].lines[0].subject for plots in found], [*files, *cameras])
    return wanted_plots([plot.about(name) for plots, name in zip(found, told, strict=True) for plot in plots], names)


def _study_plots(folders: list[str], names: list[str]) -> list[Plot]:
    """Plots that several studies have, each with its own colour. names: of plots, by their beginnings; none: all."""
    from simulator.studies.report.study_input import open_study
    from simulator.studies.report.study_plots import study_plots

    studies = [open_study(Path(folder)) for folder in folders]
    told = _distinct([study.name for study in studies], folders)
    found = [plot.about(name) for study, name in zip(studies, told, strict=True) for plot in study_plots(study)]
    known = list(dict.fromkeys(plot.name for plot in found))
    for name in names:
        if name not in known:
            raise PhotositeError(f"give one of {', '.join(known)}", key="--only", value=name)
    return [plot for plot in found if not names or plot.name in names]
