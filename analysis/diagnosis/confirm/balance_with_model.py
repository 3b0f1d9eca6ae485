"""Force balance with a given mechanical model as its base: which laws are missing in that model?

Inverse dynamics give the force that the model requires for the measured motion, with its actuator, modes and effects.
The base of the regression (`balance.model_base`) consists of that force and its derivatives with respect to the model's
free parameters, which have the prior of their calibration. Laws are then tested as for a fitted model
(`balance.judge_laws`), by their gain on held-out data over the re-tuned model.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance, judge_laws
from analysis.diagnosis.balance.model_base import GivenBase
from analysis.diagnosis.balance.motion import Motion, NoMotionError, motions_of
from analysis.diagnosis.balance.structures import search_structures
from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.recorded_conditions import add_carried_weight, effects_under_conditions
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.forces.inverse_dynamics import band_motion, compute_required_force
from analysis.diagnosis.settings import LAW_OF_SIGNAL, MOTION_OVERSAMPLED
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import PlacedEffect, Structure
from equalizer.effects.placing import place_recorded_effects
from equalizer.effects.simulation.along_motion import actuator_force, force_along
from equalizer.effects.simulation.bodies import bodies_of
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

FINEST = 6.0
"""Least samples per period of the band's upper end at which laws are computed, so that harmonics of nonlinear laws are
not aliased into the band."""
DIFFERENCE_STEP = 0.1
"""Step of the finite differences for the parameters of modes, in standard deviations of the calibration."""


def find_balances_beside_model(
    recordings: Sequence[Recording], model: MechanicalModel, without: frozenset[str], time_left: TimeBudget
) -> tuple[Balance, ...]:
    """One balance per command; empty where a command drives no measured position or velocity, where there is no time
    axis, or where the model's inverse dynamics cannot be computed. without: names of effects that are not tested."""
    records = observe_parts(recordings, model.outputs)
    if not all(has_motion(record.recording, model) for record in records):
        return ()
    try:
        found = motions_of(records)
        if len(found[0].channels) < model.inputs or found[0].order == 2 or not np.isfinite(found[0].band_hz):
            return ()
        data = [_balance_data(record, motion, model) for record, motion in zip(records, found, strict=True)]
        axes = driven_axes(model)
        mass = np.einsum("nm,nk,km->m", axes, model.mass, axes)
        return tuple(
            judge_laws(
                search_structures(
                    [_select_axis(each.motion, axis) for each in data], axis, model.rotational, without, time_left,
                    GivenBase(tuple(each.columns[axis] for each in data), float(mass[axis]), LAW_OF_SIGNAL),
                )
            )
            for axis in range(model.inputs)
        )  # fmt: skip
    except (NoMotionError, MechanicalModelError, np.linalg.LinAlgError):
        return ()


def _select_axis(motion: Motion, axis: int) -> Motion:
    """The motion of one axis alone: laws that depend on the motion of another axis are not tested."""
    selected = {name: getattr(motion, name)[:, [axis]] for name in ("position", "velocity", "acceleration")}
    return replace(motion, channels=motion.channels[axis : axis + 1], **selected)


@dataclass(frozen=True, slots=True, eq=False)
class _BalanceData:
    """One record along the m driven axes, decimated to `FINEST` samples or more per period of the band's upper end."""

    motion: Motion
    """Motion of the driven axes; its force is that of the actuators and known effects there, in N (N m)."""
    columns: tuple[FloatArray, ...]
    """Per axis, the columns of `GivenBase`, (n, 1 + parameters)."""


def _balance_data(record: Observed, motion: Motion, model: MechanicalModel) -> _BalanceData:
    """Motion, force and base columns of one record. Raises LinAlgError where the model's outputs do not determine its
    motion."""
    recording, rate_hz, m = record.recording, motion.rate_hz, model.inputs
    known = effects_under_conditions(place_recorded_effects(model, recording), recording)
    at = _structure(add_carried_weight(model, recording), known)
    whole = compute_required_force(at, band_motion(motion.position[:, :m], rate_hz, motion.band_hz))
    motion_of_axis = whole.axis_position, whole.axis_velocity, whole.axis_acceleration
    entered = actuator_force(model, motion.force, rate_hz, known, recording.hold)
    added = force_along(at, known, motion_of_axis, (motion.force, entered - whole.force), rate_hz)
    every = max(int(rate_hz / (FINEST * motion.band_hz)), 1)
    position, velocity, acceleration = (each[::every] for each in motion_of_axis)
    thin = replace(
        motion, rate_hz=rate_hz / every, step=max(int(rate_hz / every / (MOTION_OVERSAMPLED * motion.band_hz)), 1),
        channels=motion.channels[:m], position=position, velocity=velocity, acceleration=acceleration,
        force=motion.band_pass(entered + added)[::every], condition=motion.condition[::every],
        fit=motion.fit[::every], test=motion.test[::every],
    )  # fmt: skip
    changes = [*_make_grounded_columns(thin, model, recording), *_mode_columns(thin, model, recording, known)]
    columns = np.stack([whole.force[::every], *changes], axis=1)
    return _BalanceData(thin, tuple(columns[:, :, axis] for axis in range(m)))


def _make_grounded_columns(motion: Motion, model: MechanicalModel, recording: Recording) -> Iterator[FloatArray]:
    """(n, m) each: change of the required force per standard deviation of each entry of mass, damping and stiffness at
    the driven axes, in the order of `Tuning`. It is exact, because the force is linear in these entries."""
    tuning, m = tuning_of(model, recording.command.channels), model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    length = np.linalg.norm(model.input, axis=0)
    for part, signal in enumerate((motion.acceleration, motion.velocity, motion.position)):
        for number, (i, j) in enumerate(pairs, part * len(pairs)):
            added = np.zeros((len(signal), m))
            added[:, i] = signal[:, j]
            added[:, j] = signal[:, i]
            yield tuning.deviation[number] * added / length


def _mode_columns(
    motion: Motion, model: MechanicalModel, recording: Recording, known: Sequence[PlacedEffect]
) -> Iterator[FloatArray]:
    """(n, m) each: change of the required force per standard deviation of each parameter of the modes, by forward
    differences."""
    tuning, m = tuning_of(model, recording.command.channels), model.inputs
    first = 3 * m * (m + 1) // 2
    if first == len(tuning.names):
        return
    seen = motion.position @ (model.output[:m] @ driven_axes(model)).T
    moved = band_motion(seen, motion.rate_hz, motion.band_hz)
    steps = DIFFERENCE_STEP * np.eye(len(tuning.names))[first:]
    here, *there = (
        compute_required_force(_structure(add_carried_weight(tuning.tune(step), recording), known), moved).force
        for step in (0 * steps[0], *steps)
    )
    yield from ((each - here) / DIFFERENCE_STEP for each in there)


def _structure(model: MechanicalModel, known: Sequence[PlacedEffect]) -> MechanicalModel:
    """The linear model changed by those known effects that alter its masses, dampers or springs."""
    return bodies_of(model, [effect for effect in known if isinstance(effect.effect.acts, Structure)]).structure
