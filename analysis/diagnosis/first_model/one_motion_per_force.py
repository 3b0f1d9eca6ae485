"""Convert recordings of any form to forces and the motions that they drive, with a sentence on each change.

Used only without a given model, because a model defines its commands and responses itself. Begin at
`convert_to_driven_motions`; each of its steps returns the recordings unchanged, with an empty sentence, where it does
not apply.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.laws.friction_laws import LEAST_WIDTH_SHARE
from analysis.diagnosis.balance.laws.law import smooth_sign
from analysis.diagnosis.balance.motion import NoMotionError, compute_motions
from analysis.diagnosis.balance.structures import Structure, improves_significantly
from analysis.diagnosis.data.measured_motion import FORCE_QUANTITIES
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.first_model.free_motion import convert_free_motion
from analysis.diagnosis.first_model.infer_quantity import infer_quantities
from analysis.diagnosis.first_model.restore_sign import restore_sign
from analysis.diagnosis.first_model.reversed_commands import reverse_commands
from analysis.diagnosis.limits import SINGULAR_VALUE_RATIO
from analysis.wording import conjoin
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

DRIVE_QUANTITIES = FORCE_QUANTITIES | {"voltage", "current"} | set(DERIVATIVE_OF_QUANTITY)
"""Quantities of commands that drive a motion; all other commands, such as a temperature, are conditions."""
CONSTANT_RANGE = 1e-9
"""Range of a signal over its largest magnitude, up to which changes are rounding errors. Chosen by hand."""
GAIN_FOLDS = 8
"""Number of stretches over which the gains of commands are cross-validated. Chosen."""
MOTION_QUANTITIES = frozenset(DERIVATIVE_OF_QUANTITY) - {"voltage"}
"""Quantities of a motion: positions and their derivatives."""

Recordings = tuple[Recording, ...]
"""Recordings of one device, alike in channels, units and rate."""
Step = Callable[[Recordings], tuple[Recordings, str]]
"""Maps recordings to changed ones and a sentence; the sentence is empty where nothing was changed."""


def convert_to_driven_motions(
    recordings: Sequence[Recording], may_reverse: bool = True
) -> tuple[Recordings, tuple[str, ...]]:
    """Convert the recordings, with a sentence for each change. recordings: alike in channels, units and rate.
    may_reverse: commands whose positive direction is opposite to that of their motion are reversed; False where the
    directions were decided before, for other recordings of the device."""
    converted, remarks = tuple(recordings), []
    steps: tuple[Step, ...] = (
        infer_quantities, convert_free_motion, _separate_conditions, _select_imposed_motion, _select_motions,
        _select_forces, restore_sign, _drop_constant_commands, _merge_commands,
    )  # fmt: skip
    for step in (*steps, reverse_commands) if may_reverse else steps:
        converted, sentence = step(converted)
        remarks.append(sentence)
    return converted, tuple(filter(None, remarks))


def _separate_conditions(recordings: Recordings) -> tuple[Recordings, str]:
    """Move commands that drive no motion, such as temperatures and settings, to the recorded conditions; unchanged
    where all commands are of that kind."""
    command = recordings[0].command
    condition_channels = [k for k, quantity in enumerate(command.quantities) if quantity not in DRIVE_QUANTITIES]
    if not condition_channels or len(condition_channels) == len(command.channels):
        return recordings, ""
    kept_channels = [k for k in range(len(command.channels)) if k not in condition_channels]
    names = conjoin([command.channels[k] for k in condition_channels])
    return (
        tuple(
            replace(recording, command=recording.command.select_channels(kept_channels),
                    condition=_append_channels(recording.condition, recording.command, condition_channels),
                    excitation=_select_excitation(recording.excitation, recording.command, kept_channels))
            for recording in recordings
        ),
        f"{names} among the commands is not a force: it was taken as a condition on which laws may depend.",
    )  # fmt: skip


def _select_imposed_motion(recordings: Recordings) -> tuple[Recordings, str]:
    """Keep only the lowest derivative of an imposed motion that was recorded as several, such as the position of
    position and speed."""
    command, response = recordings[0].command, recordings[0].response
    if not (set(command.quantities) <= MOTION_QUANTITIES and set(response.quantities) <= FORCE_QUANTITIES):
        return recordings, ""
    kept_channels = _find_lowest_derivative_channels(command)
    if len(kept_channels) == len(command.channels):
        return recordings, ""
    return tuple(
        replace(recording, command=recording.command.select_channels(kept_channels), excitation=None)
        for recording in recordings
    ), (f"The imposed motion was taken from {conjoin([command.channels[k] for k in kept_channels])} alone.")


def _select_motions(recordings: Recordings) -> tuple[Recordings, str]:
    """Keep only the motions of the lowest derivative, where the responses are of several kinds."""
    signal = recordings[0].response
    quantities = set(signal.quantities)
    if (
        not quantities & MOTION_QUANTITIES
        or len({DERIVATIVE_OF_QUANTITY.get(quantity, -1) for quantity in quantities}) == 1
    ):
        return recordings, ""
    kept_channels = _find_lowest_derivative_channels(signal)
    dropped_names = [name for k, name in enumerate(signal.channels) if k not in kept_channels]
    return tuple(
        replace(recording, response=recording.response.select_channels(kept_channels)) for recording in recordings
    ), (
        f"Forces are balanced along {conjoin([signal.channels[k] for k in kept_channels])}; {conjoin(dropped_names)}, "
        "of another kind, was left out."
    )


def _select_forces(recordings: Recordings) -> tuple[Recordings, str]:
    """Keep only the strongest forces, where there are more forces than imposed motions."""
    command, response = recordings[0].command, recordings[0].response
    if not (set(command.quantities) <= MOTION_QUANTITIES and set(response.quantities) <= FORCE_QUANTITIES):
        return recordings, ""
    motion_count = len(command.channels)
    if len(response.channels) <= motion_count:
        return recordings, ""
    samples = np.vstack([recording.response.samples for recording in recordings])
    force_stds = np.array(
        [np.std(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0 for column in samples.T]
    )
    kept_channels = sorted(np.argsort(-force_stds, kind="stable")[:motion_count].tolist())
    dropped_names = [name for k, name in enumerate(response.channels) if k not in kept_channels]
    return tuple(
        replace(recording, response=recording.response.select_channels(kept_channels)) for recording in recordings
    ), (
        f"Of the measured forces the strongest, {conjoin([response.channels[k] for k in kept_channels])}, alone "
        f"entered the balance; for {conjoin(dropped_names)}, import the recording with that force as its only response."
    )


def _drop_constant_commands(recordings: Recordings) -> tuple[Recordings, str]:
    """Leave out commands that never change, because nothing about their axis can be identified, and with them the
    motion of their axis, where there is one for each command. Unchanged where all commands are constant, responses are
    more numerous, or no sample is complete."""
    command, response = recordings[0].command, recordings[0].response
    samples = np.vstack([recording.command.samples for recording in recordings])
    samples = samples[np.isfinite(samples).all(axis=1)]
    if len(command.channels) < len(response.channels) or not len(samples):
        return recordings, ""
    kept_channels = np.flatnonzero(np.ptp(samples, axis=0) > CONSTANT_RANGE * np.abs(samples).max(axis=0)).tolist()
    if len(kept_channels) in (0, len(command.channels)):
        return recordings, ""
    is_paired = len(command.channels) == len(response.channels)
    constant_names = [name for k, name in enumerate(command.channels) if k not in kept_channels]
    dropped_motions = [name for k, name in enumerate(response.channels) if k not in kept_channels] if is_paired else []
    motions_text = f" with {conjoin(dropped_motions)}, which no command moves" if dropped_motions else ""
    return (
        tuple(_select_axes(recording, kept_channels, is_paired) for recording in recordings),
        f"{conjoin(constant_names)} among the commands never {_inflect_verb(constant_names, 'changes')}, and "
        f"{_inflect_verb(constant_names, 'was')} left out{motions_text}.",
    )


def _select_axes(recording: Recording, kept_channels: list[int], is_paired: bool) -> Recording:
    """Select the kept commands. is_paired: select the responses and positions of the same indices as well."""
    command, position, excitation = recording.command, recording.position, recording.excitation
    has_paired_position = position is not None and len(position.channels) == len(recording.response.channels)
    return replace(
        recording,
        command=command.select_channels(kept_channels),
        excitation=_select_excitation(excitation, command, kept_channels),
        response=recording.response.select_channels(kept_channels) if is_paired else recording.response,
        position=position.select_channels(kept_channels)
        if is_paired and has_paired_position and position is not None
        else position,
    )


def _inflect_verb(names: Sequence[str], singular: str) -> str:
    """Inflect a verb: singular for a single name, else plural."""
    plural = {"changes": "change", "was": "were", "drives": "drive"}
    return singular if len(names) == 1 else plural[singular]


def _merge_commands(recordings: Recordings) -> tuple[Recordings, str]:
    """Merge commands that drive the same single motion into their sum, each with its fitted gain."""
    command, response = recordings[0].command, recordings[0].response
    if len(command.channels) < 2 or len(response.channels) != 1 or set(response.quantities) <= FORCE_QUANTITIES:
        return recordings, ""
    try:
        gains, main_command = _fit_gains(recordings)
    except (NoMotionError, np.linalg.LinAlgError):
        return recordings, ""
    merged_names = [name for k, name in enumerate(command.channels) if k != main_command]
    return (
        tuple(
            replace(recording, command=_sum_channels(recording.command, gains, main_command),
                    excitation=None if recording.excitation is None
                    else _sum_channels(recording.excitation, gains, main_command))
            for recording in recordings
        ),
        f"{conjoin(merged_names)} {_inflect_verb(merged_names, 'drives')} the same motion as "
        f"{command.channels[main_command]}: one command was made of them, "
        f"{' + '.join(f'{gain:.3g} x {name}' for gain, name in zip(gains, command.channels, strict=True))}.",
    )  # fmt: skip


def _sum_channels(signal: Signal, gains: FloatArray, main_command: int) -> Signal:
    """Sum the channels times their gains, under the name and unit of the main channel."""
    return replace(signal.select_channels([main_command]), samples=signal.samples @ gains[:, None])


def _fit_gains(recordings: Recordings) -> tuple[FloatArray, int]:
    """Fit the gains (m,) of the commands relative to the strongest, and find its index. Gains are the weights of the
    commands in a regression of the acceleration on commands, velocity, position and dry friction; without a time axis,
    of the position on commands and friction. Commands in one unit have gains of 1 or -1 unless others are significantly
    better: a command that is computed from the motion, such as a virtual spring, has no gain that the motion
    determines."""
    x, y = _make_gain_rows(recordings)
    command = recordings[0].command
    command_count = len(command.channels)
    column_stds = np.maximum(x.std(axis=0), 1e-300)
    x = x / column_stds
    scaled_gains = _solve_truncated(x, y)[:command_count]
    main_command = int(np.argmax(np.abs(scaled_gains)))
    gains = scaled_gains / column_stds[:command_count]
    gains /= gains[main_command]
    if len(set(zip(command.quantities, command.units, strict=True))) == 1:
        fitted = _cross_validate(x, y)
        for equal_gains in (np.ones(command_count), np.where(gains < 0, -1.0, 1.0)):
            sums = x[:, :command_count] @ (equal_gains * column_stds[:command_count])
            summed = _cross_validate(np.column_stack([sums / max(float(sums.std()), 1e-300), x[:, command_count:]]), y)
            if not improves_significantly(summed, fitted):
                return equal_gains * equal_gains[main_command], main_command
    return np.asarray(gains), main_command


def _make_gain_rows(recordings: Recordings) -> tuple[FloatArray, FloatArray]:
    """Make the rows of the regression of `_fit_gains`: regressors (n, k), the commands first, and the target (n,), all
    without their means, because of two commands with a constant sum this sum would appear to drive the motion."""
    regressor_rows, motion_targets = [], []
    for motion in compute_motions(observe_parts(recordings, 1)):
        friction = smooth_sign(motion.velocity, LEAST_WIDTH_SHARE * max(float(motion.velocity.std()), 1e-300))
        columns = [motion.force, motion.velocity, motion.position, friction]
        if not np.isfinite(motion.band_hz):
            columns, motion_target = [motion.force, friction], motion.position
        else:
            motion_target = motion.acceleration
        valid_mask = motion.mask_valid_samples(motion.fit)
        regressor_rows.append(motion.decimate(np.hstack(columns))[valid_mask])
        motion_targets.append(motion.decimate(motion_target)[valid_mask])
    x, y = (stacked - stacked.mean(axis=0) for stacked in (np.vstack(regressor_rows), np.vstack(motion_targets)[:, 0]))
    return x, y


def _solve_truncated(x: FloatArray, y: FloatArray) -> FloatArray:
    """Solve x w = y by least squares, without components of the size of rounding. x: (n, k), of equal deviations."""
    return np.asarray(np.linalg.lstsq(x, y, rcond=SINGULAR_VALUE_RATIO)[0])


def _cross_validate(x: FloatArray, y: FloatArray) -> Structure:
    """Compute the squared error of each of `GAIN_FOLDS` stretches, with weights fitted to the others."""
    stretches = np.array_split(np.arange(len(y)), GAIN_FOLDS)
    errors = [
        float(np.sum((y[rows] - x[rows] @ _solve_truncated(np.delete(x, rows, 0), np.delete(y, rows))) ** 2))
        for rows in stretches
    ]
    return Structure((), np.array(errors))


def _find_lowest_derivative_channels(signal: Signal) -> list[int]:
    """Find the indices of the motions with the lowest derivative, such as the positions among positions and
    velocities."""
    # Channels that are no motion get 9, above any order of derivative.
    orders = [
        DERIVATIVE_OF_QUANTITY[quantity] if quantity in MOTION_QUANTITIES else 9 for quantity in signal.quantities
    ]
    return [k for k, order in enumerate(orders) if order == min(orders)]


def _select_excitation(excitation: Signal | None, command: Signal, kept_channels: Sequence[int]) -> Signal | None:
    """Select the excitations of the kept commands; None where there is no excitation, or none for each command."""
    if excitation is None or len(excitation.channels) != len(command.channels):
        return None
    return excitation.select_channels(kept_channels)


def _append_channels(condition: Signal | None, command: Signal, indices: Sequence[int]) -> Signal:
    """Append these channels of the command to the conditions (None = none yet), as "command T" where T is a condition
    already: no signal names a channel twice."""
    new_conditions = command.select_channels(indices)
    if condition is None:
        return new_conditions
    return Signal(
        np.hstack([condition.samples, new_conditions.samples]),
        new_conditions.sample_rate_hz,
        (*condition.quantities, *new_conditions.quantities),
        (*condition.units, *new_conditions.units),
        (
            *condition.channels,
            *(f"command {name}" if name in condition.channels else name for name in new_conditions.channels),
        ),
    )
