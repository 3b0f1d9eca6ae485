"""State around the trials: forms, checks, demonstration, and today's vibration dose. Part of the fold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from protocols.trial import Trial
from study.session.facts.log_time import ClockStep, Moment, clock_step, elapsed_s
from study.session.facts.sitting_events import DemoFinished, DeviceChecked, FormFilled
from study.session.state.probe_state import ProbeState
from study.session.state.vibration_dose import NO_DOSE, Dose, add, total


@dataclass(frozen=True, slots=True)
class Night:
    """A rest after which the dose started again from zero."""

    still_s: float
    """Time without movement of the handle, by the clock."""
    dose: Dose
    """The dose that was reset."""


@dataclass(frozen=True, slots=True)
class SittingState:
    """Consent, inclusion, questions, demonstration, debrief hold for the session; set-up and check for one sitting."""

    consented: bool = False
    included: bool = False
    turned_away: Literal["", "refused", "excluded"] = ""
    """Why nothing may be played: see TURNED_AWAY; empty if allowed."""
    placed: bool = False
    """The place in the balanced order is taken."""
    questioned: bool = False
    setup_done: bool = False
    device_checked: bool = False
    demo_done: bool = False
    demos: int = 0
    """Demonstrations played in the session."""
    debriefed: bool = False
    last: Moment = Moment("")  # noqa: RUF009 - frozen
    """Time of the last log entry, up to which everything here counts."""
    sat_s: float | None = None
    """Seconds since the handle first moved in this sitting; None before."""
    busy_voids: int = 0
    """Trials of this sitting that were void because the computer was too busy."""
    answers_before: int = 0
    """Answers given in earlier sittings."""
    still_s: float | None = None
    """Seconds since the handle last moved, in any sitting; None before."""
    dose: Dose = NO_DOSE
    """Dose since the last long rest: see NIGHT_H."""
    elsewhere: Dose = NO_DOSE
    """Dose of the participant's other sessions since then, as known at the beginning of this sitting."""
    not_counted: tuple[str, ...] = ()
    """Sessions of the participant that could not be read then."""
    night: Night | None = None
    """The last long rest."""
    clock_steps: tuple[ClockStep, ...] = ()
    """Steps of the computer's wall clock."""
    probing: ProbeState = ProbeState()  # noqa: RUF009 - frozen


NIGHT_H = 10.0
"""A rest of this length (h) without movement starts a new day for the hand. A calendar date would be worse: midnight
may fall into a sitting. Within a sitting the monotonic clock counts, between sittings the wall clock: setting it
forward by this much there passes for a night, unless it is set back later."""
NIGHT_S = 3600 * NIGHT_H
"""`NIGHT_H` in seconds."""


def fill_in(sitting: SittingState, event: FormFilled) -> SittingState:
    """The state after a form."""
    match event.form:
        case "consent":
            return replace(sitting, consented=event.passed, turned_away="" if event.passed else "refused")
        case "exclusion":
            return replace(sitting, included=event.passed, turned_away="" if event.passed else "excluded")
        case "questionnaire":
            return replace(sitting, questioned=True)
        case "setup":
            return replace(sitting, setup_done=True)
        case "debrief":
            return replace(sitting, debriefed=True)


def check(sitting: SittingState, event: DeviceChecked) -> SittingState:
    """The state after a device check."""
    return replace(sitting, device_checked=event.passed)


def finish_demo(sitting: SittingState, event: DemoFinished) -> SittingState:
    """The state after the demonstration."""
    return replace(sitting, demo_done=True)


def sit_down_again(sitting: SittingState, answers: int) -> SittingState:
    """The state at the beginning of another sitting. Under the first rules, which ask once, a person who was turned
    away is asked again, in case of a mistyped answer."""
    return replace(
        sitting,
        setup_done=False,
        device_checked=False,
        sat_s=None,
        busy_voids=0,
        turned_away="",
        answers_before=answers,
        probing=replace(sitting.probing, since_s=None, referenced=False, open=None, hand_mass_kg=None),
    )


def pass_time(sitting: SittingState, now: Moment, resumed: bool = False) -> SittingState:
    """Advance to this moment. resumed: it begins a new sitting, so that its monotonic clock is not comparable with
    earlier ones."""
    last = Moment(sitting.last.utc) if resumed else sitting.last
    passed, step = elapsed_s(last, now), clock_step(last, now, between_sittings=resumed)
    since_s = sitting.probing.since_s
    later = replace(
        sitting,
        last=now,
        probing=replace(sitting.probing, since_s=None if since_s is None else since_s + passed),
        sat_s=None if sitting.sat_s is None else sitting.sat_s + passed,
        still_s=None if sitting.still_s is None else sitting.still_s + passed,
    )
    return later if step is None else _apply_clock_step(later, step)


def _apply_clock_step(sitting: SittingState, step: ClockStep) -> SittingState:
    """A clock set back may reveal that a rest between two sittings was shorter than it seemed, because the clock had
    been set forward: the rest is shortened, and a dose that it reset is restored."""
    steps = (*sitting.clock_steps, step)
    known = replace(sitting, clock_steps=steps)
    # Known steps forward were never counted as rest: setting the clock back by as much changes nothing.
    doubt_s = max(0.0, -_sum_s(steps)) - max(0.0, -_sum_s(sitting.clock_steps))
    if doubt_s <= 0:
        return known
    if known.still_s is not None:
        known = replace(known, still_s=max(0.0, known.still_s - doubt_s))
    if known.night is None:
        return known
    night = replace(known.night, still_s=known.night.still_s - doubt_s)
    if night.still_s >= NIGHT_S:
        return replace(known, night=night)
    return replace(known, night=None, dose=total(night.dose, known.dose))


def _sum_s(steps: tuple[ClockStep, ...]) -> float:
    return sum(step.by_s for step in steps)


def start_motion(sitting: SittingState) -> SittingState:
    """The handle moves now: after a night's rest the dose starts again."""
    if sitting.still_s is not None and sitting.still_s >= NIGHT_S:
        sitting = replace(sitting, night=Night(sitting.still_s, sitting.dose), dose=NO_DOSE, elsewhere=NO_DOSE)
    return replace(sitting, sat_s=sitting.sat_s or 0.0, still_s=0.0)


def dose_now(sitting: SittingState) -> Dose:
    """Dose of today: none after a night's rest."""
    rested = sitting.still_s is not None and sitting.still_s >= NIGHT_S
    return NO_DOSE if rested else total(sitting.dose, sitting.elsewhere)


def add_exposure(
    sitting: SittingState, frequency_hz: float, amplitude_mps2: float | None, seconds: float | None
) -> SittingState:
    """Add vibration to the dose. seconds: None where an older log did not count them; nothing is then added."""
    if not seconds:
        return sitting
    return replace(sitting, dose=add(sitting.dose, frequency_hz, amplitude_mps2, seconds))


def likely_amplitude_mps2(trials: tuple[Trial, ...], frequency_hz: float, level_n: float) -> float | None:
    """Estimated acceleration (m/s^2) of a stimulus without a measurement: level times the largest ratio measured at
    this frequency."""
    ratios = [
        trial.delivered_mps2 / trial.level_n
        for trial in trials
        if trial.frequency_hz == frequency_hz and trial.delivered_mps2 is not None
    ]
    return level_n * max(ratios) if ratios else None
