"""Let go after a stimulus, and tell whoever holds the handle at once if the force could not be taken away."""

import contextlib

from study.devices.device import Fault, Played
from study.workflows.trial.sitting import Sitting


def released(sitting: Sitting) -> Played:
    """Before any work on disk: whoever holds the handle hears first."""
    played = sitting.device.release()
    if played.health.fault is Fault.FORCE_LEFT:
        with contextlib.suppress(OSError):
            sitting.display.trouble(played.health.fault.value)
    return played
