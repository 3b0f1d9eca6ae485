"""Output error: the measured signals less a simulation from the commands alone (free simulation).

    e(t) = (y(t) - yhat(t)) / unit        yhat: simulated from rest at the first sample, without measured feedback

The residual holds the noise and the whole effect of the missing physics, because no measured sample corrects the
simulation (only the realisation of a random effect is conditioned on the measurement). Joined parts of records begin in
given states instead (`restarts`). Made by `choose_measure`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Self

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.recorded_conditions import add_payload, apply_conditions
from analysis.diagnosis.errors.evidence_from_residuals import make_evidence
from equalizer.effects.effect import AxisForce, Effect, JointForce, PlacedEffect
from equalizer.effects.simulation.bodies import Restarts
from equalizer.effects.simulation.simulator import (
    Measurement,
    SimulationResult,
    simulate_mechanism,
    simulate_response,
    simulate_states_before,
    simulate_windows,
)
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FreeSimulation:
    """Output error of a simulation that starts at rest (a joined part: in its state of `restarts`) and is driven by the
    commands alone; an `ErrorMeasure`. The c channels are those of the response, then those of the position where it was
    measured."""

    records: tuple[Observed, ...]
    unit: FloatArray
    """(c,): unit of the residuals, in each channel's unit: the rms noise, with a share of the signal
    (`compute_error_units`) and the floor of `with_floor` added in power."""
    noise: FloatArray
    """(c,): rms noise, in each channel's own unit, with the same floor added."""
    name: str = "free simulation"
    model_effects: tuple[PlacedEffect, ...] = ()
    """Effects named in the model's own file, which are part of every simulation."""
    least_error: float = 0.0
    """Least error in units of the noise, to which smaller errors are set; 1 with a floor."""
    step_factor: int = 1
    """Factor by which the time steps of motion-dependent forces are lengthened, to save time (`short_recordings`)."""
    restarts: tuple[Restarts, ...] = ()
    """Per record, the samples at which its parts were joined, and the state in which each part begins; empty where no
    record consists of parts."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """Return the measure on other records, of any length. Each counts as a single part: `restarts` is emptied."""
        return replace(self, records=records, restarts=())

    def with_floor(self, rms: FloatArray) -> Self:
        """Return the measure with noise of this rms (c,) added in power, and 1 as its least error."""
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least_error=1.0)

    def shorten(self) -> "FreeSimulation":
        """Return the measure without the samples after the last to fit or to choose by, and without records that have
        none."""
        used = [bool((record.fit | record.choose).any()) for record in self.records]
        records = tuple(record.shorten() for record in compress(self.records, used))
        return replace(self, records=records, restarts=tuple(compress(self.restarts, used)))

    def can_observe(self, effect: Effect) -> bool:
        """True for every effect."""
        return True

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Compute, per record, (n, c): measured less simulated, in units of `unit`; NaN where a sample is missing."""
        with np.errstate(over="ignore", invalid="ignore"):  # A simulation of trial parameters may diverge.
            return tuple(
                _subtract_prediction(
                    record.measured, self._simulate(model, effects, record, simulate_response, restarts)
                )
                / self.unit
                for record, restarts in zip(self.records, self.restarts or (None,) * len(self.records), strict=True)
            )

    def simulate_states_before(
        self,
        model: MechanicalModel,
        effects: Sequence[PlacedEffect],
        record: Observed,
        sample_indices: npt.NDArray[np.int64],
    ) -> FloatArray:
        """Simulate (k, 2n): positions, then velocities of the n coordinates just before the samples `sample_indices`
        (k,)."""
        recording = record.recording
        all_effects = apply_conditions((*self.model_effects, *effects), recording)
        model = add_payload(model, recording)
        return simulate_states_before(
            model, record.command, (recording.sample_rate_hz, recording.hold), all_effects, sample_indices
        )

    def _simulate(
        self,
        model: MechanicalModel,
        effects: Sequence[PlacedEffect],
        record: Observed,
        simulate: Callable[..., SimulationResult],
        restarts: Restarts | None = None,
    ) -> SimulationResult:
        """Simulate one record by the function `simulate`, or restarted at each part where parts were joined."""
        recording, p = record.recording, model.outputs
        position = record.measured[:, p:] if record.measured.shape[1] == 2 * p else None
        measurement = Measurement(record.measured[:, :p], self.noise[:p], position, len(record.recording))
        model = add_payload(model, recording)
        all_effects = [
            _lengthen_steps(placed_effect, self.step_factor)
            for placed_effect in apply_conditions((*self.model_effects, *effects), recording)
        ]
        if restarts is not None:
            sampling = recording.sample_rate_hz, recording.hold
            return simulate_windows(model, record.command, sampling, all_effects, measurement, restarts)
        return simulate(model, record.command, recording.sample_rate_hz, all_effects, recording.hold, measurement)

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Gather, per record, the motion and missing force from which starting values are estimated. residuals: of the
        same model and effects."""
        evidence_by_record = []
        for record, residual in zip(self.records, residuals, strict=True):
            simulated = self._simulate(model, effects, record, simulate_mechanism)
            loaded_model = add_payload(model, record.recording)
            evidence_by_record.append(make_evidence(loaded_model, record, simulated, residual, (self.unit, self.noise)))
        return tuple(evidence_by_record)


def _lengthen_steps(placed_effect: PlacedEffect, factor: int) -> PlacedEffect:
    """Return the effect with time steps about `factor` times longer, at least one step per sample; other effects than
    motion-dependent forces unchanged."""
    action = placed_effect.effect.action
    if factor == 1 or not isinstance(action, (AxisForce, JointForce)):
        return placed_effect
    coarser_action = replace(action, steps=-(-action.steps // factor))
    return replace(placed_effect, effect=replace(placed_effect.effect, action=coarser_action))


def _subtract_prediction(measured: FloatArray, simulated: SimulationResult) -> FloatArray:
    """Compute (n, c): measured less simulated signals, in the channels' units: the response, then the position if
    measured."""
    p, difference = simulated.response.shape[1], measured.copy()
    difference[:, :p] -= simulated.response
    difference[:, p:] -= simulated.position[:, : difference.shape[1] - p]
    return difference


def stack_simulated_channels(simulated: SimulationResult, channel_count: int) -> FloatArray:
    """Stack (n, channel_count): the first of the simulated channels, the response before the position."""
    return np.hstack([simulated.response, simulated.position])[:, :channel_count]
