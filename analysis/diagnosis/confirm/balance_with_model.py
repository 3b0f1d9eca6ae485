"""Force balance with a given mechanical model as its base: finds the force laws that the model lacks.

Inverse dynamics give the force that the model requires for the measured motion, with its actuator, modes and effects.
The base of the regression (`balance.given_model_base`) consists of that force and its derivatives with respect to the
model's free parameters, which have the prior of their calibration. Laws are then tested as for a fitted model
(`balance.judge_laws`), by their gain on held-out data over the re-tuned model. Called by `decide_with_model`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.given_model_base import GivenModelBase
from analysis.diagnosis.balance.judge_laws import Balance, judge_laws
from analysis.diagnosis.balance.motion import Motion, NoMotionError, compute_motions
from analysis.diagnosis.balance.structures import search_structures
from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.recorded_conditions import add_payload, apply_conditions
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.forces.inverse_dynamics import compute_band_motion, compute_required_force
from analysis.diagnosis.limits import LAW_FORCE_SHARE, MOTION_OVERSAMPLED
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import PlacedEffect, Structure
from equalizer.effects.placing import place_recorded_effects
from equalizer.effects.simulation.bodies import build_bodies
from equalizer.effects.simulation.forces_along_motion import compute_actuator_force, compute_effect_forces_along_motion
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

LEAST_SAMPLES_PER_PERIOD = 6.0
"""Least samples per period of the band's upper end that decimation before the laws keeps, so that harmonics of
nonlinear laws are not aliased into the band. Chosen by hand."""
DIFFERENCE_STEP = 0.1
"""Step of the finite differences for parameters of modes, in standard deviations of the calibration; by hand."""


def find_balances_with_model(
    recordings: Sequence[Recording], model: MechanicalModel, excluded: frozenset[str], time_left: TimeBudget
) -> tuple[Balance, ...]:
    """Find the balance of each command; empty where a command drives no measured position or velocity, where there is
    no time axis, or where the motion or the model's inverse dynamics cannot be computed. excluded: names of effects
    that are not tested."""
    records = observe_parts(recordings, model.outputs)
    if not all(has_motion(record.recording, model) for record in records):
        return ()
    try:
        motions = compute_motions(records)
        if len(motions[0].channels) < model.inputs or motions[0].order == 2 or not np.isfinite(motions[0].band_hz):
            return ()
        prepared = [_prepare_record(record, motion, model) for record, motion in zip(records, motions, strict=True)]
        axis_directions = compute_driven_axes(model)
        mass = np.einsum("nm,nk,km->m", axis_directions, model.mass, axis_directions)
        return tuple(
            judge_laws(
                search_structures(
                    [_select_axis(entry.motion, axis) for entry in prepared], axis, model.rotational, excluded,
                    time_left,
                    GivenModelBase(
                        tuple(entry.columns[axis] for entry in prepared), float(mass[axis]), LAW_FORCE_SHARE
                    ),
                )
            )
            for axis in range(model.inputs)
        )  # fmt: skip
    except (NoMotionError, MechanicalModelError, np.linalg.LinAlgError):
        return ()


def _select_axis(motion: Motion, axis: int) -> Motion:
    """Select the motion of one axis: laws that depend on the motion of another axis are not tested."""
    selected = {name: getattr(motion, name)[:, [axis]] for name in ("position", "velocity", "acceleration")}
    return replace(motion, channels=motion.channels[axis : axis + 1], **selected)


@dataclass(frozen=True, slots=True, eq=False)
class _PreparedRecord:
    """One record along the m driven axes, decimated, where its rate allows, to at least `LEAST_SAMPLES_PER_PERIOD`
    samples per period of the band's upper end."""

    motion: Motion
    """Motion of the driven axes; its force is that of the actuators and known effects there, in N (N m)."""
    columns: tuple[FloatArray, ...]
    """Per axis, the columns of `GivenModelBase`, (n, 1 + parameters)."""


def _prepare_record(record: Observed, motion: Motion, model: MechanicalModel) -> _PreparedRecord:
    """Compute motion, force and base columns of one record. Raises LinAlgError where outputs do not determine the
    motion."""
    recording, rate_hz, m = record.recording, motion.rate_hz, model.inputs
    known_effects = apply_conditions(place_recorded_effects(model, recording), recording)
    structure = _apply_structural_effects(add_payload(model, recording), known_effects)
    required = compute_required_force(structure, compute_band_motion(motion.position[:, :m], rate_hz, motion.band_hz))
    axis_motion = required.axis_position, required.axis_velocity, required.axis_acceleration
    actuator_force = compute_actuator_force(model, motion.force, rate_hz, known_effects, recording.hold)
    effect_force = compute_effect_forces_along_motion(
        structure, known_effects, axis_motion, (motion.force, actuator_force - required.force), rate_hz
    )
    stride = max(int(rate_hz / (LEAST_SAMPLES_PER_PERIOD * motion.band_hz)), 1)
    position, velocity, acceleration = (series[::stride] for series in axis_motion)
    decimated = replace(
        motion, rate_hz=rate_hz / stride, step=max(int(rate_hz / stride / (MOTION_OVERSAMPLED * motion.band_hz)), 1),
        channels=motion.channels[:m], position=position, velocity=velocity, acceleration=acceleration,
        force=motion.filter_to_band(actuator_force + effect_force)[::stride], condition=motion.condition[::stride],
        fit=motion.fit[::stride], test=motion.test[::stride],
    )  # fmt: skip
    parameter_columns = [
        *_compute_grounded_columns(decimated, model, recording),
        *_compute_mode_columns(decimated, model, recording, known_effects),
    ]
    columns = np.stack([required.force[::stride], *parameter_columns], axis=1)
    return _PreparedRecord(decimated, tuple(columns[:, :, axis] for axis in range(m)))


def _compute_grounded_columns(motion: Motion, model: MechanicalModel, recording: Recording) -> Iterator[FloatArray]:
    """Compute (n, m) each: change of the required force per standard deviation of each entry of mass, damping and
    stiffness at the driven axes, in the order of `Tuning`. It is exact, because the force is linear in these
    entries."""
    tuning, m = make_tuning(model, recording.command.channels), model.inputs
    entries = [(i, j) for i in range(m) for j in range(i, m)]
    input_norms = np.linalg.norm(model.input, axis=0)
    for part, signal in enumerate((motion.acceleration, motion.velocity, motion.position)):
        for parameter_index, (i, j) in enumerate(entries, part * len(entries)):
            change = np.zeros((len(signal), m))
            change[:, i] = signal[:, j]
            change[:, j] = signal[:, i]
            yield tuning.deviation[parameter_index] * change / input_norms


def _compute_mode_columns(
    motion: Motion, model: MechanicalModel, recording: Recording, known_effects: Sequence[PlacedEffect]
) -> Iterator[FloatArray]:
    """Compute (n, m) each: change of the required force per standard deviation of each parameter of the modes, by
    forward differences."""
    tuning, m = make_tuning(model, recording.command.channels), model.inputs
    first_mode_parameter = 3 * m * (m + 1) // 2
    if first_mode_parameter == len(tuning.names):
        return
    output_position = motion.position @ (model.output[:m] @ compute_driven_axes(model)).T
    output_motion = compute_band_motion(output_position, motion.rate_hz, motion.band_hz)
    deviation_steps = DIFFERENCE_STEP * np.eye(len(tuning.names))[first_mode_parameter:]
    base_force, *shifted_forces = (
        compute_required_force(
            _apply_structural_effects(add_payload(tuning.tune(step), recording), known_effects), output_motion
        ).force
        for step in (0 * deviation_steps[0], *deviation_steps)
    )
    yield from ((shifted_force - base_force) / DIFFERENCE_STEP for shifted_force in shifted_forces)


def _apply_structural_effects(model: MechanicalModel, known_effects: Sequence[PlacedEffect]) -> MechanicalModel:
    """Return the model changed by those known effects that alter its masses, dampers or springs."""
    return build_bodies(
        model, [effect for effect in known_effects if isinstance(effect.effect.action, Structure)]
    ).structure
