"""Sums of one to three laws that explain a force along a measured motion: a beam search over cross-validated errors.

From the linear structure (mass, damping, stiffness) on, every structure in the beam is extended by each further law;
weights are least squares, nonlinear parameters of the best are refined, and the best `STRUCTURES_BEAM` are kept, while
each size is significantly better than the one before (`is_better`). The error of a structure is the sum over folds of
the squared force error with weights fitted to the other folds (`regression`). `simplest_structure` then selects, among
all structures, the fewest parameters at about the least error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.law import BaseTerms, Law, Scales, scales_of
from analysis.diagnosis.balance.laws import cogging_law, laws_of, likely_pitches
from analysis.diagnosis.balance.model_base import GivenBase, regression_beside_model, takes_enough
from analysis.diagnosis.balance.motion import Motion, NoMotionError
from analysis.diagnosis.balance.regression import (
    Regression,
    append_laws,
    fit_all_laws,
    keep_laws,
    regression_of,
    replace_law,
)
from analysis.diagnosis.settings import (
    FURTHER_LAW_ERRORS,
    FURTHER_LAW_GAIN,
    FURTHER_LAW_OF_ALL,
    FURTHER_LAW_OF_REST,
    MOST_SUMMED_LAWS,
    PLAINER_LEAVES,
    STRUCTURES_BEAM,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

REFINED = (0.8, 0.93, 1.075, 1.25)
"""Factors on a nonlinear parameter in one pass of a coordinate search."""
ROUNDS = 6
"""Largest number of steps of the coordinate search over the nonlinear parameters of one law."""


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """A sum of laws with its cross-validated errors."""

    laws: tuple[int, ...]
    """Indices in a regression's `laws`."""
    errors: FloatArray
    """(folds,): sums of squares."""

    @property
    def error(self) -> float:
        return float(self.errors.sum())


@dataclass(frozen=True, slots=True, eq=False)
class StructureSearch:
    """Result of the search for sums of laws."""

    regression: Regression
    """With refined laws."""
    linear: Structure
    best: Structure
    ranked: tuple[Structure, ...]
    """The best structure of each set of effects, of all sizes, the best first."""
    complete: bool
    """Whether the search was completed."""


def search_structures(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    without: frozenset[str],
    time_left: TimeBudget,
    beside: BaseTerms | GivenBase | None = None,
) -> StructureSearch:
    """Beam search for the sum of at most three laws with the least cross-validated error. without: effects that are
    left out. beside: None = mass, damping and stiffness alone. Raises NoMotionError where nothing can be fitted."""
    if not any(each.valid_samples(each.fit).any() for each in motions):
        raise NoMotionError("too few samples with motion are available for the fit")
    scales = [scales_of(motions, c, rotational) for c in range(len(motions[0].channels))]
    turns = any(each.turns for each in scales)
    held = {(law.key, law.numbers) for law in (beside.laws if isinstance(beside, BaseTerms) else ())}
    laws = [
        law for law in laws_of(motions, rotational) if law.effect not in without and (law.key, law.numbers) not in held
    ]
    if isinstance(beside, GivenBase):
        first = regression_beside_model(motions, axis, laws, beside)
        if not takes_enough(first, beside.least):
            alone = _linear_structure(first)
            return StructureSearch(first, alone, alone, (alone,), True)
    else:
        first = regression_of(motions, axis, laws, turns, beside)
    if "cogging" not in without:
        first = _add_cogging_laws(first, scales)
    linear = _linear_structure(first)
    first, ranked, best = _beam(first, linear, time_left)
    return StructureSearch(first, linear, best, tuple(sorted(ranked, key=lambda each: each.error)), time_left())


def _beam(first: Regression, linear: Structure, time_left: TimeBudget) -> tuple[Regression, list[Structure], Structure]:
    """The regression with its laws refined, the structures of all sizes, and the best."""
    beam, ranked, best = [linear], [linear], linear
    for _ in range(MOST_SUMMED_LAWS):
        if not time_left():
            break
        grown = _add_law_to_each(first, beam)
        if not grown:
            break
        first = refine_parameters(first, grown[:STRUCTURES_BEAM])
        grown = [replace(each, errors=first.cross_validated_errors(first.columns_of(each.laws))) for each in grown]
        ranked += grown
        beam = sorted(grown, key=lambda each: each.error)[:STRUCTURES_BEAM]
        if not is_better(best, beam[0]):
            break
        best = beam[0]
    return first, ranked, best


def is_better(plain: Structure, richer: Structure) -> bool:
    """Whether further laws are significant. With the errors p_i and r_i of the folds, the total must fall by
    `FURTHER_LAW_GAIN`, and any of three sums must exceed `FURTHER_LAW_ERRORS` standard errors: of p_i - r_i; of
    log(p_i / r_i), because an end stop that is reached in one fold makes the differences unequal; of p_i - r_i with the
    standard error of a ratio estimate, because an end stop that is reached in few folds gains nothing in others."""
    floor = 1e-12 * plain.error / len(plain.errors)
    shares = np.log(np.maximum(plain.errors, floor) / np.maximum(richer.errors, floor)) if floor > 0 else np.zeros(1)
    gains = plain.errors - richer.errors
    # Residuals of the gains about their ratio to the errors (Cochran, Sampling Techniques, 3rd ed., equation 6.4).
    about_ratio = gains - (1 - richer.error / max(plain.error, 1e-300)) * plain.errors
    agreed = _is_significant(gains, gains) or _is_significant(shares, shares) or _is_significant(gains, about_ratio)
    return richer.error < (1 - FURTHER_LAW_GAIN) * plain.error and agreed


def _is_significant(gains: FloatArray, residuals: FloatArray) -> bool:
    """Whether the sum of the gains exceeds `FURTHER_LAW_ERRORS` standard errors. residuals: gains less their mean."""
    standard_error = float(np.std(residuals, ddof=1) * np.sqrt(len(residuals))) if len(residuals) > 1 else np.inf
    return float(gains.sum()) > FURTHER_LAW_ERRORS * standard_error


def _linear_structure(regression: Regression) -> Structure:
    return Structure((), regression.cross_validated_errors(regression.columns_of(())))


def _add_law_to_each(regression: Regression, beam: Sequence[Structure]) -> list[Structure]:
    """Each structure with one more law: the best physical one of each set of effects, sorted by error."""
    found: dict[tuple[tuple[str, int], ...], Structure] = {}
    for structure in beam:
        held = {regression.laws[k].key for k in structure.laws}
        for number, law in enumerate(regression.laws):
            if law.key in held or any(_overlap(law.key, other) for other in held):
                continue
            laws = tuple(sorted((*structure.laws, number)))
            grown = Structure(laws, regression.cross_validated_errors(regression.columns_of(laws)))
            effects = tuple(sorted(regression.laws[k].key for k in laws))
            if (effects not in found or grown.error < found[effects].error) and _is_physical(regression, laws):
                found[effects] = grown
    return sorted(found.values(), key=lambda each: each.error)


SLIDING = (
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "position_dependent_friction", "drifting_friction"
)  # fmt: skip
"""Laws that share the column of dry friction: two of them on one motion would divide its level arbitrarily."""


def _overlap(first: tuple[str, int], other: tuple[str, int]) -> bool:
    return first[1] == other[1] and first[0] in SLIDING and other[0] in SLIDING


def _is_physical(regression: Regression, laws: Sequence[int]) -> bool:
    return all(values is not None for values in values_of(regression, laws))


def values_of(regression: Regression, laws: Sequence[int]) -> list[dict[str, float] | None]:
    """Parameters of each law, all fitted together; None where the signs of its weights are not physical."""
    columns = regression.columns_of(laws)
    weights = regression.weights(columns)
    mass = float(weights[regression.beside.own]) if regression.mass is None else regression.mass
    begin, found = regression.base, []
    for number in laws:
        law, place = regression.laws[number], regression.places[number]
        count = place.stop - place.start
        found.append(law.values(weights[begin : begin + count], law.numbers, mass))
        begin += count
    return found


def _add_cogging_laws(first: Regression, scales: Sequence[Scales]) -> Regression:
    """The regression with cogging at the pitches in the residual without laws, and in that with the best one."""
    first = _add_pitches(first, scales, ())
    grown = _add_law_to_each(first, [_linear_structure(first)])
    return _add_pitches(first, scales, grown[0].laws) if grown else first


def _add_pitches(regression: Regression, scales: Sequence[Scales], laws: Sequence[int]) -> Regression:
    """The regression with cogging at the pitches that the residual of these laws shows."""
    residuals = regression.remainder(regression.columns_of(laws))
    more = [
        cogging_law(c, pitch, of)
        for c, of in enumerate(scales)
        for pitch in likely_pitches(regression.motions, residuals, c, of)
    ]
    return append_laws(regression, more) if more else regression


def refine_parameters(regression: Regression, structures: Sequence[Structure]) -> Regression:
    """The regression with the nonlinear parameters of the structures' laws moved to the least cross-validated error,
    each law in the first structure that has it."""
    seen: set[int] = set()
    for structure in structures:
        for place, number in enumerate(structure.laws):
            if number not in seen and regression.laws[number].bounded:
                seen.add(number)
                fitted = replace(keep_laws(regression, structure.laws), test=())  # only the parameters are used
                moved = replace_law(regression, number, _refine_law(fitted, place))
                regression = moved or regression
    return regression


def _refine_law(alone: Regression, place: int) -> Law:
    """One law of a structure, refined by steps to its best neighbour. alone: with the structure's laws alone."""
    laws = tuple(range(len(alone.laws)))
    best = float(alone.cross_validated_errors(alone.columns_of(laws)).sum())
    for _ in range(ROUNDS):
        tried = []
        for there in _neighbours(alone.laws[place]):
            other = replace_law(alone, place, there)
            if other is not None and _is_physical(other, laws):
                tried.append((float(other.cross_validated_errors(other.columns_of(laws)).sum()), other))
        if not tried or min(tried, key=lambda each: each[0])[0] >= best * (1 - 1e-4):
            break
        best, alone = min(tried, key=lambda each: each[0])
    return alone.laws[place]


def _neighbours(law: Law) -> Iterator[Law]:
    """The law with each nonlinear parameter moved by each factor, within its bounds."""
    for place, (low, high) in enumerate(law.bounded):
        # Over a travel of many pitches, the phase of cogging turns by a multiple of a pitch's relative change.
        share = 0.05 if law.effect == "cogging" else 1.0
        for factor in REFINED:
            value = law.numbers[place] * (1 + (factor - 1) * share)
            if low <= value <= high:
                numbers = (*law.numbers[:place], float(value), *law.numbers[place + 1 :])
                yield replace(law, numbers=numbers)


WIDTH_ALONE = ("coulomb_friction", "condition_dependent_friction")
"""Laws whose only nonlinear parameter is the width of a smoothed sign."""


def simplest_structure(search: StructureSearch) -> Structure:
    """The structure with the fewest parameters at about the least error, extended by laws that explain most of the
    remaining error."""
    allowed = search.best.error + PLAINER_LEAVES * (search.linear.error - search.best.error)
    enough = [each for each in search.ranked if each.error <= allowed]
    plain = min(
        enough, key=lambda each: (count_parameters(search.regression, each.laws), each.error), default=search.linear
    )
    least_error = fit_all_laws(search.regression, range(search.regression.columns[0].shape[1]))[0]
    while (richer := _add_further_laws(search, plain, least_error)) is not None:
        plain = richer
    return plain


def _add_further_laws(search: StructureSearch, plain: Structure, least_error: float) -> Structure | None:
    """The structure with further laws that explain most of what all laws (least_error) could; None = none such."""
    allowed = plain.error - max(FURTHER_LAW_OF_REST * (plain.error - least_error), FURTHER_LAW_OF_ALL * plain.error)
    more = [
        each
        for each in search.ranked
        if _extends(search.regression, plain.laws, each.laws) and each.error <= allowed and is_better(plain, each)
    ]
    return min(more, key=lambda each: (count_parameters(search.regression, each.laws), each.error), default=None)


def _extends(regression: Regression, plain: Sequence[int], richer: Sequence[int]) -> bool:
    """Whether `richer` contains all laws of `plain` and more; Coulomb friction may be replaced by friction that depends
    on a condition."""
    covered, known = set(richer), {regression.laws[number].key for number in richer}
    for number in plain:
        effect, channel = regression.laws[number].key
        if effect == "coulomb_friction" and ("condition_dependent_friction", channel) in known:
            covered.add(number)
    return set(plain) < covered


def count_parameters(regression: Regression, laws: Sequence[int]) -> int:
    """Number of parameters of these laws. The width of the smoothed sign of dry friction is not counted, and a gravity
    torque counts as a parameter less, because it replaces the spring."""
    count = 0
    for number in laws:
        law, place = regression.laws[number], regression.places[number]
        count += place.stop - place.start + (0 if law.effect in WIDTH_ALONE else len(law.numbers))
        count -= law.effect == "gravity_torque"
    return count
