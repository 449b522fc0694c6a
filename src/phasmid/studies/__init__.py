"""Studies: many runs of a varied scenario, one row of numbers for each."""

from phasmid.studies.definition import Study, load_study_file
from phasmid.studies.driver import repeat_run, study
from phasmid.studies.results import DamagedPart, StudyResults, load_study

__all__ = [
    "DamagedPart",
    "Study",
    "StudyResults",
    "load_study",
    "load_study_file",
    "repeat_run",
    "study",
]
