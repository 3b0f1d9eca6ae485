"""Relaxation of the decay bound for poles whose data demand it, by a likelihood-ratio test.

A pole at the bound is either superfluous, because the order is higher than needed, and then costs nothing there, or it
represents a resonance with a longer decay. The likelihood ratio decides: the fall of the cost when the bound is lifted,
compared with that from noise alone at the best of all lines (chi-squared, Bonferroni over the lines).
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

PERIODS_TOLD = 4.0
"""Longest decay over the period (the inverse of the step from line to line): a resonance narrower than the line spacing
is still determined by the flanks on both sides of it, until they, too, equal those of an undamped mode."""
FALSE_ALARM = 1e-3
"""Probability that noise alone relaxes a pole (significance level)."""
RELAXED = ", poles relaxed"

Search = Callable[[IdentificationSettings], Sequence[Candidate]]
"""Search for candidates from new starting models, under the given settings."""


@dataclass(frozen=True, slots=True)
class SlowPole:
    """A pole with a longer decay than the ordinary bound allows."""

    frequency_hz: float
    decay_s: float
    """Time constant in seconds."""
    damping_ratio: float


@dataclass(frozen=True, slots=True, eq=False)
class RelaxedFit:
    """Candidate after the likelihood-ratio test of the decay bound; result of `relax_poles`."""

    candidate: Candidate
    """The candidate with its poles relaxed; the given one where no pole needs a longer decay."""
    bound_costs: bool
    """Whether a pole is at the bound although the fit would improve beyond noise without it."""


def relax_poles(
    chosen: Candidate, search: Search, lines: WeightedLines, settings: IdentificationSettings
) -> RelaxedFit:
    """Relax the poles of a candidate that need it; a bound that the settings state is kept."""
    limit_s = longest_resolved_decay_s(lines)
    if limit_s <= settings.decay_s:
        return RelaxedFit(chosen, bound_costs=False)
    limit = largest_radius(limit_s, lines.sample_rate_hz)
    costs = _bound_costs(chosen, limit, lines, settings)
    if settings.longest_decay_s is not None or not (costs or _has_outlying_line(chosen, lines)):
        return RelaxedFit(chosen, costs)
    freer = replace(settings, longest_decay_s=limit_s)
    found = choose_best([*search(freer), refine_candidate(chosen.name, chosen.fitted, lines, settings, limit)])
    again = _tighten_poles(found, lines, settings, limit)
    taken = again.sane >= chosen.sane and _is_better(again, chosen, lines)
    return RelaxedFit(again, bound_costs=False) if taken else RelaxedFit(chosen, costs)


def retighten(near: Candidate, lines: WeightedLines, settings: IdentificationSettings) -> Candidate:
    """Refine a candidate of another estimate of the same device, and keep of its relaxed poles those still needed."""
    again = refine_candidate(near.name, near.fitted, lines, settings, near.radius)
    return _tighten_poles(again, lines, settings, float(np.max(near.radius)))


def slow_poles(chosen: Candidate, bound_s: float, sample_rate_hz: float) -> tuple[SlowPole, ...]:
    """Poles of a candidate beyond the bound, slowest first."""
    form = chosen.fitted.form
    first, second = form.poles.reshape(2, -1)
    slower = np.where(np.abs(first) >= np.abs(second), first, second)
    beyond = slower[np.abs(slower) > largest_radius(bound_s, sample_rate_hz) * (1 + 1e-9)]
    continuous = np.log(beyond) * sample_rate_hz
    natural = np.abs(continuous)
    found = [
        SlowPole(float(size / (2 * np.pi)), float(-1 / pole.real), float(-pole.real / size))
        for pole, size in zip(continuous, natural, strict=True)
    ]
    return tuple(sorted(found, key=lambda pole: -pole.decay_s))


def longest_resolved_decay_s(lines: WeightedLines) -> float:
    """Time constant in seconds above which these lines do not distinguish a decay from an undamped mode."""
    steps = np.diff(np.unique(lines.frequency_hz))
    return PERIODS_TOLD / float(np.median(steps)) if len(steps) else 0.0


def is_at_bound(found: FittedForm, radius: Radius) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(blocks,): whether a block's larger pole lies on the radius."""
    return np.asarray(_pole_radii(found) >= radius * (1 - 1e-7))


def _pole_radii(found: FittedForm) -> FloatArray:
    """(blocks,): magnitude of the larger pole."""
    poles = np.abs(found.form.poles).reshape(2, -1)
    return np.asarray(poles.max(axis=0))


def _bound_costs(chosen: Candidate, limit: float, lines: WeightedLines, settings: IdentificationSettings) -> bool:
    """Whether the bound costs more than noise, for the poles on it: tested by a few steps without it."""
    on = is_at_bound(chosen.fitted, chosen.radius)
    if not on.any():
        return False
    bins = bins_about(chosen.fitted, lines, settings)
    loose = np.where(on, limit, chosen.radius)
    after = bins.cost(refine(chosen.fitted.form, bins, loose, MOST_STEPS[-1]).response(bins.z))
    if not _exceeds_noise(bins.cost(chosen.fitted.response(bins.z)) - after, after, bins, len(lines)):
        return False
    # The gain of further steps with the bound is not counted.
    held = bins.cost(refine(chosen.fitted.form, bins, chosen.radius, MOST_STEPS[-1]).response(bins.z))
    return _exceeds_noise(held - after, after, bins, len(lines))


def _has_outlying_line(chosen: Candidate, lines: WeightedLines) -> bool:
    """Whether the residual of a line is an outlier: a resonance so narrow that no pole moved there."""
    left = (np.abs(lines.weight * (chosen.fitted.response(lines.z) - lines.response)) ** 2).sum(axis=(1, 2))
    entries = lines.response[0].size
    return bool(2 * left.max() / max(chosen.cost, 1.0) > chi2.isf(FALSE_ALARM / len(lines), 2 * entries))


def _tighten_poles(free: Candidate, lines: WeightedLines, settings: IdentificationSettings, limit: float) -> Candidate:
    """Return poles to the ordinary bound, slowest first, where that costs no more than noise."""
    ordinary = largest_radius(settings.decay_s, lines.sample_rate_hz)
    sizes, entries = _pole_radii(free.fitted), lines.response.size
    name = f"{free.name.removesuffix(RELAXED)}{RELAXED}"
    found = replace(free, name=name, radius=np.where(sizes > ordinary, limit, ordinary))
    for block in [int(k) for k in np.argsort(-sizes) if sizes[k] > ordinary]:
        radii = np.array(found.radius)
        radii[block] = ordinary
        form = found.fitted.form
        a, b = stabilise_blocks(form.a, form.b, radii)
        tried = refine_candidate(name, complete_form(replace(form, a=a, b=b), lines), lines, settings, radii)
        lost = entries * (tried.cost - free.cost)
        if tried.sane and not _exceeds_noise(lost, entries * free.cost, lines, len(lines)):
            found = tried
    return found


def _is_better(again: Candidate, chosen: Candidate, lines: WeightedLines) -> bool:
    entries = lines.response.size
    gained = entries * (chosen.cost - again.cost)
    return bool(np.any(again.radius > np.min(again.radius))) and _exceeds_noise(
        gained, entries * again.cost, lines, len(lines)
    )


def _exceeds_noise(gained: float, left: float, lines: WeightedLines, tried: int) -> bool:
    """Whether the fall of the cost to `left` exceeds that of a resonance fitted to noise at the best of `tried` lines.
    Where residuals exceed the noise, they count as the noise."""
    p, m = lines.response.shape[1:]
    scale = max(left / lines.response.size, 1.0)
    return bool(2 * gained / scale > chi2.isf(FALSE_ALARM / tried, 2 * (p + m + 1)))
