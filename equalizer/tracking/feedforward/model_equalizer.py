"""Equalizer by inversion of an identified linear model: forces that produce a reference acceleration at the handle.

The loop of a repeated stimulus is inverted line by line in the frequency domain (`periodic_inverse`); its onset from
rest is the solution of a finite-horizon linear-quadratic tracking problem (`lqr`) that ends in the state of the loop.
`study.workflows.session.equalize_stimuli` uses it instead of `feedforward.equalizer.IdentityEqualizer` where a model is
given.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.periodic_inverse import FORCE_WEIGHT, compute_periodic_command
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
    """Equalizer with one identified model of m forces and p accelerations, an implementation of
    `feedforward.equalizer.Equalizer`. Raises ValueError for an unstable model."""

    model: IdentifiedModel
    """Model from forces (N) to accelerations (m/s²) at the handle."""
    spring: VirtualSpring = NO_SPRING
    """Virtual spring whose force the device's control loop adds to the commands, from which it is therefore
    subtracted."""
    weight: float = FORCE_WEIGHT
    """Weight of |force|² against |acceleration error|², (m/s² per N)²."""

    def __post_init__(self) -> None:
        if self.model.spectral_radius >= 1:
            raise ValueError("the model is not stable, so nothing can be played through it; identify it again")

    @property
    def name(self) -> str:
        """Kind, order and band (Hz) of the model, for a session's log."""
        low_hz, high_hz = self.model.band_hz
        return f"identified model, order {self.model.order}, {low_hz:g} to {high_hz:g} Hz"

    @property
    def reference_quantity(self) -> str:
        """Quantity of the reference signal."""
        return "acceleration"

    def compute_loop_commands(self, reference: Signal) -> Signal:
        """Compute the forces (samples, m), in N, of one loop in the periodic steady state. reference: accelerations
        (samples, p) of one loop, m/s². Raises OutsideBandError for a reference with content outside the model's band,
        ValueError for a sample rate, number of channels or unit other than the model's."""
        return compute_periodic_command(self.model, reference, self.weight, self.spring)

    def compute_onset_commands(self, reference: Signal, envelope: FloatArray) -> Signal:
        """Compute the forces (ticks, m), in N, from rest into the loop. The transient at the start of the loop is
        small, because the deviation of the final state from the loop's is weighted by the observability Gramian.
        reference: one loop, as in `compute_loop_commands`; envelope: (ticks,), factor on it. Raises as
        `compute_loop_commands`."""
        onset_ticks, loop_ticks = len(envelope), len(reference)
        gains = _compute_onset_gains(self.model, self.weight, onset_ticks)
        loop = compute_periodic_command(self.model, reference, self.weight)
        # Forces of the loop from the end of the onset on, and the model's state at that time.
        continued_loop = np.roll(loop.samples, -onset_ticks, axis=0)
        loop_state = compute_periodic_state(gains.problem, continued_loop)
        faded_reference = envelope[:, None] * reference.samples[np.arange(onset_ticks) % loop_ticks]
        forces = track(gains, faded_reference, final_state=loop_state).forces
        return replace(loop, samples=forces - self._compute_onset_spring_force(reference, loop, envelope))

    def _compute_onset_spring_force(self, reference: Signal, loop: Signal, envelope: FloatArray) -> FloatArray:
        """Compute the spring force (ticks, m), in N, to subtract during the onset, approximated by its value in the
        loop times the envelope. loop: forces of one loop without the spring."""
        spring_force = loop.samples - self.compute_loop_commands(reference).samples
        ticks = np.arange(len(envelope)) % len(reference)
        faded_force: FloatArray = envelope[:, None] * spring_force[ticks]
        return faded_force


@lru_cache(maxsize=8)
def _compute_onset_gains(model: IdentifiedModel, weight: float, sample_count: int) -> StoredGains:
    """Compute the gains of the tracking problem over sample_count steps. The last 8 results are cached, because this
    takes longer than the rest of an onset; 8 is chosen."""
    problem = make_tracking_problem(model, TrackingWeights(weight))
    return compute_stored_gains(problem, sample_count, compute_free_decay_weight(problem))
