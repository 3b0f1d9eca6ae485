"""A whole sitting, from opening the device to closing the log."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field

from study.devices.clock import Clock
from study.devices.device import Device, Fault
from study.devices.opening import open_device
from study.session.state.state import SessionState
from study.store.sessions.archive import SessionFolder
from study.store.sessions.live_file import write_live
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.device_settings import device_settings
from study.workflows.results.fold_session import fold_session
from study.workflows.session.equalize_stimuli import (
    Equalized,
    check_playable,
    equalized_again,
    equalized_stimuli,
    load_equalizer,
)
from study.workflows.session.open_session import (
    OpenedSession,
    SessionPlan,
    opened_session,
)
from study.workflows.session.resume_session import resumed_session
from study.workflows.session.run_session import run_session
from study.workflows.trial.attendant import Attendant
from study.workflows.trial.display import Display, Hand
from study.workflows.trial.requests_port import ManyRequests, QueuedRequests, Requests
from study.workflows.trial.sitting import Sitting, tell, tell_clock_steps


def _nobody_listens(folder: SessionFolder, device: Device) -> None:
    return None


@dataclass(frozen=True, slots=True)
class Participant:
    """Who sits at the device, and the time that passes for them."""

    display: Display
    hand: Hand
    clock: Clock
    requests: Requests = field(default_factory=QueuedRequests)
    """What is asked for from within this program: notes typed at the display, a stop from its other screens."""
    on_opened: Callable[[SessionFolder, Device], None] = _nobody_listens
    """Hears once of the session, now locked, and of the device, which it may stop from any thread."""


@dataclass(frozen=True, slots=True)
class Conducted:
    folder: SessionFolder
    state: SessionState
    left: str
    """Why the sitting ended before the session was finished; empty where it is finished."""
    fault: Fault
    """What was wrong with the device, if that was why."""
    withdrawn: bool = False
    """The participant takes the consent back: the caller erases the data."""


def conduct_new(plan: SessionPlan, device_name: str, participant: Participant) -> Conducted:
    """Open the device, then the session, and run it."""
    check_playable(plan.protocol, plan.model)
    settings = device_settings(plan.protocol)
    with contextlib.closing(open_device(device_name, settings, participant.clock, plan.seed)) as device:
        equalized = equalized_stimuli(plan.protocol, plan.model, device.info)
        with opened_session(plan, device.info, equalized, participant.clock) as opened:
            return _run(opened, device, equalized, participant)


def conduct_resumed(folder: SessionFolder, device_name: str, participant: Participant) -> Conducted:
    """Fold the log, open the device, and go on where the session stopped."""
    state = fold_session(folder).state
    if state.opened.equalized is not None:
        load_equalizer()
    settings = device_settings(state.protocol)
    with contextlib.closing(open_device(device_name, settings, participant.clock, state.opened.seed)) as device:
        equalized = equalized_again(folder, state, device.info)
        with resumed_session(folder, device.info, participant.clock) as opened:
            return _run(opened, device, equalized, participant, known_steps=len(state.sitting.clock_steps))


def _run(
    opened: OpenedSession, device: Device, equalized: Equalized, participant: Participant, known_steps: int = 0
) -> Conducted:
    """known_steps: how often the computer's clock was set before this sitting; only what is new is told."""
    folder, protocol = opened.folder, opened.state.protocol
    participant.on_opened(folder, device)
    place_m = device_settings(protocol).place_m
    inbox = RequestInbox(folder.path)
    attendant = Attendant(
        device,
        participant.clock,
        ManyRequests(participant.requests, inbox),
        tell=lambda live: write_live(folder.path, live),
        buttons=protocol.trial.device_buttons,
        place_m=place_m,
    )
    sitting = Sitting(
        folder=folder,
        log=opened.log,
        clock=participant.clock,
        device=device,
        equalizer=equalized.equalizer,
        display=participant.display,
        hand=participant.hand,
        attendant=attendant,
        place_m=place_m,
    )
    tell_clock_steps(opened.state.sitting.clock_steps[known_steps:], sitting)
    for name in opened.state.sitting.not_counted:
        tell(f"{name} cannot be read: what the hand got in it is not in the vibration dose of today.", sitting)
    end = run_session(opened.state, sitting)
    return Conducted(folder, end.state, end.left, end.fault, end.withdrawn)
