"""Measure a free device (no hand on the handle) from one recording, for a daily check: friction from slow strokes,
frequency response, noise at rest.

The mean friction force (N) is the work dissipated in a closed stroke, the integral of F dx along its path, divided by
the length of the path. Springs, weights and inertia do no net work over a closed path, so that no model is needed.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.measured_motion import fill_gaps
from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.transfer_estimate import TransferEstimateError, estimate_transfer
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal, find_runs
from equalizer.tracking.feedforward.band_pass import remove_trend

STROKES_BELOW_HZ = 1.0
"""Sinusoids below this frequency count as strokes: those of the shipped daily check have 0.5 Hz, and the lowest
stimulus of the shipped studies has 5 Hz."""

MISSED_LIMIT = 0.02
"""Largest share of missing samples (missed ticks of the control loop) of a signal: the default `missed_ticks_limit` of
a protocol."""


class NotMeasurableError(ValueError):
    """A measure cannot be computed from the recording; the text of the error is the reason, a clause."""


@dataclass(frozen=True, slots=True, eq=False)
class DeviceMeasures:
    """Friction, frequency response and noise of a free device, from a single recording."""

    friction_n: FloatArray
    """(axes,): mean friction force over the strokes along each axis; NaN where in at least one of them the handle moved
    no further along the axis than across it."""
    friction_error_n: FloatArray
    """(axes,): standard error of the mean friction, from the standard deviation between strokes; NaN as
    `friction_n`."""
    response: FrequencyResponse
    """Estimated frequency response from the commands to the responses of the recording."""
    noise: FloatArray
    """(outputs,): rms of the response at rest after linear detrending, in the unit of the response."""
    noise_samples: int
    """Number of samples at rest from which the noise was computed."""


def measure_device(recording: Recording) -> DeviceMeasures:
    """Measure friction, frequency response and noise of a free device. recording: strokes and a broadband excitation
    along every axis, with rests. Raises NotMeasurableError without a position along every axis or a rest, for too many
    missing samples, with fewer than two strokes along an axis, and where the frequency response cannot be estimated or
    has no reliable line."""
    recording = _interpolate_gaps(recording)
    response = _estimate_response(recording)
    friction_and_error_n = np.array(
        [_measure_friction(recording, axis) for axis in range(len(recording.command.channels))]
    )
    rest_responses = _select_settled_rests(recording)
    if not rest_responses:
        raise NotMeasurableError("the handle is never at rest, so the noise cannot be measured")
    noise, sample_count = _measure_noise(recording, rest_responses)
    return DeviceMeasures(friction_and_error_n[:, 0], friction_and_error_n[:, 1], response, noise, sample_count)


def _interpolate_gaps(recording: Recording) -> Recording:
    """Interpolate missing samples of all signals, because the estimate of the frequency response leaves out periods
    with missing samples. Raises NotMeasurableError without a position along every axis, or for too many missing
    samples."""
    if recording.position is None:
        raise NotMeasurableError("the recording contains no position signal")
    channel_count, axis_count = len(recording.position.channels), len(recording.command.channels)
    if channel_count != axis_count:
        raise NotMeasurableError(
            f"the number of channels of the position is {channel_count}, that of the command {axis_count}, and "
            "friction is computed from a position along every axis"
        )
    command, response = _fill_missing(recording.command, "command"), _fill_missing(recording.response, "response")
    position = _fill_missing(recording.position, "position")
    excitation = None if recording.excitation is None else _fill_missing(recording.excitation, "excitation")
    return replace(recording, command=command, response=response, position=position, excitation=excitation)


def _fill_missing(signal: Signal, name: str) -> Signal:
    """Interpolate the missing samples of a signal. Raises NotMeasurableError where more than `MISSED_LIMIT` of them are
    missing in at least one channel. name: of the signal, for the error."""
    gap_share = 1 - float(np.isfinite(signal.samples).all(axis=1).mean())
    if gap_share > MISSED_LIMIT:
        raise NotMeasurableError(
            f"{100 * gap_share:.1f} % of the samples of the {name} are missing; at most {100 * MISSED_LIMIT:g} % are "
            "allowed"
        )
    return replace(signal, samples=fill_gaps(signal.samples))


def _estimate_response(recording: Recording) -> FrequencyResponse:
    """Estimate the frequency response. Raises NotMeasurableError where it cannot be estimated, or where no spectral
    line is reliable."""
    try:
        response = estimate_transfer([recording])
    except TransferEstimateError as error:
        raise NotMeasurableError(str(error)) from error
    if not response.reliable.any():
        raise NotMeasurableError("no line of its frequency response is reliable")
    return response


def _measure_friction(recording: Recording, axis: int) -> tuple[float, float]:
    """Measure the mean friction along an axis and its standard error, both in N, over its strokes, the periods of slow
    sinusoids; NaN where any stroke gives NaN. Raises NotMeasurableError with fewer than two strokes along the axis."""
    losses_n = [
        _measure_loss_per_path(recording, start, start + segment.period, axis)
        for segment in recording.segments
        if _is_stroke(recording, segment) and _find_driven_axis(recording, segment) == axis
        for start in range(segment.start, segment.stop - segment.period + 1, segment.period)
    ]
    if len(losses_n) < 2:
        raise NotMeasurableError(
            f"the recording contains {len(losses_n)} slow strokes along {recording.command.channels[axis]}; at least 2 "
            "are needed"
        )
    return float(np.mean(losses_n)), float(np.std(losses_n, ddof=1) / np.sqrt(len(losses_n)))


def _is_stroke(recording: Recording, segment: Segment) -> bool:
    """Whether a segment is a sinusoid below `STROKES_BELOW_HZ`."""
    return segment.kind == "sine" and segment.period * STROKES_BELOW_HZ > recording.sample_rate_hz


def _find_driven_axis(recording: Recording, segment: Segment) -> int:
    """Find the index of the command with the largest peak-to-peak excitation in a segment."""
    return int(np.argmax(np.ptp(select_instrument_signal(recording)[segment.start : segment.stop], axis=0)))


def _measure_loss_per_path(recording: Recording, start: int, stop: int, axis: int) -> float:
    """Compute the work of the command force in one stroke, divided by the length of its path along the axis (N); NaN
    where the handle moved no further along the axis than across it. start, stop: indices of the first sample of the
    stroke and of the sample after its last."""
    assert recording.position is not None
    position_m = recording.position.samples[start : stop + 1]
    force_n = recording.command.samples[start : start + len(position_m) - 1]
    path_m = 2 * float(np.ptp(position_m[:, axis]))
    cross_path_m = 2 * float(np.delete(np.ptp(position_m, axis=0), axis).max(initial=0.0))
    if not path_m > cross_path_m:
        return np.nan
    return float(np.sum(force_n * np.diff(position_m, axis=0)) / path_m)


def _select_settled_rests(recording: Recording) -> list[FloatArray]:
    """Select the responses (k, outputs) in the second half of each rest that is longer than half the longest;
    transients decay in the first half. A rest is a run of samples without excitation; empty without any."""
    rests = find_runs(np.asarray(~select_instrument_signal(recording).any(axis=1)))
    longest_length = max((stop - start for start, stop in rests), default=0)
    return [
        recording.response.samples[(start + stop) // 2 : stop]
        for start, stop in rests
        if stop - start > longest_length / 2
    ]


def _measure_noise(recording: Recording, rest_responses: list[FloatArray]) -> tuple[FloatArray, int]:
    """Compute the rms (outputs,) of the response about the least-squares line of each rest, and the number of
    samples."""
    sums_of_squares, sample_count = np.zeros(len(recording.response.channels)), 0
    for rest_response in rest_responses:
        sums_of_squares += np.sum(remove_trend(rest_response) ** 2, axis=0)
        sample_count += len(rest_response)
    return np.sqrt(sums_of_squares / max(sample_count, 1)), sample_count
