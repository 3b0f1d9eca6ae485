"""The inverse of a model as a linear operator on records of a fixed length, for iterative learning control.

The operator maps reference accelerations (N, p), m/s², to forces (N, m), N, by finite-horizon LQR tracking (`lqr`). The
gains do not depend on the record, so that they are computed once for a length. `workspace.feedforward_at_place`
combines the operators of several models; `study.workflows.equalizer` calls `compensate_spring`.
"""

from collections.abc import Callable

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.planned_motion import integrate_motion
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.iteration import InverseOperator
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem

InverseOfLength = Callable[[int], InverseOperator]
"""Function from a number of rows to the inverse operator for records of that length."""


def make_inverse_operator(model: IdentifiedModel, weight: float = 1e-3) -> InverseOfLength:
    """Make the inverse of a model by finite-horizon LQR tracking, from rest and with a free final state, for any record
    length. weight: R = weight I, of |u|², (m/s² per N)²; default as in `TrackingWeights`."""

    def make_inverse_of_length(row_count: int) -> InverseOperator:
        """Make the inverse operator for records of `row_count` rows."""
        gains = compute_stored_gains(make_tracking_problem(model, TrackingWeights(weight)), row_count)
        return lambda reference: track(gains, reference).forces

    return make_inverse_of_length


def compensate_spring(
    invert: InverseOperator, spring: VirtualSpring, sample_rate_hz: float, band_hz: tuple[float, float]
) -> InverseOperator:
    """Extend the inverse `invert` by the compensation of a virtual spring, whose force -(k x + b v) the device's loop
    adds to the commands: that force, along the planned motion (position x and velocity v integrated from the reference
    acceleration within band_hz), is subtracted. Without a spring, `invert` itself."""
    if spring == VirtualSpring():
        return invert

    def compute_commands(reference: FloatArray) -> FloatArray:
        """Compute the commands (N, m), N, for reference accelerations (N, p), m/s²."""
        motion = integrate_motion(reference, sample_rate_hz, band_hz)
        spring_force = spring.stiffness_n_per_m * motion.position + spring.damping_n_s_per_m * motion.velocity
        return np.asarray(invert(reference) + spring_force)

    return compute_commands
