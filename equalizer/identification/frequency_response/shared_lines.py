"""Instrumental-variable estimate of a frequency response at the spectral lines common to a set of experiments.

G = Y R^H (U R^H)^-1 at each line, with one column per experiment: U (inputs, experiments) the total commands, Y
(outputs, experiments) the responses, R (inputs, experiments) the instruments, which are the excitations where these
were recorded. Noise that a feedback adds to the command is uncorrelated with the excitations, so that it then causes no
bias. The noise variance follows from the residuals between periods, else between experiments, else from the scatter
between lines (`noise_floor`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.experiments import Experiment
from equalizer.identification.frequency_response.noise_floor import (
    compute_period_variance,
    estimate_line_scatter,
    smooth_over_lines,
)
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray

_RANK_TOLERANCE = 1e-6
"""Singular value, relative to the largest at any line, below which it counts as zero (rounding)."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedLines:
    """Instrumental-variable estimate at the spectral lines common to several experiments, with its noise variance."""

    frequency_hz: FloatArray
    """(lines,): lines at which the response can be estimated."""
    response: ComplexArray
    """(lines, outputs, inputs): G, in units of the response per unit of the command."""
    noise_variance: FloatArray
    """(lines, outputs, inputs): expected |error|² of each entry of `response`; NaN where it cannot be estimated."""
    coherence: FloatArray
    """(lines, outputs): share of the response's power that the commands explain, 0 to 1; NaN where the noise is
    not known, and for an output that is always zero."""
    excitation: ComplexArray
    """(lines, inputs, experiments): mean spectra, times the root of the effective number of samples."""


@dataclass(frozen=True, slots=True, eq=False)
class _SpectraColumns:
    """Mean spectra, a column per experiment, times the root of its effective number of samples (length times effective
    periods), so that the noise power of a column equals the noise density."""

    command: ComplexArray
    """(lines, inputs, experiments)"""
    response: ComplexArray
    """(lines, outputs, experiments)"""
    instrument: ComplexArray
    """(lines, inputs, experiments)"""
    power: FloatArray
    """(lines, outputs): power of single periods, summed over the experiments."""


def solve_shared_lines(
    experiments: Sequence[Experiment],
    frequency_hz: FloatArray,
    rest_density: FloatArray | None,
    noise_lines: int,
) -> SharedLines:
    """Estimate the response at the given lines. experiments: all with exactly these lines. rest_density: (lines,
    outputs), by `estimate_rest_density`, a lower bound where the noise is estimated from the scatter of lines.
    noise_lines: number of lines over which noise is averaged. Lines at which instruments or commands do not have full
    rank are left out."""
    all_columns = _stack_columns(experiments)
    is_solvable = _has_full_rank(all_columns)
    columns = _SpectraColumns(
        all_columns.command[is_solvable],
        all_columns.response[is_solvable],
        all_columns.instrument[is_solvable],
        all_columns.power[is_solvable],
    )
    adjoint = np.conj(columns.instrument.swapaxes(1, 2))
    solution = adjoint @ np.linalg.inv(columns.command @ adjoint)
    response = columns.response @ solution
    density = _estimate_density_from_periods(experiments, is_solvable, response)
    if density is None:
        density = _estimate_density_from_residuals(columns, response)
    if density is not None:
        density = smooth_over_lines(density, noise_lines)
        variance: FloatArray = np.einsum("lpe,lem->lpm", density, np.abs(solution) ** 2)
        noise_power = density.sum(axis=2)
    else:
        variance = smooth_over_lines(estimate_line_scatter(response), noise_lines)
        if rest_density is not None:
            gain = np.sum(np.abs(solution) ** 2, axis=1)
            variance = np.fmax(variance, rest_density[is_solvable][:, :, None] * gain[:, None, :])
        noise_power = np.einsum("lpm,lme->lp", variance, np.abs(columns.command) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN for an output that is always zero
        coherence = np.clip(1 - noise_power / smooth_over_lines(columns.power, noise_lines), 0.0, 1.0)
    return SharedLines(frequency_hz[is_solvable], response, variance, coherence, columns.instrument)


def _stack_columns(experiments: Sequence[Experiment]) -> _SpectraColumns:
    """Stack the weighted mean spectra of the experiments as the columns of U, Y and R."""

    def stack(name: str) -> ComplexArray:
        """Stack the weighted mean spectra with this attribute's name, (lines, channels, experiments)."""
        weighted_spectra = [
            getattr(experiment, name).mean(axis=0) * np.sqrt(experiment.length * experiment.effective_periods)
            for experiment in experiments
        ]
        return np.stack(weighted_spectra, axis=2)

    power = sum(experiment.length * np.mean(np.abs(experiment.response) ** 2, axis=0) for experiment in experiments)
    return _SpectraColumns(stack("command"), stack("response"), stack("instrument"), np.asarray(power))


def _has_full_rank(columns: _SpectraColumns) -> BoolArray:
    """Whether, at each line (lines,), R and U both have full rank, which is the number of inputs."""
    input_count, experiment_count = columns.command.shape[1:]
    has_full_rank = np.full(len(columns.command), experiment_count >= input_count)
    if experiment_count >= input_count and len(has_full_rank):
        for matrices in (columns.instrument, columns.command):
            singular_values = np.linalg.svd(matrices, compute_uv=False)
            has_full_rank &= singular_values[:, -1] > _RANK_TOLERANCE * singular_values.max()
    return has_full_rank


def _estimate_density_from_periods(
    experiments: Sequence[Experiment], is_solvable: BoolArray, response: ComplexArray
) -> FloatArray | None:
    """Estimate the noise density (lines, outputs, experiments) from the variance of the residuals Y - G U between
    periods. An experiment with a single period takes the mean of the others; None where all experiments have a single
    period."""
    densities: list[FloatArray | None] = []
    for experiment in experiments:
        residuals = experiment.response[:, is_solvable] - np.einsum(
            "lpm,klm->klp", response, experiment.command[:, is_solvable]
        )
        densities.append(
            experiment.length * compute_period_variance(residuals) / experiment.observed_noise_share
            if experiment.periods > 1
            else None
        )
    known_densities = [density for density in densities if density is not None]
    if not known_densities:
        return None
    mean_density = np.mean(known_densities, axis=0)
    return np.stack([mean_density if density is None else density for density in densities], axis=2)


def _estimate_density_from_residuals(columns: _SpectraColumns, response: ComplexArray) -> FloatArray | None:
    """Estimate the noise density (lines, outputs, experiments) from the residual power over all experiments per degree
    of freedom, the same for each; None for fewer than inputs + 2 experiments."""
    input_count, experiment_count = columns.command.shape[1:]
    if experiment_count < input_count + 2:
        return None
    residual_power = np.abs(columns.response - response @ columns.command) ** 2
    density = residual_power.sum(axis=2, keepdims=True) / (experiment_count - input_count)
    return np.broadcast_to(density, residual_power.shape).copy()
