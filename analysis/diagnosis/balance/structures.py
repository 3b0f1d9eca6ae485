"""Sums of one to three laws that explain a force along a measured motion: a beam search over folds' errors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.given_base import GivenBase, based_on, takes_enough
from analysis.diagnosis.balance.law import Beside, Law, Scales, scales_of
from analysis.diagnosis.balance.laws import laws_of, likely_pitches, pitched
from analysis.diagnosis.balance.motion import Motion, NoMotionError
from analysis.diagnosis.balance.regression import Regression, of_laws, regression_of, with_law, with_laws
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

MOST_LAWS = 3
BEAM = 5
"""Structures of each size that are taken further."""
NOTICED = 0.02
"""Share of the error power that a further law must take, over the folds; and by the folds' agreement in it:"""
SURE = 2.0
"""standard errors of the folds' mean gain, or of their mean logarithmic gain."""
REFINED = (0.8, 0.93, 1.075, 1.25)
"""Factors by which nonlinear numbers are moved, as long as that helps."""
ROUNDS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """Laws by their place in a regression, and each fold's sum of squares."""

    laws: tuple[int, ...]
    errors: FloatArray

    @property
    def error(self) -> float:
        return float(self.errors.sum())


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    regression: Regression
    """With the final structures' own laws, refined, among its laws."""
    linear: Structure
    best: Structure
    ranked: tuple[Structure, ...]
    """The best structure of each set of effects, of all sizes, the best first."""
    complete: bool
    """The search was not ended early."""


def search_structures(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    without: frozenset[str],
    time_left: TimeBudget,
    beside: Beside | GivenBase | None = None,
) -> Searched:
    """without: effects that are not to be considered. beside: None = mass, damping and stiffness alone."""
    if not any(each.kept(each.fit).any() for each in motions):
        raise NoMotionError("too little of the motion is to be fitted to")
    scales = [scales_of(motions, c, rotational) for c in range(len(motions[0].channels))]
    turns = any(each.turns for each in scales)
    held = {(law.key, law.numbers) for law in (beside.laws if isinstance(beside, Beside) else ())}
    laws = [
        law for law in laws_of(motions, rotational) if law.effect not in without and (law.key, law.numbers) not in held
    ]
    if isinstance(beside, GivenBase):
        first = based_on(motions, axis, laws, beside)
        if not takes_enough(first, beside.least):
            alone = _linear(first)
            return Searched(first, alone, alone, (alone,), True)
    else:
        first = regression_of(motions, axis, laws, turns, beside)
    if "cogging" not in without:
        first = _pitched(first, scales)
    linear = _linear(first)
    first, ranked, best = _beam(first, linear, time_left)
    return Searched(first, linear, best, tuple(sorted(ranked, key=lambda each: each.error)), time_left())


def _beam(first: Regression, linear: Structure, time_left: TimeBudget) -> tuple[Regression, list[Structure], Structure]:
    """Of all sizes; and with the laws refined."""
    beam, ranked, best = [linear], [linear], linear
    for _ in range(MOST_LAWS):
        if not time_left():
            break
        grown = _grown(first, beam)
        if not grown:
            break
        first = refined(first, grown[:BEAM])
        grown = [replace(each, errors=first.crossed(first.chosen(each.laws))) for each in grown]
        ranked += grown
        beam = sorted(grown, key=lambda each: each.error)[:BEAM]
        if not better(best, beam[0]):
            break
        best = beam[0]
    return first, ranked, best


def better(plain: Structure, richer: Structure) -> bool:
    """Whether the folds agree that more laws are worth it: by what each gains, or by the share of its own error, for
    a stop that is met in one fold only, or one swing that is larger than all others, makes the gains unlike."""
    floor = 1e-12 * plain.error / len(plain.errors)
    shares = np.log(np.maximum(plain.errors, floor) / np.maximum(richer.errors, floor)) if floor > 0 else np.zeros(1)
    agreed = any(_sure(gains) for gains in (plain.errors - richer.errors, shares))
    return richer.error < (1 - NOTICED) * plain.error and agreed


def _sure(gains: FloatArray) -> bool:
    spread = float(np.std(gains, ddof=1) * np.sqrt(len(gains))) if len(gains) > 1 else np.inf
    return float(gains.sum()) > SURE * spread


def _linear(regression: Regression) -> Structure:
    return Structure((), regression.crossed(regression.chosen(())))


def _grown(regression: Regression, beam: Sequence[Structure]) -> list[Structure]:
    """Each with one law more, the best of each set of effects, the best first."""
    found: dict[tuple[tuple[str, int], ...], Structure] = {}
    for structure in beam:
        held = {regression.laws[k].key for k in structure.laws}
        for number, law in enumerate(regression.laws):
            if law.key in held or any(_overlap(law.key, other) for other in held):
                continue
            laws = tuple(sorted((*structure.laws, number)))
            grown = Structure(laws, regression.crossed(regression.chosen(laws)))
            name = tuple(sorted(regression.laws[k].key for k in laws))
            if (name not in found or grown.error < found[name].error) and _possible(regression, laws):
                found[name] = grown
    return sorted(found.values(), key=lambda each: each.error)


SLIDING = (
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "position_dependent_friction", "drifting_friction"
)  # fmt: skip
"""Laws that share the column of dry friction: two of them on one motion would divide its level by chance."""


def _overlap(first: tuple[str, int], other: tuple[str, int]) -> bool:
    return first[1] == other[1] and first[0] in SLIDING and other[0] in SLIDING


def _possible(regression: Regression, laws: Sequence[int]) -> bool:
    return all(values is not None for values in values_of(regression, laws))


def values_of(regression: Regression, laws: Sequence[int]) -> list[dict[str, float] | None]:
    """Each law's numbers with all of them fitted together; None where its signs are not physics."""
    columns = regression.chosen(laws)
    weights = regression.weights(columns)
    mass = float(weights[regression.beside.own]) if regression.mass is None else regression.mass
    begin, found = regression.base, []
    for number in laws:
        law, place = regression.laws[number], regression.places[number]
        count = place.stop - place.start
        found.append(law.values(weights[begin : begin + count], law.numbers, mass))
        begin += count
    return found


def _pitched(first: Regression, scales: Sequence[Scales]) -> Regression:
    """With the pitches that show before any law, and beside the best one."""
    first = _with_pitches(first, scales, ())
    grown = _grown(first, [_linear(first)])
    return _with_pitches(first, scales, grown[0].laws) if grown else first


def _with_pitches(regression: Regression, scales: Sequence[Scales], laws: Sequence[int]) -> Regression:
    """And with the pitches that the remainder of some laws shows."""
    left = regression.remainder(regression.chosen(laws))
    more = [
        pitched(c, pitch, of)
        for c, of in enumerate(scales)
        for pitch in likely_pitches(regression.motions, left, c, of)
    ]
    return with_laws(regression, more) if more else regression


def refined(regression: Regression, structures: Sequence[Structure]) -> Regression:
    """The nonlinear numbers of the structures' laws moved to where the folds' errors are least, each law in the first
    structure that has it."""
    seen: set[int] = set()
    for structure in structures:
        for place, number in enumerate(structure.laws):
            if number not in seen and regression.laws[number].bounded:
                seen.add(number)
                moved = with_law(regression, number, _moved(of_laws(regression, structure.laws), place))
                regression = moved or regression
    return regression


def _moved(alone: Regression, place: int) -> Law:
    laws = tuple(range(len(alone.laws)))
    best = float(alone.crossed(alone.chosen(laws)).sum())
    for _ in range(ROUNDS):
        tried = []
        for there in _neighbours(alone.laws[place]):
            other = with_law(alone, place, there)
            if other is not None and _possible(other, laws):
                tried.append((float(other.crossed(other.chosen(laws)).sum()), other))
        if not tried or min(tried, key=lambda each: each[0])[0] >= best * (1 - 1e-4):
            break
        best, alone = min(tried, key=lambda each: each[0])
    return alone.laws[place]


def _neighbours(law: Law) -> Iterator[Law]:
    for place, (low, high) in enumerate(law.bounded):
        fine = law.effect == "cogging"
        for factor in REFINED:
            value = law.numbers[place] * (1 + (factor - 1) * (0.05 if fine else 1.0))
            if low <= value <= high:
                numbers = (*law.numbers[:place], float(value), *law.numbers[place + 1 :])
                yield replace(law, numbers=numbers)
