"""Measured motion of the driven axes with its noise, and which signal drives a recording: force, motion or none.

A recording may be driven by a force, by an imposed motion (the force is then the response; `convert_to_force_driven`
exchanges the two), or not at all (free motion).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.noise.noise_floor import NoiseFloor
from equalizer.effects.simulation.sensor_path import undo_low_pass
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

FORCE_QUANTITIES = frozenset({"force", "torque"})
"""Quantities that count as forces: a recording with such a response was driven by an imposed motion."""

FREE_MOTION = "free"
"""Value of `meta["imposed"]` of a free (undriven) motion."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredMotion:
    """Positions of the driven axes, as measured or integrated from velocities, and their noise."""

    position: FloatArray
    """(n, m), finite: positions of the model's first m outputs."""
    noise: FloatArray
    """(lines, m): density of its noise, as `ChannelNoise.density`; of the response's noise where that of a measured
    position is not known; NaN where unknown."""


def has_motion(recording: Recording, model: MechanicalModel) -> bool:
    """Whether positions or velocities of every driven axis were measured; accelerations do not count, because they do
    not show slow forces."""
    return model.outputs >= model.inputs and (
        _has_position(recording, model) or DERIVATIVE_OF_QUANTITY[model.quantity] < 2
    )


def choose_measured_motion(recording: Recording, model: MechanicalModel, floor: NoiseFloor) -> MeasuredMotion:
    """Choose the position where it was measured, else the response without the sensor's low pass: a velocity is
    integrated by the trapezoidal rule, and its noise divided by (2 pi f)². Missing samples are interpolated. floor:
    noise of the recording. See `has_motion`."""
    axis_count, rate_hz = model.inputs, recording.sample_rate_hz
    if _has_position(recording, model):
        assert recording.position is not None
        noise = floor.position if floor.position is not None else floor.response
        return MeasuredMotion(fill_gaps(recording.position.samples[:, :axis_count]), noise.density[:, :axis_count])
    samples = undo_low_pass(fill_gaps(recording.response.samples[:, :axis_count]), rate_hz, model.sensor.bandwidth_hz)
    density = floor.response.density[:, :axis_count]
    if DERIVATIVE_OF_QUANTITY[model.quantity] == 0:
        return MeasuredMotion(samples, density)
    # The lowest line has one period per recording; below it, f is held there to avoid a division by zero.
    frequency_hz = np.maximum(floor.frequency_hz, rate_hz / len(recording))[:, None]
    position = np.zeros(samples.shape)
    position[1:] = np.cumsum(samples[1:] + samples[:-1], axis=0) / (2 * rate_hz)
    return MeasuredMotion(position, density / (2 * np.pi * frequency_hz) ** 2)


def _has_position(recording: Recording, model: MechanicalModel) -> bool:
    """Whether a position was measured, with one channel per output of the model."""
    return recording.position is not None and recording.position.samples.shape[1] == model.outputs


def fill_gaps(samples: FloatArray) -> FloatArray:
    """Interpolate samples (n, k) linearly across gaps, constant at the ends; zero without a finite sample."""
    filled_samples, indices = np.array(samples, dtype=np.float64), np.arange(len(samples))
    for column in filled_samples.T:
        is_finite = np.isfinite(column)
        if is_finite.any() and not is_finite.all():
            column[:] = np.interp(indices, indices[is_finite], column[is_finite])
        elif not is_finite.any():
            column[:] = 0.0
    return filled_samples


def is_quasi_static(recording: Recording) -> bool:
    """Whether the time axis is unknown, and either a position or no motion was measured: each force is then compared
    with the position at the same sample, without velocity or acceleration. Where only speeds or accelerations were
    measured, the result is False, and the sample number serves as time."""
    quantities = [
        quantity for signal in (recording.position, recording.response) if signal for quantity in signal.quantities
    ]
    orders = [order for quantity in quantities if (order := DERIVATIVE_OF_QUANTITY.get(quantity)) is not None]
    return not recording.is_timed and min(orders, default=0) == 0


def is_free_motion(recording: Recording) -> bool:
    """Whether the motion was free (not driven), by the mark that `first_model.free_motion` sets in `meta`. The command
    is then the force per unit mass that the motion implies."""
    return recording.meta.get("imposed") == FREE_MOTION


def select_time_unit(recording: Recording) -> str:
    """Select the unit of time: s, or "sample" where the time axis is unknown, so that rates are per sample."""
    return "s" if recording.is_timed else "sample"


def is_driven(recordings: Sequence[Recording]) -> bool:
    """Whether any command changes, in or between recordings; True where no sample has all commands finite."""
    commands = np.vstack([recording.command.samples for recording in recordings])
    commands = commands[np.isfinite(commands).all(axis=1)]
    return len(commands) == 0 or bool(np.any(np.ptp(commands, axis=0) != 0))


def convert_to_force_driven(recording: Recording) -> Recording:
    """Exchange command and response of a recording with an imposed motion: the measured force becomes the command, the
    motion the response, an excitation is removed, and `imposed` is set in its meta. Recordings with fewer commands than
    responses, and all others, are returned unchanged."""
    is_motion_command = set(recording.command.quantities) <= set(DERIVATIVE_OF_QUANTITY) - {"voltage"}
    is_force_response = set(recording.response.quantities) <= FORCE_QUANTITIES
    if not (
        is_motion_command and is_force_response and len(recording.command.channels) >= len(recording.response.channels)
    ):
        return recording
    return replace(
        recording,
        command=recording.response,
        response=recording.command,
        excitation=None,
        meta={**recording.meta, "imposed": recording.command.quantity},
    )


def convert_all_to_force_driven(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Exchange command and response of each recording with an imposed motion (`convert_to_force_driven`)."""
    return tuple(convert_to_force_driven(recording) for recording in recordings)
