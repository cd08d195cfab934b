"""Check every picture of a data set before the run, so that all problems are known before the work begins."""

import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from data_gen.sources.patches import AUGMENTATIONS, Augmentation, choose_crop
from data_gen.sources.source import PictureSource
from simulator.errors import PhotositeError
from simulator.progress import Progress, Steps, silent
from simulator.sensor.camera.cfa import CfaName

ProblemKind = Literal["not listed", "duplicate name", "unreadable", "too small"]


@dataclass(frozen=True)
class Problem:
    """One picture that cannot be used, or (kind "not listed", name "") a whole source.

    message: names the file, what is wrong and what helps.
    """

    source: int
    name: str
    kind: ProblemKind
    message: str


@dataclass(frozen=True)
class SourceReport:
    """What `check_sources` found: how many pictures are listed, and every problem in the order of the names."""

    pictures: int
    problems: tuple[Problem, ...]

    def counts(self) -> dict[ProblemKind, int]:
        """Problems by kind."""
        return dict(Counter(problem.kind for problem in self.problems))

    def refuse(self) -> None:
        """Raise PhotositeError with the count and the first problems, if there is any problem."""
        if self.problems:
            kinds = ", ".join(f"{count} {kind}" for kind, count in self.counts().items())
            shown = "\n  ".join(problem.message for problem in self.problems[:10])
            more = f"\n  and {len(self.problems) - 10} more" if len(self.problems) > 10 else ""
            raise PhotositeError(f"{self.pictures} pictures, of which cannot be used: {kinds}\n  {shown}{more}")


def check_sources(
    sources: Iterable[PictureSource],
    size: tuple[int, int] = (1, 1),
    cfas: Iterable[CfaName] = (),
    augmentations: Iterable[Augmentation] = AUGMENTATIONS,
    progress: Progress = silent,
) -> SourceReport:
    """Read every picture of all sources and note what is wrong, without stopping.

    size: height and width of the patches; a picture must hold one that begins with each of `cfas`, after some augmentation.
    progress: called after each picture.
    """
    listed: list[tuple[int, PictureSource, str]] = []
    problems: list[Problem] = []
    for number, source in enumerate(sources):
        try:
            listed += [(number, source, name) for name in source.names()]
        except PhotositeError as error:
            problems.append(Problem(number, "", "not listed", str(error)))
    wanted, symmetries = tuple(cfas), tuple(augmentations)
    composed: dict[str, int] = {}  # first source of each name, in Unicode's composed form
    steps = Steps(progress, len(listed))
    for number, source, name in listed:
        first = composed.setdefault(unicodedata.normalize("NFC", name), number)
        if first != number:
            message = f"{name}: in source {first + 1} and in source {number + 1}; rename one, or its folder"
            problems.append(Problem(number, name, "duplicate name", message))
        elif (problem := _problem(source, name, size, wanted, symmetries)) is not None:
            problems.append(Problem(number, name, *problem))
        steps.add("pictures looked at")
    return SourceReport(len(listed), tuple(problems))


def _problem(
    source: PictureSource, name: str, size: tuple[int, int], cfas: Sequence[CfaName], augmentations: Sequence[Augmentation]
) -> tuple[ProblemKind, str] | None:
    """Read a picture and choose a crop for each filter array; return the kind of problem and its message, None without one."""
    try:
        picture = source.read(name, np.random.default_rng(0))
    except PhotositeError as error:
        return "unreadable", str(error)
    try:
        for cfa in cfas:
            choose_crop(picture, size, cfa, augmentation=augmentations[0], name=name, others=augmentations)
    except PhotositeError as error:
        return "too small", str(error)
    return None
