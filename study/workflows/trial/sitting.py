"""Ports of one sitting (device, display, log, ...), and the functions that change the state of its session.

The state of a session changes only by events that are logged (`log_and_apply`), so that it can be rebuilt from the log.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from equalizer.tracking.feedforward.equalizer import Equalizer
from study.devices.clock import Clock
from study.devices.device import Device, Fault, PlaybackResult
from study.errors import StudyError
from study.session.facts.events import Event, NoteTaken
from study.session.facts.log_time import ClockStep
from study.session.state.fold import apply_event
from study.session.state.state import SessionState
from study.session.watching.requests import NoteAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog
from study.store.sessions.request_inbox import RequestInbox
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
        """Why the pulse was lost; empty where it was sent."""
        ...


class SoundOutput(Protocol):
    """Masking noise, as `study.devices.masking_sound` plays it. `start` and `check` raise `DeviceError`."""

    @property
    def output(self) -> str:
        """Name of the sound output."""
        ...

    def start(self) -> None:
        """Play from the beginning, until `stop`."""
        ...

    def check(self) -> None:
        """Raise DeviceError where the noise is not played."""
        ...

    def stop(self) -> bool:
        """Stop the noise. Returns whether it was played until then."""
        ...


def send_no_pulse() -> None:
    """Default of `Sitting.pulse`, for a lab without a trigger line: does nothing."""


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
    device_name: str
    """Name under which the device was opened (`open_device`)."""
    place_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of the virtual spring, the start position of the handle (x, y, z; m)."""
    pulse: Callable[[], Pulse | None] = send_no_pulse
    """Sends a pulse on the lab's trigger line, right after the device has begun a trial's force. Never raises."""
    masking_noise: SoundOutput | None = None
    """None where none is played."""


def log_and_apply(state: SessionState, event: Event, sitting: Sitting) -> SessionState:
    """Apply the event to the state, and append it to the log. Returns the new state, whose events are on disk. Raises
    LogContradictionError, and StudyError where it cannot be written."""
    event = replace(event, monotonic_s=sitting.clock.now_s())
    updated_state = apply_event(state, event)
    sitting.log.append(event)
    report_clock_steps(updated_state.sitting.clock_steps[len(state.sitting.clock_steps) :], sitting)
    return updated_state


def report_clock_steps(steps: tuple[ClockStep, ...], sitting: Sitting) -> None:
    """Notify the experimenter of each step of the wall clock, see `notify_experimenter`."""
    for step in steps:
        notify_experimenter(step.sentence, sitting)


def notify_experimenter(sentence: str, sitting: Sitting) -> None:
    """Notify the experimenter: on the screen now, and in the log with the next notes."""
    sitting.display.trouble(sentence)
    sitting.supervisor.add_note(NoteAsked("program", sentence))


def write_notes(state: SessionState, sitting: Sitting) -> SessionState:
    """Take pending requests, then log all notes that are not logged yet. Raises as `log_and_apply`; the notes that are
    not logged then are kept for the next call, those of other programs also for the next sitting."""
    sitting.supervisor.listen()
    inbox = RequestInbox(sitting.folder.path)
    while (note := sitting.supervisor.next_note) is not None:
        event = NoteTaken(utc=sitting.clock.utc(), who=note.who, text=note.text, adverse=note.adverse)
        state = log_and_apply(state, event, sitting)
        sitting.supervisor.drop_note()
        inbox.forget_logged(note)
    return state


def write_last_notes(state: SessionState, sitting: Sitting) -> SessionState:
    """Log notes as `write_notes` does, at the end of a sitting: neither a full disk nor a closed screen hides why it
    ended."""
    with contextlib.suppress(StudyError, OSError, KeyboardInterrupt):
        return write_notes(state, sitting)
    return state


def release_device(sitting: Sitting) -> PlaybackResult:
    """Release the stimulus, and report at once if the force could not be removed, before any disk access. A message of
    the driver becomes a note."""
    play_result = sitting.device.release()
    if play_result.health.fault is Fault.FORCE_LEFT:
        with contextlib.suppress(OSError):
            sitting.display.trouble(play_result.health.fault.value)
    if play_result.health.why:
        sitting.supervisor.add_note(NoteAsked("program", f"The device: {play_result.health.why}."))
    return play_result
