"""Find and reverse commands whose sign is opposite to the motion that they drive, as with reversed wiring of an encoder
or amplifier.

A passive device has no negative mass and no negative damping. The force of each axis, F = m a + d v + k x, is therefore
balanced twice, with the recorded and with the negated command, each time with m >= 0 and d >= 0. The sign is reversed
where that lowers the cross-validated error by more than `REVERSED_SIGN_GAIN` and significantly
(`improves_significantly`), and leaves at most half of the force's power: with more, as against a rigid wall, mass and
damping may only stand for other physics, and their signs mean nothing. A spring alone does not determine the sign,
because k may be positive or negative. The reversed commands are listed in the recording's `meta`, so that a model is
written for the commands as recorded (`recorded_conditions`).

A controller, such as a virtual spring and damper on a device that a hand moves, resists the motion as well. Where a
closed loop shows and -d v - k x with d, k >= 0 leaves at most `PREDICTED_SHARE` of the command's rms, the recordings
determine the controller instead of the device, and are refused. A recorded excitation of more than that share is no
controller's: then a device that pushes itself away, such as an upside-down pendulum, explains the command.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import Motion, NoMotionError, compute_motions
from analysis.diagnosis.balance.regression import build_regression, compute_signal_power
from analysis.diagnosis.balance.structures import Structure, improves_significantly
from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.data.measured_motion import convert_all_to_force_driven, is_free_motion
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.recorded_conditions import REVERSED_CHANNELS_KEY
from analysis.diagnosis.limits import PREDICTED_SHARE, REVERSED_SIGN_GAIN
from analysis.wording import conjoin
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import FloatArray, Signal

LARGEST_ERROR_SHARE = 0.5
"""Largest share of the force's power that mass, damping and stiffness leave where a sign is reversed. Chosen as in
`confirm.held_out_gain.explains_half`: with more, they may only be a substitute."""


def reverse_commands(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """Negate the commands whose sign is opposite to the motion that they drive; returns the recordings and a sentence
    about these commands. Returns them unchanged, with an empty sentence, where there are none, the forces cannot be
    balanced, the motions are not as many as the forces, or the motion was free. Where the motion was imposed, the
    response (force) is negated instead. recordings: at least one, with the same channels, units and rate. Raises
    NothingToDiagnoseError where commands are those of a controller."""
    if is_free_motion(recordings[0]):
        return recordings, ""
    force_driven = convert_all_to_force_driven(recordings)
    axis_count = len(force_driven[0].command.channels)
    try:
        motions = compute_motions(observe_parts(force_driven, len(force_driven[0].response.channels)))
        if len(motions[0].channels) != axis_count:
            return recordings, ""
        if force_driven[0] is recordings[0] and any(map(is_in_closed_loop, recordings)):
            _require_no_controller(recordings)
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


def _require_no_controller(recordings: Sequence[Recording]) -> None:
    """Raise NothingToDiagnoseError where commands in a closed loop, as many as motions, are those of a controller,
    which acts on the reading of its own sample."""
    at_readings = [replace(recording, hold=Hold.LINEAR) for recording in recordings]
    motions = compute_motions(observe_parts(at_readings, len(recordings[0].response.channels)))
    channels = recordings[0].command.channels
    names = [
        name
        for axis, name in enumerate(channels)
        if not _has_own_excitation(recordings, axis) and _is_reversed(motions, axis, of_controller=True)
    ]
    if names:
        raise NothingToDiagnoseError(
            (
                f"{conjoin(names)} only {'resists' if len(names) == 1 else 'resist'} the measured position and speed, "
                "as the command of a controller or of a virtual spring does: the recordings determine this controller "
                "and not the device; record with an excitation of its own (hapteq record), or record what moves the "
                "device, such as the force of a hand, and add it to the command in the map of the import; if the sign "
                "was recorded the wrong way round, correct it there",
            )
        )


def _has_own_excitation(recordings: Sequence[Recording], axis: int) -> bool:
    """Whether any recording's excitation of an axis varies by more than `PREDICTED_SHARE` of its command."""
    return any(
        bool(
            np.nanstd(recording.excitation.samples[:, axis])
            > PREDICTED_SHARE * np.nanstd(recording.command.samples[:, axis])
        )
        for recording in recordings
        if recording.excitation is not None
    )


def _is_reversed(motions: Sequence[Motion], axis: int, of_controller: bool = False) -> bool:
    """Whether negating the force lowers the error of an axis's balance (see the module's docstring). of_controller:
    whether a spring and a damper without a mass must explain the negated force."""
    recorded, negated = (
        _fit_linear_balance([replace(motion, force=sign * motion.force) for motion in motions], axis, of_controller)
        for sign in (1.0, -1.0)
    )
    largest_share = PREDICTED_SHARE**2 if of_controller else LARGEST_ERROR_SHARE
    largest_error = min((1 - REVERSED_SIGN_GAIN) * recorded[0].error, largest_share * negated[1])
    return negated[0].error < largest_error and improves_significantly(recorded[0], negated[0])


def _fit_linear_balance(motions: Sequence[Motion], axis: int, of_controller: bool) -> tuple[Structure, float]:
    """Fit the linear balance of an axis's force; returns it, and the power of the force. of_controller: as
    `_is_reversed`."""
    regression = build_regression(motions, axis, (), turns_freely=False)
    columns, power = regression.select_columns(()), compute_signal_power(regression.fit)
    if of_controller:
        driven, channel_count = regression.base_terms.driven_channel, len(motions[0].channels)
        columns.remove(driven)  # its mass
        damper_and_spring = (columns.index(channel_count + driven), columns.index(2 * channel_count + driven))
        regression = replace(regression, nonnegative_columns=damper_and_spring)
    return Structure((), regression.cross_validate(columns)), power


def _multiply_forces(recording: Recording, is_motion_imposed: bool, signs: FloatArray) -> Recording:
    """Multiply each force by its sign, `signs` (m,): the response where the motion was imposed, else the commands."""
    if is_motion_imposed:
        return replace(recording, response=_scale_channels(recording.response, signs))
    excitation = None if recording.excitation is None else _scale_channels(recording.excitation, signs)
    return replace(recording, command=_scale_channels(recording.command, signs), excitation=excitation)


def _scale_channels(signal: Signal, factors: FloatArray) -> Signal:
    """Multiply the channels of a signal by `factors` (channels,)."""
    return replace(signal, samples=signal.samples * factors)
