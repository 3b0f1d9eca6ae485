"""Validation of a model: free simulation over the segments that were kept for a test.

The model is simulated from rest some time before each segment, so that its state settles. The error is the rms of
prediction - response in the model's band, relative to that of the response, over the last period of a periodic segment,
else over the whole segment.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import simulate
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import ComplexArray, FloatArray

LEAD_S = 2.0
"""Least run-in (s) before a segment, in which the state settles; shorter where the recording begins later."""
DECAYS = 5.0
"""Least run-in in time constants of the model's slowest pole; the longer of the two applies."""


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Error of a free simulation over the segments that were kept for a test; result of `validate_on_test`."""

    error: float
    """Root mean square of prediction - response over that of the response, over all channels, within the model's
    band."""
    noise: float | None
    """Noise of the response in the same measure, from the residuals' differences between the last two periods; None
    where a segment has fewer than three periods. The error of a perfect model equals it."""
    seconds: float
    """Seconds compared."""


def validate_on_test(model: IdentifiedModel, recordings: Sequence[Recording]) -> HeldOut | None:
    """Simulation error over all segments with the role "test"; None where there are none. The command is the total
    command.

    Raises ValueError where the number of channels or the rate are not the model's, samples are missing in a segment, or
    it is too short for the band.
    """
    parts = [_compare_segment(model, recording, segment) for recording, segment in _test_segments(recordings)]
    if not parts:
        return None
    power = sum(part.power for part in parts)
    noises = [part.noise_power for part in parts]
    known_noise = [noise for noise in noises if noise is not None]
    return HeldOut(
        error=float(np.sqrt(sum(part.error_power for part in parts) / power)),
        noise=float(np.sqrt(sum(known_noise) / power)) if len(known_noise) == len(noises) else None,
        seconds=sum(part.seconds for part in parts),
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """Power of error, noise and response in the band, summed over lines and channels, and seconds of a segment."""

    error_power: float
    noise_power: float | None
    power: float
    seconds: float


def _test_segments(recordings: Sequence[Recording]) -> Iterator[tuple[Recording, Segment]]:
    for recording in recordings:
        for segment in recording.segments:
            if segment.role == "test":
                yield recording, segment


def _compare_segment(model: IdentifiedModel, recording: Recording, segment: Segment) -> _Part:
    """Simulate from rest, from the run-in or the last gap in the command on, and compare. Raises ValueError."""
    _check_compatible(model, recording)
    rate_hz = recording.sample_rate_hz
    start = max(0, segment.start - _lead_samples(model))
    gaps = np.flatnonzero(~np.isfinite(recording.command.samples[start : segment.start]).all(axis=1))
    start += int(gaps[-1]) + 1 if len(gaps) else 0
    commands = recording.command.samples[start : segment.stop]
    response = recording.response.samples[start : segment.stop]
    if not (np.isfinite(commands).all() and np.isfinite(response[segment.start - start :]).all()):
        raise ValueError(f"samples {start} to {segment.stop} hold missing values; a test segment needs all of them")
    predicted = simulate(model, commands)
    first_compared = _first_compared_sample(segment) - start
    length = segment.stop - start - first_compared
    measured = _band_spectrum(response[first_compared:], rate_hz, model.band_hz)
    error = measured - _band_spectrum(predicted[first_compared:], rate_hz, model.band_hz)
    noise = None
    if (
        segment.period and first_compared - 2 * length >= segment.start - start
    ):  # the first period contains the transient
        # From the residuals, so that a free decay from period to period does not count as noise.
        previous_error = _band_spectrum(
            (response - predicted)[first_compared - length : first_compared], rate_hz, model.band_hz
        )
        noise = _power(error - previous_error) / 2
    return _Part(_power(error), noise, _power(measured), length / rate_hz)


def _lead_samples(model: IdentifiedModel) -> int:
    """Length of the run-in in samples."""
    radius = model.spectral_radius
    slowest = -1 / np.log(radius) if 0 < radius < 1 else 0.0
    return round(max(LEAD_S * model.sample_rate_hz, DECAYS * slowest))


def _first_compared_sample(segment: Segment) -> int:
    """First compared sample: start of the last period, when the transient has decayed; without periods, of the
    segment."""
    periods = (segment.stop - segment.start) // segment.period if segment.period else 0
    return segment.stop - segment.period if periods >= 1 else segment.start


def _band_spectrum(samples: FloatArray, rate_hz: float, band_hz: tuple[float, float]) -> ComplexArray:
    """(lines, p): spectrum within the band, ends included. Raises ValueError where no line lies in it."""
    lines = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    in_band = (lines >= band_hz[0]) & (lines <= band_hz[1])
    if not in_band.any():
        raise ValueError(f"{len(samples)} samples are too few to compare {band_hz[0]:g} to {band_hz[1]:g} Hz")
    return np.asarray(np.fft.rfft(samples, axis=0)[in_band], dtype=np.complex128)


def _power(spectrum: ComplexArray) -> float:
    return float((np.abs(spectrum) ** 2).sum())


def _check_compatible(model: IdentifiedModel, recording: Recording) -> None:
    if recording.sample_rate_hz != model.sample_rate_hz:
        raise ValueError(
            f"a recording at {recording.sample_rate_hz:g} Hz cannot test a model at {model.sample_rate_hz:g}"
        )
    shape = (len(recording.response.channels), len(recording.command.channels))
    if shape != model.D.shape:
        raise ValueError(f"a recording of {shape[1]} commands and {shape[0]} responses cannot test this model")
