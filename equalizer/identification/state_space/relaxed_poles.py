"""Relaxation of the bound on the decay for the poles that need a longer decay, by a likelihood-ratio test.

A pole at the bound of the decay is either superfluous, because the order is higher than needed, and then the bound does
not raise the cost; or it represents a resonance with a longer decay. A likelihood-ratio test decides: twice the fall of
the cost J (negative log-likelihood) when the bound is lifted, compared with the chi-squared distribution, with a
Bonferroni correction for the number of lines at which noise could imitate a resonance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from equalizer.identification.state_space.candidates import (
    MAX_BIN_STEPS,
    Candidate,
    average_about_model,
    choose_best,
    refine_candidate,
)
from equalizer.identification.state_space.refinement import FittedForm, complete_form, refine_form
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.stable_poles import Radius, compute_pole_radius, stabilise_blocks
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.signals.signal import FloatArray

RESOLVED_PERIODS = 4.0
"""Longest resolvable time constant, in periods (1 / line spacing). The flanks of a resonance that is narrower than the
line spacing still determine its decay, up to the point where they equal those of an undamped mode. Chosen."""
SIGNIFICANCE_LEVEL = 1e-3
"""Significance level of the test: probability that noise alone relaxes a pole. Chosen."""
RELAXED_SUFFIX = ", poles relaxed"
"""Suffix of the name of a candidate with poles beyond the ordinary bound."""

CandidateSearch = Callable[[IdentificationSettings], Sequence[Candidate]]
"""Search for candidates from new starting models, under the given settings."""


@dataclass(frozen=True, slots=True)
class SlowPole:
    """A pole with a longer decay than the ordinary bound allows."""

    frequency_hz: float
    """Natural frequency in hertz."""
    decay_s: float
    """Time constant in seconds."""
    damping_ratio: float


@dataclass(frozen=True, slots=True, eq=False)
class RelaxedFit:
    """Candidate after the likelihood-ratio test of the decay bound."""

    candidate: Candidate
    """The candidate with its poles relaxed; else the given candidate."""
    is_bound_binding: bool
    """Whether the bound is a binding constraint: a pole is at the bound although the fit would improve by more than
    noise explains without it."""


def relax_poles(
    chosen: Candidate, search: CandidateSearch, lines: WeightedLines, settings: IdentificationSettings
) -> RelaxedFit:
    """Relax the decay bound for the poles of a candidate that need it, up to `compute_longest_resolved_decay_s`. Where
    the settings state `longest_decay_s`, the candidate is returned unchanged. search: finds candidates under the
    relaxed bound."""
    limit_s = compute_longest_resolved_decay_s(lines)
    if limit_s <= settings.decay_s:
        return RelaxedFit(chosen, is_bound_binding=False)
    limit_radius = compute_pole_radius(limit_s, lines.sample_rate_hz)
    is_bound_binding = _is_bound_binding(chosen, limit_radius, lines, settings)
    if settings.longest_decay_s is not None or not (is_bound_binding or _has_outlying_line(chosen, lines)):
        return RelaxedFit(chosen, is_bound_binding)
    relaxed_settings = replace(settings, longest_decay_s=limit_s)
    relaxed_candidate = choose_best(
        [*search(relaxed_settings), refine_candidate(chosen.name, chosen.fitted, lines, settings, limit_radius)]
    )
    tightened_candidate = _tighten_poles(relaxed_candidate, lines, settings, limit_radius)
    is_accepted = tightened_candidate.has_acceptable_gain >= chosen.has_acceptable_gain and _lowers_cost(
        tightened_candidate, chosen, lines
    )
    return (
        RelaxedFit(tightened_candidate, is_bound_binding=False) if is_accepted else RelaxedFit(chosen, is_bound_binding)
    )


def refine_and_tighten(candidate: Candidate, lines: WeightedLines, settings: IdentificationSettings) -> Candidate:
    """Refine a candidate from another estimate of the same device on these lines; relaxed poles
    that do not need a longer decay there return to the ordinary bound."""
    refined = refine_candidate(candidate.name, candidate.fitted, lines, settings, candidate.radius)
    return _tighten_poles(refined, lines, settings, float(np.max(candidate.radius)))


def list_slow_poles(chosen: Candidate, bound_s: float, sample_rate_hz: float) -> tuple[SlowPole, ...]:
    """List the poles of a candidate with a time constant above bound_s (beyond rounding, 1e-9), slowest first; of each
    pair of real poles the slower one."""
    form = chosen.fitted.form
    first_poles, second_poles = form.poles.reshape(2, -1)
    slower_poles = np.where(np.abs(first_poles) >= np.abs(second_poles), first_poles, second_poles)
    slow_poles = slower_poles[np.abs(slower_poles) > compute_pole_radius(bound_s, sample_rate_hz) * (1 + 1e-9)]
    continuous_poles = np.log(slow_poles) * sample_rate_hz
    natural_rad_s = np.abs(continuous_poles)
    poles = [
        SlowPole(float(rad_s / (2 * np.pi)), float(-1 / pole.real), float(-pole.real / rad_s))
        for pole, rad_s in zip(continuous_poles, natural_rad_s, strict=True)
    ]
    return tuple(sorted(poles, key=lambda pole: -pole.decay_s))


def compute_longest_resolved_decay_s(lines: WeightedLines) -> float:
    """Compute the time constant (s) above which these lines do not distinguish a decay from an undamped mode:
    `RESOLVED_PERIODS` over the median line spacing; 0 for a single line."""
    spacings_hz = np.diff(np.unique(lines.frequency_hz))
    return RESOLVED_PERIODS / float(np.median(spacings_hz)) if len(spacings_hz) else 0.0


def is_at_bound(fitted: FittedForm, radius: Radius) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether the pole of larger magnitude of each block, (blocks,), lies on the radius or beyond, with a relative
    tolerance of 1e-7 for rounding."""
    return np.asarray(_compute_pole_radii(fitted) >= radius * (1 - 1e-7))


def _compute_pole_radii(fitted: FittedForm) -> FloatArray:
    """Compute the magnitude of the larger pole of each block, (blocks,)."""
    poles = np.abs(fitted.form.poles).reshape(2, -1)
    return np.asarray(poles.max(axis=0))


def _is_bound_binding(
    chosen: Candidate, limit_radius: float, lines: WeightedLines, settings: IdentificationSettings
) -> bool:
    """Whether lifting the bound for the poles at it lowers the cost by more than noise does, judged from a limited
    number of refinement steps."""
    is_pole_at_bound = is_at_bound(chosen.fitted, chosen.radius)
    if not is_pole_at_bound.any():
        return False
    bins = average_about_model(chosen.fitted, lines, settings)
    pole_radii = np.where(is_pole_at_bound, limit_radius, chosen.radius)
    relaxed_cost = bins.compute_cost(
        refine_form(chosen.fitted.form, bins, pole_radii, MAX_BIN_STEPS[-1]).compute_response(bins.z)
    )
    if not _exceeds_noise(
        bins.compute_cost(chosen.fitted.compute_response(bins.z)) - relaxed_cost, relaxed_cost, bins, len(lines)
    ):
        return False
    # A fall of the cost that further steps achieve with the bound, too, is not counted.
    bounded_cost = bins.compute_cost(
        refine_form(chosen.fitted.form, bins, chosen.radius, MAX_BIN_STEPS[-1]).compute_response(bins.z)
    )
    return _exceeds_noise(bounded_cost - relaxed_cost, relaxed_cost, bins, len(lines))


def _has_outlying_line(chosen: Candidate, lines: WeightedLines) -> bool:
    """Whether the residual of a line is an outlier, as from a resonance so narrow that no pole moved there in the
    search."""
    line_costs = (np.abs(lines.weight * (chosen.fitted.compute_response(lines.z) - lines.response)) ** 2).sum(
        axis=(1, 2)
    )
    entry_count = lines.response[0].size
    return bool(
        2 * line_costs.max() / max(chosen.cost, 1.0) > chi2.isf(SIGNIFICANCE_LEVEL / len(lines), 2 * entry_count)
    )


def _tighten_poles(
    relaxed: Candidate, lines: WeightedLines, settings: IdentificationSettings, limit_radius: float
) -> Candidate:
    """Return poles to the ordinary bound, slowest first, where that raises the cost by no more than noise would."""
    ordinary_radius = compute_pole_radius(settings.decay_s, lines.sample_rate_hz)
    pole_radii, entry_count = _compute_pole_radii(relaxed.fitted), lines.response.size
    name = f"{relaxed.name.removesuffix(RELAXED_SUFFIX)}{RELAXED_SUFFIX}"
    tightened = replace(
        relaxed, name=name, radius=np.where(pole_radii > ordinary_radius, limit_radius, ordinary_radius)
    )
    for block in [int(k) for k in np.argsort(-pole_radii) if pole_radii[k] > ordinary_radius]:
        trial_radii = np.array(tightened.radius)
        trial_radii[block] = ordinary_radius
        form = tightened.fitted.form
        a, b = stabilise_blocks(form.a, form.b, trial_radii)
        trial = refine_candidate(name, complete_form(replace(form, a=a, b=b), lines), lines, settings, trial_radii)
        increase = entry_count * (trial.cost - relaxed.cost)
        if trial.has_acceptable_gain and not _exceeds_noise(increase, entry_count * relaxed.cost, lines, len(lines)):
            tightened = trial
    is_relaxed = bool(np.any(tightened.radius > ordinary_radius))
    return tightened if is_relaxed else replace(tightened, name=relaxed.name.removesuffix(RELAXED_SUFFIX))


def _lowers_cost(tightened: Candidate, chosen: Candidate, lines: WeightedLines) -> bool:
    """Whether poles are still relaxed, but not those of all blocks, and the cost fell by more than noise alone
    explains."""
    entry_count = lines.response.size
    decrease = entry_count * (chosen.cost - tightened.cost)
    return bool(np.any(tightened.radius > np.min(tightened.radius))) and _exceeds_noise(
        decrease, entry_count * tightened.cost, lines, len(lines)
    )


def _exceeds_noise(decrease: float, remaining: float, lines: WeightedLines, tested_lines: int) -> bool:
    """Whether the fall `decrease` of the cost, to `remaining`, exceeds that of a resonance fitted to noise at the best
    of `tested_lines` lines: chi-squared with 2 (p + m + 1) degrees of freedom. Residuals larger than the noise count as
    the noise."""
    output_count, input_count = lines.response.shape[1:]
    noise_scale = max(remaining / lines.response.size, 1.0)
    return bool(
        2 * decrease / noise_scale > chi2.isf(SIGNIFICANCE_LEVEL / tested_lines, 2 * (output_count + input_count + 1))
    )
