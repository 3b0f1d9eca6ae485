"""What holds around the trials: forms, checks, the demonstration, and what the hand got today. A part of the fold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime

from protocols.trial import Trial
from study.session.sitting_events import DemoFinished, DeviceChecked, FormFilled
from study.session.vibration_dose import NO_DOSE, Dose, add


@dataclass(frozen=True, slots=True)
class SittingState:
    """Consent, inclusion, demonstration and debrief hold for the session; set-up and check for one sitting."""

    consented: bool = False
    included: bool = False
    refused: str = ""
    """Why nothing may be played; empty where nothing speaks against it."""
    setup_done: bool = False
    device_checked: bool = False
    demo_done: bool = False
    debriefed: bool = False
    began_utc: str = ""
    """First time in this sitting that the handle moved; empty before."""
    answers_before: int = 0
    """Given in earlier sittings."""
    moved_utc: str = ""
    """Last time that it moved."""
    dose: Dose = NO_DOSE
    """Since the last long rest: see NIGHT_H."""


NIGHT_H = 10.0
"""After so long without a movement a new day begins for the hand. A date would do worse: midnight, in whatever time
zone, may fall into a sitting."""

REFUSALS = {
    "consent": "consent was not given",
    "exclusion": "a question of the exclusion list was answered with yes",
}


def fill_in(sitting: SittingState, event: FormFilled) -> SittingState:
    match event.form:
        case "consent":
            return replace(sitting, consented=event.passed, refused="" if event.passed else REFUSALS["consent"])
        case "exclusion":
            return replace(sitting, included=event.passed, refused="" if event.passed else REFUSALS["exclusion"])
        case "setup":
            return replace(sitting, setup_done=True)
        case "debrief":
            return replace(sitting, debriefed=True)


def check(sitting: SittingState, event: DeviceChecked) -> SittingState:
    return replace(sitting, device_checked=event.passed)


def demonstrated(sitting: SittingState, event: DemoFinished) -> SittingState:
    return replace(sitting, demo_done=True)


def sit_down_again(sitting: SittingState, answers: int) -> SittingState:
    """A new sitting of the same session: whoever was refused is asked again, in case it was a slip of the finger."""
    return replace(sitting, setup_done=False, device_checked=False, began_utc="", refused="", answers_before=answers)


def moved(sitting: SittingState, utc: str) -> SittingState:
    """The handle moves at this time."""
    return replace(
        sitting,
        began_utc=sitting.began_utc or utc,
        moved_utc=utc,
        dose=dose_now(sitting, utc),
    )


def dose_now(sitting: SittingState, utc: str) -> Dose:
    """What counts today: nothing after a night's rest."""
    return NO_DOSE if minutes_between(sitting.moved_utc, utc) >= 60 * NIGHT_H else sitting.dose


def exposed(
    sitting: SittingState, frequency_hz: float, amplitude_mps2: float | None, seconds: float | None
) -> SittingState:
    """seconds: None where nobody counted them (an older log); that adds nothing."""
    if not seconds:
        return sitting
    return replace(sitting, dose=add(sitting.dose, frequency_hz, amplitude_mps2, seconds))


def likely_amplitude_mps2(trials: tuple[Trial, ...], frequency_hz: float, level_n: float) -> float | None:
    """What a stimulus without a measurement gave the hand: at the largest ratio measured so far at this frequency."""
    ratios = [
        trial.delivered_mps2 / trial.level_n
        for trial in trials
        if trial.frequency_hz == frequency_hz and trial.delivered_mps2 is not None
    ]
    return level_n * max(ratios) if ratios else None


def minutes_between(first_utc: str, second_utc: str) -> float:
    """Both ISO 8601; 0 where the first is empty."""
    if not first_utc:
        return 0.0
    return (datetime.fromisoformat(second_utc) - datetime.fromisoformat(first_utc)).total_seconds() / 60.0
