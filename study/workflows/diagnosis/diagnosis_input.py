"""What a diagnosis starts from: recordings or a session's trials, and the model that they are compared with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.balance.first_model import plain_model
from analysis.diagnosis.balance.plain_form import plain_form
from analysis.diagnosis.balance.weigh import Balance
from analysis.diagnosis.data.belonging import (
    NothingToDiagnose,
    require_alike,
    require_different,
    require_model_of,
    require_something,
)
from analysis.diagnosis.data.carried_weight import weighted
from analysis.diagnosis.data.command_gaps import across_gaps
from analysis.diagnosis.data.force_driven import all_force_driven
from analysis.diagnosis.errors.rigid_model import can_be_rigid, rigid_model, wants_rigid_model
from analysis.diagnosis.search.by_balance import balances_of
from analysis.diagnosis.types import Patience, Progress
from analysis.wording import listed
from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitRefused
from equalizer.identification.mechanical.open_tolerance import opened
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording
from study.workflows.diagnosis.session_as_recordings import session_recordings

STILL = 1e-9
"""Of its value: what changes by less is the rounding of numbers."""
RIGID_SAID = (
    "No model was given. One body per axis, with damping and, where that shows, a spring, was fitted first to the "
    "forces along the measured motion; its damping is left open by a quarter, for friction hides in it."
)
BALANCE_SAID = (
    "No model was given. One body per axis, with damping and a spring, was fitted first to the forces along the "
    "measured motion; its numbers are left open by a tenth, and by half of what the named laws change in them."
)


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


def read_input(sources: Sequence[Path], seed: int, plain: bool = False) -> DiagnosisInput:
    """Recordings, or one session's folder. plain: recordings in the form in which forces can be balanced, see
    `plain_form`. Raises StudyError."""
    folders = [source for source in sources if source.is_dir()]
    if folders and len(sources) > 1:
        raise nothing_to_diagnose(
            (f"{folders[0]} is a folder: a session is diagnosed by itself",), "Give recordings, or one session."
        )
    if folders:
        session = session_recordings(folders[0], seed)
        found = DiagnosisInput(
            (session.recording,), (session.name,), session.parents, session.remarks, session.simulated,
            session.spring_n_per_m,
        )  # fmt: skip
    else:
        read = tuple(read_recording(source) for source in sources)
        _require_alike(read, _names(sources))
        formed, said = plain_form(read) if plain else (read, ())
        driven, gaps = across_gaps(all_force_driven(formed), _names(sources))
        found = DiagnosisInput(driven, _names(sources), tuple(sources), (*said, *gaps))
    try:
        require_something(found.recordings, found.names)
        require_different(found.recordings, found.names)
    except NothingToDiagnose as refusal:
        raise nothing_to_diagnose(refusal.problems) from refusal
    return _moving_position(same_position(found))


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


@dataclass(frozen=True, slots=True, eq=False)
class FirstModel:
    """What a diagnosis starts from where no model was given."""

    model: MechanicalModel
    remarks: tuple[str, ...]
    """What must be known of it."""
    balances: tuple[Balance, ...] | None = None
    """None = not weighed."""


def first_model_of(
    found: DiagnosisInput, without: Sequence[str], patient: Patience, on_progress: Progress
) -> FirstModel:
    """From the force balance where that names laws along the motion of one body per command; else by a fit to spectra,
    which takes longer. Raises StudyError where the recordings do not carry one."""
    _require_no_weight(found)
    on_progress("weighing laws in the force balance", 0.0)
    balances = balances_of(found.recordings, frozenset(without), patient)
    model = plain_model(balances, found.recordings[0], "fitted to these recordings")
    if model is not None:
        return FirstModel(model, (BALANCE_SAID,), balances)
    on_progress("fitting a linear model, as none was given", 0.5)
    model, remarks = fitted_model(
        found, lambda share: on_progress("fitting a linear model, as none was given", 0.5 + share / 2)
    )
    return FirstModel(model, remarks, balances)


def fitted_model(
    found: DiagnosisInput, on_progress: Callable[[float], None], whose: str = "these recordings"
) -> tuple[MechanicalModel, tuple[str, ...]]:
    """A linear one, and what must be known of it. Raises StudyError where the recordings do not carry one."""
    _require_no_weight(found)
    if wants_rigid_model(found.recordings) and (rigid := _rigid(found.recordings, whose)) is not None:
        return rigid, (RIGID_SAID,)
    try:
        fit = fit_mechanical_model(found.recordings, on_progress=on_progress, name=f"fitted to {whose}")
    except (MechanicalFitRefused, MechanicalModelError, np.linalg.LinAlgError) as refusal:
        if (rigid := _rigid(found.recordings, whose)) is not None:
            return rigid, (RIGID_SAID,)
        raise nothing_to_diagnose(
            (f"no model was given, and none can be fitted: {refusal}",),
            "Give a model with --model, or a recording that carries one.",
        ) from refusal
    tested = "" if fit.held_out is None else f" and of {100 * fit.held_out:.1f} % on what was kept for a test"
    said = (
        f"No model was given. A linear one was fitted to {whose} first, with an error of "
        f"{100 * fit.error:.1f} %{tested}, and its masses, dampers and springs were left open by much more than that; "
        "what it could take on itself, such as friction at one level as damping, is not missing from it any more, and "
        "is not named."
    )
    return opened(fit.model), (said, *(f"{remark[:1].upper()}{remark[1:].rstrip('.')}." for remark in fit.remarks))


def _require_no_weight(found: DiagnosisInput) -> None:
    if weighted(found.recordings):
        raise nothing_to_diagnose(
            ("a recording was made with a weight on, and a model that is fitted to it would hold the weight",),
            "Give a model of the device without it with --model.",
        )


def _rigid(recordings: Sequence[Recording], whose: str) -> MechanicalModel | None:
    """None where the recordings do not carry one."""
    if not can_be_rigid(recordings):
        return None
    try:
        return rigid_model(recordings, f"fitted to {whose}")
    except (MechanicalModelError, np.linalg.LinAlgError):
        return None


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
