"""State of a sitting apart from its trials: forms, device check, demonstration, and the vibration dose of the day.

Part of the session's state, `SessionState.sitting`, with functions that return the state after an event or at a later
time. The dose is that of the daily exposure A(8) (`vibration_dose`); a rest of `DAILY_REST_H` without movement of the
handle starts a new day.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from protocols.trial import Trial
from study.session.facts.log_time import ClockStep, Moment, compute_elapsed_s, find_clock_step
from study.session.facts.sitting_events import FormFilled
from study.session.state.probe_state import ProbeState
from study.session.state.vibration_dose import NO_DOSE, Dose, add_sinusoid, sum_doses


@dataclass(frozen=True, slots=True)
class DailyRest:
    """A rest of `DAILY_REST_H` or more, which reset the dose to zero."""

    still_s: float
    """Duration (s) of the rest without movement of the handle."""
    dose: Dose
    """Dose of the session before the rest."""
    day_s: float
    """Time (s) from the first movement of the day before the rest to the first movement after it."""


@dataclass(frozen=True, slots=True)
class SittingState:
    """State of a sitting apart from its trials. Consent, inclusion, questionnaire, demonstration and debriefing hold
    for the whole session; set-up and device check for one sitting."""

    consented: bool = False
    included: bool = False
    """Whether the exclusion form was passed: no exclusion criterion applies."""
    ineligibility: Literal["", "refused", "excluded"] = ""
    """Reason why no stimulus may be played: consent refused, or an exclusion criterion applies; empty if allowed."""
    place_assigned: bool = False
    """Whether the participant's place in the counterbalanced order of conditions is assigned."""
    questionnaire_done: bool = False
    setup_done: bool = False
    device_checked: bool = False
    demo_done: bool = False
    demo_count: int = 0
    """Number of demonstration stimuli played in the session."""
    debriefed: bool = False
    last_moment: Moment = Moment("")  # noqa: RUF009 - frozen
    """Time of the last log entry, or later (`pass_time`), for which `sitting_elapsed_s`, `still_s` and `day_s` are
    given."""
    sitting_elapsed_s: float | None = None
    """Seconds since the handle first moved in this sitting; None before."""
    busy_voids: int = 0
    """Number of trials of this sitting that were void because the computer was too busy."""
    answers_before: int = 0
    """Number of answers given in earlier sittings."""
    still_s: float | None = None
    """Seconds since the handle last moved, in any sitting of this session or in the sessions of `other_sessions_dose`;
    None before."""
    day_s: float | None = None
    """Seconds since the handle first moved in this session after the last rest of `DAILY_REST_H` or more, in any
    sitting; None before. Too long, never too short, where a clock was set forward and back between sittings."""
    dose: Dose = NO_DOSE
    """Dose of this session since the last rest of `DAILY_REST_H` or more."""
    other_sessions_dose: Dose = NO_DOSE
    """Dose of the participant's other sessions on the same day, as known at the beginning of this sitting."""
    unread_sessions: tuple[str, ...] = ()
    """Names of the participant's sessions that could not be read at the beginning of this sitting."""
    daily_rest: DailyRest | None = None
    """The last rest of `DAILY_REST_H` or more; None before the first, or where a step of the clock disproved it."""
    clock_steps: tuple[ClockStep, ...] = ()
    """Steps of the computer's wall clock that the log shows."""
    probing: ProbeState = ProbeState()  # noqa: RUF009 - frozen
    """State of the probes and references of the session."""


DAILY_REST_H = 10.0
"""Least rest (h) without movement of the handle that resets the daily dose to 0; chosen. The calendar date is not used,
because midnight may fall into a sitting. Time is taken from the monotonic clock within a sitting, where it was logged,
otherwise from the wall clock: setting that forward between sittings counts as rest, until it is set back."""
DAILY_REST_S = 3600 * DAILY_REST_H


def apply_form(sitting: SittingState, event: FormFilled) -> SittingState:
    """Return the state after a form was filled in; `event.passed` states whether consent was given, or no exclusion
    criterion applies, and is ignored for other forms."""
    match event.form:
        case "consent":
            return replace(sitting, consented=event.passed, ineligibility="" if event.passed else "refused")
        case "exclusion":
            return replace(sitting, included=event.passed, ineligibility="" if event.passed else "excluded")
        case "questionnaire":
            return replace(sitting, questionnaire_done=True)
        case "setup":
            return replace(sitting, setup_done=True)
        case "debrief":
            return replace(sitting, debriefed=True)


def resume_sitting(sitting: SittingState, answers: int) -> SittingState:
    """Return the state at the beginning of a further sitting. answers: number of answers so far. A participant who
    refused or was excluded is asked again, in case an answer was mistyped: possible under version 1 of the rules only,
    because later versions close such a session (`rules.is_refusal_final`)."""
    return replace(
        sitting,
        setup_done=False,
        device_checked=False,
        sitting_elapsed_s=None,
        busy_voids=0,
        ineligibility="",
        answers_before=answers,
        probing=replace(sitting.probing, since_probe_s=None, is_reference_done=False, open=None, hand_mass_kg=None),
    )


def pass_time(sitting: SittingState, moment: Moment, resumed: bool = False) -> SittingState:
    """Return the state with all durations advanced to this moment. resumed: whether it begins a new sitting, whose
    monotonic clock cannot be compared with earlier values."""
    previous_moment = Moment(sitting.last_moment.utc) if resumed else sitting.last_moment
    elapsed_s, step = (
        compute_elapsed_s(previous_moment, moment),
        find_clock_step(previous_moment, moment, between_sittings=resumed),
    )
    since_probe_s = sitting.probing.since_probe_s
    advanced_sitting = replace(
        sitting,
        last_moment=moment,
        probing=replace(sitting.probing, since_probe_s=None if since_probe_s is None else since_probe_s + elapsed_s),
        sitting_elapsed_s=None if sitting.sitting_elapsed_s is None else sitting.sitting_elapsed_s + elapsed_s,
        still_s=None if sitting.still_s is None else sitting.still_s + elapsed_s,
        day_s=None if sitting.day_s is None else sitting.day_s + elapsed_s,
    )
    return advanced_sitting if step is None else _apply_clock_step(advanced_sitting, step)


def _apply_clock_step(sitting: SittingState, step: ClockStep) -> SittingState:
    """Return the state with the rests corrected for a step of the wall clock. A clock that is set back may have been
    set forward between two sittings, so that less time passed than was counted: the rest is shortened, and a dose that
    it reset is restored if the rest is then shorter than `DAILY_REST_H`."""
    steps = (*sitting.clock_steps, step)
    corrected_sitting = replace(sitting, clock_steps=steps)
    # Known steps forward were not counted as rest: setting the clock back by the same amount changes nothing.
    overcounted_s = max(0.0, -_sum_steps_s(steps)) - max(0.0, -_sum_steps_s(sitting.clock_steps))
    if overcounted_s <= 0:
        return corrected_sitting
    if corrected_sitting.still_s is not None:
        corrected_sitting = replace(corrected_sitting, still_s=max(0.0, corrected_sitting.still_s - overcounted_s))
    if corrected_sitting.daily_rest is None:
        return corrected_sitting
    daily_rest = replace(corrected_sitting.daily_rest, still_s=corrected_sitting.daily_rest.still_s - overcounted_s)
    if daily_rest.still_s >= DAILY_REST_S:
        return replace(corrected_sitting, daily_rest=daily_rest)
    return replace(
        corrected_sitting,
        daily_rest=None,
        dose=sum_doses(daily_rest.dose, corrected_sitting.dose),
        day_s=daily_rest.day_s + (corrected_sitting.day_s or 0.0),
    )


def _sum_steps_s(steps: tuple[ClockStep, ...]) -> float:
    """Sum the steps of the clock (s); positive: forward."""
    return sum(step.step_s for step in steps)


def start_motion(sitting: SittingState) -> SittingState:
    """Return the state after the handle begins to move, which resets the dose to zero after a rest of `DAILY_REST_H` or
    more, and begins the duration of the sitting at its first motion."""
    if sitting.still_s is not None and sitting.still_s >= DAILY_REST_S:
        daily_rest = DailyRest(sitting.still_s, sitting.dose, sitting.day_s or 0.0)
        sitting = replace(sitting, daily_rest=daily_rest, dose=NO_DOSE, other_sessions_dose=NO_DOSE, day_s=0.0)
    return replace(sitting, sitting_elapsed_s=sitting.sitting_elapsed_s or 0.0, still_s=0.0, day_s=sitting.day_s or 0.0)


def compute_daily_dose(sitting: SittingState) -> Dose:
    """Compute the dose of the day, over this and the participant's other sessions; `NO_DOSE` after a rest of
    `DAILY_REST_H` or more."""
    is_rested = sitting.still_s is not None and sitting.still_s >= DAILY_REST_S
    return NO_DOSE if is_rested else sum_doses(sitting.dose, sitting.other_sessions_dose)


def add_exposure(
    sitting: SittingState, frequency_hz: float, amplitude_mps2: float | None, duration_s: float | None
) -> SittingState:
    """Return the state with a sinusoidal vibration added to the dose. amplitude_mps2: amplitude of the acceleration
    (m/s²), None if not known. duration_s: nothing is added for 0, or for None as in logs of older versions, which do
    not record it."""
    if not duration_s:
        return sitting
    return replace(sitting, dose=add_sinusoid(sitting.dose, frequency_hz, amplitude_mps2, duration_s))


def estimate_amplitude_mps2(trials: tuple[Trial, ...], frequency_hz: float, level_n: float) -> float | None:
    """Estimate the acceleration amplitude (m/s²) of a stimulus that was not measured: its level (N) times the largest
    ratio of amplitude, along and across the direction, to level measured at this frequency; None without such a
    measurement."""
    ratios = [
        math.hypot(trial.delivered_mps2, trial.off_axis_mps2 or 0.0) / trial.level_n
        for trial in trials
        if trial.frequency_hz == frequency_hz and trial.delivered_mps2 is not None
    ]
    return level_n * max(ratios) if ratios else None
