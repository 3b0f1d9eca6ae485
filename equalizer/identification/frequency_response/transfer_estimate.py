"""Estimate of the frequency responses of all channels from all recordings.

An example is figure 4 of Wilson, Chan, Salisbury and Niemeyer, "Multi-DOF Equalization of Haptic Devices for Accurate
Rendering at High Frequencies". Each line uses all experiments whose period contains it, weighted by their number of
samples; experiments of different periods are combined at the lines that they share (`shared_lines`). Begin with
`estimate_transfer`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from equalizer.identification.frequency_response.experiments import (
    Experiment,
    ExperimentSet,
    collect_periodic_experiments,
    collect_window_experiments,
)
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.noise_floor import estimate_rest_density
from equalizer.identification.frequency_response.reliable_lines import (
    ReliabilityRules,
    find_excited_lines,
    find_spring_frequency_hz,
    judge_lines,
)
from equalizer.identification.frequency_response.shared_lines import SharedLines, solve_shared_lines
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.recording_checks import find_unusable_channels, list_recording_problems
from equalizer.signals.signal import FloatArray, Signal


class TransferEstimateError(ValueError):
    """The transfer functions cannot be estimated from these recordings. The message states the reason and, where there
    is any, the remedy."""


@dataclass(frozen=True, slots=True)
class EstimateSettings:
    """Settings of a transfer function estimate."""

    rules: ReliabilityRules = field(default_factory=ReliabilityRules)
    noise_lines: int = 17
    """Number of lines over which the noise variance is averaged; chosen."""
    window_s: float = 4.0
    """Length of the windows (s) where no excitation is periodic: lines are 1 / window_s apart. Chosen."""


def estimate_transfer(recordings: Sequence[Recording], settings: EstimateSettings | None = None) -> FrequencyResponse:
    """Estimate the transfer function from the total command to the response. Raises TransferEstimateError where there
    is no recording, one is inconsistent (`list_recording_problems`), the recordings differ in hold, rate, channels or
    units, no segment for the fit yields a whole period or window without missing samples, an output is constant, or
    there are fewer independent experiments than inputs at every line."""
    settings = settings or EstimateSettings()
    check_compatible(recordings)
    experiment_set = _collect_experiments(recordings, settings)
    if not experiment_set.experiments:
        raise TransferEstimateError(
            "no segment for the fit contains a whole period or window of excitation without missing samples; "
            "record a sweep or a multisine along every axis"
        )
    _refuse_constant_outputs(recordings)
    rate_hz = recordings[0].sample_rate_hz
    groups = []
    for frequency_hz, experiments in _group_by_lines(experiment_set.experiments, rate_hz):
        rest_density = estimate_rest_density(recordings, frequency_hz)
        groups.append(solve_shared_lines(experiments, frequency_hz, rest_density, settings.noise_lines))
    return _join_groups([group for group in groups if len(group.frequency_hz)], recordings, experiment_set, settings)


def _collect_experiments(recordings: Sequence[Recording], settings: EstimateSettings) -> ExperimentSet:
    """Collect periodic experiments or, where there are none, windows, with remarks on the quality of the estimate."""
    experiment_set = collect_periodic_experiments(recordings)
    if not experiment_set.experiments:
        experiment_set = collect_window_experiments(recordings, settings.window_s)
    remarks = list(experiment_set.remarks)
    if (
        experiment_set.experiments
        and all(experiment.periods == 1 for experiment in experiment_set.experiments)
        and experiment_set.periodic
    ):
        remarks.append(
            "No experiment has two counted periods: errors were estimated from the residuals between experiments where "
            "these are enough, else from the scatter from line to line or, where larger, the noise at rest."
        )
    if any(recording.excitation is None and find_spring_frequency_hz([recording.meta]) for recording in recordings):
        remarks.append(
            "A feedback acted, but its share of the command was not recorded: noise that it fed back biases the "
            "estimate where the response is weak."
        )
    if recordings[0].hold is not Hold.ZERO_ORDER:
        remarks.append(
            f"The command is {recordings[0].hold.value} between its samples, and so are the commands of a model: a "
            "controller that holds each force until the next one acts half a sample later than the model predicts."
        )
    return replace(experiment_set, remarks=tuple(remarks))


def _group_by_lines(experiments: Sequence[Experiment], rate_hz: float) -> Iterator[tuple[FloatArray, list[Experiment]]]:
    """Partition all lines by the experiments that contain them; yields the frequencies (lines,), Hz, of each group, and
    its experiments restricted to these lines."""
    lengths = sorted({experiment.length for experiment in experiments})
    # Lines k / length in cycles per sample: a quotient of whole numbers is rounded correctly, so that equal lines of
    # different lengths are equal numbers. The least common multiple of many lengths could exceed 64 bits.
    lines_by_length = {length: np.arange(1, (length + 1) // 2) / length for length in lengths}
    all_lines = np.unique(np.concatenate(list(lines_by_length.values())))
    has_line = np.stack([np.isin(all_lines, lines_by_length[length]) for length in lengths], axis=1)
    for pattern in np.unique(has_line, axis=0):
        shared_lines = all_lines[(has_line == pattern).all(axis=1)]
        numbers_by_length = {
            length: np.rint(shared_lines * length).astype(np.int64)
            for length, has_lines in zip(lengths, pattern, strict=True)
            if has_lines
        }
        restricted_experiments = [
            _select_lines(experiment, numbers_by_length[experiment.length] - 1)
            for experiment in experiments
            if experiment.length in numbers_by_length
        ]
        length, line_numbers = next(iter(numbers_by_length.items()))
        yield line_numbers * (rate_hz / length), restricted_experiments


def _select_lines(experiment: Experiment, line_indices: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Experiment:
    """Restrict an experiment to the lines with these indices (lines,)."""
    return Experiment(
        experiment.length,
        experiment.command[:, line_indices],
        experiment.response[:, line_indices],
        experiment.instrument[:, line_indices],
        experiment.replaced_share,
    )


def _join_groups(
    groups: Sequence[SharedLines],
    recordings: Sequence[Recording],
    experiment_set: ExperimentSet,
    settings: EstimateSettings,
) -> FrequencyResponse:
    """Join the groups of lines in ascending order of frequency, and judge the reliability of each line. Raises
    TransferEstimateError without any group."""
    command, response = recordings[0].command, recordings[0].response
    if not groups:
        raise TransferEstimateError(_describe_too_few_experiments(len(command.channels), experiment_set))
    order = np.argsort(np.concatenate([group.frequency_hz for group in groups]))
    frequency_hz = np.concatenate([group.frequency_hz for group in groups])[order]
    excited = np.concatenate(
        [
            find_excited_lines(group.frequency_hz, group.excitation, command.units, settings.rules.least_energy_db)
            for group in groups
        ]
    )[order]
    coherence = np.concatenate([group.coherence for group in groups])[order]
    spring_hz = find_spring_frequency_hz([recording.meta for recording in recordings])
    judgement = judge_lines(frequency_hz, excited, coherence, spring_hz, settings.rules)
    return FrequencyResponse(
        frequency_hz,
        np.concatenate([group.response for group in groups])[order],
        np.concatenate([group.noise_variance for group in groups])[order],
        coherence,
        judgement.reliable,
        recordings[0].sample_rate_hz,
        command.channels,
        response.channels,
        command.unit,
        response.unit,
        (*experiment_set.remarks, *judgement.remarks),
    )


def check_compatible(recordings: Sequence[Recording]) -> None:
    """Check the recordings: raises TransferEstimateError without any, for an inconsistent one, and where hold, sample
    rate, channels or units differ."""
    if not recordings:
        raise TransferEstimateError("there is no recording to estimate from; give at least one")
    if problems := list_recording_problems(recordings):
        raise TransferEstimateError("; ".join(problems))
    first_recording = recordings[0]
    for recording_number, recording in enumerate(recordings[1:], start=2):
        for property_name, expected, value in (
            ("hold", first_recording.hold.value, recording.hold.value),
            ("sample rate", f"{first_recording.sample_rate_hz:.12g} Hz", f"{recording.sample_rate_hz:.12g} Hz"),
            ("command channels", _describe_channels(first_recording.command), _describe_channels(recording.command)),
            ("response channels", _describe_channels(first_recording.response), _describe_channels(recording.response)),
        ):
            if expected != value:
                raise TransferEstimateError(
                    f"recording {recording_number} has the {property_name} {value}, but the first has {expected}; "
                    "estimate them separately"
                )


def _refuse_constant_outputs(recordings: Sequence[Recording]) -> None:
    """Raise TransferEstimateError for an output that is constant in every recording, as of a stuck sensor: its response
    would consist of rounding errors."""
    constant_names = ", ".join(
        name for name, _ in find_unusable_channels([recording.response for recording in recordings])
    )
    if constant_names:
        raise TransferEstimateError(
            f"there is no signal from {constant_names}, not even noise: check the sensor and record again"
        )


def _describe_channels(signal: Signal) -> str:
    """Format names and units of the channels for an error message."""
    return f"{', '.join(signal.channels)} in {_format_unit(signal)}"


def _format_unit(signal: Signal) -> str:
    """Format the common unit of all channels, or the unit of each, separated by commas."""
    return signal.unit if isinstance(signal.unit, str) else ", ".join(signal.unit)


def _describe_too_few_experiments(inputs: int, experiment_set: ExperimentSet) -> str:
    """Write the error message for fewer independent experiments than inputs at every line."""
    return (
        f"{inputs} inputs need {inputs} independent experiments at each line, but the "
        f"{len(experiment_set.experiments)} that were found are not: at no line do they "
        "drive the inputs in so many directions. Record every axis "
        "separately, or as many multisines with independent phases as there are inputs"
    )
