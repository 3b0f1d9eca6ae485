"""Detection thresholds of single effects: the strength from which they are named."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import compute_wilson_interval
from analysis.evaluation.blind_test.outcome import DETECTABLE, Outcome

SIZE_GROUPS = 10
"""Bins of the detection curve, with equally many cases each. By hand."""
LEAST_DRAWS = 3
"""Fewest draws for a line fit. By hand."""


@dataclass(frozen=True, slots=True)
class EffectDraws:
    """All draws of an effect with their outcomes by strength, and the strength from which an ideal observer detects
    it."""

    effect: str
    draws: tuple[tuple[float, str], ...]
    """Strength (0 to 1) and outcome: right, in the set, missed or invisible; weakest first."""
    ideal_threshold: float | None
    """Strength from which an ideal observer detects it; None where too few cases were drawn."""


@dataclass(frozen=True, slots=True)
class SizeGroup:
    """Detection rate of a group of effects of similar size, with Wilson's 95 % interval."""

    median_change: float
    """Median of its draws: what the effect changes of the readings, in units of the noise."""
    rate: float
    low: float
    high: float
    count: int


def make_detection_strips(singles: Sequence[Outcome]) -> tuple[EffectDraws, ...]:
    """The draws of each effect, by name. singles: outcomes with a single concealed effect."""
    names = sorted({single.names[0] for single in singles})
    strips = []
    for name in names:
        effect_singles = [single for single in singles if single.names[0] == name]
        draws = tuple(sorted((case.strengths[0], classify_outcome(case)) for case in effect_singles))
        strips.append(EffectDraws(name, draws, compute_ideal_threshold(effect_singles)))
    return tuple(strips)


def compute_ideal_threshold(draws: Sequence[Outcome]) -> float | None:
    """The strength (0 to 1) from which an ideal observer detects an effect, by a line fit: strength is the logarithm of
    the effect's parameter, and what it adds grows about as a power of that. None with fewer than `LEAST_DRAWS` draws,
    or where what is added does not grow."""
    points = [(draw.strengths[0], np.log(draw.adds)) for draw in draws if draw.adds > 0]
    strengths = [strength for strength, _ in points]
    if len(points) < LEAST_DRAWS or np.ptp(strengths) == 0:
        return None
    slope, intercept = np.polyfit(strengths, [log_change for _, log_change in points], 1)
    if slope <= 0:
        return None
    return float(np.clip((np.log(np.sqrt(DETECTABLE**2 - 1)) - intercept) / slope, 0.0, 1.0))


def classify_outcome(outcome: Outcome) -> str:
    """Class of an outcome with a concealed effect: "right", "in the set" (returned, but not right), "missed", or
    "invisible" (missed where it was not detectable)."""
    if outcome.is_correct:
        return "right"
    if outcome.names[0] in outcome.returned:
        return "in the set"
    return "missed" if outcome.detectable else "invisible"


def compute_rates_by_size(singles: Sequence[Outcome]) -> tuple[SizeGroup, ...]:
    """Detection rate in groups of equal count, the smallest effects first."""
    ordered = sorted(singles, key=lambda single: single.adds)
    groups = []
    for indices in np.array_split(np.arange(len(ordered)), min(SIZE_GROUPS, len(ordered))):
        group = [ordered[k] for k in indices]
        hits = sum(case.is_correct for case in group)
        median_change = float(np.median([max(case.adds, 1e-3) for case in group]))
        groups.append(
            SizeGroup(median_change, hits / len(group), *compute_wilson_interval(hits, len(group)), len(group))
        )
    return tuple(groups)
