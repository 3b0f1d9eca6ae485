"""Relative error of a discovered law against the true law, along a simulated motion that no recording contains.

    error = |P (f_true - f_found)| / |P f_true|        on each axis with a true law; the worst axis counts

f: contribution of the laws, (samples,); P: projection onto the orthogonal complement of the signals that the model
without the law fits: acceleration, velocity, position and a constant for forces; acceleration and a constant for
readings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FreshMotion:
    """Simulated motion that no recording contains, with the contributions of the true laws."""

    signals: Mapping[str, FloatArray]
    """(samples,) each, SI units, by the names of variables in laws: x, vx, ax, fx, ..., t."""
    contributions: Mapping[str, FloatArray]
    """(samples,) each, by letter of the axis: contribution of the true laws to its force (N) or reading (m/s^2)."""
    acts_on_response: bool
    """Whether the true laws act on the sensor reading; otherwise on the force."""
    rate_hz: float
    """Sample rate, Hz."""


def compute_law_error(laws: Sequence[Law], motion: FreshMotion) -> float:
    """Compute the relative error of the module's equation on the worst axis that has a true law, at least one; inf
    where a found law gives a number that is not finite. laws: the found laws."""
    return max(_compute_axis_error(laws, motion, axis) for axis in motion.contributions)


def _compute_axis_error(laws: Sequence[Law], motion: FreshMotion, axis: str) -> float:
    """Compute the relative error on one axis. Laws of another axis, or of another kind than the true laws (force or
    reading), contribute nothing; a law that replaces a command or response contributes its difference from it."""
    true_contribution, found_contribution = motion.contributions[axis], np.zeros(len(motion.contributions[axis]))
    for law in laws:
        if law.axis[-1] != axis or (law.acts_on == "response") != motion.acts_on_response:
            continue
        replaced_signal = {"force": None, "command": f"f{axis}", "response": f"a{axis}"}[law.acts_on]
        predicted = evaluate(law, _begin_at_rest(motion), motion.rate_hz)[1:]
        found_contribution = (
            found_contribution + predicted - (0.0 if replaced_signal is None else motion.signals[replaced_signal])
        )
    if not np.isfinite(found_contribution).all():
        return float("inf")
    fitted_signals = [
        motion.signals[name] for name in ((f"a{axis}",) if motion.acts_on_response else (f"a{axis}", f"v{axis}", axis))
    ]
    fitted_basis = np.linalg.qr(
        np.column_stack([*(_normalise(column) for column in fitted_signals), np.ones(len(true_contribution))])
    )[0]

    def compute_projected_norm(force: FloatArray) -> float:
        return float(np.linalg.norm(force - fitted_basis @ (fitted_basis.T @ force)))

    # The lower bound prevents a division by zero where the model can fit the true law.
    return compute_projected_norm(true_contribution - found_contribution) / max(
        compute_projected_norm(true_contribution), 1e-300
    )


def _begin_at_rest(motion: FreshMotion) -> Mapping[str, FloatArray]:
    """Prepend to the signals a sample of zeros, because the states of laws with memory start at rest, as the simulated
    device did."""
    extended_signals = {name: np.concatenate([[0.0], signal]) for name, signal in motion.signals.items()}
    return extended_signals | {
        "t": np.concatenate([[motion.signals["t"][0] - 1 / motion.rate_hz], motion.signals["t"]])
    }


def _normalise(column: FloatArray) -> FloatArray:
    """Scale the column to a Euclidean norm of 1, so that units do not affect the QR decomposition; a column of zeros
    stays zero."""
    return np.asarray(column / max(float(np.linalg.norm(column)), 1e-300))
