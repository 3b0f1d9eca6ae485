"""Held-out validation of an identified model: free simulation over test segments, which the fit did not use.

The model is simulated from rest some time before each segment (run-in), so that its state settles. The error is the rms
of prediction - response in the model's band, relative to the rms of the response: over the last period of a periodic
segment, else over the whole segment.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import simulate
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import ComplexArray, FloatArray

MIN_RUN_IN_S = 2.0
"""Minimum run-in (s) before a segment, chosen by hand; shorter where the recording begins later."""
MIN_RUN_IN_TIME_CONSTANTS = 5.0
"""Minimum run-in in time constants of the model's slowest pole (e^-5 < 1 %); the longer of the two applies."""


@dataclass(frozen=True, slots=True)
class HeldOutValidation:
    """Error of a free simulation over the held-out test segments."""

    error: float
    """Root mean square of prediction - response over that of the response, over all channels, within the model's
    band."""
    noise: float | None
    """Rms of the response's noise over rms of the response, estimated from the difference of the residuals between the
    last two periods; None where a segment is not periodic or has fewer than three periods. A perfect model has this
    error."""
    seconds: float
    """Duration that was compared (s), summed over the segments."""


def validate_on_test(model: IdentifiedModel, recordings: Sequence[Recording]) -> HeldOutValidation | None:
    """Compute the simulation error over all segments with the role "test"; None where there are none. The model's input
    is the recorded total command.

    Raises ValueError where the number of channels or the rate are not the model's, samples are missing in a segment, it
    is too short for the band, or the response is zero within the band.
    """
    comparisons = [
        _compare_segment(model, recording, segment) for recording, segment in _iterate_test_segments(recordings)
    ]
    if not comparisons:
        return None
    response_power = sum(comparison.response_power for comparison in comparisons)
    if response_power == 0:
        raise ValueError(
            f"the test segments hold no response between {model.band_hz[0]:g} and {model.band_hz[1]:g} Hz, so no "
            "relative error exists; test with a recording in which the device moves"
        )
    noise_powers = [comparison.noise_power for comparison in comparisons]
    known_noise_powers = [noise_power for noise_power in noise_powers if noise_power is not None]
    return HeldOutValidation(
        error=float(np.sqrt(sum(comparison.error_power for comparison in comparisons) / response_power)),
        noise=float(np.sqrt(sum(known_noise_powers) / response_power))
        if len(known_noise_powers) == len(noise_powers)
        else None,
        seconds=sum(comparison.seconds for comparison in comparisons),
    )


@dataclass(frozen=True, slots=True)
class _SegmentComparison:
    """Squared magnitudes of error, noise and response spectra, summed over the lines of the band and the channels, and
    duration (s) of the compared part of a segment."""

    error_power: float
    noise_power: float | None
    response_power: float
    seconds: float


def _iterate_test_segments(recordings: Sequence[Recording]) -> Iterator[tuple[Recording, Segment]]:
    """Iterate over the segments with the role "test", each with its recording."""
    for recording in recordings:
        for segment in recording.segments:
            if segment.role == "test":
                yield recording, segment


def _compare_segment(model: IdentifiedModel, recording: Recording, segment: Segment) -> _SegmentComparison:
    """Simulate from rest, beginning with the run-in or after the last missing command in it, and compare with the
    response. Raises ValueError as `validate_on_test` does."""
    _check_compatible(model, recording)
    rate_hz = recording.sample_rate_hz
    start = max(0, segment.start - _count_run_in_samples(model))
    missing_indices = np.flatnonzero(~np.isfinite(recording.command.samples[start : segment.start]).all(axis=1))
    start += int(missing_indices[-1]) + 1 if len(missing_indices) else 0
    commands = recording.command.samples[start : segment.stop]
    response = recording.response.samples[start : segment.stop]
    if not (np.isfinite(commands).all() and np.isfinite(response[segment.start - start :]).all()):
        raise ValueError(f"samples {start} to {segment.stop} hold missing values; a test segment needs all of them")
    predicted = simulate(model, commands)
    first_index = _find_first_compared_sample(segment) - start
    compared_count = segment.stop - start - first_index
    measured_spectrum = _compute_band_spectrum(response[first_index:], rate_hz, model.band_hz)
    error_spectrum = measured_spectrum - _compute_band_spectrum(predicted[first_index:], rate_hz, model.band_hz)
    noise_power = None
    if (
        segment.period and first_index - 2 * compared_count >= segment.start - start
    ):  # at least three periods: the first contains the transient
        # From the residuals, so that a free decay from period to period does not count as noise.
        previous_error_spectrum = _compute_band_spectrum(
            (response - predicted)[first_index - compared_count : first_index], rate_hz, model.band_hz
        )
        noise_power = _compute_power(error_spectrum - previous_error_spectrum) / 2
    return _SegmentComparison(
        _compute_power(error_spectrum), noise_power, _compute_power(measured_spectrum), compared_count / rate_hz
    )


def _count_run_in_samples(model: IdentifiedModel) -> int:
    """Count the samples of the run-in; `MIN_RUN_IN_S` alone counts where the spectral radius is 0, or 1 and more."""
    spectral_radius = model.spectral_radius
    time_constant_samples = -1 / np.log(spectral_radius) if 0 < spectral_radius < 1 else 0.0
    return round(max(MIN_RUN_IN_S * model.sample_rate_hz, MIN_RUN_IN_TIME_CONSTANTS * time_constant_samples))


def _find_first_compared_sample(segment: Segment) -> int:
    """Find the first compared sample: one period before the segment's end, when the transient has decayed; without a
    whole period, start of the segment."""
    period_count = (segment.stop - segment.start) // segment.period if segment.period else 0
    return segment.stop - segment.period if period_count >= 1 else segment.start


def _compute_band_spectrum(samples: FloatArray, rate_hz: float, band_hz: tuple[float, float]) -> ComplexArray:
    """Compute the Fourier transform (lines, p) of samples (n, p) at the lines within the band, ends included. Raises
    ValueError where no line lies in it."""
    line_hz = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    in_band = (line_hz >= band_hz[0]) & (line_hz <= band_hz[1])
    if not in_band.any():
        raise ValueError(f"{len(samples)} samples are too few to compare {band_hz[0]:g} to {band_hz[1]:g} Hz")
    return np.asarray(np.fft.rfft(samples, axis=0)[in_band], dtype=np.complex128)


def _compute_power(spectrum: ComplexArray) -> float:
    """Compute the sum of the squared magnitudes of a spectrum (lines, p)."""
    return float((np.abs(spectrum) ** 2).sum())


def _check_compatible(model: IdentifiedModel, recording: Recording) -> None:
    """Check a recording: raises ValueError where sample rate or numbers of channels differ from the model's."""
    if recording.sample_rate_hz != model.sample_rate_hz:
        raise ValueError(
            f"a recording at {recording.sample_rate_hz:g} Hz cannot test a model at {model.sample_rate_hz:g}"
        )
    channel_counts = (len(recording.response.channels), len(recording.command.channels))
    if channel_counts != model.D.shape:
        raise ValueError(
            f"a recording of {channel_counts[1]} commands and {channel_counts[0]} responses cannot test this model"
        )
