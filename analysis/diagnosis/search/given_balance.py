"""The force balance beside a model that was given: its numbers are columns under the prior of their calibration.

The force that the model needs is taken along the measured motion, with everything that its file names: actuator, modes,
effects. Laws are then weighed as beside a fitted model (`balance.weigh`), by what they take of the error on held-out
data that re-tuning leaves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.given_base import GivenBase
from analysis.diagnosis.balance.motion import Motion, NoMotionError, motions_of
from analysis.diagnosis.balance.structures import search_structures
from analysis.diagnosis.balance.weigh import OF_SIGNAL, Balance, weigh
from analysis.diagnosis.data.carried_weight import carrying
from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import observed_parts
from analysis.diagnosis.errors.needed_force import band_motion, needed_force
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.types import Patience
from equalizer.effects.effect import PlacedEffect, Structure
from equalizer.effects.placing import placed_effects
from equalizer.effects.simulation.along_motion import entered_force, force_along
from equalizer.effects.simulation.bodies import bodies_of
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

FINER = 2
"""Samples at which laws are computed, per sample that is kept: they have overtones, which must not fold back."""
MOVED = 0.1
"""Step of the finite differences, in standard deviations of the calibration."""


def balances_beside(
    recordings: Sequence[Recording], model: MechanicalModel, without: frozenset[str], patient: Patience
) -> tuple[Balance, ...]:
    """One per command; none where not each drives a measured position or velocity."""
    records = observed_parts(recordings, model.outputs)
    if not all(has_motion(record.recording, model) for record in records):
        return ()
    try:
        found = motions_of(records)
        if len(found[0].channels) < model.inputs or found[0].order == 2 or not np.isfinite(found[0].band_hz):
            return ()
        seen = [_seen(record, motion, model) for record, motion in zip(records, found, strict=True)]
        axes = driven_axes(model)
        mass = np.einsum("nm,nk,km->m", axes, model.mass, axes)
        return tuple(
            weigh(
                search_structures(
                    [_along(each.motion, axis) for each in seen], axis, model.rotational, without, patient,
                    GivenBase(tuple(each.columns[axis] for each in seen), float(mass[axis]), OF_SIGNAL),
                )
            )
            for axis in range(model.inputs)
        )  # fmt: skip
    except (NoMotionError, MechanicalModelError, np.linalg.LinAlgError):
        return ()


def _along(motion: Motion, axis: int) -> Motion:
    """Of one axis alone: laws of another one's motion are no physics of the catalogue."""
    courses = {name: getattr(motion, name)[:, [axis]] for name in ("position", "velocity", "acceleration")}
    return replace(motion, channels=motion.channels[axis : axis + 1], **courses)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    motion: Motion
    """Of the driven axes, and the force that entered there."""
    columns: tuple[FloatArray, ...]
    """As `GivenBase.columns`, per axis."""


def _seen(record: Observed, motion: Motion, model: MechanicalModel) -> _Seen:
    recording, rate_hz = record.recording, motion.rate_hz
    known = placed_effects(model, recording.command.channels, recording.response.channels)
    tuning = tuning_of(model, recording.command.channels)
    moved = band_motion(motion.position[:, : model.inputs], rate_hz, motion.band_hz)

    def needs(deviations: FloatArray) -> FloatArray:
        structure = _structure(carrying(tuning.tuned(deviations), recording), known)
        return needed_force(structure, moved).force

    at = _structure(carrying(model, recording), known)
    whole = needed_force(at, moved)
    course = whole.axis_position, whole.axis_velocity, whole.axis_acceleration
    entered = entered_force(model, motion.force, rate_hz, known, recording.hold)
    added = force_along(at, known, course, (motion.force, entered - whole.force), rate_hz)
    changes = [(needs(step) - whole.force) / MOVED for step in MOVED * np.eye(len(tuning.names))]
    columns = np.stack([whole.force, *changes], axis=1)
    every = max(motion.step // FINER, 1)
    turned = replace(
        motion, rate_hz=rate_hz / every, step=motion.step // every, channels=motion.channels[: model.inputs],
        position=course[0][::every], velocity=course[1][::every], acceleration=course[2][::every],
        force=motion.within(entered + added)[::every], condition=motion.condition[::every],
        fit=motion.fit[::every], test=motion.test[::every],
    )  # fmt: skip
    return _Seen(turned, tuple(columns[::every, :, axis] for axis in range(model.inputs)))


def _structure(model: MechanicalModel, known: Sequence[PlacedEffect]) -> MechanicalModel:
    return bodies_of(model, [effect for effect in known if isinstance(effect.effect.acts, Structure)]).structure
