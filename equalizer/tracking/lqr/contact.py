"""A recorded transient that starts at a contact: forces are causal, and the resulting loss of accuracy is stated.

The forces for a transient a(t) along a unit normal n are linear in n: F(t) = sum_i n_i F_i(t), where F_i is the LQR
solution, stored beforehand, for the transient along axis i. The error of the predicted acceleration is also linear,
E(t) = sum_i n_i E_i(t), and its relative square in the model's band is the quadratic form

    |E|² / |a|² = n' S n,        S_ij = <E_i, E_j> / |a|²

whose largest eigenvalue belongs to the worst normal. The optimal tracker is not causal: forces before the contact
reduce the error, but at an unforeseen contact there are none. Comparison of `deviation` with `early_deviation` shows
the cost of causality.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.changing_direction import TurningTransient, make_normal_transient
from equalizer.tracking.lqr.lqr import compute_stored_gains
from equalizer.tracking.lqr.padding import CAUSAL, Padding, compute_band_spectrum
from equalizer.tracking.lqr.rotation import RotationBasis, compute_normal_basis, make_axis_recordings
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem


@dataclass(frozen=True, slots=True, eq=False)
class ContactSolutions:
    """Stored solutions of a transient for every contact normal. Made by `prepare_causal_start`."""

    basis: RotationBasis
    """Forces of the whole transient at once, for a normal (p,)."""
    live: TurningTransient
    """The same transient tick by tick, for a normal that changes while it is played."""
    deviation: FloatArray
    """(p, p): S of the module docstring; n' S n is the squared relative error for the unit normal n."""
    early_deviation: FloatArray
    """(p, p): S for forces that may begin before the contact."""

    def compute_error(self, normal: FloatArray) -> float:
        """Compute the relative error of the predicted acceleration in the model's band. normal: (p,), scaled to unit
        length here. Raises TrackingError for another shape, for zero and for values that are not finite."""
        return _compute_relative_error(self.deviation, normal)

    def compute_early_error(self, normal: FloatArray) -> float:
        """Compute the relative error if forces were allowed to begin before the contact. Argument and exceptions as for
        `compute_error`."""
        return _compute_relative_error(self.early_deviation, normal)

    @property
    def worst_error(self) -> float:
        """Largest relative error over all normals: square root of the largest eigenvalue of `deviation`."""
        return float(np.sqrt(max(0.0, float(np.linalg.eigvalsh(self.deviation)[-1]))))


def prepare_causal_start(
    problem: TrackingProblem, recording: FloatArray, padding: Padding | None = None
) -> ContactSolutions:
    """Prepare a recording (N,), the acceleration (m/s²) along the normal from the contact on, at the problem's sample
    rate. padding: `after_s` is the time after the recording in which the device comes to rest; `before_s` is used only
    for `early_deviation`. None = 0.3 s each.

    Raises TrackingError where the recording has no content in the model's band, or another shape.
    """
    full_padding = padding or Padding()
    causal_padding = Padding(CAUSAL.before_s, full_padding.after_s)
    _, rows_after = causal_padding.count_rows(problem.sample_rate_hz)
    padded_recording = np.pad(np.asarray(recording, dtype=np.float64), (0, rows_after))
    gains = compute_stored_gains(problem, len(padded_recording))
    basis = compute_normal_basis(gains, padded_recording)
    deviation = _compute_deviation(problem, basis, padded_recording)
    return ContactSolutions(
        basis,
        make_normal_transient(gains, padded_recording),
        deviation,
        _compute_early_deviation(problem, padded_recording, full_padding),
    )


def _compute_early_deviation(problem: TrackingProblem, recording: FloatArray, padding: Padding) -> FloatArray:
    """Compute S, (p, p), with zeros before the transient, during which forces may begin. recording: (N,), with its rows
    of rest after the transient."""
    rows_before, _ = padding.count_rows(problem.sample_rate_hz)
    padded_recording = np.pad(recording, (rows_before, 0))
    return _compute_deviation(
        problem,
        compute_normal_basis(compute_stored_gains(problem, len(padded_recording)), padded_recording),
        padded_recording,
    )


def _compute_deviation(problem: TrackingProblem, basis: RotationBasis, recording: FloatArray) -> FloatArray:
    """Compute S of the module docstring, (p, p). recording: (N,), with its padding. Raises TrackingError where it has
    no content in the band."""
    p, rate_hz, band_hz = problem.outputs, problem.sample_rate_hz, problem.band_hz
    recording_norm = float(np.linalg.norm(compute_band_spectrum(recording[:, np.newaxis], rate_hz, band_hz)))
    if not recording_norm > 0:
        raise TrackingError(
            f"the recording has no content from {band_hz[0]:g} to {band_hz[1]:g} Hz, the model's band; "
            "give a transient with content there"
        )
    references = make_axis_recordings(recording, p)
    axis_errors = [basis.predict_response(axis) - references[i] for i, axis in enumerate(np.eye(p))]
    relative_error_spectra = (
        np.array([compute_band_spectrum(error, rate_hz, band_hz).ravel() for error in axis_errors]) / recording_norm
    )
    return np.asarray(relative_error_spectra @ relative_error_spectra.T)


def _compute_relative_error(deviation: FloatArray, normal: FloatArray) -> float:
    """Compute sqrt(n' S n) for the normal scaled to unit length; a value below zero by rounding counts as zero. Raises
    TrackingError for another shape, for zero and for values that are not finite."""
    normal_vector = np.asarray(normal, dtype=np.float64)
    normal_length = float(np.linalg.norm(normal_vector))
    if normal_vector.shape != deviation.shape[:1] or not (np.isfinite(normal_length) and normal_length > 0):
        raise TrackingError(
            f"a normal must be {len(deviation)} finite numbers, not all zero; it is {normal_vector.tolist()}"
        )
    normal_vector = normal_vector / normal_length
    return float(np.sqrt(max(0.0, float(normal_vector @ deviation @ normal_vector))))
