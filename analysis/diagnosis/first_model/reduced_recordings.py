"""Subtract from the commands the linear forces of a balance that a model with one body per command cannot describe.

These are forces of motions other than the driven ones, of modes, and of a delayed command, with the weights of the
force balance. Each reduced command drives one measured motion, so that nonlinear laws are fitted and drawn as for any
device.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.motion import Motion, find_motion_signals
from equalizer.signals.recording import Hold, Recording, find_parts
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.unit_system import determine_unit_system


def is_reduction_needed(balances: Sequence[Balance]) -> bool:
    """Whether commands must be reduced: a balance has linear terms beyond one body per command (further motions, linear
    laws or a delay), or integrated accelerations; False where a named law is no column of the regression, because a law
    of the command acts on the whole command, not on a part. balances: at least one."""
    if not all(judged_law.has_column for balance in balances for judged_law in balance.named):
        return False
    motion = balances[0].search.regression.motions[0]
    # `order` counts the time derivatives in the measurement: 2 is an acceleration, whose integrals are the motion.
    if len(motion.channels) > len(balances) or motion.order == 2:
        return True
    return any(balance.linear_laws or balance.search.regression.base_terms.delay_s for balance in balances)


def reduce_recordings(recordings: Sequence[Recording], balances: Sequence[Balance]) -> tuple[Recording, ...]:
    """Reduce the commands of recordings. The driven motions become the response, positions in place of measured
    accelerations (with a band-limited hold); position and excitation are removed. recordings: those of the balances, in
    the same order."""
    reduced_recordings, first_part = [], 0
    for recording, measured_motion in zip(recordings, find_motion_signals(recordings), strict=True):
        parts = find_parts(recording)
        reduced_recordings.append(_reduce_recording(recording, measured_motion, parts, balances, first_part))
        first_part += len(parts)
    return tuple(reduced_recordings)


def _reduce_recording(
    recording: Recording,
    measured_motion: Signal,
    parts: Sequence[tuple[int, int]],
    balances: Sequence[Balance],
    first_part: int,
) -> Recording:
    """Reduce one recording. measured_motion: its channels from which motions were computed. parts: start and stop of
    each, in samples. first_part: index of its first part among all motions."""
    command_samples = recording.command.samples.copy()
    for axis, balance in enumerate(balances):
        regression = balance.search.regression
        for part_index, (start, stop) in enumerate(parts, first_part):
            motion = regression.motions[part_index]
            remaining_force = motion.force[:, axis] - _compute_other_linear_force(balance, motion)
            # Order 2, a measured acceleration: below the band of its integrals no motion balances the force.
            command_samples[start:stop, axis] = (
                motion.filter_to_band(remaining_force[:, None])[:, 0] if motion.order == 2 else remaining_force
            )
    response, is_integrated = _extract_driven_motions(recording.command, measured_motion, parts, balances, first_part)
    return replace(
        recording,
        command=replace(recording.command, samples=command_samples),
        response=response,
        position=None,
        excitation=None,
        # `compute_motions` has already advanced an integrated motion by the half sample of a zero-order hold.
        hold=Hold.BAND_LIMITED if is_integrated else recording.hold,
    )


def _compute_other_linear_force(balance: Balance, motion: Motion) -> FloatArray:
    """Compute (n,), N (N m): force of the linear laws and, where more motions than commands are measured, of mass,
    damping and stiffness of the other motions. The named laws are part of the regression, but not of this force."""
    regression, motion_count = balance.search.regression, len(motion.channels)
    linear_laws = [judged_law.law_index for judged_law in balance.laws if judged_law.law.is_linear]
    weights = regression.fit_weights(
        regression.select_columns([*linear_laws, *(judged_law.law_index for judged_law in balance.named)])
    )
    # The last column of the base is the constant force, which stays in the command for the later fit.
    weights = np.delete(weights, regression.base_column_count - 1)
    motion_columns = [motion.acceleration, motion.velocity, motion.position][
        : regression.matrix_column_count // motion_count
    ]
    columns = np.hstack([*motion_columns, *(law.make_columns(motion, law.numbers) for law in balance.linear_laws)])
    # The first `matrix_column_count` columns are accelerations, velocities and positions, each group with one column
    # per motion: the column number modulo the number of motions is the motion's channel. Linear laws follow.
    has_undriven_motions = motion_count > motion.force.shape[1]
    subtracted_columns = [
        column >= regression.matrix_column_count
        or (has_undriven_motions and column % motion_count != regression.base_terms.driven_channel)
        for column in range(columns.shape[1])
    ]
    return np.asarray(columns[:, subtracted_columns] @ weights[: columns.shape[1]][subtracted_columns])


def _extract_driven_motions(
    command: Signal,
    measured_motion: Signal,
    parts: Sequence[tuple[int, int]],
    balances: Sequence[Balance],
    first_part: int,
) -> tuple[Signal, bool]:
    """Return the driven motions as a signal, one channel per command or fewer, and whether they are positions that were
    integrated from accelerations."""
    regression = balances[0].search.regression
    motion_count = len(regression.motions[0].channels)
    driven_channels = [
        axis if motion_count <= len(balances) else balances[axis].search.regression.base_terms.driven_channel
        for axis in range(min(motion_count, len(balances)))
    ]
    samples, order = measured_motion.samples.copy(), regression.motions[0].order
    quantities, units = measured_motion.quantities, measured_motion.units
    if order == 2:  # measured accelerations
        for part_index, (start, stop) in enumerate(parts, first_part):
            samples[start:stop] = regression.motions[part_index].position
        units = tuple(determine_unit_system(command.units, (unit,)).length for unit in units)
        quantities = tuple("angle" if unit == "rad" else "position" for unit in units)
    return replace(measured_motion, samples=samples, quantity=quantities, unit=units).select_channels(
        driven_channels
    ), order == 2
