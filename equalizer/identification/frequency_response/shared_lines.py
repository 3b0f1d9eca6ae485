"""Instrumental-variable estimate of the response at the lines that a set of experiments shares, with its errors.

G = Y R^H (U R^H)^-1 at each line, with one column per experiment: U the total commands, Y the responses, R the
excitations as instruments. A feedback that adds to the excitation is uncorrelated with the instruments, so that it
causes no bias.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.experiments import Experiment
from equalizer.identification.frequency_response.frequency_response import BoolArray
from equalizer.identification.frequency_response.noise_floor import (
    line_scatter,
    period_variance,
    smooth_over_lines,
)
from equalizer.signals.signal import ComplexArray, FloatArray

_RANK_TOLERANCE = 1e-6
"""Rank tolerance, relative to the strongest line's amplitude: anything smaller is rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedLines:
    """Instrumental-variable estimate at the lines that several experiments share, with its noise."""

    frequency_hz: FloatArray
    response: ComplexArray
    """(lines, outputs, inputs)"""
    noise_variance: FloatArray
    """(lines, outputs, inputs)"""
    coherence: FloatArray
    """(lines, outputs)"""
    excitation: ComplexArray
    """(lines, inputs, experiments), scaled to unit noise density."""


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """One column per experiment, weighted by the root of its number of samples, so that the noise power equals its
    density."""

    command: ComplexArray
    """(lines, inputs, experiments)"""
    response: ComplexArray
    instrument: ComplexArray
    power: FloatArray
    """(lines, outputs): power of single periods, summed over the experiments."""


def solve_shared_lines(
    experiments: Sequence[Experiment],
    frequency_hz: FloatArray,
    rest_density: FloatArray | None,
    noise_lines: int,
) -> SharedLines:
    """Estimate at the given lines. experiments: all with exactly these lines. rest_density: (lines, outputs) by
    `rest_floor`.

    Lines at which the experiments are not independent are left out.
    """
    every = _columns(experiments)
    kept = _has_full_rank(every)
    columns = _Columns(every.command[kept], every.response[kept], every.instrument[kept], every.power[kept])
    adjoint = np.conj(columns.instrument.swapaxes(1, 2))
    solution = adjoint @ np.linalg.inv(columns.command @ adjoint)
    response = columns.response @ solution
    density = _density_from_periods(experiments, kept, response)
    if density is None:
        density = _density_from_residuals(columns, response)
    if density is not None:
        density = smooth_over_lines(density, noise_lines)
        variance: FloatArray = np.einsum("lpe,lem->lpm", density, np.abs(solution) ** 2)
        noise = density.sum(axis=2)
    else:
        variance = smooth_over_lines(line_scatter(response), noise_lines)
        if rest_density is not None:
            gain = np.sum(np.abs(solution) ** 2, axis=1)
            variance = np.fmax(variance, rest_density[kept][:, :, None] * gain[:, None, :])
        noise = np.einsum("lpm,lme->lp", variance, np.abs(columns.command) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN for an output that is always zero
        coherence = np.clip(1 - noise / smooth_over_lines(columns.power, noise_lines), 0.0, 1.0)
    return SharedLines(frequency_hz[kept], response, variance, coherence, columns.instrument)


def _columns(experiments: Sequence[Experiment]) -> _Columns:
    def stack(name: str) -> ComplexArray:
        weighted = [
            getattr(experiment, name).mean(axis=0) * np.sqrt(experiment.length * experiment.effective_periods)
            for experiment in experiments
        ]
        return np.stack(weighted, axis=2)

    power = sum(experiment.length * np.mean(np.abs(experiment.response) ** 2, axis=0) for experiment in experiments)
    return _Columns(stack("command"), stack("response"), stack("instrument"), np.asarray(power))


def _has_full_rank(columns: _Columns) -> BoolArray:
    """(lines,): where excitations and commands both have full rank, the number of inputs."""
    inputs, experiments = columns.command.shape[1:]
    kept = np.full(len(columns.command), experiments >= inputs)
    if experiments >= inputs and len(kept):
        for stack in (columns.instrument, columns.command):
            strengths = np.linalg.svd(stack, compute_uv=False)
            kept &= strengths[:, -1] > _RANK_TOLERANCE * strengths.max()
    return kept


def _density_from_periods(
    experiments: Sequence[Experiment], kept: BoolArray, response: ComplexArray
) -> FloatArray | None:
    """Noise density (lines, outputs, experiments) from the residuals' variance between periods. Experiments with a
    single period take the mean of the others; None where all have one."""
    found: list[FloatArray | None] = []
    for experiment in experiments:
        residuals = experiment.response[:, kept] - np.einsum("lpm,klm->klp", response, experiment.command[:, kept])
        found.append(
            experiment.length * period_variance(residuals) / experiment.observed_noise_share
            if experiment.periods > 1
            else None
        )
    known = [density for density in found if density is not None]
    if not known:
        return None
    mean = np.mean(known, axis=0)
    return np.stack([mean if density is None else density for density in found], axis=2)


def _density_from_residuals(columns: _Columns, response: ComplexArray) -> FloatArray | None:
    """Noise density (lines, outputs, experiments) from the residuals between experiments, the same for all; None where
    there are fewer than two more experiments than inputs."""
    inputs, experiments = columns.command.shape[1:]
    if experiments < inputs + 2:
        return None
    residuals = np.abs(columns.response - response @ columns.command) ** 2
    density = residuals.sum(axis=2, keepdims=True) / (experiments - inputs)
    return np.broadcast_to(density, residuals.shape).copy()
