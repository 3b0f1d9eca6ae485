"""What a diagnosis starts from: recordings or a session's trials, and the model that they are compared with."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.data.command_gaps import across_gaps
from analysis.diagnosis.data.force_constant import NoForceConstant, with_force_constant
from analysis.diagnosis.data.force_driven import all_force_driven
from analysis.diagnosis.data.found_segments import with_found_segments
from analysis.diagnosis.data.input_checks import (
    FEW_CYCLES,
    NothingToDiagnose,
    require_alike,
    require_different,
    require_model_of,
    require_something,
)
from analysis.diagnosis.first_model.plain_form import plain_form
from analysis.wording import listed
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.errors import StudyError, WrongUseError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.workflows.recording.recording_from import recording_from

STILL = 1e-9
"""Of its value: what changes by less is the rounding of numbers."""


@dataclass(frozen=True, slots=True, eq=False)
class DiagnosisInput:
    recordings: tuple[Recording, ...]
    names: tuple[str, ...]
    parents: tuple[Path, ...]
    """Files that it was read from."""
    remarks: tuple[str, ...]
    simulated: bool = False
    """A session on the simulated omega.3."""
    spring_n_per_m: float = 0.0
    """Of the virtual spring that held the handle and is no part of the commands: a session's."""
    constants: tuple[float, ...] = ()
    """Force constants that were stated."""


def read_input(
    sources: Sequence[Path], seed: int, plain: bool = False, constants: tuple[float, ...] = ()
) -> DiagnosisInput:
    """Recordings, or one session's folder. plain: recordings in the form in which forces can be balanced, see
    `plain_form`. constants: see `with_force_constant`. Raises StudyError."""
    folders = [source for source in sources if source.is_dir()]
    if folders and len(sources) > 1:
        raise nothing_to_diagnose(
            (f"{folders[0]} is a folder: a session is diagnosed by itself",), "Give recordings, or one session."
        )
    if folders:
        # Here, for all that reads sessions takes long to import.
        from study.workflows.diagnosis.session_as_recordings import session_recordings

        session = session_recordings(folders[0], seed)
        found = DiagnosisInput(
            (session.recording,), (session.name,), session.parents, session.remarks, session.simulated,
            session.spring_n_per_m,
        )  # fmt: skip
    else:
        taken = [recording_from(source) for source in sources]
        read = tuple(recording for recording, _ in taken)
        _require_alike(read, _names(sources))
        read, stated = _as_forces(read, constants)
        read, repeats = _with_segments(read, sources)
        formed, said = plain_form(read) if plain else (read, ())
        driven, gaps = across_gaps(all_force_driven(formed), _names(sources))
        found = DiagnosisInput(
            driven,
            _names(sources),
            tuple(sources),
            (*_notes(taken), *stated, *repeats, *said, *gaps),
            constants=constants,
        )
    said = _few_cycles(found, plain)
    return _moving_position(same_position(replace(found, remarks=(*found.remarks, *said))))


def _few_cycles(found: DiagnosisInput, plain: bool) -> tuple[str, ...]:
    """A remark where no model is given, as of a real recording, for which there is no other. Raises StudyError."""
    try:
        require_different(found.recordings, found.names)
        require_something(found.recordings, found.names)
    except NothingToDiagnose as refusal:
        if not plain or not all(FEW_CYCLES in problem for problem in refusal.problems):
            raise nothing_to_diagnose(refusal.problems) from refusal
        return tuple(f"{_begun(problem)}." for problem in refusal.problems)
    return ()


def _as_forces(
    recordings: tuple[Recording, ...], constants: Sequence[float]
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Raises WrongUseError."""
    if not constants:
        return recordings, ()
    try:
        found = [with_force_constant(recording, constants) for recording in recordings]
    except NoForceConstant as refusal:
        raise WrongUseError(
            "The force constant cannot be used", f"{_begun(str(refusal))}.", "Leave --force-constant out, or mend it.",
            saved="Nothing was written.",
        ) from refusal  # fmt: skip
    return tuple(recording for recording, _ in found), (found[0][1],)


def _notes(taken: Sequence[tuple[Recording, tuple[str, ...]]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(note for _, notes in taken for note in notes))


def _with_segments(
    recordings: Sequence[Recording], sources: Sequence[Path]
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Of parts that repeat, where a recording has none of its own; and what was found."""
    found = [with_found_segments(recording) for recording in recordings]
    told = [(source.stem, said) for source, (_, said) in zip(sources, found, strict=True) if said]
    said = tuple(said if len(sources) == 1 else f"{name}: {said}" for name, said in told)
    return tuple(recording for recording, _ in found), said


def _require_alike(recordings: Sequence[Recording], names: Sequence[str]) -> None:
    """Before any form is found for all of them. Raises StudyError."""
    try:
        require_alike(recordings, names)
    except NothingToDiagnose as refusal:
        raise nothing_to_diagnose(refusal.problems) from refusal


def given_model(path: Path, found: DiagnosisInput) -> MechanicalModel:
    """Raises StudyError where it cannot be of the recordings' device."""
    model = read_mechanical_model(path)
    try:
        require_model_of(model, found.recordings)
    except NothingToDiagnose as refusal:
        raise StudyError(
            "Model and recording do not belong together",
            _sentences(refusal.problems),
            f"Correct {path.name}, or give the model of the device that was recorded; without --model a linear one is "
            "fitted first.",
            saved="Nothing was written.",
        ) from refusal
    return model


def nothing_to_diagnose(problems: Sequence[str], do_now: str = "Correct them, or record again.") -> StudyError:
    return StudyError(
        "These recordings cannot be diagnosed", _sentences(problems), do_now, saved="Nothing was written."
    )


def _sentences(problems: Sequence[str]) -> str:
    return " ".join(f"{_begun(problem).rstrip('.')}." for problem in problems)


def _begun(sentence: str) -> str:
    """With a capital, unless the name of a file or an effect comes first: that stays as it is."""
    named = any(mark in sentence.partition(" ")[0] for mark in "./\\_")
    return sentence if named else sentence[:1].upper() + sentence[1:]


def _names(sources: Sequence[Path]) -> tuple[str, ...]:
    """File names; with their folders where they are not enough."""
    names = tuple(source.name for source in sources)
    if len(set(names)) == len(names):
        return names
    return tuple(f"{source.parent.name}/{source.name} ({number})" for number, source in enumerate(sources, start=1))


def same_position(found: DiagnosisInput) -> DiagnosisInput:
    """Compared where every recording has it in the same channels; where not, it is left out, and that is said."""
    kinds = {
        None if each.position is None else (each.position.channels, each.position.units) for each in found.recordings
    }
    if len(kinds) < 2:
        return found
    said = "Only some recordings hold the same position channels: the position was left out of the comparison."
    return replace(
        found,
        recordings=tuple(replace(each, position=None) for each in found.recordings),
        remarks=(*found.remarks, said),
    )


def _moving_position(found: DiagnosisInput) -> DiagnosisInput:
    """What stands still throughout says nothing, and its errors cannot be counted in units of anything."""
    positions = [each.position for each in found.recordings if each.position is not None]
    if not positions:
        return found
    courses = np.vstack([each.samples for each in positions])
    known = np.where(np.isfinite(courses), courses, np.nanmedian(courses, axis=0))
    still = np.ptp(known, axis=0) <= STILL * np.abs(known).max(axis=0)
    dead = [name for name, stands in zip(positions[0].channels, still, strict=True) if stands]
    if not dead:
        return found
    said = f"Position {listed(dead)} never changes: the position was left out of the comparison."
    return replace(
        found,
        recordings=tuple(replace(each, position=None) for each in found.recordings),
        remarks=(*found.remarks, said),
    )
