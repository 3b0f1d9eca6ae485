"""The ports of one sitting, and the only way a fact gets into its state: through the log."""

import contextlib
from dataclasses import dataclass, replace

from equalizer.tracking.feedforward.equalizer import Equalizer
from study.devices.clock import Clock
from study.devices.device import Device, Fault, Played
from study.session.facts.events import Event, NoteTaken
from study.session.facts.log_time import ClockStep
from study.session.state.fold import apply
from study.session.state.state import SessionState
from study.session.watching.requests import NoteAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog
from study.workflows.trial.attendant import Attendant
from study.workflows.trial.display import Display, Hand


@dataclass(frozen=True, slots=True)
class Sitting:
    folder: SessionFolder
    log: EventLog
    clock: Clock
    device: Device
    equalizer: Equalizer
    display: Display
    hand: Hand
    attendant: Attendant
    place_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the spring's centre, where the handle belongs."""


def record(state: SessionState, event: Event, sitting: Sitting) -> SessionState:
    """First the fold, which refuses what cannot be; then the disk; only then may it be acted on."""
    event = replace(event, monotonic_s=sitting.clock.now_s())
    after = apply(state, event)
    sitting.log.append(event)
    tell_clock_steps(after.sitting.clock_steps[len(state.sitting.clock_steps) :], sitting)
    return after


def tell_clock_steps(steps: tuple[ClockStep, ...], sitting: Sitting) -> None:
    for step in steps:
        tell(step.sentence, sitting)


def tell(sentence: str, sitting: Sitting) -> None:
    """The experimenter: on the screen now, and in the log with the next notes."""
    sitting.display.trouble(sentence)
    sitting.attendant.note(NoteAsked("program", sentence))


def write_notes(state: SessionState, sitting: Sitting) -> SessionState:
    """What was noted meanwhile, by whomever. Listens first: a note may have come since the last glance."""
    sitting.attendant.listen()
    for note in sitting.attendant.take_notes():
        event = NoteTaken(utc=sitting.clock.utc(), who=note.who, text=note.text, adverse=note.adverse)
        state = record(state, event, sitting)
    return state


def released(sitting: Sitting) -> Played:
    """Let go after a stimulus, and say at once where the force could not be taken away: before any work on disk."""
    played = sitting.device.release()
    if played.health.fault is Fault.FORCE_LEFT:
        with contextlib.suppress(OSError):
            sitting.display.trouble(played.health.fault.value)
    return played
