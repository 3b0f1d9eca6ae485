"""Zero padding before and after a finite trajectory, and the error if only the rows of the trajectory are played.

A row is the sample of all channels at one time. The inverse of a device is non-causal: its forces start before the
trajectory and end after it, within the padding. Where only the rows of the trajectory are played, from rest, the forces
before the first row are lost, and the other forces were computed for an initial motion that does not exist. No padding
before the trajectory (`CAUSAL`) is then best: it gives the optimal forces among those that start with the first row.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.lqr import StoredGains, TrackResult, compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, require_trajectory


@dataclass(frozen=True, slots=True)
class Padding:
    """Durations (s) of the zeros before and after a trajectory. Raises TrackingError for a negative or non-finite
    duration. The default of 0.3 s is chosen."""

    before_s: float = 0.3
    after_s: float = 0.3

    def __post_init__(self) -> None:
        for name in ("before_s", "after_s"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise TrackingError(f"{name} is {value}; it must be a number that is not negative")

    def count_rows(self, rate_hz: float) -> tuple[int, int]:
        """Count the rows before and after at a sample rate (Hz), rounded to whole rows."""
        return round(self.before_s * rate_hz), round(self.after_s * rate_hz)


CAUSAL = Padding(before_s=0.0)
"""No padding before the first row: for a start that is not known beforehand, and where only the trajectory's rows are
played."""


@dataclass(frozen=True, slots=True, eq=False)
class PaddedTrack:
    """Tracking of a padded trajectory, and its error with and without the padding played; result of `track_padded`."""

    padded: TrackResult
    """Forces and response with padding."""
    rows: slice
    """Rows of the trajectory in `padded`."""
    padded_error: float
    """Relative rms error in the model's band over the trajectory's rows, if all rows are played."""
    cut_error: float
    """The same error if only the trajectory's rows are played, from rest."""

    @property
    def forces(self) -> FloatArray:
        """(N, m), in N: forces in the rows of the trajectory."""
        return self.padded.forces[self.rows]


def track_padded(
    problem: TrackingProblem, reference: FloatArray, padding: Padding | None = None, gains: StoredGains | None = None
) -> PaddedTrack:
    """Track reference (N, p), m/s², from rest. padding: None = `CAUSAL`. gains: for the length with padding; None =
    computed here. Raises TrackingError for another shape, and for a reference without content in the model's band."""
    r = require_trajectory(problem, reference)
    rows_before, rows_after = (padding or CAUSAL).count_rows(problem.sample_rate_hz)
    padded_reference = np.pad(r, ((rows_before, rows_after), (0, 0)))
    padded_track = track(gains or compute_stored_gains(problem, len(padded_reference)), padded_reference)
    rows = slice(rows_before, rows_before + len(r))
    cut_response = simulate_from_rest(problem, padded_track.forces[rows])
    rate_hz, band_hz = problem.sample_rate_hz, problem.band_hz
    padded_error = compute_band_error(r, padded_track.predicted[rows], rate_hz, band_hz)
    return PaddedTrack(padded_track, rows, padded_error, compute_band_error(r, cut_response, rate_hz, band_hz))


def simulate_from_rest(problem: TrackingProblem, forces: FloatArray) -> FloatArray:
    """Simulate the model's response (N, p), m/s², to forces (N, m), in N, from rest."""
    x, predicted = np.zeros(problem.order), np.empty((len(forces), problem.outputs))
    for k, force in enumerate(forces):
        next_state_and_output = np.concatenate((x, force)) @ problem.step
        x, predicted[k] = next_state_and_output[: problem.order], next_state_and_output[problem.order :]
    return predicted


def compute_band_error(
    reference: FloatArray, delivered: FloatArray, rate_hz: float, band_hz: tuple[float, float]
) -> float:
    """Compute the relative rms error of delivered against reference, (N, p) each, over their spectra in the band (Hz).

    Raises TrackingError for a reference without content in the band.
    """
    error_spectrum, reference_spectrum = (
        compute_band_spectrum(delivered - reference, rate_hz, band_hz),
        compute_band_spectrum(reference, rate_hz, band_hz),
    )
    if not np.abs(reference_spectrum).max(initial=0.0) > 0:
        raise TrackingError(
            f"the reference has no content from {band_hz[0]:g} to {band_hz[1]:g} Hz, the model's band; "
            "give a trajectory within it, or a model of its band"
        )
    return float(np.linalg.norm(error_spectrum) / np.linalg.norm(reference_spectrum))


def compute_band_spectrum(samples: FloatArray, rate_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Compute the spectrum (2 lines, channels) within the band (Hz, limits included): real parts, then imaginary parts,
    of the unscaled FFT. Samples (N, channels) are zero-padded to at least twice their length, so that the end does not
    wrap around, and so that the lines are at most a quarter of the bandwidth apart."""
    fft_length = max(2 * len(samples), int(np.ceil(4 * rate_hz / (band_hz[1] - band_hz[0]))))
    lines_hz = np.fft.rfftfreq(fft_length, 1 / rate_hz)
    spectrum = np.fft.rfft(samples, fft_length, axis=0)[(lines_hz >= band_hz[0]) & (lines_hz <= band_hz[1])]
    return np.concatenate((spectrum.real, spectrum.imag))
