"""Converts recordings of any form to forces and the motions that they drive, with a sentence on each change.

Used only without a given model, because a model defines its commands and responses itself. The steps are in the order
of `one_motion_per_force`; each returns the recordings unchanged, with an empty sentence, where it does not apply.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.friction_laws import SHARP
from analysis.diagnosis.balance.law import smooth_sign
from analysis.diagnosis.balance.motion import NoMotionError, motions_of
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.first_model.free_motion import read_free_motion
from analysis.diagnosis.first_model.infer_quantity import name_motion
from analysis.diagnosis.first_model.restore_sign import restore_sign
from analysis.diagnosis.first_model.reversed_commands import reverse_commands
from analysis.diagnosis.settings import DEPENDENT_SIGNALS
from analysis.wording import conjoin
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

FORCES = frozenset({"force", "torque"})
"""Quantities of a measured force."""
DRIVES = FORCES | {"voltage", "current"} | set(DERIVATIVE_OF_QUANTITY)
"""Quantities of commands that drive a motion; all other commands, such as a temperature, are conditions."""
STILL = 1e-9
"""Range of a signal over its largest magnitude, below which changes are rounding errors."""
MOTIONS = frozenset(DERIVATIVE_OF_QUANTITY) - {"voltage"}
"""Quantities of a motion: positions and their derivatives."""

Recordings = tuple[Recording, ...]
Step = Callable[[Recordings], tuple[Recordings, str]]
"""Maps recordings to changed ones and a sentence; the sentence is empty where nothing was changed."""


def one_motion_per_force(recordings: Sequence[Recording], turns: bool = True) -> tuple[Recordings, tuple[str, ...]]:
    """The converted recordings, and a sentence for each change. recordings: alike in channels, units and rate. turns:
    commands whose positive direction is opposite to that of their motion are reversed; False where a model defines the
    directions."""
    found, remarks = tuple(recordings), []
    steps: tuple[Step, ...] = (
        name_motion, read_free_motion, _separate_conditions, _select_imposed_motion, _select_motions, _select_forces,
        restore_sign, _drop_constant_commands, _merge_commands,
    )  # fmt: skip
    for step in (*steps, reverse_commands) if turns else steps:
        found, sentence = step(found)
        remarks.append(sentence)
    return found, tuple(filter(None, remarks))


def _separate_conditions(recordings: Recordings) -> tuple[Recordings, str]:
    """Temperatures and settings among the commands become conditions."""
    command = recordings[0].command
    others = [k for k, quantity in enumerate(command.quantities) if quantity not in DRIVES]
    if not others or len(others) == len(command.channels):
        return recordings, ""
    kept = [k for k in range(len(command.channels)) if k not in others]
    names = conjoin([command.channels[k] for k in others])
    return (
        tuple(
            replace(each, command=each.command.select_channels(kept),
                    condition=_append_channels(each.condition, each.command, others),
                    excitation=_select_excitation(each.excitation, each.command, kept))
            for each in recordings
        ),
        f"{names} among the commands is not a force: it was taken as a condition on which laws may depend.",
    )  # fmt: skip


def _select_imposed_motion(recordings: Recordings) -> tuple[Recordings, str]:
    """Keep only the position of an imposed motion that was recorded as position and speed."""
    command, response = recordings[0].command, recordings[0].response
    if not (set(command.quantities) <= MOTIONS and set(response.quantities) <= FORCES):
        return recordings, ""
    kept = _lowest_derivative_channels(command)
    if len(kept) == len(command.channels):
        return recordings, ""
    return tuple(replace(each, command=each.command.select_channels(kept), excitation=None) for each in recordings), (
        f"The imposed motion was taken from {conjoin([command.channels[k] for k in kept])} alone."
    )


def _select_motions(recordings: Recordings) -> tuple[Recordings, str]:
    """Keep only the motions of the lowest derivative, where the responses are of several kinds."""
    response = recordings[0].response
    quantities = set(response.quantities)
    if not quantities & MOTIONS or len({DERIVATIVE_OF_QUANTITY.get(quantity, -1) for quantity in quantities}) == 1:
        return recordings, ""
    kept = _lowest_derivative_channels(response)
    left = [name for k, name in enumerate(response.channels) if k not in kept]
    return tuple(replace(each, response=each.response.select_channels(kept)) for each in recordings), (
        f"Forces are balanced along {conjoin([response.channels[k] for k in kept])}; {conjoin(left)}, of another kind, "
        "was left out."
    )


def _select_forces(recordings: Recordings) -> tuple[Recordings, str]:
    """Keep only the strongest forces, where there are more forces than imposed motions."""
    command, response = recordings[0].command, recordings[0].response
    if not (set(command.quantities) <= MOTIONS and set(response.quantities) <= FORCES):
        return recordings, ""
    count = len(command.channels)
    if len(response.channels) <= count:
        return recordings, ""
    samples = np.vstack([each.response.samples for each in recordings])
    sizes = np.array(
        [np.std(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0 for column in samples.T]
    )
    kept = sorted(np.argsort(-sizes, kind="stable")[:count].tolist())
    left = [name for k, name in enumerate(response.channels) if k not in kept]
    return tuple(replace(each, response=each.response.select_channels(kept)) for each in recordings), (
        f"Of the forces along one motion the strongest, {conjoin([response.channels[k] for k in kept])}, was balanced; "
        f"for {conjoin(left)}, import the recording with that force as its only response."
    )


def _drop_constant_commands(recordings: Recordings) -> tuple[Recordings, str]:
    """Leaves out commands that never change, because nothing about their axis can be identified, and with them the
    motion of their axis, where there is one for each command."""
    command, response = recordings[0].command, recordings[0].response
    samples = np.vstack([each.command.samples for each in recordings])
    samples = samples[np.isfinite(samples).all(axis=1)]
    if len(command.channels) < len(response.channels) or not len(samples):
        return recordings, ""
    kept = np.flatnonzero(np.ptp(samples, axis=0) > STILL * np.abs(samples).max(axis=0)).tolist()
    if len(kept) in (0, len(command.channels)):
        return recordings, ""
    paired = len(command.channels) == len(response.channels)
    left = [name for k, name in enumerate(command.channels) if k not in kept]
    gone = [name for k, name in enumerate(response.channels) if k not in kept] if paired else []
    also = f" with {conjoin(gone)}, which no command moves" if gone else ""
    return (
        tuple(_with_axes(each, kept, paired) for each in recordings),
        f"{conjoin(left)} among the commands never {_verb(left, 'changes')}, and {_verb(left, 'was')} left out{also}.",
    )


def _with_axes(recording: Recording, kept: list[int], paired: bool) -> Recording:
    """The recording with the kept commands only. paired: also with the responses and positions of the same indices
    only."""
    command, position, excitation = recording.command, recording.position, recording.excitation
    alike = position is not None and len(position.channels) == len(recording.response.channels)
    return replace(
        recording,
        command=command.select_channels(kept),
        excitation=_select_excitation(excitation, command, kept),
        response=recording.response.select_channels(kept) if paired else recording.response,
        position=position.select_channels(kept) if paired and alike and position is not None else position,
    )


def _verb(names: Sequence[str], name: str) -> str:
    """The verb in the singular for a single name, else in the plural."""
    plural = {"changes": "change", "was": "were", "drives": "drive"}
    return name if len(names) == 1 else plural[name]


def _merge_commands(recordings: Recordings) -> tuple[Recordings, str]:
    """Merges commands that drive the same single motion into their sum, each with its fitted gain."""
    command, response = recordings[0].command, recordings[0].response
    if len(command.channels) < 2 or len(response.channels) != 1 or set(response.quantities) <= FORCES:
        return recordings, ""
    try:
        gains, main = _gains(recordings)
    except (NoMotionError, np.linalg.LinAlgError):
        return recordings, ""
    others = [name for k, name in enumerate(command.channels) if k != main]
    return (
        tuple(
            replace(each, command=_sum(each.command, gains, main),
                    excitation=None if each.excitation is None else _sum(each.excitation, gains, main))
            for each in recordings
        ),
        f"{conjoin(others)} {_verb(others, 'drives')} the same motion as {command.channels[main]}: one command was "
        "made of them, "
        f"{' + '.join(f'{gain:.3g} x {name}' for gain, name in zip(gains, command.channels, strict=True))}.",
    )  # fmt: skip


def _sum(signal: Signal, gains: FloatArray, main: int) -> Signal:
    """The sum of the channels times their gains, under the name and unit of the main channel."""
    return replace(signal.select_channels([main]), samples=signal.samples @ gains[:, None])


def _gains(recordings: Recordings) -> tuple[FloatArray, int]:
    """Gains (m,) of the commands relative to the strongest, and the index of that. They are the weights of the commands
    in a regression of the acceleration on commands, velocity, position and dry friction; without a time axis, of the
    position on commands and friction."""
    motions = motions_of(observe_parts(recordings, 1))
    rows, aims = [], []
    for motion in motions:
        rubbing = smooth_sign(motion.velocity, SHARP * max(float(motion.velocity.std()), 1e-300))
        columns = [motion.force, motion.velocity, motion.position, rubbing]
        if not np.isfinite(motion.band_hz):
            columns, aim = [motion.force, rubbing], motion.position
        else:
            aim = motion.acceleration
        kept = motion.valid_samples(motion.fit)
        rows.append(motion.decimate(np.hstack(columns))[kept])
        aims.append(motion.decimate(aim)[kept])
    # The means are subtracted, and components of the size of rounding ignored: of two commands with a constant sum, the
    # sum would otherwise appear to drive the motion.
    x, y = (found - found.mean(axis=0) for found in (np.vstack(rows), np.vstack(aims)[:, 0]))
    size = np.maximum(x.std(axis=0), 1e-300)
    pushed = np.linalg.lstsq(x / size, y, rcond=DEPENDENT_SIGNALS)[0][: motions[0].force.shape[1]]
    main = int(np.argmax(np.abs(pushed)))
    own = pushed / size[: len(pushed)]
    return np.asarray(own / own[main]), main


def _lowest_derivative_channels(signal: Signal) -> list[int]:
    """Indices of the motions with the lowest derivative, such as the positions among positions and velocities."""
    orders = [DERIVATIVE_OF_QUANTITY[quantity] if quantity in MOTIONS else 9 for quantity in signal.quantities]
    return [k for k, order in enumerate(orders) if order == min(orders)]


def _select_excitation(excitation: Signal | None, command: Signal, kept: Sequence[int]) -> Signal | None:
    """The excitations of the kept commands; None where there is no excitation, or none for each command."""
    if excitation is None or len(excitation.channels) != len(command.channels):
        return None
    return excitation.select_channels(kept)


def _append_channels(condition: Signal | None, command: Signal, places: Sequence[int]) -> Signal:
    """The conditions with these channels of the command appended."""
    more = command.select_channels(places)
    if condition is None:
        return more
    return Signal(
        np.hstack([condition.samples, more.samples]), more.sample_rate_hz, (*condition.quantities, *more.quantities),
        (*condition.units, *more.units), (*condition.channels, *more.channels),
    )  # fmt: skip
