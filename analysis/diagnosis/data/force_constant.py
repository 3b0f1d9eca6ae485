"""Convert commands in A, V or no unit to forces or torques, by a force (torque) constant that the user states.

force = constant x command, in N or N m per unit of the command, so that masses and stiffnesses are found in SI units.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from equalizer.signals.unit_system import FORCE_UNITS, determine_unit_system

QUANTITY_AND_UNIT = {"m": ("force", "N"), "rad": ("torque", "N m")}
"""Quantity and unit of the converted command, by the unit of length of the motion."""


class ForceConstantError(ValueError):
    """The constants do not suit the recording; the message is a sentence without a full stop."""


def convert_commands_to_forces(recording: Recording, constants: Sequence[float]) -> tuple[Recording, str]:
    """Convert the commands to forces (torques), and also an excitation with as many channels. Returns the recording and
    a sentence about it. constants: a single value for all commands or a value for each, in N or N m per unit of the
    command. Raises ForceConstantError where the motion has no SI unit, a command is a force already, or the constants
    are of a wrong number, zero or not finite."""
    command, length_unit = (
        recording.command,
        determine_unit_system(recording.command.units, recording.response.units).length,
    )
    if length_unit not in QUANTITY_AND_UNIT:
        raise ForceConstantError(
            f"the motion is in {length_unit}: no force constant makes SI of it, so give its unit in the map"
        )
    if any(unit in FORCE_UNITS for unit in command.units):
        raise ForceConstantError(f"the command is a force already (in {command.units[0]}), so it has no force constant")
    if len(constants) not in (1, len(command.channels)):
        raise ForceConstantError(f"{len(constants)} force constants were given, for {len(command.channels)} commands")
    if not all(np.isfinite(constant) and constant for constant in constants):
        raise ForceConstantError("a force constant must be a number other than 0")
    quantity, unit = QUANTITY_AND_UNIT[length_unit]
    factors = np.broadcast_to(np.asarray(constants, dtype=np.float64), (len(command.channels),))

    def convert(signal: Signal) -> Signal:
        return replace(signal, samples=signal.samples * factors, quantity=quantity, unit=unit)

    excitation = recording.excitation
    has_same_channel_count = excitation is not None and len(excitation.channels) == len(command.channels)
    per_unit = "" if command.units[0] == "1" else f" per {command.units[0]}"
    constants_text = ", ".join(f"{constant:g}" for constant in constants)
    return (
        replace(
            recording,
            command=convert(command),
            excitation=convert(excitation) if excitation is not None and has_same_channel_count else excitation,
        ),
        f"The commands were multiplied by the {quantity} constant that was stated, {constants_text} {unit}{per_unit}.",
    )
