"""Read the input of a diagnosis: recordings or the trials of a session, and the model to compare with.

Recordings are checked for consistent channels, units and rates, converted to forces where a force constant is given,
and brought into the form in which they can be compared.
"""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from analysis.diagnosis.data.input_checks import NothingToDiagnoseError, require_comparable, require_model_of
from analysis.diagnosis.localisation.model_error_floor import IncomparableRecordingsError
from analysis.diagnosis.prepare_recordings import prepare_comparison, prepare_recordings
from analysis.wording import begin_sentence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.errors import StudyError, WrongUseError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.workflows.recording.read_any_recording import read_any_recording

Checked = TypeVar("Checked")
"""Type of the result of the function that `_translate_refusal` calls."""


@dataclass(frozen=True, slots=True, eq=False)
class DiagnosisInput:
    """Recordings for a diagnosis, in the form in which they can be compared, and facts about their source."""

    recordings: tuple[Recording, ...]
    names: tuple[str, ...]
    """Name of each recording's source, for messages and reports."""
    parents: tuple[Path, ...]
    """Input files."""
    remarks: tuple[str, ...]
    """Sentences on what was changed or noticed while reading."""
    simulated: bool = False
    """Whether the recordings are trials of a session on the simulated omega.3."""
    spring_n_per_m: float = 0.0
    """Stiffness of the virtual spring that held the handle, whose force is not part of the commands (sessions only)."""
    constants: tuple[float, ...] = ()
    """Force constants by which commands were multiplied, N or N m per unit of the command; empty without any."""


def read_input(
    sources: Sequence[Path], seed: int, for_force_balance: bool = False, constants: tuple[float, ...] = ()
) -> DiagnosisInput:
    """Read recordings, or the folder of one session; a session with reference probes is represented by these instead of
    its trials (`find_references`). seed: of the choice among a session's trials. for_force_balance: convert to one
    motion per force, as a force balance needs (`one_motion_per_force`). constants: see `convert_commands_to_forces`;
    not used for a session, whose commands are forces. Raises StudyError."""
    session_folders = [source for source in sources if source.is_dir()]
    if session_folders and len(sources) > 1:
        raise make_not_diagnosable_error(
            (f"{session_folders[0]} is a folder: a session is diagnosed alone",), "Give recordings, or one session."
        )
    if session_folders:
        # Imported here, because the modules that read sessions take long to import.
        from study.workflows.diagnosis.join_session_trials import join_session_trials
        from study.workflows.diagnosis.session_references import find_references

        if (references := find_references(session_folders[0])) is not None:
            reference_input = read_input(references.paths, seed, for_force_balance)
            parents, remarks = (references.log, *references.paths), (*references.remarks, *reference_input.remarks)
            return replace(reference_input, parents=parents, remarks=remarks)
        joined_trials = join_session_trials(session_folders[0], seed)
        comparable_trials = _translate_refusal(
            lambda: prepare_comparison((joined_trials.recording,), (joined_trials.name,), for_force_balance)
        )
        return DiagnosisInput(
            comparable_trials.recordings, (joined_trials.name,), joined_trials.parents,
            (*joined_trials.remarks, *comparable_trials.remarks), joined_trials.simulated, joined_trials.spring_n_per_m,
        )  # fmt: skip
    recordings_with_notes = [read_any_recording(source) for source in sources]
    recordings, names = tuple(recording for recording, _ in recordings_with_notes), _name_sources(sources)
    _translate_refusal(lambda: require_comparable(recordings, names))
    force_recordings, constant_remarks = _convert_to_forces(recordings, constants)
    prepared_recordings = _translate_refusal(lambda: prepare_recordings(force_recordings, names, for_force_balance))
    notes = dict.fromkeys(note for _, notes in recordings_with_notes for note in notes)
    remarks = (*notes, *constant_remarks, *prepared_recordings.remarks)
    return DiagnosisInput(prepared_recordings.recordings, names, tuple(sources), remarks, constants=constants)


def _translate_refusal(operation: Callable[[], Checked]) -> Checked:
    """Call `operation` and return its result. Raises StudyError where it raises NothingToDiagnoseError."""
    try:
        return operation()
    except NothingToDiagnoseError as refusal:
        raise make_not_diagnosable_error(refusal.problems) from refusal


def _convert_to_forces(
    recordings: tuple[Recording, ...], constants: Sequence[float]
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Multiply commands by the force constants. Returns the recordings and the remark on the conversion of the first;
    unchanged recordings and no remark without constants. Raises WrongUseError for a wrong constant."""
    if not constants:
        return recordings, ()
    from analysis.diagnosis.data.force_constant import ForceConstantError, convert_commands_to_forces

    try:
        converted_recordings = [convert_commands_to_forces(recording, constants) for recording in recordings]
    except ForceConstantError as refusal:
        raise WrongUseError(
            "The force constant cannot be used", f"{begin_sentence(str(refusal))}.",
            "Leave --force-constant out, or correct it.",
            saved="Nothing was written.",
        ) from refusal  # fmt: skip
    return tuple(recording for recording, _ in converted_recordings), (converted_recordings[0][1],)


def read_given_model(path: Path, diagnosis_input: DiagnosisInput) -> MechanicalModel:
    """Read the given model. Raises StudyError, also if it does not fit the recordings' device."""
    model = read_mechanical_model(path)
    try:
        require_model_of(model, diagnosis_input.recordings)
    except NothingToDiagnoseError as refusal:
        raise StudyError(
            "Model and recording do not belong together",
            _join_sentences(refusal.problems),
            f"Correct {path.name}, or give the model of the device that was recorded; without --model a linear one is "
            "fitted first.",
            saved="Nothing was written.",
        ) from refusal
    return model


@contextlib.contextmanager
def convert_refusals(has_model: bool) -> Iterator[None]:
    """Convert errors of the diagnosis to errors for the user. has_model: whether the user gave a model."""
    try:
        yield
    except IncomparableRecordingsError as refusal:
        raise make_not_diagnosable_error(
            (str(refusal),), "Leave --clean out, or record the device in order in the same way."
        ) from refusal
    except np.linalg.LinAlgError as error:
        raise make_not_diagnosable_error(
            (f"The fits broke down ({error}): near the parameters of the model the simulation diverges",),
            "State narrower tolerances in the model, or give one that is nearer to the device."
            if has_model
            else "Give a model with --model, or diagnose recordings that resemble each other more, each by itself.",
        ) from error


def make_not_diagnosable_error(problems: Sequence[str], advice: str = "Correct them, or record again.") -> StudyError:
    """Make the error for input that cannot be diagnosed. problems: sentence fragments."""
    return StudyError(
        "These recordings cannot be diagnosed", _join_sentences(problems), advice, saved="Nothing was written."
    )


def _join_sentences(problems: Sequence[str]) -> str:
    """Join problems as sentences, each with a capital and a full stop."""
    return " ".join(f"{begin_sentence(problem).rstrip('.')}." for problem in problems)


def _name_sources(sources: Sequence[Path]) -> tuple[str, ...]:
    """Name the sources by their file names; all with folder and number where two files have the same name."""
    names = tuple(source.name for source in sources)
    if len(set(names)) == len(names):
        return names
    paths = (Path(source.parent.name, source.name).as_posix() for source in sources)
    return tuple(f"{path} ({number})" for number, path in enumerate(paths, start=1))
