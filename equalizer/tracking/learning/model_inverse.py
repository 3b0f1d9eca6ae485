"""A model's inverse as a linear operator on records of a fixed length, for iterative learning."""

from collections.abc import Callable

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.planned_motion import planned_motion
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.iteration import Invert
from equalizer.tracking.lqr.lqr import stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem

InverseOfLength = Callable[[int], Invert]
"""Makes the inverse operator for records of a number of rows; prepared once per length."""


def inverse_operator(model: IdentifiedModel, weight: float = 1e-3) -> InverseOfLength:
    """Inverse of a model by finite-horizon LQR tracking, from rest and with a free end. weight: R = weight I, of
    |u|²."""

    def of_length(rows: int) -> Invert:
        gains = stored_gains(make_tracking_problem(model, TrackingWeights(weight)), rows)
        return lambda wanted: track(gains, wanted).forces

    return of_length


def compensate_spring(
    invert: Invert, spring: VirtualSpring, sample_rate_hz: float, band_hz: tuple[float, float]
) -> Invert:
    """The operator for commands to which a spring adds: its force along the planned motion is subtracted."""
    if spring == VirtualSpring():
        return invert

    def commands(wanted: FloatArray) -> FloatArray:
        motion = planned_motion(wanted, sample_rate_hz, band_hz)
        held = spring.stiffness_n_per_m * motion.position + spring.damping_n_s_per_m * motion.velocity
        return np.asarray(invert(wanted) + held)

    return commands
