"""From which strength on single effects are named."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.proof.outcome import DETECTABLE, Outcome
from analysis.evaluation.proof.share import wilson

PARTS = 10
LEAST_DRAWS = 3
"""Through so many a line is laid."""


@dataclass(frozen=True, slots=True)
class Strip:
    effect: str
    draws: tuple[tuple[float, str], ...]
    """Strength (0 to 1) and what became of it: right, in the set, missed or invisible; weakest first."""
    oracle: float | None
    """From which strength on an oracle sees it; None where too little is drawn to say."""


@dataclass(frozen=True, slots=True)
class Part:
    adds: float
    """Median of its draws: what the effect changes of the readings, in units of the noise."""
    right: float
    low: float
    high: float
    of: int


def detection_strips(singles: Sequence[Outcome]) -> tuple[Strip, ...]:
    names = sorted({single.names[0] for single in singles})
    found = []
    for name in names:
        own = [single for single in singles if single.names[0] == name]
        draws = tuple(sorted((each.strengths[0], what_became_of(each)) for each in own))
        found.append(Strip(name, draws, seen_from(own)))
    return tuple(found)


def seen_from(draws: Sequence[Outcome]) -> float | None:
    """The strength (0 to 1) from which on an oracle sees an effect: what it adds grows about as a power of its number,
    whose logarithm the strength is."""
    known = [(draw.strengths[0], np.log(draw.adds)) for draw in draws if draw.adds > 0]
    strengths = [strength for strength, _ in known]
    if len(known) < LEAST_DRAWS or np.ptp(strengths) == 0:
        return None
    slope, start = np.polyfit(strengths, [size for _, size in known], 1)
    if slope <= 0:
        return None
    return float(np.clip((np.log(np.sqrt(DETECTABLE**2 - 1)) - start) / slope, 0.0, 1.0))


def what_became_of(outcome: Outcome) -> str:
    if outcome.right:
        return "right"
    if outcome.names[0] in outcome.returned:
        return "in the set"
    return "missed" if outcome.detectable else "invisible"


def shares_by_size(singles: Sequence[Outcome]) -> tuple[Part, ...]:
    """In parts of equal count, the smallest effects first."""
    order = sorted(singles, key=lambda single: single.adds)
    found = []
    for part in np.array_split(np.arange(len(order)), min(PARTS, len(order))):
        drawn = [order[k] for k in part]
        hits = sum(each.right for each in drawn)
        size = float(np.median([max(each.adds, 1e-3) for each in drawn]))
        found.append(Part(size, hits / len(drawn), *wilson(hits, len(drawn)), len(drawn)))
    return tuple(found)
