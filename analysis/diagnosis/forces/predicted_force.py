"""Force error of a model: the applied force u less the force that the model requires along the measured motion q.

    e = L (u + h) - L (M q'' + D q' + K q)        L: zero-phase low pass, see `force_measure`

with the forces h of the effects along q (inverse dynamics). The residual is e rescaled to an actuator gain of 1
(`_balance_forces`). Because no simulation is needed, this error measure suits plants in closed loop and plants that
drift. The forces in e are means over one sample period around each sample. `force_measure` builds the measure.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self, TypeVar, cast

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.recorded_conditions import add_payload, apply_conditions
from analysis.diagnosis.forces.inverse_dynamics import (
    BandMotion,
    RequiredForce,
    compute_band_motion,
    compute_required_force,
)
from equalizer.effects.effect import AxisForce, Effect, OnCommand, PlacedEffect, Structure
from equalizer.effects.simulation.bodies import build_bodies
from equalizer.effects.simulation.forces_along_motion import compute_actuator_force, compute_effect_forces_along_motion
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.band_limited import filter_low_pass
from equalizer.signals.signal import FloatArray

EDGE_PERIODS = 0.5
"""Length of the edge at either end of a record that the low pass distorts, in periods of the band's end. Chosen."""
_Result = TypeVar("_Result")
LEAST_ACTUATOR_SHARE = 1e-3
"""Least ratio of an actuator's rms force to its rms command by which errors are rescaled (`_balance_forces`), against
division by zero. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class PredictedForce:
    """Error of the force that the model requires for the measured motion; implements `ErrorMeasure`."""

    records: tuple[Observed, ...]
    """Records whose `measured` is the applied force within the band."""
    motions: tuple[BandMotion, ...]
    """Per record: measured motion of the model's first m outputs."""
    unit: FloatArray
    """(m,): unit of a residual, in the commands' unit (N or N m in SI, here and below)."""
    noise: FloatArray
    """(m,): rms noise of the forces: see `force_measure`."""
    band_hz: float
    """Upper end (Hz) of the band in which forces are compared; it begins at 0."""
    name: str = "predicted force"
    model_effects: tuple[PlacedEffect, ...] = ()
    """Effects that the model's file contains: added to the effects of every hypothesis."""
    least_error: float = 0.0
    """Least error in units of the noise, to which smaller errors are set: 0, or 1 after `with_floor`."""
    cache: dict[tuple[str, int], tuple[tuple[object, ...], object]] = field(default_factory=dict)
    """Cache of the last inputs and result by name ("required", "applied") and record index, because many laws are
    tested on the same model and command."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """Return the measure on other records, which must match `motions` in number and length."""
        return replace(self, records=records)

    def with_floor(self, rms: FloatArray) -> Self:
        """Return the measure with noise of this rms (m,) added in power, and 1 as its least error."""
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least_error=1.0)

    def shorten(self) -> "PredictedForce":
        """Return the measure without the samples after the last to fit or to choose by, and without records that have
        none."""
        records_and_motions = [
            (self._shorten_record(record), motion)
            for record, motion in zip(self.records, self.motions, strict=True)
            if (record.fit | record.choose).any()
        ]
        records = tuple(record for record, _ in records_and_motions)
        motions = tuple(self._cut_motion(motion, len(record.command)) for record, motion in records_and_motions)
        return replace(self, records=records, motions=motions)

    def _cut_motion(self, motion: BandMotion, sample_count: int) -> BandMotion:
        """Return the motion of the first `sample_count` samples, filtered anew where samples are cut off."""
        position = motion.position
        return (
            motion
            if sample_count == len(position)
            else compute_band_motion(position[:sample_count], motion.sample_rate_hz, self.band_hz)
        )

    def _shorten_record(self, record: Observed) -> Observed:
        """Cut the record after the last sample of the roles "fit" and "choose"; the samples that the filter distorts at
        the cut lose their role."""
        shortened, edge_samples = record.shorten(), count_edge_samples(record.recording.sample_rate_hz, self.band_hz)
        is_undistorted = np.arange(len(shortened.command)) < len(shortened.command) - edge_samples
        return replace(shortened, fit=shortened.fit & is_undistorted, choose=shortened.choose & is_undistorted)

    def can_observe(self, effect: Effect) -> bool:
        """Whether the effect changes forces along the axes. Effects of sensors do not, because the reading is used as
        the motion; forces within joints are not computed along a measured motion."""
        return isinstance(effect.action, (Structure, AxisForce, OnCommand))

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Compute, per record, (n, m): applied less required force, in units of `unit`. Raises numpy.linalg.LinAlgError
        where the model's outputs do not determine its motion."""
        return tuple(
            self._balance_forces(model, (*self.model_effects, *effects), record_index).residual / self.unit
            for record_index in range(len(self.records))
        )

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Gather, per record, the motion and missing force from which starting values are estimated. residuals: not
        used, because the force balance yields them."""
        return tuple(
            self._gather_evidence(model, (*self.model_effects, *effects), record_index)
            for record_index in range(len(self.records))
        )

    def _balance_forces(self, model: MechanicalModel, effects: Sequence[PlacedEffect], record_index: int) -> "_Balance":
        """Compute the force balance of a record. Its residual is scaled by the rms of the command over that of the
        actuator's force: a smaller actuator gain would otherwise reduce every error."""
        record, motion = self.records[record_index], self.motions[record_index]
        rate_hz = record.recording.sample_rate_hz
        model = add_payload(model, record.recording)
        structure = build_bodies(
            model, [effect for effect in effects if isinstance(effect.effect.action, Structure)]
        ).structure
        required_force = self._compute_cached(
            "required", record_index, (structure, motion), lambda: compute_required_force(structure, motion)
        )
        actuator_force = self._compute_actuator_force(model, effects, record_index)
        next_force = np.concatenate([required_force.force[1:], required_force.force[-1:]])
        axis_motion = required_force.axis_position, required_force.axis_velocity, required_force.axis_acceleration
        unbalanced_force = actuator_force.band_force - (required_force.force + next_force) / 2
        effects = apply_conditions(effects, record.recording)
        effect_force = compute_effect_forces_along_motion(
            structure, effects, axis_motion, (record.command, unbalanced_force), rate_hz
        )
        # Actuator and effect forces are means over the step that begins at a sample: half a step of delay makes them
        # means around the sample, as the required force is.
        applied_force = actuator_force.centred_force
        if effect_force.any():
            applied_force = applied_force + filter_low_pass(effect_force, rate_hz, self.band_hz, delay_s=0.5 / rate_hz)
        command_rms = _compute_rms(record.command)
        scale = command_rms / np.maximum(
            _compute_rms(actuator_force.force), LEAST_ACTUATOR_SHARE * command_rms + np.finfo(float).tiny
        )
        return _Balance(required_force, (applied_force - required_force.force) * scale, applied_force)

    def _compute_actuator_force(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], record_index: int
    ) -> "_ActuatorForce":
        """Compute the force of the actuators for a record; cached where no effect changes the command."""
        record = self.records[record_index]
        rate_hz, hold = record.recording.sample_rate_hz, record.recording.hold
        command_effects = [effect for effect in effects if isinstance(effect.effect.action, OnCommand)]

        def compute_force() -> _ActuatorForce:
            force = compute_actuator_force(model, record.command, rate_hz, command_effects, hold)
            centred_force = filter_low_pass(force, rate_hz, self.band_hz, delay_s=0.5 / rate_hz)
            return _ActuatorForce(force, filter_low_pass(force, rate_hz, self.band_hz), centred_force)

        return (
            compute_force()
            if command_effects
            else self._compute_cached("applied", record_index, (model.actuator, record.command), compute_force)
        )

    def _compute_cached(
        self, cache_name: str, record_index: int, inputs: tuple[object, ...], compute: Callable[[], _Result]
    ) -> _Result:
        """Return the cached result where all inputs are identical objects (`is`), else compute and cache it.
        cache_name, record_index: key of the cache."""
        cached = self.cache.get((cache_name, record_index))
        if cached is None or any(
            cached_input is not current_input for cached_input, current_input in zip(cached[0], inputs, strict=True)
        ):
            cached = inputs, compute()
            self.cache[cache_name, record_index] = cached
        return cast(_Result, cached[1])

    def _gather_evidence(self, model: MechanicalModel, effects: Sequence[PlacedEffect], record_index: int) -> Evidence:
        """Gather the evidence from which effects estimate starting values: motion, residual and force of a record."""
        record, balance = self.records[record_index], self._balance_forces(model, effects, record_index)
        return Evidence(
            model=add_payload(model, record.recording),
            sample_rate_hz=record.recording.sample_rate_hz,
            command=record.command,
            axis_position=balance.required_force.axis_position,
            axis_velocity=balance.required_force.axis_velocity,
            axis_force=-balance.residual,
            response=balance.required_force.force,
            predicted=balance.applied_force,
            noise=self.noise,
            used=(record.fit | record.choose).astype(np.float64),
        )


def count_edge_samples(sample_rate_hz: float, band_hz: float) -> int:
    """Count the samples at either end of a record that the band's filter distorts."""
    return int(EDGE_PERIODS * sample_rate_hz / band_hz)


@dataclass(frozen=True, slots=True, eq=False)
class _ActuatorForce:
    """The actuators' force, (n, m) each: mean over the step that begins at a sample; the same within the band; and,
    within the band, the mean around the sample."""

    force: FloatArray
    band_force: FloatArray
    centred_force: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Balance:
    """Force balance of one record within the band."""

    required_force: RequiredForce
    residual: FloatArray
    """(n, m): applied less required force, scaled to an actuator gain of 1."""
    applied_force: FloatArray
    """(n, m): force of the actuators and the effects."""


def _compute_rms(samples: FloatArray) -> FloatArray:
    """Compute (m,): root mean square of samples (n, m) over time."""
    return np.asarray(np.sqrt(np.mean(samples**2, axis=0)))
