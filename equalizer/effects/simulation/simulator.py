"""Simulation of a mechanical model with effects under commands: actuator, mechanism and hand, sensor, in this order.

Main function: `simulate_mechanism`. Variants: `simulate_response` without the motion of the axes, faster;
`simulate_windows` with restarts from given states, for multiple shooting; `simulate_states_before` for these states.
Sizes: n samples, m driven axes, p response channels; c coordinates of the model, k instants."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np
import numpy.typing as npt

from equalizer.effects.effect import STEPS, OnResponse, PlacedEffect
from equalizer.effects.simulation.bodies import Bodies, Restarts, build_bodies, simulate_bodies, simulate_states
from equalizer.effects.simulation.command_path import (
    ActuatorForce,
    drive_actuators,
    has_intersample_changes,
    subdivide_commands,
)
from equalizer.effects.simulation.sensor_path import apply_low_pass, clip_to_range
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

KEPT_BYTES = 2**27
"""Largest size (bytes) of all motions that a process keeps for further simulations (`_recall_rows`). Chosen: some forty
motions of three axes over a minute at 1 kHz, as many as the derivatives by the parameters of a backlash need."""
KEPT_MOTIONS = 512
"""Largest number of them: the sum of many thousand sizes would take longer than the simulation of a short motion."""
_Rows = tuple[FloatArray, FloatArray]
"""The two arrays of `simulate_bodies`."""
_kept_rows: dict[tuple[object, ...], _Rows] = {}
"""Results of `simulate_bodies` by all that determines them (`_list_causes`), the last used at the end."""


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """A measured response on which effects such as lost samples are conditioned."""

    response: FloatArray
    """(n, p): as measured."""
    noise: FloatArray
    """(p,): rms of the noise, in the unit of the response."""
    position: FloatArray | None = None
    """(n, p): measured position of each response channel."""
    full_length: int = 0
    """Length in samples of the recording whose beginning this is; 0 = this is the whole recording."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulationResult:
    """Simulated response and motion, sampled just before each command is written."""

    response: FloatArray
    """(n, p): as the sensor reads it, without noise."""
    position: FloatArray
    """(n, p): position of each response channel, m (rotation: rad)."""
    axis_position: FloatArray
    """(n, m): positions along the driven axes."""
    axis_velocity: FloatArray
    """(n, m): velocities along the driven axes."""
    axis_force: FloatArray
    """(n, m): force of motion-dependent effects at the driven axes, N (rotation: N m)."""


def simulate_mechanism(
    model: MechanicalModel,
    commands: FloatArray,
    sample_rate_hz: float,
    effects: Sequence[PlacedEffect] = (),
    hold: Hold = Hold.ZERO_ORDER,
    measurement: Measurement | None = None,
) -> SimulationResult:
    """Simulate response and motion from rest. commands: (n, m), SI. Only `effects` are simulated, not `model.effects`,
    which `equalizer.effects.placing` converts. measurement: effects such as lost samples are conditioned on it; without
    one they are drawn at random.

    Raises ValueError where an effect acts on an axis that is not there, for too many different force laws, and for a
    discovered law that does not fit the model or lacks conditions.
    """
    return _apply_sensor(
        model, _simulate_motion(model, commands, (sample_rate_hz, hold), effects), sample_rate_hz, effects, measurement
    )


def simulate_response(
    model: MechanicalModel,
    commands: FloatArray,
    sample_rate_hz: float,
    effects: Sequence[PlacedEffect] = (),
    hold: Hold = Hold.ZERO_ORDER,
    measurement: Measurement | None = None,
) -> SimulationResult:
    """Simulate the response as `simulate_mechanism` does, faster: without the driven axes, whose arrays are (n, 0)."""
    motion = _simulate_motion(model, commands, (sample_rate_hz, hold), effects, with_axes=False)
    return _apply_sensor(model, motion, sample_rate_hz, effects, measurement)


def simulate_windows(
    model: MechanicalModel,
    commands: FloatArray,
    sampling: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
    measurement: Measurement | None,
    restarts: Restarts,
) -> SimulationResult:
    """Simulate like `simulate_mechanism`, but restarted from given states. sampling: sample rate in Hz, and course of
    the commands between samples."""
    return _apply_sensor(
        model,
        _simulate_motion(model, commands, sampling, effects, restarts=restarts),
        sampling[0],
        effects,
        measurement,
    )


def simulate_states_before(
    model: MechanicalModel,
    commands: FloatArray,
    sampling: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
    sample_indices: npt.NDArray[np.int64],
) -> FloatArray:
    """Simulate, from rest, the states (k, 2 c) just before the samples `sample_indices` (k,): positions, then
    velocities, of the model's own c coordinates; coordinates that effects add are left out. sampling: as in
    `simulate_windows`."""
    bodies = build_bodies(model, effects)
    actuator_force, steps = _drive_bodies(bodies, model, commands, sampling, effects)
    states = simulate_states(bodies, actuator_force, (len(commands), steps), 1 / (sampling[0] * steps), sample_indices)
    structure_coordinates, model_coordinates = bodies.structure.coordinates, model.coordinates
    return np.hstack(
        [states[:, :model_coordinates], states[:, structure_coordinates : structure_coordinates + model_coordinates]]
    )


def _drive_bodies(
    bodies: Bodies,
    model: MechanicalModel,
    commands: FloatArray,
    sampling: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
) -> tuple[ActuatorForce, int]:
    """Compute the actuator force that drives the bodies, and the number of integration steps per sample: the most that
    a motion-dependent effect asks for, else `STEPS` where the force changes between samples, else 1."""
    rate_hz, hold = sampling
    changes_between_samples = has_intersample_changes(model, effects, hold)
    steps = max((action.steps for action in bodies.actions), default=STEPS if changes_between_samples else 1)
    command_steps = steps if changes_between_samples else 1
    held_commands = subdivide_commands(commands, command_steps, hold)
    return drive_actuators(model, held_commands, 1 / (rate_hz * command_steps), effects), steps


def _simulate_motion(
    model: MechanicalModel,
    commands: FloatArray,
    sampling: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
    with_axes: bool = True,
    restarts: Restarts | None = None,
) -> SimulationResult:
    """Simulate the motion, with the true response before the sensor. with_axes: whether to output the driven axes,
    whose arrays are else (n, 0)."""
    bodies = build_bodies(model, effects)

    def simulate_rows() -> _Rows:
        """Simulate the two arrays of `simulate_bodies`, without the sensor."""
        actuator_force, steps = _drive_bodies(bodies, model, commands, sampling, effects)
        step_s = 1 / (sampling[0] * steps)
        return simulate_bodies(bodies, actuator_force, (len(commands), steps), step_s, with_axes, restarts)

    # Only forces that depend on the motion take longer than a comparison of what determines it, and actions with
    # recorded conditions are made anew for each simulation.
    if bodies.actions and not any(placed.effect.with_conditions for placed in effects):
        causes = _list_causes(model, commands, sampling, effects, with_axes, restarts)
        motion_rows, port_forces = _recall_rows(causes, simulate_rows)
    else:
        motion_rows, port_forces = simulate_rows()
    axis_count, output_count, port_count = (
        bodies.axes if with_axes else 0,
        bodies.structure.outputs,
        bodies.ports.shape[1],
    )
    response_rows = motion_rows[:, 3 * port_count if with_axes else 0 :]
    return SimulationResult(
        response_rows[:, :output_count],
        response_rows[:, output_count:],
        motion_rows[:, :axis_count],
        motion_rows[:, port_count : port_count + axis_count],
        port_forces[:, :axis_count],
    )


def _list_causes(
    model: MechanicalModel,
    commands: FloatArray,
    sampling: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
    with_axes: bool,
    restarts: Restarts | None,
) -> tuple[object, ...]:
    """List all that determines a motion, in a form that can be compared; effects of the sensor do not."""
    matrices = (model.mass, model.damping, model.stiffness, model.input, model.output)
    samples = np.asarray(commands)
    return (
        *((matrix.shape, matrix.tobytes()) for matrix in matrices),
        *(samples.shape, samples.dtype, blake2b(samples.tobytes()).digest()),
        *(model.quantity, model.actuator, sampling, with_axes),
        None if restarts is None else (restarts.sample_indices.tobytes(), restarts.states.tobytes()),
        tuple(
            (placed.effect.action, tuple(placed.sites), tuple(placed.values.items()))
            for placed in effects
            if not isinstance(placed.effect.action, OnResponse)
        ),
    )


def _recall_rows(causes: tuple[object, ...], simulate_rows: Callable[[], _Rows]) -> _Rows:
    """Return copies of what `simulate_rows` returned under the same causes, or call it: hypotheses that differ in the
    effects of the sensor alone have the same motion. At most `KEPT_MOTIONS` are kept, of at most `KEPT_BYTES`."""
    rows = _kept_rows.pop(causes, None) or simulate_rows()
    _kept_rows[causes] = rows
    # Copies of keys and values, and a default, because another thread may simulate meanwhile, and remove the last.
    while len(_kept_rows) > KEPT_MOTIONS or sum(a.nbytes + b.nbytes for a, b in [*_kept_rows.values()]) > KEPT_BYTES:
        _kept_rows.pop(next(iter(tuple(_kept_rows)), ()), None)
    return rows[0].copy(), rows[1].copy()


def _apply_sensor(
    model: MechanicalModel,
    motion: SimulationResult,
    sample_rate_hz: float,
    effects: Sequence[PlacedEffect],
    measurement: Measurement | None,
) -> SimulationResult:
    """Apply the sensor: low pass of each channel, effects in the order of their stages, limits of the range. Positions
    change only by effects with `on_position` or, under a measurement of the position, `conditioned_position`."""
    response_effects = [
        (placed.effect.action, placed) for placed in effects if isinstance(placed.effect.action, OnResponse)
    ]
    response_effects.sort(key=lambda item: item[0].stage)
    bandwidths_hz = _list_bandwidths_hz(model, motion.response.shape[1], response_effects)
    response, position = _filter_channels(motion.response, sample_rate_hz, bandwidths_hz), motion.position
    for action, placed in response_effects:
        previous_response = response
        if measurement is not None and action.conditioned is not None:
            response = action.conditioned(
                response, measurement.response, measurement.noise, placed.sites, placed.values
            )
        else:
            response = _change_response(action, placed, response, sample_rate_hz, measurement)
        if action.on_position is not None:
            position = action.on_position(position, sample_rate_hz, placed.values)
        if measurement is not None and measurement.position is not None and action.conditioned_position is not None:
            position = action.conditioned_position(previous_response, response, position, measurement.position)
    response = clip_to_range(response, model.sensor.range)
    return SimulationResult(response, position, motion.axis_position, motion.axis_velocity, motion.axis_force)


def _change_response(
    action: OnResponse,
    placed: PlacedEffect,
    response: FloatArray,
    sample_rate_hz: float,
    measurement: Measurement | None,
) -> FloatArray:
    """Compute the response (n, p) after an effect. For an effect that depends on the recording's length, an excerpt
    is first extended to that length by its last sample."""
    missing_samples = (
        measurement.full_length - len(response) if action.needs_full_length and measurement is not None else 0
    )
    if missing_samples <= 0:
        return action.change(response, sample_rate_hz, placed.sites, placed.values)
    full_response = np.pad(response, ((0, missing_samples), (0, 0)), mode="edge")
    return action.change(full_response, sample_rate_hz, placed.sites, placed.values)[: len(response)]


def _filter_channels(response: FloatArray, sample_rate_hz: float, bandwidths_hz: Sequence[float]) -> FloatArray:
    """Filter the response (n, p) by the low pass of each channel. bandwidths_hz: p values, 0 = no low pass."""
    if len(set(bandwidths_hz)) == 1:
        return apply_low_pass(response, sample_rate_hz, bandwidths_hz[0])
    filtered_channels = [
        apply_low_pass(channel_response, sample_rate_hz, bandwidth_hz)
        for channel_response, bandwidth_hz in zip(response.T, bandwidths_hz, strict=True)
    ]
    return np.stack(filtered_channels, axis=1)


def _list_bandwidths_hz(
    model: MechanicalModel, channel_count: int, response_effects: Sequence[tuple[OnResponse, PlacedEffect]]
) -> list[float]:
    """List the bandwidth (Hz) of each channel's low pass: that of the model, replaced by effects; 0 = no low pass."""
    bandwidths_hz = [model.sensor.bandwidth_hz] * channel_count
    for action, placed in response_effects:
        for channel in placed.sites if action.bandwidth_hz is not None else ():
            assert action.bandwidth_hz is not None
            bandwidths_hz[channel] = action.bandwidth_hz(bandwidths_hz[channel], placed.values)
    return bandwidths_hz
