"""The inverse of a model as a linear operator on records of a fixed length, for iterative learning control.

The operator maps wanted accelerations (N, p), m/s², to forces (N, m), N, by finite-horizon LQR tracking (`lqr`). The
gains depend on the length only, so that they are computed once.
"""

from collections.abc import Callable

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.planned_motion import integrate_motion
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.iteration import Invert
from equalizer.tracking.lqr.lqr import stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem

InverseOfLength = Callable[[int], Invert]
"""Function from a number of rows to the inverse operator for records of that length."""


def inverse_operator(model: IdentifiedModel, weight: float = 1e-3) -> InverseOfLength:
    """Inverse of a model by finite-horizon LQR tracking, from rest and with a free final state. weight: R = weight I,
    of |u|², (m/s² per N)²."""

    def of_length(rows: int) -> Invert:
        """Inverse operator for records of `rows` rows."""
        gains = stored_gains(make_tracking_problem(model, TrackingWeights(weight)), rows)
        return lambda reference: track(gains, reference).forces

    return of_length


def compensate_spring(
    invert: Invert, spring: VirtualSpring, sample_rate_hz: float, band_hz: tuple[float, float]
) -> Invert:
    """The operator from wanted accelerations to commands, where the device's loop adds the force of a virtual spring to
    the commands: that force, -(k x + b v) along the planned motion, is subtracted."""
    if spring == VirtualSpring():
        return invert

    def commands(reference: FloatArray) -> FloatArray:
        """Commands (N, m) for wanted accelerations (N, p)."""
        motion = integrate_motion(reference, sample_rate_hz, band_hz)
        spring_force = spring.stiffness_n_per_m * motion.position + spring.damping_n_s_per_m * motion.velocity
        return np.asarray(invert(reference) + spring_force)

    return commands
