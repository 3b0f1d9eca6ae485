"""Detection of single effects in a blind test: outcomes and an ideal observer's threshold by the strength of each
effect, and the rate of right names by the size of the effects."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import compute_wilson_interval
from analysis.evaluation.blind_test.outcome import DETECTABLE_ERROR, Outcome

SIZE_GROUP_COUNT = 10
"""Largest number of groups of the detection curve, with about equally many cases each. Chosen."""
LEAST_LINE_DRAWS = 3
"""Least number of draws for the line fit of `compute_ideal_threshold`. Chosen: one more than a line needs."""


@dataclass(frozen=True, slots=True)
class EffectDraws:
    """All draws of an effect with their outcomes by strength, and the strength from which an ideal observer detects
    it."""

    effect: str
    draws: tuple[tuple[float, str], ...]
    """Strength (0 to 1) and outcome: right, in the set, missed or invisible; weakest first."""
    ideal_threshold: float | None
    """Of `compute_ideal_threshold`; None where the draws do not determine it."""


@dataclass(frozen=True, slots=True)
class SizeGroup:
    """Detection rate of a group of effects of similar size, with Wilson's 95 % interval."""

    median_change: float
    """Median over its cases of the change of the readings by the effect (`Outcome.adds`), in units of the noise."""
    rate: float
    """Share of its cases whose effect, and no other, is named."""
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""
    count: int
    """Number of its cases."""


def collect_effect_draws(singles: Sequence[Outcome]) -> tuple[EffectDraws, ...]:
    """Collect the draws of each effect, in the order of the effects' names. singles: outcomes with a single concealed
    effect."""
    names = sorted({single.names[0] for single in singles})
    draws_by_effect = []
    for name in names:
        effect_singles = [single for single in singles if single.names[0] == name]
        draws = tuple(sorted((case.strengths[0], classify_outcome(case)) for case in effect_singles))
        draws_by_effect.append(EffectDraws(name, draws, compute_ideal_threshold(effect_singles)))
    return tuple(draws_by_effect)


def compute_ideal_threshold(draws: Sequence[Outcome]) -> float | None:
    """Compute the strength, limited to 0 to 1, from which an ideal observer detects an effect
    (`Outcome.is_seen_by_ideal_observer`) by a line fit to the logarithm of its change of the readings, `Outcome.adds`:
    strength is the logarithm of the effect's parameter, and the change grows about as a power of that parameter. draws:
    of one effect. None with fewer than `LEAST_LINE_DRAWS` draws that change the readings, of one strength only, or
    where the change does not grow."""
    strength_changes = [(draw.strengths[0], np.log(draw.adds)) for draw in draws if draw.adds > 0]
    strengths = [strength for strength, _ in strength_changes]
    if len(strength_changes) < LEAST_LINE_DRAWS or np.ptp(strengths) == 0:
        return None
    slope, intercept = np.polyfit(strengths, [log_change for _, log_change in strength_changes], 1)
    if slope <= 0:
        return None
    return float(np.clip((np.log(np.sqrt(DETECTABLE_ERROR**2 - 1)) - intercept) / slope, 0.0, 1.0))


def classify_outcome(outcome: Outcome) -> str:
    """Classify an outcome with a single concealed effect: "right", "in the set" (returned, but not right), "missed", or
    "invisible" (missed where it was not detectable)."""
    if outcome.is_correct:
        return "right"
    if outcome.names[0] in outcome.returned:
        return "in the set"
    return "missed" if outcome.detectable else "invisible"


def compute_rates_by_size(singles: Sequence[Outcome]) -> tuple[SizeGroup, ...]:
    """Compute the detection rate in groups of about equal count, the smallest effects first. singles: at least one
    outcome."""
    singles_by_size = sorted(singles, key=lambda single: single.adds)
    groups = []
    for indices in np.array_split(np.arange(len(singles_by_size)), min(SIZE_GROUP_COUNT, len(singles_by_size))):
        group = [singles_by_size[k] for k in indices]
        hits = sum(case.is_correct for case in group)
        # Changes below a thousandth of the noise are raised to it, so that the median fits on a logarithmic axis.
        median_change = float(np.median([max(case.adds, 1e-3) for case in group]))
        groups.append(
            SizeGroup(median_change, hits / len(group), *compute_wilson_interval(hits, len(group)), len(group))
        )
    return tuple(groups)
