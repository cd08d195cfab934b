from simulator.studies.study_result import StudyResult as StudyResult
from simulator.studies.study_result import load as load
from simulator.studies.study_run import StudyRun as StudyRun
from simulator.studies.study_run import load_study as load_study
from simulator.studies.study_run import run_study as run_study
