"""Infer the physical quantity of responses for which none is stated: position, velocity or force.

From the channel's name where that is clear; force where the commands are motions; else from a force balance on the
response y and its derivatives, f = m y'' + c y' + k y. With a position, mass makes y'' significant; with a velocity,
mass multiplies y' and damping y, so that y'' is not needed. A response is a velocity where y'' explains less than
`DERIVATIVE_GAIN` of the force's power in cross-validation and y at least that much, otherwise a position. A sensor's
voltage is treated likewise. Without a command that changes, a response without a unit is taken for a position. Where
forces were measured, a command without a unit is the imposed motion that its name states.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import NoMotionError, compute_motions
from analysis.diagnosis.balance.regression import build_regression
from analysis.diagnosis.data.measured_motion import FORCE_QUANTITIES, is_driven
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.limits import DERIVATIVE_GAIN
from analysis.wording import conjoin
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from equalizer.signals.units import NO_UNIT

BALANCE_QUANTITIES = (frozenset(DERIVATIVE_OF_QUANTITY) | FORCE_QUANTITIES) - {"voltage"}
"""Quantities that a force balance can use. A voltage is a sensor's reading of an unknown quantity."""


def infer_quantities(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """Infer the quantity of the responses, or of commands (`_infer_imposed_motion`). Returns the recordings with it,
    and a sentence on the assumption. Unchanged, with an empty sentence: where the quantity of any response is stated;
    with a unit, where no name tells a quantity and no command changes; for a voltage that behaves like a position.
    recordings: alike in channels, units, rate."""
    first_recording = recordings[0]
    if set(first_recording.response.quantities) <= FORCE_QUANTITIES:
        return _infer_imposed_motion(recordings)
    if set(first_recording.response.quantities) & BALANCE_QUANTITIES:
        return recordings, ""
    if quantities_in_names := _infer_from_names(first_recording.response, BALANCE_QUANTITIES):
        return tuple(_set_quantity(recording, quantities_in_names) for recording in recordings), _format_names_sentence(
            first_recording.response, quantities_in_names
        )
    if not is_driven(recordings):
        if set(first_recording.response.units) != {NO_UNIT}:
            return recordings, ""
        return tuple(_set_quantity(recording, "position") for recording in recordings), (
            f"The recording does not state what {conjoin(list(first_recording.response.channels))} measures; it was "
            "taken for a position that moves freely; if it is a speed, state that in the map (quantity)."
        )
    is_imposed_motion = set(first_recording.command.quantities) <= set(DERIVATIVE_OF_QUANTITY) - {"voltage"}
    quantity = "force" if is_imposed_motion else _infer_from_balance(recordings)
    if quantity == "position" and set(first_recording.response.quantities) == {"voltage"}:
        return recordings, ""
    names = conjoin(list(first_recording.response.channels))
    return tuple(_set_quantity(recording, quantity) for recording in recordings), (
        f"The recording does not state what {names} measures; it was taken for a {quantity}, as the commands and "
        "its time series suggest; if it is another quantity, state that in the map (quantity)."
    )


def _infer_imposed_motion(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """Infer, where all responses are forces, the motion that commands without a unit (encoder counts) impose, from
    their names. Unchanged, with an empty sentence, where no name of such a command states a motion."""
    command = recordings[0].command
    quantities = _infer_from_names(command, BALANCE_QUANTITIES - FORCE_QUANTITIES)
    if not quantities or quantities == command.quantities:
        return recordings, ""
    return tuple(
        replace(recording, command=replace(recording.command, quantity=quantities)) for recording in recordings
    ), _format_names_sentence(command, quantities)


def _infer_from_names(signal: Signal, allowed: frozenset[str]) -> tuple[str, ...]:
    """Infer the quantities of the channels without a unit from their names; empty where no channel has one of the
    allowed quantities then."""
    from equalizer.signals.quantity_words import detect_quantity  # only where a quantity is missing

    quantities = [
        inferred_quantity if unit == NO_UNIT and (inferred_quantity := detect_quantity(name)) in allowed else quantity
        for name, unit, quantity in zip(signal.channels, signal.units, signal.quantities, strict=True)
    ]
    return tuple(quantities) if set(quantities) & allowed else ()


def _format_names_sentence(signal: Signal, quantities: Sequence[str]) -> str:
    """Format a sentence on the quantities that were taken from names, with the way to correct them."""
    phrases = [
        f"{name} was taken for {'an' if quantity.startswith('a') else 'a'} {quantity}"
        for name, quantity, stated in zip(signal.channels, quantities, signal.quantities, strict=True)
        if quantity != stated
    ]
    return f"From the name alone, {conjoin(phrases)}; if it is another quantity, state that in the map (quantity)."


def _infer_from_balance(recordings: Sequence[Recording]) -> str:
    """Infer the quantity of the responses from the force balance of the first command (see the module's docstring); a
    position where the balance cannot be computed or there is no time axis (infinite band)."""
    channel_count = len(recordings[0].response.channels)
    position_recordings = [replace(_set_quantity(recording, "position"), position=None) for recording in recordings]
    try:
        motions = compute_motions(observe_parts(position_recordings, channel_count))
        regression = build_regression(motions, 0, (), turns_freely=False)
    except (NoMotionError, np.linalg.LinAlgError):
        return "position"
    all_columns = regression.select_columns(())
    force_power = max(sum(block.centred_power for block in regression.fit), 1e-300)
    if not np.isfinite(motions[0].band_hz):
        return "position"

    def compute_error_increase(columns: Sequence[int]) -> float:
        """Compute the increase of the cross-validated squared error without these columns, relative to the force's
        power."""
        errors_without = regression.cross_validate([k for k in all_columns if k not in columns])
        return float((errors_without - regression.cross_validate(all_columns)).sum()) / force_power

    motion_count = len(motions[0].channels)
    acceleration_increase, position_increase = (
        compute_error_increase(range(motion_count)),
        compute_error_increase(range(2 * motion_count, 3 * motion_count)),
    )
    return "velocity" if acceleration_increase < DERIVATIVE_GAIN <= position_increase else "position"


def _set_quantity(recording: Recording, quantity: str | tuple[str, ...]) -> Recording:
    """Set the quantity of all response channels (a single name), or of each (a tuple)."""
    return replace(recording, response=replace(recording.response, quantity=quantity))
