"""State machine of a session: the next action, as a function of the state that `fold` computes from the log.

`find_next_preparation` gives the steps before the instructions of a sitting (forms, device check), `find_next_action`
those after them, in this order of precedence: end of the session, limits of the sitting (`find_reached_limit`),
demonstration, rest, reference, probe, trial.
"""

from dataclasses import dataclass

from study.session.facts.log_time import Moment
from study.session.state.due_trial import PresentTrial
from study.session.state.probe_state import Probe, Reference, find_due_probe, find_due_reference
from study.session.state.sitting_state import compute_daily_dose, pass_time
from study.session.state.state import SessionState, find_due_presentation
from study.session.state.vibration_dose import compute_a8_mps2
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.views.form_views import Form, FormKind
from study.session.views.forms import make_form


@dataclass(frozen=True, slots=True)
class FillIn:
    """A form must be filled in."""

    form: Form


@dataclass(frozen=True, slots=True)
class CheckDevice:
    """The device must be checked before a person holds the handle."""


@dataclass(frozen=True, slots=True)
class Demonstrate:
    """The demonstration must be shown: each direction at each frequency, labelled, as often as the participant
    wants."""


@dataclass(frozen=True, slots=True)
class TakeRest:
    """A rest is enforced before the next trial."""

    seconds: float
    """Duration of the rest (s)."""


@dataclass(frozen=True, slots=True)
class EndSitting:
    """The sitting must end here."""

    reason: str
    """Reason for the user, as a clause."""


@dataclass(frozen=True, slots=True)
class Finish:
    """The session is finished."""


Preparation = FillIn | CheckDevice | EndSitting
"""The possible steps before the instructions of a sitting."""
Action = Demonstrate | PresentTrial | Probe | Reference | TakeRest | FillIn | EndSitting | Finish
"""The possible next actions of a session."""


def find_next_preparation(state: SessionState) -> Preparation | None:
    """Find the next step before the instructions of this sitting; None when all are done, after the last trial of the
    session, and for simulated participants."""
    sitting = state.sitting
    if state.opened.observer is not None or state.finished:
        return None
    if sitting.ineligibility:
        return EndSitting(INELIGIBILITY_REASONS[sitting.ineligibility])
    form_steps = (
        (FormKind.CONSENT, sitting.consented),
        (FormKind.EXCLUSION, sitting.included),
        (FormKind.QUESTIONNAIRE, sitting.questionnaire_done),
        (FormKind.SETUP, sitting.setup_done),
    )
    for kind, is_done in form_steps:
        form = None if is_done else make_form(state.protocol, kind)
        if form is not None:
            return FillIn(form)
    return None if sitting.device_checked else CheckDevice()


def find_next_action(state: SessionState, utc: str = "", monotonic_s: float | None = None) -> Action:
    """Find the next action. Raises ValueError while a trial is open: its answer and measurement, or that it is void,
    must be logged first.

    utc, monotonic_s: the present time (ISO 8601) and monotonic clock (s), by which the limits of a sitting are judged;
    with an empty utc the limits are not applied.
    """
    if state.presented is not None:
        raise ValueError("a trial is open; it must be closed before the next action")
    is_person = state.opened.observer is None
    if state.finished:
        form = make_form(state.protocol, FormKind.DEBRIEF) if is_person and not state.sitting.debriefed else None
        return FillIn(form) if form is not None and not state.closed else Finish()
    if is_person and utc and (reason := find_reached_limit(state, utc, monotonic_s)):
        return EndSitting(reason)
    probe_state, probe_settings = state.sitting.probing, state.protocol.probes
    if is_person and state.protocol.demo.level_n > 0 and not state.sitting.demo_done and not state.trials:
        return Demonstrate()
    if state.rest_due_s > 0:
        return TakeRest(seconds=state.rest_due_s)
    return (
        find_due_reference(probe_state, probe_settings)
        or find_due_probe(probe_state, probe_settings)
        or find_due_presentation(state)
    )


def find_reached_limit(state: SessionState, utc: str, monotonic_s: float | None = None) -> str:
    """Find the limit that ends this sitting; returns the reason as a clause, empty if the sitting may continue. The
    limits are the duration of the sitting since the first motion of the handle (min) and the daily vibration exposure
    A(8) of the hand (m/s²). utc, monotonic_s: the present time, as in `find_next_action`."""
    limits = state.protocol.limits
    sitting = pass_time(state.sitting, Moment(utc, monotonic_s))
    if (sitting.sitting_elapsed_s or 0.0) / 60.0 >= limits.longest_min:
        return f"the longest sitting of {limits.longest_min:g} minutes is reached; go on another day"
    a8_mps2 = compute_a8_mps2(compute_daily_dose(sitting))
    if a8_mps2 >= limits.dose_a8_mps2:
        return (
            f"the hand has got its vibration dose for today (A(8) {a8_mps2:.2f} of {limits.dose_a8_mps2:g} m/s²); "
            "go on another day"
        )
    return ""
