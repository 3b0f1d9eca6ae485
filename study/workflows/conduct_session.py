"""A whole sitting, from opening the device to closing the log."""

import contextlib
from dataclasses import dataclass

from equalizer.tracking.equalizer import Identity
from study.devices.clock import Clock
from study.devices.device import Device, Fault
from study.devices.opening import open_device
from study.session.state import SessionState
from study.store.archive import SessionFolder
from study.workflows.display import Display, Hand
from study.workflows.fold_session import fold_session
from study.workflows.open_session import (
    OpenedSession,
    SessionPlan,
    check_playable,
    device_settings,
    opened_session,
)
from study.workflows.resume_session import resumed_session
from study.workflows.run_session import run_session
from study.workflows.sitting import Sitting


@dataclass(frozen=True, slots=True)
class Participant:
    """Who sits at the device, and the time that passes for them."""

    display: Display
    hand: Hand
    clock: Clock


@dataclass(frozen=True, slots=True)
class Conducted:
    folder: SessionFolder
    state: SessionState
    left: str
    """Why the sitting ended before the session was finished; empty where it is finished."""
    fault: Fault
    """What was wrong with the device, if that was why."""


def conduct_new(plan: SessionPlan, device_name: str, participant: Participant) -> Conducted:
    """Open the device, then the session, and run it."""
    check_playable(plan.protocol)
    settings = device_settings(plan.protocol)
    with (
        contextlib.closing(open_device(device_name, settings, participant.clock, plan.seed)) as device,
        opened_session(plan, device.info, Identity.name, participant.clock) as opened,
    ):
        return _run(opened, device, participant)


def conduct_resumed(folder: SessionFolder, device_name: str, participant: Participant) -> Conducted:
    """Fold the log, open the device, and go on where the session stopped."""
    state = fold_session(folder).state
    settings = device_settings(state.protocol)
    with (
        contextlib.closing(open_device(device_name, settings, participant.clock, state.opened.seed)) as device,
        resumed_session(folder, device.info, participant.clock) as opened,
    ):
        return _run(opened, device, participant)


def _run(opened: OpenedSession, device: Device, participant: Participant) -> Conducted:
    sitting = Sitting(
        folder=opened.folder,
        log=opened.log,
        clock=participant.clock,
        device=device,
        equalizer=Identity(),
        display=participant.display,
        hand=participant.hand,
    )
    end = run_session(opened.state, sitting)
    return Conducted(opened.folder, end.state, end.left, end.fault)
