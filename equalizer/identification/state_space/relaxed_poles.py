"""Relaxation of the decay bound for poles whose data demand it, by a likelihood-ratio test.

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
    MOST_STEPS,
    Candidate,
    bins_about,
    choose_best,
    refine_candidate,
)
from equalizer.identification.state_space.refinement import FittedForm, complete_form, refine
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.stable_poles import Radius, largest_radius, stabilise_blocks
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.signals.signal import FloatArray

RESOLVED_PERIODS = 4.0
"""Longest resolvable time constant, in periods (1 / line spacing). The flanks of a resonance that is narrower than the
line spacing still determine its decay, up to the point where they equal those of an undamped mode. Heuristic."""
FALSE_ALARM = 1e-3
"""Significance level: probability that noise alone relaxes a pole."""
RELAXED = ", poles relaxed"
"""Suffix of a candidate's name."""

Search = Callable[[IdentificationSettings], Sequence[Candidate]]
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
    """Candidate after the likelihood-ratio test of the decay bound; result of `relax_poles`."""

    candidate: Candidate
    """The candidate with its poles relaxed; the given candidate where no pole needs a longer decay."""
    bound_costs: bool
    """Whether a pole is at the bound although the fit would improve beyond noise without it."""


def relax_poles(
    chosen: Candidate, search: Search, lines: WeightedLines, settings: IdentificationSettings
) -> RelaxedFit:
    """Relax the decay bound for the poles of a candidate that need it, up to `longest_resolved_decay_s`. Where the
    settings state `longest_decay_s`, the candidate is returned unchanged. search: finds candidates under the relaxed
    bound."""
    limit_s = longest_resolved_decay_s(lines)
    if limit_s <= settings.decay_s:
        return RelaxedFit(chosen, bound_costs=False)
    limit = largest_radius(limit_s, lines.sample_rate_hz)
    bound_costs = _bound_costs(chosen, limit, lines, settings)
    if settings.longest_decay_s is not None or not (bound_costs or _has_outlying_line(chosen, lines)):
        return RelaxedFit(chosen, bound_costs)
    relaxed_settings = replace(settings, longest_decay_s=limit_s)
    relaxed = choose_best(
        [*search(relaxed_settings), refine_candidate(chosen.name, chosen.fitted, lines, settings, limit)]
    )
    tightened = _tighten_poles(relaxed, lines, settings, limit)
    is_accepted = tightened.sane >= chosen.sane and _lowers_cost(tightened, chosen, lines)
    return RelaxedFit(tightened, bound_costs=False) if is_accepted else RelaxedFit(chosen, bound_costs)


def retighten(candidate: Candidate, lines: WeightedLines, settings: IdentificationSettings) -> Candidate:
    """Refine a candidate from another estimate of the same device on these lines; of its relaxed poles, those that are
    no longer needed return to the ordinary bound."""
    refined = refine_candidate(candidate.name, candidate.fitted, lines, settings, candidate.radius)
    return _tighten_poles(refined, lines, settings, float(np.max(candidate.radius)))


def slow_poles(chosen: Candidate, bound_s: float, sample_rate_hz: float) -> tuple[SlowPole, ...]:
    """Poles of a candidate with a time constant above bound_s, slowest first."""
    form = chosen.fitted.form
    first, second = form.poles.reshape(2, -1)
    slower = np.where(np.abs(first) >= np.abs(second), first, second)
    slow = slower[np.abs(slower) > largest_radius(bound_s, sample_rate_hz) * (1 + 1e-9)]
    continuous = np.log(slow) * sample_rate_hz
    natural_rad_s = np.abs(continuous)
    poles = [
        SlowPole(float(rad_s / (2 * np.pi)), float(-1 / pole.real), float(-pole.real / rad_s))
        for pole, rad_s in zip(continuous, natural_rad_s, strict=True)
    ]
    return tuple(sorted(poles, key=lambda pole: -pole.decay_s))


def longest_resolved_decay_s(lines: WeightedLines) -> float:
    """Time constant (s) above which these lines do not distinguish a decay from an undamped mode; 0 for a single
    line."""
    steps = np.diff(np.unique(lines.frequency_hz))
    return RESOLVED_PERIODS / float(np.median(steps)) if len(steps) else 0.0


def is_at_bound(fitted: FittedForm, radius: Radius) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(blocks,): whether the larger pole of a block lies on the radius, to within 1e-7 of it."""
    return np.asarray(_pole_radii(fitted) >= radius * (1 - 1e-7))


def _pole_radii(fitted: FittedForm) -> FloatArray:
    """(blocks,): magnitude of the larger pole."""
    poles = np.abs(fitted.form.poles).reshape(2, -1)
    return np.asarray(poles.max(axis=0))


def _bound_costs(chosen: Candidate, limit: float, lines: WeightedLines, settings: IdentificationSettings) -> bool:
    """Whether lifting the bound for the poles at it lowers the cost by more than noise does, judged from a limited
    number of refinement steps."""
    at_bound = is_at_bound(chosen.fitted, chosen.radius)
    if not at_bound.any():
        return False
    bins = bins_about(chosen.fitted, lines, settings)
    radii = np.where(at_bound, limit, chosen.radius)
    relaxed_cost = bins.cost(refine(chosen.fitted.form, bins, radii, MOST_STEPS[-1]).response(bins.z))
    if not _exceeds_noise(bins.cost(chosen.fitted.response(bins.z)) - relaxed_cost, relaxed_cost, bins, len(lines)):
        return False
    # A fall of the cost that further steps achieve with the bound, too, is not counted.
    bounded_cost = bins.cost(refine(chosen.fitted.form, bins, chosen.radius, MOST_STEPS[-1]).response(bins.z))
    return _exceeds_noise(bounded_cost - relaxed_cost, relaxed_cost, bins, len(lines))


def _has_outlying_line(chosen: Candidate, lines: WeightedLines) -> bool:
    """Whether the residual of a line is an outlier, as from a resonance so narrow that no pole moved there in the
    search."""
    line_costs = (np.abs(lines.weight * (chosen.fitted.response(lines.z) - lines.response)) ** 2).sum(axis=(1, 2))
    entries = lines.response[0].size
    return bool(2 * line_costs.max() / max(chosen.cost, 1.0) > chi2.isf(FALSE_ALARM / len(lines), 2 * entries))


def _tighten_poles(
    relaxed: Candidate, lines: WeightedLines, settings: IdentificationSettings, limit: float
) -> Candidate:
    """Return poles to the ordinary bound, slowest first, where that raises the cost by no more than noise would."""
    ordinary = largest_radius(settings.decay_s, lines.sample_rate_hz)
    sizes, entries = _pole_radii(relaxed.fitted), lines.response.size
    name = f"{relaxed.name.removesuffix(RELAXED)}{RELAXED}"
    tightened = replace(relaxed, name=name, radius=np.where(sizes > ordinary, limit, ordinary))
    for block in [int(k) for k in np.argsort(-sizes) if sizes[k] > ordinary]:
        radii = np.array(tightened.radius)
        radii[block] = ordinary
        form = tightened.fitted.form
        a, b = stabilise_blocks(form.a, form.b, radii)
        trial = refine_candidate(name, complete_form(replace(form, a=a, b=b), lines), lines, settings, radii)
        increase = entries * (trial.cost - relaxed.cost)
        if trial.sane and not _exceeds_noise(increase, entries * relaxed.cost, lines, len(lines)):
            tightened = trial
    return tightened


def _lowers_cost(tightened: Candidate, chosen: Candidate, lines: WeightedLines) -> bool:
    """Whether a pole is still relaxed, and the cost fell by more than noise alone explains."""
    entries = lines.response.size
    decrease = entries * (chosen.cost - tightened.cost)
    return bool(np.any(tightened.radius > np.min(tightened.radius))) and _exceeds_noise(
        decrease, entries * tightened.cost, lines, len(lines)
    )


def _exceeds_noise(decrease: float, remaining: float, lines: WeightedLines, tested_lines: int) -> bool:
    """Whether the fall `decrease` of the cost, to `remaining`, exceeds that of a resonance fitted to noise at the best
    of `tested_lines` lines: chi-squared with 2 (p + m + 1) degrees of freedom. Residuals larger than the noise count as
    the noise."""
    p, m = lines.response.shape[1:]
    scale = max(remaining / lines.response.size, 1.0)
    return bool(2 * decrease / scale > chi2.isf(FALSE_ALARM / tested_lines, 2 * (p + m + 1)))
