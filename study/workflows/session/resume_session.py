"""Resumption of a session after a crash or a pause: its state is rebuilt from the log, and an open trial is closed.

An incomplete last line of the log is removed. A trial without an answer is void; a trial with an answer is judged from
its recording or from the device's counters in the log, because dropping answers after they are known would bias the
result.
"""

import shlex
from collections.abc import Iterator
from contextlib import contextmanager

from pydantic import TypeAdapter

from protocols.trial import VoidCause
from study.devices.clock import Clock
from study.devices.device import DeviceInfo
from study.errors import StudyError
from study.session.facts.events import (
    SessionClosed,
    SessionInterrupted,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.facts.sensor_facts import SensorFacts
from study.session.state.fold import apply_event
from study.session.state.state import SessionState
from study.session.stimulus.delivered import measure_delivered
from study.session.stimulus.stimulus import compute_vector_at_angle
from study.session.views.count_text import format_answer_count
from study.store.disk.privacy import restrict_data_folder, restrict_to_owner
from study.store.disk.provenance import list_versions
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog, remove_incomplete_line
from study.store.sessions.live_file import remove_live
from study.store.sessions.request_inbox import RequestInbox
from study.store.sessions.session_lock import hold_session_lock
from study.store.sessions.trial_recordings import find_trial_recording, name_recording
from study.workflows.results.fold_session import FoldedSession, fold_session
from study.workflows.results.session_results import write_tables
from study.workflows.session.open_session import OpenedSession, collect_device_facts
from study.workflows.session.other_session_dose import compute_other_session_dose
from study.workflows.session.prepare_sitting import make_ineligible_error
from study.workflows.trial.judge_trial import Judgement, judge_trial
from study.workflows.trial.trial_events import restore_health

RECORDING_LOST = "its recording was lost when the program ended"
"""Remark on a trial that counts without its recording, or reason why the trial is void."""


@contextmanager
def resume_session(folder: SessionFolder, device: DeviceInfo, clock: Clock) -> Iterator[OpenedSession]:
    """Open an existing session and repair its log; the session is locked while the context lasts.

    Raises StudyError where it cannot be resumed: it is running in another program, finished or withdrawn, its log is
    damaged, it was begun on another kind of device (real or simulated), or the participant refused or was excluded.
    """
    restrict_data_folder(folder.path.parent)
    restrict_to_owner(folder.path, recursive=True)  # earlier versions wrote files that other accounts could read
    with hold_session_lock(folder.path):
        log = EventLog.reopen(folder.log)
        # A stop request of the interrupted sitting must not end this sitting, and its live state is outdated. Requests
        # that arrive from now on are received.
        RequestInbox(folder.path).clear()
        remove_live(folder.path)
        try:
            folded_session = fold_session(folder)
            if folded_session.state.is_finally_ineligible:
                _close_ineligible_session(folded_session, folder, log, clock)
                raise make_ineligible_error(folded_session.state)
            _check_resumable(folded_session.state, device, folder)
            remove_incomplete_line(folder.log, folded_session.log_contents)
            utc, observer = clock.utc(), folded_session.state.opened.observer
            resumed_event = SessionResumed(
                utc=utc,
                device=collect_device_facts(device),
                versions=list_versions(),
                mended=folded_session.log_contents.torn,
                dose_elsewhere=compute_other_session_dose(folder, observer, device.simulated, utc),
                monotonic_s=clock.now_s(),
            )
            log.append(resumed_event)
            # An interruption by Ctrl-C, which a participant may press too, has another cause than a crash.
            was_interrupted = isinstance(folded_session.log_contents.events[-1], SessionInterrupted)
            state = _close_open_trial(
                apply_event(folded_session.state, resumed_event), folder, log, clock, was_interrupted
            )
            yield OpenedSession(folder, log, state)
        finally:
            log.close()


def _close_ineligible_session(
    folded_session: FoldedSession, folder: SessionFolder, log: EventLog, clock: Clock
) -> None:
    """Close the session of a participant who refused or was excluded: append the closing event if a crash prevented
    it, and write seal and tables."""
    if not folded_session.state.closed:
        remove_incomplete_line(folder.log, folded_session.log_contents)
        outcome = folded_session.state.sitting.ineligibility or "refused"
        log.append(SessionClosed(utc=clock.utc(), outcome=outcome, monotonic_s=clock.now_s()))
    write_tables(folder)


def _check_resumable(state: SessionState, device: DeviceInfo, folder: SessionFolder) -> None:
    """Check that the session is open and the device of the same kind. Raises StudyError for a closed session, and for a
    simulated device in place of a real one or the reverse."""
    if state.closed:
        raise make_finished_error(state, folder)
    if device.simulated != state.opened.device.simulated:
        raise StudyError(
            "This session was begun on another kind of device",
            f"{folder.name} was begun on '{state.opened.device.name}', now there is '{device.name}'. A session must "
            "not mix answers on a real device with answers on a simulated one.",
            "Resume it with the device it was begun on.",
            saved="Nothing was changed.",
        )


def make_finished_error(state: SessionState, folder: SessionFolder) -> StudyError:
    """Make the error for a closed session, which cannot be resumed."""
    return StudyError(
        "This session is finished",
        f"{folder.name} has all its runs.",
        f"Look at its results: hapteq analyze {shlex.quote(str(folder.path))}",
        saved=f"{format_answer_count(state.answers)} on disk.",
    )


def _close_open_trial(
    state: SessionState, folder: SessionFolder, log: EventLog, clock: Clock, was_interrupted: bool
) -> SessionState:
    """Close the trial that was open when the program ended, if any, and return the new state. An answered trial is
    judged now; an unanswered trial is void, because the participant may have felt the stimulus. was_interrupted:
    whether Ctrl-C ended the program."""
    presented = state.presented
    if presented is None:
        return state
    if state.answered is None:
        event: TrialMeasured | TrialSpoiled = TrialSpoiled(
            utc=clock.utc(),
            run=presented.run,
            trial=presented.trial,
            attempt=presented.attempt,
            reason="the program ended before the answer",
            monotonic_s=clock.now_s(),
            cause=VoidCause.LEFT if was_interrupted else VoidCause.PROGRAM_ENDED,
        )
    else:
        event = _judge_after_restart(state, presented, folder, clock)
    log.append(event)
    return apply_event(state, event)


def _judge_after_restart(
    state: SessionState, presented: TrialPresented, folder: SessionFolder, clock: Clock
) -> TrialMeasured | TrialSpoiled:
    """Judge an answered trial that the program did not judge before it ended; returns its event.

    With a usable recording, which is saved only for a trial that counts, the trial is measured from it. Otherwise the
    trial is judged by the device's counters that were logged with the answer (older logs have none); if it counts, it
    is logged as unmeasured, or as void where the protocol requires the accelerometer.
    """
    try:
        measured_event = _measure_from_recording(state, presented, folder, clock)
    except (StudyError, ValueError):  # the answer is in the log; the damaged recording is kept for inspection
        measured_event = None
    return measured_event if measured_event is not None else _judge_without_recording(state, presented, clock)


def _judge_without_recording(
    state: SessionState, presented: TrialPresented, clock: Clock
) -> TrialMeasured | TrialSpoiled:
    """Judge an answered trial without a usable recording by the counters that were logged with the answer; returns its
    event."""
    counters = state.answered.health if state.answered is not None else None
    health = restore_health(counters) if counters is not None else None
    judgement = Judgement("", ())
    if health is not None and counters is not None:
        judgement = judge_trial(health, state.protocol.measurement, counters.felt_whole)
    if state.protocol.measurement.accelerometer_needed and not judgement.void_reason:
        judgement = Judgement(RECORDING_LOST, (), VoidCause.NO_ACCELERATION)
    missed_ticks = health.missed_ticks if health is not None else None
    late_ticks, latest_s = (counters.late_ticks, counters.latest_s) if counters is not None else (None, None)
    vibrated_s = health.ticks / state.opened.device.sample_rate_hz if health is not None else None
    if judgement.void_reason:
        return TrialSpoiled(
            utc=clock.utc(),
            run=presented.run,
            trial=presented.trial,
            attempt=presented.attempt,
            reason=judgement.void_reason,
            missed_ticks=missed_ticks,
            late_ticks=late_ticks,
            latest_s=latest_s,
            vibrated_s=vibrated_s,
            monotonic_s=clock.now_s(),
            cause=judgement.cause,
        )
    return TrialMeasured(
        utc=clock.utc(),
        run=presented.run,
        trial=presented.trial,
        attempt=presented.attempt,
        status="unmeasured",
        flags=(RECORDING_LOST, *judgement.flags),
        missed_ticks=missed_ticks,
        late_ticks=late_ticks,
        latest_s=latest_s,
        vibrated_s=vibrated_s,
        monotonic_s=clock.now_s(),
    )


def _measure_from_recording(
    state: SessionState, presented: TrialPresented, folder: SessionFolder, clock: Clock
) -> TrialMeasured | None:
    """Measure an answered trial from its recording; returns its event, or None if there is no recording. Raises
    StudyError or ValueError if the recording cannot be used."""
    trial_recording = find_trial_recording(folder, name_recording(presented.run, presented.trial, presented.attempt))
    if trial_recording is None:
        return None
    saved_file, recording = trial_recording
    counters = state.answered.health if state.answered is not None else None
    # By the angle, because `direction` of a detection trial is the number of the interval.
    unit_vector = compute_vector_at_angle(state.protocol.directions, presented.angle_deg)
    is_trusted = recording.meta.get("acceleration_trusted", True)
    delivered = measure_delivered(recording, unit_vector, presented.frequency_hz) if is_trusted else None
    return TrialMeasured(
        utc=clock.utc(),
        run=presented.run,
        trial=presented.trial,
        attempt=presented.attempt,
        status="flagged",
        flags=("measured after a restart", *recording.meta.get("flags", ())),
        recording=saved_file.name,
        sha256=saved_file.sha256,
        delivered_mps2=delivered.along_mps2 if delivered else None,
        off_axis_mps2=delivered.off_axis_mps2 if delivered else None,
        displacement_mm=delivered.displacement_mm if delivered else None,
        harmonics_mps2=delivered.harmonics_mps2 if delivered else None,
        missed_ticks=recording.meta.get("missed_ticks"),
        late_ticks=recording.meta.get("late_ticks"),
        latest_s=recording.meta.get("latest_s"),
        sensor=TypeAdapter(SensorFacts | None).validate_python(recording.meta.get("sensor")),
        vibrated_s=counters.ticks / state.opened.device.sample_rate_hz if counters is not None else None,
        monotonic_s=clock.now_s(),
    )
