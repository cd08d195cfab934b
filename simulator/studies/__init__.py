"""Studies that take many shots: `run_study` makes one, `load` reads its results."""

from simulator.studies.study_result import StudyResult, load
from simulator.studies.study_run import StudyRun, load_study, run_study

__all__ = ["StudyResult", "StudyRun", "load", "load_study", "run_study"]
