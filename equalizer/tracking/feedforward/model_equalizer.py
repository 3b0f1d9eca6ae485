"""Equalizer by inversion of an identified linear model: forces that produce a reference acceleration at the handle.

A repeated stimulus is inverted line by line in the frequency domain (`periodic_inverse`); its onset from rest is the
solution of a finite-horizon linear-quadratic tracking problem (`lqr`) that ends in the state of the loop. A session
uses it in place of `equalizer.Identity` when a model is given.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.periodic_inverse import WEIGHT, compute_periodic_command
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.lqr.lqr import (
    StoredGains,
    compute_free_decay_weight,
    compute_periodic_state,
    compute_stored_gains,
    track,
)
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem


@dataclass(frozen=True, slots=True, eq=False)
class ModelEqualizer:
    """Equalizer with one identified model, an implementation of `equalizer.Equalizer`. Raises ValueError for an
    unstable model."""

    model: IdentifiedModel
    spring: VirtualSpring = NO_SPRING
    """Virtual spring whose force the device's loop adds to the commands; it is subtracted from them."""
    weight: float = WEIGHT
    """Weight of |force|² against |acceleration error|², (m/s² per N)²."""

    def __post_init__(self) -> None:
        if self.model.spectral_radius >= 1:
            raise ValueError("the model is not stable, so nothing can be played through it; identify it again")

    @property
    def name(self) -> str:
        """Kind, order and band of the model, for a session's log."""
        low_hz, high_hz = self.model.band_hz
        return f"identified model, order {self.model.order}, {low_hz:g} to {high_hz:g} Hz"

    @property
    def takes(self) -> str:
        """Quantity of the reference signal."""
        return "acceleration"

    def compute_loop_commands(self, reference: Signal) -> Signal:
        """Forces (N), (N, inputs), of one loop in the periodic steady state. reference: one loop, (N, p), m/s². Raises
        OutsideBandError for a reference with content outside the model's band, ValueError for another sample rate or
        unit."""
        return compute_periodic_command(self.model, reference, self.weight, self.spring)

    def compute_onset_commands(self, reference: Signal, envelope: FloatArray) -> Signal:
        """Forces (N), (ticks, inputs), from rest into the loop with almost no transient afterwards: the deviation of
        the final state from the loop's is weighted by the observability Gramian. envelope: (ticks,), factor on the
        reference. Raises as `compute_loop_commands`."""
        onset_ticks, loop_ticks = len(envelope), len(reference)
        gains = _compute_onset_gains(self.model, self.weight, onset_ticks)
        loop = compute_periodic_command(self.model, reference, self.weight)
        # The loop as it continues after the onset, and the state of the model at that moment.
        continued_loop = np.roll(loop.samples, -onset_ticks, axis=0)
        loop_state = compute_periodic_state(gains.problem, continued_loop)
        faded_reference = envelope[:, None] * reference.samples[np.arange(onset_ticks) % loop_ticks]
        forces = track(gains, faded_reference, final_state=loop_state).forces
        return Signal(
            forces - self._compute_onset_spring_force(reference, loop, envelope), *_list_force_properties(loop)
        )

    def _compute_onset_spring_force(self, reference: Signal, loop: Signal, envelope: FloatArray) -> FloatArray:
        """Spring force (N), (ticks, inputs), to subtract during the onset, approximated as its value in the loop times
        the envelope. loop: forces of one loop without the spring."""
        spring_force = loop.samples - self.compute_loop_commands(reference).samples
        ticks = np.arange(len(envelope)) % len(reference)
        faded_force: FloatArray = envelope[:, None] * spring_force[ticks]
        return faded_force


def _list_force_properties(loop: Signal) -> tuple[float, str | tuple[str, ...], str | tuple[str, ...], tuple[str, ...]]:
    """Sample rate, quantity, unit and channels of a force signal, in the order of the fields of `Signal`."""
    return loop.sample_rate_hz, loop.quantity, loop.unit, loop.channels


@lru_cache(maxsize=8)
def _compute_onset_gains(model: IdentifiedModel, weight: float, samples: int) -> StoredGains:
    """Gains of the tracking problem over `samples` steps; cached, because they take longer to compute than everything
    else of an onset."""
    problem = make_tracking_problem(model, TrackingWeights(weight))
    return compute_stored_gains(problem, samples, compute_free_decay_weight(problem))
