"""Opens the folder of a study for its report."""

import os

from simulator.errors import reading
from simulator.studies.report.study_data import StudyFolder
from simulator.studies.study_folder import BROKEN, STUDY
from simulator.studies.study_result import load


def open_study(folder: str | os.PathLike[str]) -> StudyFolder:
    """Return a study and all that its report tells. Raises PhotositeError for a folder that holds no results of a study."""
    result = load(folder)
    path = result.folder / STUDY
    with reading(path, BROKEN):
        text, name = path.read_text(encoding="utf-8"), str(result.study["study"])
        description = str(result.study.get("description") or "")
    return StudyFolder(result, result.folder, name, description, list(result.curves), text, result.provenance)
