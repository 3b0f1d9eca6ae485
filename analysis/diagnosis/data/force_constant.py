"""Convert commands in A, V or no unit to forces or torques, by a force (torque) constant that the user states.

force = constant x command, in N or N m per unit of the command, so that masses and stiffnesses are found in SI units.
Where the motion was commanded (imposed), the force is the response, which is converted in the command's place.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.quantity_words import detect_quantity
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from equalizer.signals.unit_system import FORCE_UNITS, determine_unit_system

QUANTITY_AND_UNIT = {"m": ("force", "N"), "rad": ("torque", "N m")}
"""Quantity and unit of the converted command, by the unit of length of the motion."""


class ForceConstantError(ValueError):
    """The constants do not suit the recording; the message is a sentence without a full stop."""


def convert_commands_to_forces(recording: Recording, constants: Sequence[float]) -> tuple[Recording, str]:
    """Convert the commands to forces (torques), and also an excitation with as many channels; the responses where the
    motion was imposed (`_is_force_measured`). Returns the recording and a sentence about it. constants: a single value
    for all commands (responses) or a value for each, in N or N m per unit. Raises ForceConstantError where the motion
    has no SI unit, the command (response) is a force already, or the constants are of a wrong number, zero or not
    finite."""
    is_measured = _is_force_measured(recording)
    role, motion_role = ("response", "command") if is_measured else ("command", "response")
    signal: Signal = getattr(recording, role)
    length_unit = determine_unit_system(signal.units, getattr(recording, motion_role).units).length
    if length_unit not in QUANTITY_AND_UNIT:
        raise ForceConstantError(
            f"the motion is in {length_unit}: no force constant makes SI of it, so give its unit in the map"
        )
    if any(unit in FORCE_UNITS for unit in signal.units):
        raise ForceConstantError(f"the {role} is a force already (in {signal.units[0]}), so it has no force constant")
    if len(constants) not in (1, len(signal.channels)):
        raise ForceConstantError(f"{len(constants)} force constants were given, for {len(signal.channels)} {role}s")
    if not all(np.isfinite(constant) and constant for constant in constants):
        raise ForceConstantError("a force constant must be a number other than 0")
    quantity, unit = QUANTITY_AND_UNIT[length_unit]
    factors = np.broadcast_to(np.asarray(constants, dtype=np.float64), (len(signal.channels),))

    def convert(signal: Signal) -> Signal:
        return replace(signal, samples=signal.samples * factors, quantity=quantity, unit=unit)

    per_unit = "" if signal.units[0] == "1" else f" per {signal.units[0]}"
    constants_text = ", ".join(f"{constant:g}" for constant in constants)
    sentence = (
        f"The {role}s were multiplied by the {quantity} constant that was stated, {constants_text} {unit}{per_unit}."
    )
    if is_measured:
        return replace(recording, response=convert(signal)), sentence
    excitation = recording.excitation
    has_same_channel_count = excitation is not None and len(excitation.channels) == len(signal.channels)
    converted_excitation = convert(excitation) if excitation is not None and has_same_channel_count else excitation
    return replace(recording, command=convert(signal), excitation=converted_excitation), sentence


def _is_force_measured(recording: Recording) -> bool:
    """Whether the motion was commanded and no response is one, by its quantity or, without a unit, by its name: the
    responses are then the force along an imposed motion."""
    motions, response = set(DERIVATIVE_OF_QUANTITY) - {"voltage"}, recording.response
    named = {detect_quantity(name) for name, unit in zip(response.channels, response.units, strict=True) if unit == "1"}
    return set(recording.command.quantities) <= motions and not motions & {*response.quantities, *named}
