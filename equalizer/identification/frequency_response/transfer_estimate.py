"""Estimate of the frequency responses of all channels from all recordings.

Such an estimate is figure 4 of Wilson, Chan, Salisbury and Niemeyer, "Multi-DOF Equalization of Haptic Devices for
Accurate Rendering at High Frequencies". Each line uses all experiments whose period contains it, weighted by their
number of samples; experiments of different periods are combined at the lines that they share (`shared_lines`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from equalizer.identification.frequency_response.experiments import (
    Experiment,
    ExperimentSet,
    periodic_experiments,
    window_experiments,
)
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.noise_floor import rest_floor
from equalizer.identification.frequency_response.reliable_lines import (
    ReliabilityRules,
    find_excited_lines,
    judge_lines,
    spring_frequency_hz,
)
from equalizer.identification.frequency_response.shared_lines import SharedLines, solve_shared_lines
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal


class TransferEstimateError(ValueError):
    """The transfer functions cannot be estimated from these recordings. The message states the reason and, where there
    is any, the remedy."""


@dataclass(frozen=True, slots=True)
class EstimateSettings:
    """Settings of a transfer function estimate: rules for reliable lines, noise averaging, and window length."""

    rules: ReliabilityRules = field(default_factory=ReliabilityRules)
    noise_lines: int = 17
    """Number of lines over which the noise variance is averaged."""
    window_s: float = 4.0
    """Length of the windows (s) where no excitation is periodic: lines are 1 / window_s apart."""


def estimate_transfer(recordings: Sequence[Recording], settings: EstimateSettings | None = None) -> FrequencyResponse:
    """Estimate the transfer function from the total command to the response. Raises TransferEstimateError where there
    is no recording, the recordings differ in rate, channels or units, no segment is broadband and whole, an output is
    constant, or there are fewer independent experiments than inputs."""
    settings = settings or EstimateSettings()
    _check_compatible(recordings)
    experiment_set = _collect_experiments(recordings, settings)
    if not experiment_set.experiments:
        raise TransferEstimateError(
            "no segment drives the device with more than single sinusoids for a whole period or window; "
            "record a sweep or a multisine along every axis"
        )
    _refuse_constant_outputs(recordings)
    rate_hz = recordings[0].sample_rate_hz
    parts = []
    for frequency_hz, experiments in _group_by_lines(experiment_set.experiments, rate_hz):
        rest_density = rest_floor(recordings, frequency_hz)
        parts.append(solve_shared_lines(experiments, frequency_hz, rest_density, settings.noise_lines))
    return _join_parts([part for part in parts if len(part.frequency_hz)], recordings, experiment_set, settings)


def _collect_experiments(recordings: Sequence[Recording], settings: EstimateSettings) -> ExperimentSet:
    """Periodic experiments or, where there are none, windows, with remarks on the quality of the estimate."""
    experiment_set = periodic_experiments(recordings)
    if not experiment_set.experiments:
        experiment_set = window_experiments(recordings, settings.window_s)
    remarks = list(experiment_set.remarks)
    if (
        experiment_set.experiments
        and all(experiment.periods == 1 for experiment in experiment_set.experiments)
        and experiment_set.periodic
    ):
        remarks.append(
            "No experiment has two counted periods: errors were estimated from the scatter from line to line, and from "
            "the noise at rest where that is larger."
        )
    if any(recording.excitation is None and spring_frequency_hz([recording.meta]) for recording in recordings):
        remarks.append(
            "A feedback acted, but its share of the command was not recorded: noise that it fed back biases the "
            "estimate where the response is weak."
        )
    return replace(experiment_set, remarks=tuple(remarks))


def _group_by_lines(experiments: Sequence[Experiment], rate_hz: float) -> Iterator[tuple[FloatArray, list[Experiment]]]:
    """Frequencies (Hz) of each group of lines that the same experiments contain, and these experiments on the lines."""
    lengths = sorted({experiment.length for experiment in experiments})
    # Lines as integer multiples of rate / common, common the least common multiple of the lengths: compared exactly.
    common = int(np.lcm.reduce(np.array(lengths, dtype=np.int64)))
    numbers = {length: np.arange(1, (length + 1) // 2, dtype=np.int64) * (common // length) for length in lengths}
    all_lines = np.unique(np.concatenate(list(numbers.values())))
    has_line = np.stack([np.isin(all_lines, numbers[length]) for length in lengths], axis=1)
    for pattern in np.unique(has_line, axis=0):
        shared = all_lines[(has_line == pattern).all(axis=1)]
        chosen = {length for length, has_lines in zip(lengths, pattern, strict=True) if has_lines}
        group = [
            _select_lines(experiment, shared // (common // experiment.length) - 1)
            for experiment in experiments
            if experiment.length in chosen
        ]
        yield shared * (rate_hz / common), group


def _select_lines(experiment: Experiment, lines: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Experiment:
    return Experiment(
        experiment.length,
        experiment.command[:, lines],
        experiment.response[:, lines],
        experiment.instrument[:, lines],
        experiment.borrowed,
    )


def _join_parts(
    parts: Sequence[SharedLines],
    recordings: Sequence[Recording],
    experiment_set: ExperimentSet,
    settings: EstimateSettings,
) -> FrequencyResponse:
    """Join the groups of lines in ascending order of frequency, and judge the reliability of each line."""
    command, response = recordings[0].command, recordings[0].response
    if not parts:
        raise TransferEstimateError(_too_few_experiments_text(len(command.channels), experiment_set))
    order = np.argsort(np.concatenate([part.frequency_hz for part in parts]))
    frequency_hz = np.concatenate([part.frequency_hz for part in parts])[order]
    excited = np.concatenate(
        [find_excited_lines(part.frequency_hz, part.excitation, settings.rules.least_energy_db) for part in parts]
    )[order]
    coherence = np.concatenate([part.coherence for part in parts])[order]
    spring_hz = spring_frequency_hz([recording.meta for recording in recordings])
    judgement = judge_lines(frequency_hz, excited, coherence, spring_hz, settings.rules)
    return FrequencyResponse(
        frequency_hz,
        np.concatenate([part.response for part in parts])[order],
        np.concatenate([part.noise_variance for part in parts])[order],
        coherence,
        judgement.reliable,
        recordings[0].sample_rate_hz,
        command.channels,
        response.channels,
        _unit(command),
        _unit(response),
        (*experiment_set.remarks, *judgement.remarks),
    )


def _check_compatible(recordings: Sequence[Recording]) -> None:
    if not recordings:
        raise TransferEstimateError("there is no recording to estimate from; give at least one")
    first = recordings[0]
    for number, recording in enumerate(recordings[1:], start=2):
        for name, expected, value in (
            ("sample rate", f"{first.sample_rate_hz:g} Hz", f"{recording.sample_rate_hz:g} Hz"),
            ("command channels", _channels(first.command), _channels(recording.command)),
            ("response channels", _channels(first.response), _channels(recording.response)),
        ):
            if expected != value:
                raise TransferEstimateError(
                    f"recording {number} has the {name} {value}, but the first has {expected}; estimate them separately"
                )


def _refuse_constant_outputs(recordings: Sequence[Recording]) -> None:
    """Raises TransferEstimateError for an output that is constant in every recording, as of a stuck sensor: its
    response would consist of rounding errors."""
    rows = [recording.response.samples for recording in recordings]
    constant_outputs = np.all([(samples == samples[:1]).all(axis=0) for samples in rows], axis=0)
    names = ", ".join(
        name for name, is_constant in zip(recordings[0].response.channels, constant_outputs, strict=True) if is_constant
    )
    if names:
        raise TransferEstimateError(
            f"there is no signal from {names}, not even noise: check the sensor and record again"
        )


def _channels(signal: Signal) -> str:
    return f"{', '.join(signal.channels)} in {_unit(signal)}"


def _unit(signal: Signal) -> str:
    return signal.unit if isinstance(signal.unit, str) else ", ".join(signal.unit)


def _too_few_experiments_text(inputs: int, data: ExperimentSet) -> str:
    return (
        f"{inputs} inputs need {inputs} independent experiments at each line, but the {len(data.experiments)} that "
        "were found are not: at no line do they drive the inputs in so many directions. Record every axis "
        "separately, or as many multisines with independent phases as there are inputs"
    )
