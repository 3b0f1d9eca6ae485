"""Vibration dose of the same hand in other sessions of the day.

The daily exposure A(8) of hand-transmitted vibration (ISO 5349-1, `vibration_dose`) adds up over all sessions since
the last night's rest; it does not restart with each session.
"""

from collections.abc import Mapping
from dataclasses import replace

from study.session.facts.log_time import Moment
from study.session.facts.sitting_events import DoseElsewhere
from study.session.state.sitting_state import NIGHT_S, SittingState, pass_time
from study.session.state.vibration_dose import NO_DOSE, Dose, total


def dose_elsewhere(
    sessions: Mapping[str, SittingState], own: str, utc: str, unread: tuple[str, ...] = ()
) -> DoseElsewhere | None:
    """Vibration dose from the participant's other sessions since the last rest of a night's length (`NIGHT_S`).

    sessions: states of all sessions of the participant, by name; own: the session that continues at the time utc (ISO
    8601); unread: names of sessions that could not be read. None where no other session counts and all were read.

    The sessions are searched backwards up to the first pause of a night's length between two of them. Between sessions
    only the wall clock is known; a clock set back counts as no time.
    """
    until_now = {name: pass_time(sitting, Moment(utc), resumed=True) for name, sitting in sessions.items()}
    exposed = {name: sitting for name, sitting in until_now.items() if sitting.still_s is not None}
    today: dict[str, SittingState] = {}
    # Times before now (s): `still_s` since the last vibration, `began_s` since the earliest session counted so far.
    began_s = 0.0
    for name, sitting in sorted(exposed.items(), key=lambda known: known[1].still_s or 0.0):
        still_s = sitting.still_s or 0.0
        if still_s - began_s >= NIGHT_S:
            break
        today[name] = sitting
        began_s = max(began_s, sitting.sat_s or still_s)
    today.pop(own, None)
    if not today:
        return DoseElsewhere((), 0.0, 0.0, 0.0, 0.0, unread) if unread else None
    dose = total(*(sitting.dose for sitting in today.values()))
    still_s = min(sitting.still_s or 0.0 for sitting in today.values())
    return DoseElsewhere(tuple(sorted(today)), dose.squared_s, dose.vibrated_s, dose.unmeasured_s, still_s, unread)


def with_dose_elsewhere(sitting: SittingState, found: DoseElsewhere | None) -> SittingState:
    """The state with this dose, at the beginning of a sitting; it replaces an earlier value."""
    if found is None:
        return replace(sitting, elsewhere=NO_DOSE, not_counted=())
    known = replace(sitting, not_counted=found.unread, elsewhere=NO_DOSE)
    if not found.sessions:
        return known
    still_s = found.still_s if sitting.still_s is None else min(sitting.still_s, found.still_s)
    return replace(known, elsewhere=Dose(found.squared_s, found.vibrated_s, found.unmeasured_s), still_s=still_s)
