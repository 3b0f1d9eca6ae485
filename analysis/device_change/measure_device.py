"""Measures of a free device from one recording: friction from slow strokes, frequency response, noise at rest.

The mean friction force (N) is the work dissipated in a closed stroke, the integral of F dx along its path, divided by
the length of the path. Springs, weights and inertia do no net work over a closed path, so that no model is needed. Used
by the daily check of a device (`compare_devices`).
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.measured_motion import fill_gaps
from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.transfer_estimate import TransferEstimateError, estimate_transfer
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal, find_runs

STROKES_BELOW_HZ = 1.0
"""Sinusoids below this frequency count as strokes: those of the shipped daily check have 0.5 Hz, and the lowest
stimulus of a study has 5 Hz."""

MISSED_LIMIT = 0.02
"""Largest share of missing samples (missed ticks of the control loop): the limit of a trial in the shipped
protocols."""


class NotMeasurableError(ValueError):
    """A measure cannot be computed from the recording; the text says why."""


@dataclass(frozen=True, slots=True, eq=False)
class DeviceMeasures:
    """Friction, frequency response and noise of a free device, from a single recording."""

    friction_n: FloatArray
    """(axes,): mean friction force during the strokes along each axis; NaN where the handle moved no further along the
    axis than across it in any of its strokes."""
    friction_error_n: FloatArray
    """(axes,): standard error of the mean friction, from the standard deviation between strokes."""
    response: FrequencyResponse
    """Estimated frequency response from the commands to the responses."""
    noise: FloatArray
    """(outputs,): rms of the response at rest after linear detrending, in the unit of the response."""
    noise_samples: int
    """Number of samples at rest from which the noise was computed."""


def measure_device(recording: Recording) -> DeviceMeasures:
    """Measure friction, frequency response and noise of a free device. recording: strokes and a broadband excitation
    along every axis, with rests. Raises NotMeasurableError where any of the three cannot be computed."""
    recording = _interpolate_gaps(recording)
    response = _estimate_response(recording)
    friction = np.array([_measure_friction(recording, axis) for axis in range(len(recording.command.channels))])
    rest_responses = _select_settled_rests(recording)
    if not rest_responses:
        raise NotMeasurableError("the handle is never at rest, so the noise cannot be measured")
    noise, samples = _measure_noise(recording, rest_responses)
    return DeviceMeasures(friction[:, 0], friction[:, 1], response, noise, samples)


def _interpolate_gaps(recording: Recording) -> Recording:
    """Interpolate missing samples: a period with one would otherwise be left out. Raises NotMeasurableError without a
    position, or for too many missing samples."""
    if recording.position is None:
        raise NotMeasurableError("the recording contains no position signal")
    command, response = _fill_missing(recording.command, "command"), _fill_missing(recording.response, "response")
    position = _fill_missing(recording.position, "position")
    excitation = None if recording.excitation is None else _fill_missing(recording.excitation, "excitation")
    return replace(recording, command=command, response=response, position=position, excitation=excitation)


def _fill_missing(signal: Signal, name: str) -> Signal:
    """The signal with missing samples interpolated. Raises NotMeasurableError for a share above `MISSED_LIMIT`."""
    missing = 1 - float(np.isfinite(signal.samples).all(axis=1).mean())
    if missing > MISSED_LIMIT:
        raise NotMeasurableError(
            f"{100 * missing:.1f} % of the samples of the {name} are missing; at most {100 * MISSED_LIMIT:g} % are "
            "allowed"
        )
    return replace(signal, samples=fill_gaps(signal.samples))


def _estimate_response(recording: Recording) -> FrequencyResponse:
    """Estimate the frequency response. Raises NotMeasurableError where no spectral line of it is reliable."""
    try:
        response = estimate_transfer([recording])
    except TransferEstimateError as refusal:
        raise NotMeasurableError(str(refusal)) from refusal
    if not response.reliable.any():
        raise NotMeasurableError("no line of its frequency response is reliable")
    return response


def _measure_friction(recording: Recording, axis: int) -> tuple[float, float]:
    """Measure the mean friction along an axis and its standard error, both in N, from the work dissipated in each
    stroke.

    One period of a slow sinusoid is a stroke. Raises NotMeasurableError with fewer than two strokes along the axis.
    """
    stroke_n = [
        _measure_loss_per_path(recording, start, start + segment.period, axis)
        for segment in recording.segments
        if _is_stroke(recording, segment) and _find_driven_axis(recording, segment) == axis
        for start in range(segment.start, segment.stop - segment.period + 1, segment.period)
    ]
    if len(stroke_n) < 2:
        raise NotMeasurableError(
            f"the recording contains {len(stroke_n)} slow strokes along {recording.command.channels[axis]}; at least 2 "
            "are needed"
        )
    return float(np.mean(stroke_n)), float(np.std(stroke_n, ddof=1) / np.sqrt(len(stroke_n)))


def _is_stroke(recording: Recording, segment: Segment) -> bool:
    """Whether a segment is a sinusoid below `STROKES_BELOW_HZ`."""
    return segment.kind == "sine" and segment.period * STROKES_BELOW_HZ > recording.sample_rate_hz


def _find_driven_axis(recording: Recording, segment: Segment) -> int:
    """Index of the command with the largest peak-to-peak excitation in a segment."""
    return int(np.argmax(np.ptp(select_instrument_signal(recording)[segment.start : segment.stop], axis=0)))


def _measure_loss_per_path(recording: Recording, start: int, stop: int, axis: int) -> float:
    """Work of the command force in one stroke, divided by the length of its path along the axis (N); NaN where the
    handle moved no further along the axis than across it. start, stop: first sample of the stroke and of the next."""
    assert recording.position is not None
    position_m = recording.position.samples[start : stop + 1]
    force_n = recording.command.samples[start : start + len(position_m) - 1]
    path_m = 2 * float(np.ptp(position_m[:, axis]))
    cross_path_m = 2 * float(np.delete(np.ptp(position_m, axis=0), axis).max(initial=0.0))
    if not path_m > cross_path_m:
        return np.nan
    return float(np.sum(force_n * np.diff(position_m, axis=0)) / path_m)


def _select_settled_rests(recording: Recording) -> list[FloatArray]:
    """Responses (k, outputs) in the second half of each long rest; transients decay in the first half."""
    rests = find_runs(np.asarray(~select_instrument_signal(recording).any(axis=1)))
    longest = max((stop - start for start, stop in rests), default=0)
    return [
        recording.response.samples[(start + stop) // 2 : stop] for start, stop in rests if stop - start > longest / 2
    ]


def _measure_noise(recording: Recording, rest_responses: list[FloatArray]) -> tuple[FloatArray, int]:
    """(outputs,): rms of the response about the least-squares line of each rest, and the number of samples."""
    squares, samples = np.zeros(len(recording.response.channels)), 0
    for rest_response in rest_responses:
        index = np.arange(len(rest_response)) - (len(rest_response) - 1) / 2
        detrended = rest_response - rest_response.mean(axis=0)
        detrended = detrended - np.outer(index, index @ detrended / max(float(index @ index), 1.0))
        squares += np.sum(detrended**2, axis=0)
        samples += len(rest_response)
    return np.sqrt(squares / max(samples, 1)), samples
