"""What drives a recorded motion: a command that changes, or a motion that is imposed and whose force is measured."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording

_FORCES = frozenset({"force", "torque"})


def is_driven(recordings: Sequence[Recording]) -> bool:
    """Whether any command changes, in a recording or between recordings; True where no command has a finite sample."""
    commands = np.vstack([each.command.samples for each in recordings])
    commands = commands[np.isfinite(commands).all(axis=1)]
    return len(commands) == 0 or bool(np.any(np.ptp(commands, axis=0) != 0))


def as_force_driven(recording: Recording) -> Recording:
    """The recording with the measured force as the command, the imposed motion as the response, and `imposed` in its
    meta; a recording with a changing command is not changed."""
    moves = set(recording.command.quantities) <= set(DERIVATIVE_OF_QUANTITY) - {"voltage"}
    pushes = set(recording.response.quantities) <= _FORCES
    if not (moves and pushes and len(recording.command.channels) >= len(recording.response.channels)):
        return recording
    return replace(
        recording,
        command=recording.response,
        response=recording.command,
        excitation=None,
        meta={**recording.meta, "imposed": recording.command.quantity},
    )


def all_as_force_driven(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Each recording in the form of `as_force_driven`."""
    return tuple(as_force_driven(recording) for recording in recordings)
