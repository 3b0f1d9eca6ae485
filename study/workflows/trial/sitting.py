"""The ports of one sitting, and how facts enter its state: only through the log."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

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
from study.workflows.trial.display import Display, Hand
from study.workflows.trial.session_supervisor import SessionSupervisor


class Pulse(Protocol):
    """Electrical pulse at the onset of a stimulus: the port that `study.devices.onset_line` provides."""

    @property
    def line(self) -> str:
        """Description of the output line, for the log."""
        ...

    @property
    def at_s(self) -> float | None:
        """When the pulse began, by the monotonic clock (s); None where it was lost."""
        ...

    @property
    def trouble(self) -> str:
        """Why it was lost; empty where it was not."""
        ...


class Sound(Protocol):
    """Masking noise, as `study.devices.masking_sound` plays it. `start` and `check` raise `DeviceError`."""

    @property
    def output(self) -> str:
        """Name of the sound output."""
        ...

    def start(self) -> None:
        """Play from the beginning, until `stop`."""
        ...

    def check(self) -> None:
        """Raises where the noise is not heard."""
        ...

    def stop(self) -> bool:
        """Stop the noise. Whether it was heard until then."""
        ...


def no_pulse() -> None:
    """Pulse of a lab that has no line for it: does nothing."""


@dataclass(frozen=True, slots=True)
class Sitting:
    """Ports of a sitting: the session's folder and log, clock, device, display, and optional trigger line and sound."""

    folder: SessionFolder
    log: EventLog
    clock: Clock
    device: Device
    equalizer: Equalizer
    display: Display
    hand: Hand
    supervisor: SessionSupervisor
    place_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of the spring, where the handle belongs."""
    pulse: Callable[[], Pulse | None] = no_pulse
    """Sends a pulse on the lab's trigger line, right after the device has begun a trial's force. Never raises."""
    sound: Sound | None = None


def record(state: SessionState, event: Event, sitting: Sitting) -> SessionState:
    """Fold the event, which rejects contradictions; then log it to the disk. Only the returned state may be acted
    on."""
    event = replace(event, monotonic_s=sitting.clock.now_s())
    after = apply(state, event)
    sitting.log.append(event)
    report_clock_steps(after.sitting.clock_steps[len(state.sitting.clock_steps) :], sitting)
    return after


def report_clock_steps(steps: tuple[ClockStep, ...], sitting: Sitting) -> None:
    """Tell the experimenter of each step of the wall clock, see `tell`."""
    for step in steps:
        notify_experimenter(step.sentence, sitting)


def notify_experimenter(sentence: str, sitting: Sitting) -> None:
    """Tell the experimenter: on the screen now, and in the log with the next notes."""
    sitting.display.trouble(sentence)
    sitting.supervisor.note(NoteAsked("program", sentence))


def write_notes(state: SessionState, sitting: Sitting) -> SessionState:
    """Log the notes taken meanwhile. Takes pending requests first."""
    sitting.supervisor.listen()
    for note in sitting.supervisor.take_notes():
        event = NoteTaken(utc=sitting.clock.utc(), who=note.who, text=note.text, adverse=note.adverse)
        state = record(state, event, sitting)
    return state


def release_device(sitting: Sitting) -> Played:
    """Release the stimulus, and report at once if the force could not be removed, before any disk access."""
    played = sitting.device.release()
    if played.health.fault is Fault.FORCE_LEFT:
        with contextlib.suppress(OSError):
            sitting.display.trouble(played.health.fault.value)
    if played.health.why:
        sitting.supervisor.note(NoteAsked("program", f"The device: {played.health.why}."))
    return played
