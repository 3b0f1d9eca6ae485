"""Error measure by free simulation: the measured signals against a simulation from the commands alone."""

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
    """Output error of a simulation that starts at rest at the first sample and sees the commands alone."""

    records: tuple[Observed, ...]
    unit: FloatArray
    """(c,): unit of the residuals: the rms noise, with the floor of `with_floor` added."""
    noise: FloatArray
    """(c,): rms noise."""
    name: str = "free simulation"
    known: tuple[PlacedEffect, ...] = ()
    """Effects named in the model's own file, which are part of every simulation."""
    least: float = 0.0
    """Least error in units of the noise: smaller ones are set to it; 1 with a floor."""
    coarser: int = 1
    """Factor on the length of time steps under motion-dependent forces."""
    pieces: tuple[Restarts, ...] = ()
    """Per record, where its parts were joined, and the states in which these begin; empty where records are whole."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """The measure on other records, also of another length: each is taken as whole, and `pieces` is emptied."""
        return replace(self, records=records, pieces=())

    def with_floor(self, rms: FloatArray) -> Self:
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least=1.0)

    def shorten(self) -> "FreeSimulation":
        kept = [record for record in self.records if (record.fit | record.choose).any()]
        return replace(self, records=tuple(record.shorten() for record in kept))

    def can_observe(self, effect: Effect) -> bool:
        return True

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        with np.errstate(over="ignore", invalid="ignore"):  # a simulation may diverge
            return tuple(
                _subtract_prediction(record.measured, self._simulate(model, effects, record, simulate_response, joined))
                / self.unit
                for record, joined in zip(self.records, self.pieces or (None,) * len(self.records), strict=True)
            )

    def states_before(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], record: Observed, at: npt.NDArray[np.int64]
    ) -> FloatArray:
        """States of the simulation just before given samples of a record: positions and velocities (k, 2n)."""
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
        found = []
        for record, left in zip(self.records, residuals, strict=True):
            simulated = self._simulate(model, effects, record, simulate_mechanism)
            loaded = add_carried_weight(model, record.recording)
            found.append(evidence_of(loaded, record, simulated, left, (self.unit, self.noise)))
        return tuple(found)


def _coarsen(placed: PlacedEffect, times: int) -> PlacedEffect:
    """The effect with `times` times longer time steps."""
    acts = placed.effect.acts
    if times == 1 or not isinstance(acts, (AxisForce, JointForce)):
        return placed
    longer = replace(acts, steps=-(-acts.steps // times))
    return replace(placed, effect=replace(placed.effect, acts=longer))


def _subtract_prediction(measured: FloatArray, simulated: SimulationResult) -> FloatArray:
    """The residual: measured less simulated signals."""
    p, rest = simulated.response.shape[1], measured.copy()
    rest[:, :p] -= simulated.response
    rest[:, p:] -= simulated.position[:, : rest.shape[1] - p]
    return rest


def predict_channels(simulated: SimulationResult, count: int) -> FloatArray:
    """(n, count): the response and, where `count` includes it, the position."""
    return np.hstack([simulated.response, simulated.position])[:, :count]
