"""Output error: the measured signals less a simulation from the commands alone (free simulation).

    e(t) = (y(t) - yhat(t)) / unit        yhat: simulated from rest at the first sample, without measured feedback

The residual holds the noise and the whole effect of the missing physics, because no measured sample corrects the
simulation. The other measures of `error_measure` compare windows, or forces.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.recorded_conditions import add_carried_weight, effects_under_conditions
from analysis.diagnosis.errors.evidence_from_residuals import evidence_of
from equalizer.effects.effect import AxisForce, Effect, JointForce, PlacedEffect
from equalizer.effects.simulation.bodies import Restarts
from equalizer.effects.simulation.simulator import (
    Measurement,
    SimulationResult,
    simulate_mechanism,
    simulate_response,
    simulate_windows,
    states_before,
)
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FreeSimulation:
    """Output error of a simulation that starts at rest and is driven by the commands alone; an `ErrorMeasure`. The c
    channels are those of the response, then those of the position where it was measured."""

    records: tuple[Observed, ...]
    unit: FloatArray
    """(c,): unit of the residuals, in each channel's unit: the rms noise, the floor of `with_floor` added in power."""
    noise: FloatArray
    """(c,): rms noise, in each channel's own unit, with the same floor added."""
    name: str = "free simulation"
    known: tuple[PlacedEffect, ...] = ()
    """Effects that the file of the model states; every simulation contains them."""
    least: float = 0.0
    """Least error in units of the noise, to which smaller errors are set; 1 with a floor."""
    coarser: int = 1
    """Factor by which the time steps of motion-dependent forces are lengthened."""
    pieces: tuple[Restarts, ...] = ()
    """Per record, the samples at which its parts were joined, and the state in which each part begins; empty where no
    record consists of parts."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """The measure on other records, of any length. Each counts as a single part: `pieces` is emptied."""
        return replace(self, records=records, pieces=())

    def with_floor(self, rms: FloatArray) -> Self:
        """The measure with noise of this rms (c,) added in power, and 1 as its least error."""
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least=1.0)

    def shorten(self) -> "FreeSimulation":
        """The measure without the samples after the last to fit or to choose by, and without records that have none."""
        kept = [record for record in self.records if (record.fit | record.choose).any()]
        return replace(self, records=tuple(record.shorten() for record in kept))

    def can_observe(self, effect: Effect) -> bool:
        """True for every effect: each changes the simulated response or position."""
        return True

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Per record (n, c): measured less simulated, in units of `unit`; NaN where a sample is missing."""
        with np.errstate(over="ignore", invalid="ignore"):  # A simulation of trial parameters may diverge.
            return tuple(
                _subtract_prediction(record.measured, self._simulate(model, effects, record, simulate_response, joined))
                / self.unit
                for record, joined in zip(self.records, self.pieces or (None,) * len(self.records), strict=True)
            )

    def states_before(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], record: Observed, at: npt.NDArray[np.int64]
    ) -> FloatArray:
        """States just before the samples `at` (k,) of a record: positions, then velocities (k, 2n)."""
        signals = record.recording
        every = effects_under_conditions((*self.known, *effects), signals)
        model = add_carried_weight(model, signals)
        return states_before(model, record.command, (signals.sample_rate_hz, signals.hold), every, at)

    def _simulate(
        self,
        model: MechanicalModel,
        effects: Sequence[PlacedEffect],
        record: Observed,
        simulate: Callable[..., SimulationResult],
        joined: Restarts | None = None,
    ) -> SimulationResult:
        """One record simulated by the function `simulate`, or restarted at each part where parts were joined."""
        signals, p = record.recording, model.outputs
        position = record.measured[:, p:] if record.measured.shape[1] == 2 * p else None
        measurement = Measurement(record.measured[:, :p], self.noise[:p], position, len(record.recording))
        model = add_carried_weight(model, signals)
        every = [
            _coarsen(placed, self.coarser) for placed in effects_under_conditions((*self.known, *effects), signals)
        ]
        if joined is not None:
            sampled = signals.sample_rate_hz, signals.hold
            return simulate_windows(model, record.command, sampled, every, measurement, joined)
        return simulate(model, record.command, signals.sample_rate_hz, every, signals.hold, measurement)

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Per record, the motion and missing force from which starting values are estimated. residuals: of the same
        model and effects."""
        found = []
        for record, left in zip(self.records, residuals, strict=True):
            simulated = self._simulate(model, effects, record, simulate_mechanism)
            loaded = add_carried_weight(model, record.recording)
            found.append(evidence_of(loaded, record, simulated, left, (self.unit, self.noise)))
        return tuple(found)


def _coarsen(placed: PlacedEffect, times: int) -> PlacedEffect:
    """The effect with time steps about `times` times longer, at least one step per sample; other effects than
    motion-dependent forces unchanged."""
    acts = placed.effect.acts
    if times == 1 or not isinstance(acts, (AxisForce, JointForce)):
        return placed
    longer = replace(acts, steps=-(-acts.steps // times))
    return replace(placed, effect=replace(placed.effect, acts=longer))


def _subtract_prediction(measured: FloatArray, simulated: SimulationResult) -> FloatArray:
    """(n, c): measured less simulated signals, in the channels' units: the response, then the position if measured."""
    p, rest = simulated.response.shape[1], measured.copy()
    rest[:, :p] -= simulated.response
    rest[:, p:] -= simulated.position[:, : rest.shape[1] - p]
    return rest


def predict_channels(simulated: SimulationResult, count: int) -> FloatArray:
    """(n, count): the first `count` simulated channels, the response before the position."""
    return np.hstack([simulated.response, simulated.position])[:, :count]
