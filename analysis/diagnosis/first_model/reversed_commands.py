"""Find and reverse commands whose sign is opposite to the motion that they drive, as with reversed wiring of an encoder
or amplifier.

A passive device has no negative mass and no negative damping. The force of each axis, F = m a + d v + k x, is therefore
balanced twice, with the recorded and with the negated command, each time with m >= 0 and d >= 0. The sign is reversed
where that lowers the cross-validated error by more than `REVERSED_SIGN_GAIN` and significantly
(`improves_significantly`), and leaves at most half of the force's power: with more, as against a rigid wall, mass and
damping may only stand for other physics, and their signs mean nothing. A spring alone does not determine the sign,
because k may be positive or negative. The reversed commands are listed in the recording's `meta`, so that a model is
written for the commands as recorded (`recorded_conditions`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import Motion, NoMotionError, compute_motions
from analysis.diagnosis.balance.regression import build_regression, compute_signal_power
from analysis.diagnosis.balance.structures import Structure, improves_significantly
from analysis.diagnosis.data.measured_motion import convert_all_to_force_driven, is_free_motion
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.recorded_conditions import REVERSED_CHANNELS_KEY
from analysis.diagnosis.limits import REVERSED_SIGN_GAIN
from analysis.wording import conjoin
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

LARGEST_ERROR_SHARE = 0.5
"""Largest share of the force's power that mass, damping and stiffness leave where a sign is reversed. Chosen as in
`confirm.held_out_gain.explains_half`: with more, they may only be a substitute."""


def reverse_commands(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """Negate the commands whose sign is opposite to the motion that they drive; returns the recordings and a sentence
    about these commands. Returns them unchanged, with an empty sentence, where there are none, the forces cannot be
    balanced, the motions are not as many as the forces, or the motion was free. Where the motion was imposed, the
    response (force) is negated instead. recordings: at least one, with the same channels, units and rate."""
    if is_free_motion(recordings[0]):
        return recordings, ""
    force_driven = convert_all_to_force_driven(recordings)
    axis_count = len(force_driven[0].command.channels)
    try:
        motions = compute_motions(observe_parts(force_driven, len(force_driven[0].response.channels)))
        if len(motions[0].channels) != axis_count:
            return recordings, ""
        reversed_axes = [axis for axis in range(axis_count) if _is_reversed(motions, axis)]
    except (NoMotionError, np.linalg.LinAlgError):
        return recordings, ""
    if not reversed_axes:
        return recordings, ""
    names = [force_driven[0].command.channels[axis] for axis in reversed_axes]
    is_motion_imposed = force_driven[0] is not recordings[0]
    signs = np.ones(axis_count)
    signs[reversed_axes] = -1.0
    verb = "is" if len(names) == 1 else "are"
    added_meta = {REVERSED_CHANNELS_KEY: names}
    reversed_recordings = tuple(
        _multiply_forces(replace(recording, meta={**recording.meta, **added_meta}), is_motion_imposed, signs)
        for recording in recordings
    )
    return reversed_recordings, (
        f"{conjoin(names)} {verb} opposite in sign to the motion: as recorded, the device would deliver work instead "
        "of absorbing it. The sign was reversed; a saved model has this sign in its input matrix. If the device really "
        "is a source of work, give a model with the recorded sign."
    )


def _is_reversed(motions: Sequence[Motion], axis: int) -> bool:
    """Whether negating the force lowers the error of an axis's balance (see the module's docstring)."""
    recorded_regression, negated_regression = (
        build_regression(
            [replace(motion, force=sign * motion.force) for motion in motions], axis, (), turns_freely=False
        )
        for sign in (1.0, -1.0)
    )
    recorded_structure, negated_structure = (
        Structure((), regression.cross_validate(regression.select_columns(())))
        for regression in (recorded_regression, negated_regression)
    )
    largest_error = min(
        (1 - REVERSED_SIGN_GAIN) * recorded_structure.error,
        LARGEST_ERROR_SHARE * compute_signal_power(negated_regression.fit),
    )
    return negated_structure.error < largest_error and improves_significantly(recorded_structure, negated_structure)


def _multiply_forces(recording: Recording, is_motion_imposed: bool, signs: FloatArray) -> Recording:
    """Multiply each force by its sign, `signs` (m,): the response where the motion was imposed, else the commands."""
    if is_motion_imposed:
        return replace(recording, response=_scale_channels(recording.response, signs))
    excitation = None if recording.excitation is None else _scale_channels(recording.excitation, signs)
    return replace(recording, command=_scale_channels(recording.command, signs), excitation=excitation)


def _scale_channels(signal: Signal, factors: FloatArray) -> Signal:
    """Multiply the channels of a signal by `factors` (channels,)."""
    return replace(signal, samples=signal.samples * factors)
