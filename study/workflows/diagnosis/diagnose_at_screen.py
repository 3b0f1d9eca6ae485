"""Run a diagnosis that was started from a screen of the application, and choose the folder of its results."""

from collections.abc import Callable
from itertools import count
from pathlib import Path

from study.errors import UserInterruptError
from study.store.formats.diagnosis_file import DIAGNOSIS_NAME
from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, diagnose_recordings


def diagnose_at_screen(plan: DiagnosePlan, on_progress: Callable[[str, float], None]) -> Path:
    """Run a diagnosis, and return the path of its diagnosis.json. on_progress: called with the name of the step and the
    share done, 0 to 1. Raises StudyError where the diagnosis fails, and UserInterruptError where the user stopped it;
    then no results are written."""
    try:
        return diagnose_recordings(plan, on_progress).out / DIAGNOSIS_NAME
    except KeyboardInterrupt as interruption:
        raise UserInterruptError(
            "The diagnosis was stopped",
            "It was not finished.",
            "Start it again when there is time.",
            saved="Nothing was written.",
        ) from interruption


def choose_result_folder(source: Path) -> Path:
    """Choose an unused path for the folder of the results: `diagnosis` in the folder of a session, or NAME-diagnosis
    next to the recording NAME.h5; with -2, -3, ... appended where it exists."""
    folder, name = (source, "diagnosis") if source.is_dir() else (source.parent, f"{source.stem}-diagnosis")
    numbered_paths = (folder / (name if number == 1 else f"{name}-{number}") for number in count(1))
    return next(path for path in numbered_paths if not path.exists())
