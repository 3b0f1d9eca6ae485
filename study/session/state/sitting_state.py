"""State of a sitting around its trials: forms, device check, demonstration, and the vibration dose of the day.

Part of the session's state that `fold` computes from the log. The dose is the daily exposure A(8) of `vibration_dose`;
a rest of `NIGHT_H` without movement of the handle starts a new day.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from protocols.trial import Trial
from study.session.facts.log_time import ClockStep, Moment, compute_elapsed_s, find_clock_step
from study.session.facts.sitting_events import DemoFinished, DeviceChecked, FormFilled
from study.session.state.probe_state import ProbeState
from study.session.state.vibration_dose import NO_DOSE, Dose, add_sinusoid, sum_doses


@dataclass(frozen=True, slots=True)
class Night:
    """A rest after which the dose started again from zero."""

    still_s: float
    """Duration of the rest without movement of the handle (s), by the clock."""
    dose: Dose
    """The session's dose before the rest, which the rest reset."""


@dataclass(frozen=True, slots=True)
class SittingState:
    """State around the trials. Consent, inclusion, questions, demonstration and debriefing hold for the whole session;
    set-up and device check for one sitting."""

    consented: bool = False
    included: bool = False
    ineligibility: Literal["", "refused", "excluded"] = ""
    """Reason why no stimulus may be played: consent refused, or excluded by a question; empty if allowed."""
    place_assigned: bool = False
    """Whether the participant's place in the counterbalanced order of conditions is assigned."""
    questioned: bool = False
    setup_done: bool = False
    device_checked: bool = False
    demo_done: bool = False
    demos: int = 0
    """Demonstrations played in the session."""
    debriefed: bool = False
    last: Moment = Moment("")  # noqa: RUF009 - frozen
    """Time of the last log entry; all durations below are those at this time."""
    sat_s: float | None = None
    """Seconds since the handle first moved in this sitting; None before."""
    busy_voids: int = 0
    """Trials of this sitting that were void because the computer was too busy."""
    answers_before: int = 0
    """Answers given in earlier sittings."""
    still_s: float | None = None
    """Seconds since the handle last moved, in any sitting; None before."""
    dose: Dose = NO_DOSE
    """Dose of this session since the last rest of `NIGHT_H` or more."""
    other_sessions_dose: Dose = NO_DOSE
    """Dose of the participant's other sessions on the same day, as known at the beginning of this sitting."""
    unread_sessions: tuple[str, ...] = ()
    """Sessions of the participant that could not be read at the beginning of this sitting."""
    night: Night | None = None
    """The last rest of `NIGHT_H` or more; None before the first."""
    clock_steps: tuple[ClockStep, ...] = ()
    """Steps of the computer's wall clock that the log shows."""
    probing: ProbeState = ProbeState()  # noqa: RUF009 - frozen


NIGHT_H = 10.0
"""Rest (h) without movement after which a new day begins for the hand, and the dose is 0 again. A calendar date is not
used, because midnight may fall into a sitting. Time is taken from the monotonic clock within a sitting and from the
wall clock between sittings: setting the wall clock forward between sittings counts as rest, until it is set back."""
NIGHT_S = 3600 * NIGHT_H
"""`NIGHT_H` in seconds."""


def apply_form(sitting: SittingState, event: FormFilled) -> SittingState:
    """The state after a form; `event.passed` decides on consent and on inclusion."""
    match event.form:
        case "consent":
            return replace(sitting, consented=event.passed, ineligibility="" if event.passed else "refused")
        case "exclusion":
            return replace(sitting, included=event.passed, ineligibility="" if event.passed else "excluded")
        case "questionnaire":
            return replace(sitting, questioned=True)
        case "setup":
            return replace(sitting, setup_done=True)
        case "debrief":
            return replace(sitting, debriefed=True)


def apply_device_check(sitting: SittingState, event: DeviceChecked) -> SittingState:
    """The state after a device check."""
    return replace(sitting, device_checked=event.passed)


def finish_demo(sitting: SittingState, event: DemoFinished) -> SittingState:
    """The state after the demonstration."""
    return replace(sitting, demo_done=True)


def resume_sitting(sitting: SittingState, answers: int) -> SittingState:
    """The state at the beginning of a further sitting. answers: number of answers so far. Under version 1 of the rules
    (`rules`) a person who was turned away is asked again, in case an answer was mistyped."""
    return replace(
        sitting,
        setup_done=False,
        device_checked=False,
        sat_s=None,
        busy_voids=0,
        ineligibility="",
        answers_before=answers,
        probing=replace(sitting.probing, since_probe_s=None, is_reference_done=False, open=None, hand_mass_kg=None),
    )


def pass_time(sitting: SittingState, moment: Moment, resumed: bool = False) -> SittingState:
    """Advance all durations to this moment. resumed: the moment begins a new sitting, whose monotonic clock cannot be
    compared with earlier values."""
    last = Moment(sitting.last.utc) if resumed else sitting.last
    passed_s, step = compute_elapsed_s(last, moment), find_clock_step(last, moment, between_sittings=resumed)
    since_probe_s = sitting.probing.since_probe_s
    advanced = replace(
        sitting,
        last=moment,
        probing=replace(sitting.probing, since_probe_s=None if since_probe_s is None else since_probe_s + passed_s),
        sat_s=None if sitting.sat_s is None else sitting.sat_s + passed_s,
        still_s=None if sitting.still_s is None else sitting.still_s + passed_s,
    )
    return advanced if step is None else _apply_clock_step(advanced, step)


def _apply_clock_step(sitting: SittingState, step: ClockStep) -> SittingState:
    """Correct the rests for a step of the wall clock. A clock that is set back may show that it had been set forward
    between two sittings, so that the rest was shorter than counted: the rest is shortened, and a dose that it reset is
    restored."""
    steps = (*sitting.clock_steps, step)
    corrected = replace(sitting, clock_steps=steps)
    # Known steps forward were not counted as rest: setting the clock back by the same amount changes nothing.
    doubt_s = max(0.0, -_sum_s(steps)) - max(0.0, -_sum_s(sitting.clock_steps))
    if doubt_s <= 0:
        return corrected
    if corrected.still_s is not None:
        corrected = replace(corrected, still_s=max(0.0, corrected.still_s - doubt_s))
    if corrected.night is None:
        return corrected
    night = replace(corrected.night, still_s=corrected.night.still_s - doubt_s)
    if night.still_s >= NIGHT_S:
        return replace(corrected, night=night)
    return replace(corrected, night=None, dose=sum_doses(night.dose, corrected.dose))


def _sum_s(steps: tuple[ClockStep, ...]) -> float:
    """Total of the steps (s), positive: forward."""
    return sum(step.by_s for step in steps)


def start_motion(sitting: SittingState) -> SittingState:
    """The state when the handle begins to move: after a rest of `NIGHT_H` or more the dose starts again from zero."""
    if sitting.still_s is not None and sitting.still_s >= NIGHT_S:
        sitting = replace(
            sitting, night=Night(sitting.still_s, sitting.dose), dose=NO_DOSE, other_sessions_dose=NO_DOSE
        )
    return replace(sitting, sat_s=sitting.sat_s or 0.0, still_s=0.0)


def compute_daily_dose(sitting: SittingState) -> Dose:
    """Dose of today, of this and the participant's other sessions; none after a rest of `NIGHT_H` or more."""
    is_rested = sitting.still_s is not None and sitting.still_s >= NIGHT_S
    return NO_DOSE if is_rested else sum_doses(sitting.dose, sitting.other_sessions_dose)


def add_exposure(
    sitting: SittingState, frequency_hz: float, amplitude_mps2: float | None, seconds: float | None
) -> SittingState:
    """Add vibration of this frequency and amplitude (None = not known) to the dose. seconds: duration; None in older
    logs, which did not record it, and nothing is added."""
    if not seconds:
        return sitting
    return replace(sitting, dose=add_sinusoid(sitting.dose, frequency_hz, amplitude_mps2, seconds))


def estimate_amplitude_mps2(trials: tuple[Trial, ...], frequency_hz: float, level_n: float) -> float | None:
    """Estimated acceleration amplitude (m/s^2) of a stimulus that was not measured: its level (N) times the largest
    ratio of amplitude to level measured at this frequency; None without such a measurement."""
    ratios = [
        trial.delivered_mps2 / trial.level_n
        for trial in trials
        if trial.frequency_hz == frequency_hz and trial.delivered_mps2 is not None
    ]
    return level_n * max(ratios) if ratios else None
