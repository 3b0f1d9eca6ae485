"""Select the sessions for one analysis: one protocol, one population, none withdrawn or unreadable.

People, simulated participants, and people at a device that did not move are never analysed together (`Population`).
Exclusions are reported as sentences.
"""

from collections.abc import Sequence
from pathlib import Path

from analysis.psychophysics.population import Population, split_by_population
from analysis.wording import conjoin
from equalizer.plant.model_quality import NOT_STORED
from study.errors import StudyError, WrongUseError
from study.session.facts.events import FormFilled
from study.session.state.state import SessionState
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.store.formats.answer_table import FORM_NAMES, FilledForm
from study.store.sessions.archive import (
    WITHDRAWN_CLAUSE,
    SessionFolder,
    SessionWithdrawnError,
    holds_session,
    list_session_folders,
)
from study.store.sessions.event_log import LOG_NAME
from study.workflows.results.collected_trials import CollectedTrials
from study.workflows.results.fold_session import FoldedSession, fold_session
from study.workflows.results.session_results import finish_tables

HASH_DIGITS = 12
"""Number of digits of a protocol's hash that are shown, and that select a protocol."""


def collect_sessions(data: Path, protocol_name: str | None = None) -> CollectedTrials:
    """Collect the sessions in `data` (or `data` itself, a session) that belong together. Of several protocols (with
    protocol_name, its name or the first `HASH_DIGITS` digits of its hash, only those): one with test or detection runs,
    if any, then the one with the most sessions. Of several populations: the first in the order of `Population`. Missing
    or outdated tables and seals of usable closed sessions are written (`_finish_result_files`). Raises StudyError where
    there is nothing to analyse."""
    folders = _list_folders(data)
    usable_sessions, exclusions = _fold_sessions(folders)
    session_states = [(folder, session.state) for folder, session in usable_sessions]
    chosen_hash = _choose_protocol(session_states, protocol_name, data)
    chosen_sessions = [(folder, state) for folder, state in session_states if state.opened.protocol_hash == chosen_hash]
    exclusions += [
        f"{folder.name} follows another protocol, {_name_protocol(state)}."
        for folder, state in session_states
        if state.opened.protocol_hash != chosen_hash
    ]
    exclusions += [f"{folder.name} has no trial." for folder, state in chosen_sessions if not state.trials]
    trials_by_population = split_by_population([trial for _, state in chosen_sessions for trial in state.trials])
    selected_population = next((candidate for candidate in Population if candidate in trials_by_population), None)
    exclusions += [
        f"{len(trials_by_population[population])} trials of {population.value} are not analysed together with "
        f"{selected_population.value}."
        for population in trials_by_population
        if selected_population is not None and population is not selected_population
    ]
    trials = trials_by_population[selected_population] if selected_population is not None else ()
    analysed_names = {trial.session for trial in trials}
    used_sessions = [(folder, state) for folder, state in chosen_sessions if folder.name in analysed_names]
    return CollectedTrials(
        protocol=chosen_sessions[0][1].protocol,
        protocol_hash=chosen_hash,
        trials=trials,
        sessions=tuple(folder for folder, _ in used_sessions),
        seeds=tuple(state.opened.seed for _, state in used_sessions),
        devices=tuple(dict.fromkeys(state.opened.device.name for _, state in used_sessions)),
        observers=tuple(dict.fromkeys(state.opened.observer for _, state in used_sessions if state.opened.observer)),
        exclusions=tuple(exclusions),
        model_qualities=_group_model_qualities(used_sessions),
        lock_statement=_describe_locks([state for _, state in used_sessions]),
        result_file_notes=_finish_result_files(usable_sessions),
        input_paths=tuple(folder.log for folder, _ in used_sessions),
        forms=_collect_filled_forms(
            [(folder, session) for folder, session in usable_sessions if folder.name in analysed_names]
        ),
    )


def _collect_filled_forms(sessions: Sequence[tuple[SessionFolder, FoldedSession]]) -> tuple[FilledForm, ...]:
    """Collect the answers to the protocol's questions, from the logs of the sessions that are analysed."""
    return tuple(
        FilledForm(folder.subject, folder.name, event.form, event.answers)
        for folder, session in sessions
        for event in session.log_contents.events
        if isinstance(event, FormFilled) and event.form in FORM_NAMES.values()
    )


def _describe_locks(states: Sequence[SessionState]) -> str:
    """Describe whether the protocol was locked when the sessions were opened: yes, no, or for how many of them."""
    locked_count = sum(state.opened.protocol_locked for state in states)
    if not locked_count:
        return "no: what the protocol declares was not fixed by a lock"
    return "yes" if locked_count == len(states) else f"for {locked_count} of {len(states)} sessions"


def _group_model_qualities(
    analysed_sessions: Sequence[tuple[SessionFolder, SessionState]],
) -> tuple[tuple[str, str], ...]:
    """Group the sessions by model, as pairs (names of sessions, sentence on the quality of their model); sessions with
    the same model are listed together, sessions without an equalizer are left out."""
    names_by_model: dict[tuple[str, str], list[str]] = {}
    for folder, state in analysed_sessions:
        if (equalized := state.opened.equalized) is not None:
            model_key = (equalized.sha256, equalized.quality or NOT_STORED)
            names_by_model.setdefault(model_key, []).append(folder.name)
    return tuple((conjoin(names), quality_sentence) for (_, quality_sentence), names in names_by_model.items())


def _list_folders(data: Path) -> tuple[SessionFolder, ...]:
    """List the session folders in `data`, or `data` itself if it is a session. Raises WrongUseError where there are
    none, SessionWithdrawnError for a session that was withdrawn."""
    session = SessionFolder(data.resolve())
    if holds_session(session.path) and session.withdrawn:
        raise SessionWithdrawnError(session)
    if (data / LOG_NAME).exists():
        return (session,)
    folders = list_session_folders(data)
    if not folders:
        raise WrongUseError(
            "There is nothing to analyse",
            f"{data} is neither a session nor a folder with sessions in it.",
            "Give the data folder of a study, or its export as psych-ds or csv (bids and mat are for other tools and "
            "are not read back); hapteq rehearse makes one with simulated participants.",
        )
    return folders


def _fold_sessions(folders: Sequence[SessionFolder]) -> tuple[list[tuple[SessionFolder, FoldedSession]], list[str]]:
    """Rebuild the state of each session from its log. Returns the usable sessions, and sentences on the excluded ones.
    Raises StudyError where none is usable."""
    usable_sessions: list[tuple[SessionFolder, FoldedSession]] = []
    exclusions: list[str] = []
    for folder in folders:
        if folder.withdrawn:
            exclusions.append(f"{folder.name} {WITHDRAWN_CLAUSE}.")
            continue
        try:
            session = fold_session(folder)
        except StudyError as error:
            exclusions.append(f"{folder.name} cannot be used. {error.happened}")
            continue
        if reason := session.state.sitting.ineligibility:
            exclusions.append(f"{folder.name} does not take part: {INELIGIBILITY_REASONS[reason]}.")
        else:
            usable_sessions.append((folder, session))
    if not usable_sessions:
        raise StudyError("There is nothing to analyse", " ".join(exclusions), "Record new sessions.")
    return usable_sessions, exclusions


def _finish_result_files(sessions: Sequence[tuple[SessionFolder, FoldedSession]]) -> tuple[str, ...]:
    """Write all tables and the seal of each closed session in which one is missing or out of date; returns sentences on
    these. Errors are only reported, because the analysis uses the logs alone."""
    sentences = []
    for folder, session in sessions:
        try:
            written_files = finish_tables(folder, session)
        except StudyError as error:
            sentences.append(f"{folder.name}: its results are not whole and could not be written. {error.happened}")
            continue
        if written_files:
            sentences.append(
                f"{folder.name}: written now from its log, because missing or out of date: {', '.join(written_files)}."
            )
    return tuple(sentences)


def _choose_protocol(
    session_states: Sequence[tuple[SessionFolder, SessionState]], protocol_name: str | None, data: Path
) -> str:
    """Choose the protocol to analyse, see `collect_sessions`; returns its hash. Raises WrongUseError where no session
    follows the named protocol."""
    states_by_hash: dict[str, list[SessionState]] = {}
    for _, state in session_states:
        states_by_hash.setdefault(state.opened.protocol_hash, []).append(state)
    candidates = {
        protocol_hash: states
        for protocol_hash, states in states_by_hash.items()
        if protocol_name in (None, states[0].protocol.name, protocol_hash[:HASH_DIGITS])
    }
    if not candidates:
        available_text = ", ".join(_name_protocol(states[0]) for states in states_by_hash.values())
        raise WrongUseError(
            "No session follows that protocol",
            f"'{protocol_name}' was asked for; {data} holds sessions of {available_text}.",
            "Give one of these names, or the first twelve digits of its hash.",
        )

    def rank(protocol_hash: str) -> tuple[bool, int]:
        """Rank a protocol. One with training runs only has no thresholds; it is chosen only if there is no other."""
        protocol = candidates[protocol_hash][0].protocol
        has_thresholds = bool(protocol.stimulus.frequencies_hz or protocol.detection.frequencies_hz)
        return has_thresholds, len(candidates[protocol_hash])

    return max(candidates, key=rank)


def _name_protocol(state: SessionState) -> str:
    """Name the protocol of a session, with the digits of its hash by which it can be chosen: a changed protocol may
    have kept its name."""
    return f"{state.protocol.name} ({state.opened.protocol_hash[:HASH_DIGITS]})"
