"""Equalizer by inversion of an identified linear model: forces that produce a wanted acceleration at the handle.

A repeated stimulus is inverted line by line in the frequency domain (`periodic_inverse`); its onset from rest is the
solution of a finite-horizon linear-quadratic tracking problem (`lqr`) that ends in the state of the loop.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.periodic_inverse import WEIGHT, periodic_command
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.lqr.lqr import StoredGains, free_decay_weight, periodic_state, stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem


@dataclass(frozen=True, slots=True, eq=False)
class ModelEqualizer:
    """Equalizer with one identified model. Raises ValueError for an unstable model."""

    model: IdentifiedModel
    spring: VirtualSpring = NO_SPRING
    """Virtual spring whose force the device adds to the commands; it is subtracted from them."""
    weight: float = WEIGHT
    """Weight of |force|² against |acceleration error|²."""

    def __post_init__(self) -> None:
        if self.model.spectral_radius >= 1:
            raise ValueError("the model is not stable, so nothing can be played through it; identify it again")

    @property
    def name(self) -> str:
        """Kind, order and band of the model, for a session's log."""
        low, high = self.model.band_hz
        return f"identified model, order {self.model.order}, {low:g} to {high:g} Hz"

    @property
    def takes(self) -> str:
        """The wanted quantity."""
        return "acceleration"

    def periodic(self, wanted: Signal) -> Signal:
        """Forces (N) of one loop in the periodic steady state. Raises OutsideBandError for a wanted signal with content
        outside the model's band, ValueError for another sample rate or unit."""
        return periodic_command(self.model, wanted, self.weight, self.spring)

    def onset(self, wanted: Signal, envelope: FloatArray) -> Signal:
        """Forces (N) from rest into the loop with almost no transient afterwards: the deviation of the final state from
        the loop's is weighted by the observability Gramian. Raises as `periodic`."""
        T, n = len(envelope), len(wanted)
        gains = _onset_gains(self.model, self.weight, T)
        loop = periodic_command(self.model, wanted, self.weight)
        # The loop as it continues after the onset of T samples, and the model's state at that moment.
        continued_loop = np.roll(loop.samples, -T, axis=0)
        loop_state = periodic_state(gains.problem, continued_loop)
        faded_reference = envelope[:, None] * wanted.samples[np.arange(T) % n]
        forces = track(gains, faded_reference, final_state=loop_state).forces
        return Signal(forces - self._spring_during_onset(wanted, loop, envelope), *_force_properties(loop))

    def _spring_during_onset(self, wanted: Signal, loop: Signal, envelope: FloatArray) -> FloatArray:
        """Force of the virtual spring (N), (ticks, inputs), approximated as the loop's spring force times the
        envelope."""
        spring_force = loop.samples - self.periodic(wanted).samples
        ticks = np.arange(len(envelope)) % len(wanted)
        faded_force: FloatArray = envelope[:, None] * spring_force[ticks]
        return faded_force


def _force_properties(loop: Signal) -> tuple[float, str | tuple[str, ...], str | tuple[str, ...], tuple[str, ...]]:
    """Sample rate, quantity, unit and channels of a force signal."""
    return loop.sample_rate_hz, loop.quantity, loop.unit, loop.channels


@lru_cache(maxsize=8)
def _onset_gains(model: IdentifiedModel, weight: float, samples: int) -> StoredGains:
    """Gains of the tracking problem over `samples` steps; kept, because they take longest to compute."""
    problem = make_tracking_problem(model, TrackingWeights(weight))
    return stored_gains(problem, samples, free_decay_weight(problem))
