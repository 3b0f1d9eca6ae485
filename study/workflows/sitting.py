"""The ports of one sitting, and the only way a fact gets into its state: through the log."""

from dataclasses import dataclass

from equalizer.tracking.equalizer import Equalizer
from study.devices.clock import Clock
from study.devices.device import Device
from study.session.events import Event
from study.session.state import SessionState, apply
from study.store.archive import SessionFolder
from study.store.event_log import EventLog
from study.workflows.display import Display, Hand


@dataclass(frozen=True, slots=True)
class Sitting:
    folder: SessionFolder
    log: EventLog
    clock: Clock
    device: Device
    equalizer: Equalizer
    display: Display
    hand: Hand


def record(state: SessionState, event: Event, sitting: Sitting) -> SessionState:
    """First the fold, which refuses what cannot be; then the disk; only then may anybody act on it."""
    after = apply(state, event)
    sitting.log.append(event)
    return after
