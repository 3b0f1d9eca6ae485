"""Vibration dose of the same hand in other sessions of the day.

The daily exposure A(8) of hand-transmitted vibration (ISO 5349-1, `vibration_dose`) adds up over all sessions since
the last night's rest, not per session. When a sitting begins, `find_dose_elsewhere` computes the dose of the others; it
is logged in the event that begins the sitting, and `set_dose_elsewhere` sets it in the state.
"""

from collections.abc import Mapping
from dataclasses import replace

from study.session.facts.log_time import Moment
from study.session.facts.sitting_events import DoseElsewhere
from study.session.state.sitting_state import DAILY_REST_S, SittingState, pass_time
from study.session.state.vibration_dose import NO_DOSE, Dose, sum_doses

MAX_LOGGED_DOSE = 1e9
"""Largest dose that the log holds, (m/s²)² s (`fact_types.Magnitude`): A(8) = 186 m/s², far above any limit. Only a
sensor whose sensitivity is set wrong gives more."""


def find_dose_elsewhere(
    sessions: Mapping[str, SittingState], current_session: str, utc: str, unread_sessions: tuple[str, ...] = ()
) -> DoseElsewhere | None:
    """Sum the vibration dose of the participant's other sessions since the last pause of at least `DAILY_REST_S`
    without vibration.

    sessions: states of all sessions of the participant, by name; current_session: name of the session that continues at
    the time `utc` (ISO 8601); unread_sessions: names of sessions that could not be read. Returns None where no other
    session counts and all were read.

    The sessions are searched backwards in time up to the first such pause, between two of them or after the last. Only
    the wall clock is known between sessions; where it was set back, no time is counted.
    """
    current_states = {name: pass_time(sitting, Moment(utc), resumed=True) for name, sitting in sessions.items()}
    moved_sessions = {name: sitting for name, sitting in current_states.items() if sitting.still_s is not None}
    counted_sessions: dict[str, SittingState] = {}
    # Times before now (s): `still_s` since the last vibration of a session, `earliest_start_s` since the first
    # vibration of its day, in any sitting of the sessions counted so far.
    earliest_start_s = 0.0
    for name, sitting in sorted(moved_sessions.items(), key=lambda item: item[1].still_s or 0.0):
        still_s = sitting.still_s or 0.0
        if still_s - earliest_start_s >= DAILY_REST_S:
            break
        counted_sessions[name] = sitting
        earliest_start_s = max(earliest_start_s, sitting.day_s or still_s)
    counted_sessions.pop(current_session, None)
    if not counted_sessions:
        return DoseElsewhere((), 0.0, 0.0, 0.0, 0.0, unread_sessions) if unread_sessions else None
    dose = sum_doses(*(sitting.dose for sitting in counted_sessions.values()))
    squared_s = min(dose.squared_s, MAX_LOGGED_DOSE)
    still_s = min(sitting.still_s or 0.0 for sitting in counted_sessions.values())
    return DoseElsewhere(
        tuple(sorted(counted_sessions)), squared_s, dose.vibrated_s, dose.unmeasured_s, still_s, unread_sessions
    )


def set_dose_elsewhere(sitting: SittingState, other_dose: DoseElsewhere | None) -> SittingState:
    """Set the dose from other sessions in the state, at the beginning of a sitting; None: no dose. The time since
    the handle last moved becomes the shorter of those in this and in the other sessions."""
    if other_dose is None:
        return replace(sitting, other_sessions_dose=NO_DOSE, unread_sessions=())
    updated_sitting = replace(sitting, unread_sessions=other_dose.unread, other_sessions_dose=NO_DOSE)
    if not other_dose.sessions:
        return updated_sitting
    still_s = other_dose.still_s if sitting.still_s is None else min(sitting.still_s, other_dose.still_s)
    return replace(
        updated_sitting,
        other_sessions_dose=Dose(other_dose.squared_s, other_dose.vibrated_s, other_dose.unmeasured_s),
        still_s=still_s,
    )
