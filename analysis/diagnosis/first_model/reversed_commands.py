"""Finds and reverses commands whose sign is opposite to the motion that they drive, by an encoder or amplifier with
reversed wiring.

Mass, damping and dry friction take energy from a drive. With the wrong sign they would supply it, which no physical law
does. So forces are balanced with both signs, with mass and damping non-negative in either; the reversed sign is
accepted where it has a clearly smaller error on held-out folds. A spring alone does not determine the sign.

A recording's `meta` lists the reversed commands, and a model of the device is written for the commands as they were
recorded: see `recorded_conditions`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import Motion, NoMotionError, motions_of
from analysis.diagnosis.balance.regression import regression_of
from analysis.diagnosis.balance.structures import Structure, is_better
from analysis.diagnosis.data.measured_motion import all_as_force_driven, is_read_as_free
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.recorded_conditions import REVERSED
from analysis.diagnosis.settings import REVERSED_SIGN_GAIN
from analysis.wording import conjoin
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal


def reverse_commands(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """The recordings with such commands reversed, and a sentence. recordings: alike in channels, units and rate. A free
    motion has no command that could be."""
    if is_read_as_free(recordings[0]):
        return recordings, ""
    driven = all_as_force_driven(recordings)
    count = len(driven[0].command.channels)
    try:
        motions = motions_of(observe_parts(driven, len(driven[0].response.channels)))
        if len(motions[0].channels) != count:
            return recordings, ""
        against = [axis for axis in range(count) if _is_reversed(motions, axis)]
    except (NoMotionError, np.linalg.LinAlgError):
        return recordings, ""
    if not against:
        return recordings, ""
    names = [driven[0].command.channels[axis] for axis in against]
    imposed = driven[0] is not recordings[0]
    sign = np.ones(count)
    sign[against] = -1.0
    verb = "is" if len(names) == 1 else "are"
    note = {REVERSED: names}
    turned = tuple(_reverse(replace(each, meta={**each.meta, **note}), imposed, sign) for each in recordings)
    return turned, (
        f"{conjoin(names)} {verb} counted against the motion: as recorded, the device would give work instead of "
        f"taking it. The sign was turned round, and a model that is written has it in its input matrix; where the "
        f"device is a source of work, say so by a model of your own."
    )


def _is_reversed(motions: Sequence[Motion], axis: int) -> bool:
    plain, turned = (
        regression_of([replace(each, force=sign * each.force) for each in motions], axis, (), turns=False)
        for sign in (1.0, -1.0)
    )
    first, other = (Structure((), each.cross_validated_errors(each.columns_of(()))) for each in (plain, turned))
    return other.error < (1 - REVERSED_SIGN_GAIN) * first.error and is_better(first, other)


def _reverse(recording: Recording, imposed: bool, sign: FloatArray) -> Recording:
    if imposed:
        return replace(recording, response=_scale_channels(recording.response, sign))
    excitation = None if recording.excitation is None else _scale_channels(recording.excitation, sign)
    return replace(recording, command=_scale_channels(recording.command, sign), excitation=excitation)


def _scale_channels(signal: Signal, sign: FloatArray) -> Signal:
    return replace(signal, samples=signal.samples * sign)
