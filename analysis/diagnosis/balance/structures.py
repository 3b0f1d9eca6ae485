"""Beam search for sums of one to three laws that explain a force along a measured motion.

Each structure in the beam, first the base alone, is extended by each further law (weights by least squares); nonlinear
parameters of the best are refined, and the best `STRUCTURES_BEAM` are kept, as long as each size improves
significantly. The error of a structure is the sum over folds of the squared force error with weights fitted to the
other folds. `search_structures` runs the search, `choose_simplest_structure` selects the result.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from analysis.diagnosis.balance.change_laws import append_laws, copy_columns, keep_laws, overwrite_law, try_law
from analysis.diagnosis.balance.given_model_base import GivenModelBase, build_regression_with_model, can_laws_explain
from analysis.diagnosis.balance.judged_law import SIMULATED_AS
from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS
from analysis.diagnosis.balance.laws.law import BaseTerms, Law, Scales, measure_scales
from analysis.diagnosis.balance.laws.motion_laws import find_likely_pitches, make_cogging_law, make_laws
from analysis.diagnosis.balance.motion import Motion, NoMotionError
from analysis.diagnosis.balance.regression import Regression, build_regression, fit_all_laws
from analysis.diagnosis.limits import (
    FURTHER_LAW_ERRORS,
    FURTHER_LAW_EXCESS,
    FURTHER_LAW_GAIN,
    FURTHER_LAW_SHARE,
    MOST_SUMMED_LAWS,
    SIMPLER_SHORTFALL,
    STRUCTURES_BEAM,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

STEP_FACTORS = (0.8, 0.93, 1.075, 1.25)
"""Factors on a nonlinear parameter in one pass of a coordinate search; chosen by hand."""
STEP_SHARES = {"cogging": (0.05,), "end_stop": (1.0, 0.2), "contact_beyond_position": (1.0, 0.2)}
"""By law, the shares of these steps in the passes, first coarse and then fine; for other laws 1. Chosen by hand: over a
travel of many pitches, the phase of cogging turns by a multiple of a pitch's relative change; a contact that is off by
a step leaves a force that a further law seems to explain."""
MOST_PASSES = 6
"""Largest number of passes of each kind in the coordinate search over the nonlinear parameters of one law; chosen by
hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """A sum of laws with its cross-validated errors."""

    laws: tuple[int, ...]
    """Indices in a regression's `laws`."""
    errors: FloatArray  # (folds,): sums of squares

    @property
    def error(self) -> float:
        """Sum of squares over all folds."""
        return float(self.errors.sum())


@dataclass(frozen=True, slots=True, eq=False)
class StructureSearch:
    """Result of the search for sums of laws."""

    regression: Regression  # with refined laws
    linear: Structure  # the base alone, without laws
    best: Structure  # of all sizes, the last that improves significantly
    ranked: tuple[Structure, ...]
    """The best structure of each set of effects, of all sizes, the best first."""
    complete: bool  # whether the search ended before the time limit


def search_structures(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    excluded: frozenset[str],
    time_left: TimeBudget,
    base: BaseTerms | GivenModelBase | None = None,
) -> StructureSearch:
    """Search for the sum of at most `MOST_SUMMED_LAWS` laws with the least cross-validated error. excluded: effects
    left out; without time, all are. base: None = mass, damping, stiffness. Raises NoMotionError without samples."""
    if not any(motion.mask_valid_samples(motion.fit).any() for motion in motions):
        raise NoMotionError("too few samples with motion are available for the fit")
    scales = [measure_scales(motions, c, rotational) for c in range(len(motions[0].channels))]
    turns_freely = any(scale.turns_freely for scale in scales)
    base_laws = {(law.key, law.numbers) for law in (base.laws if isinstance(base, BaseTerms) else ())}
    candidate_laws = [
        law
        for law in (make_laws(motions, rotational) if time_left() else ())
        if excluded.isdisjoint((law.effect, SIMULATED_AS.get(law.effect))) and (law.key, law.numbers) not in base_laws
    ]
    if isinstance(base, GivenModelBase):
        regression = build_regression_with_model(motions, axis, candidate_laws, base)
        if not can_laws_explain(regression, base.least_share):
            base_only = _fit_linear_structure(regression)
            return StructureSearch(regression, base_only, base_only, (base_only,), time_left())
    else:
        regression = build_regression(motions, axis, candidate_laws, turns_freely, base)
    if "cogging" not in excluded and time_left():
        regression = _add_cogging_laws(regression, scales)
    linear = _fit_linear_structure(regression)
    regression, ranked, best = _search(regression, linear, time_left)
    return StructureSearch(regression, linear, best, tuple(sorted(ranked, key=lambda s: s.error)), time_left())


def _search(
    regression: Regression, linear: Structure, time_left: TimeBudget
) -> tuple[Regression, list[Structure], Structure]:
    """Search the beam: the regression with its laws refined, the structures of all sizes, and the best."""
    beam, ranked, best = [linear], [linear], linear
    for _ in range(MOST_SUMMED_LAWS):
        sums = _add_law_to_each(regression, beam) if time_left() else []
        if not sums:
            break
        regression = refine_parameters(regression, takewhile(lambda _: time_left(), sums[:STRUCTURES_BEAM]))
        sums = [replace(s, errors=regression.cross_validate(regression.select_columns(s.laws))) for s in sums]
        ranked += sums
        beam = sorted(sums, key=lambda s: s.error)[:STRUCTURES_BEAM]
        if not improves_significantly(best, beam[0]):
            break
        best = beam[0]
    return regression, ranked, best


def improves_significantly(base: Structure, extended: Structure) -> bool:
    """Whether the laws that `extended` adds are significant. With fold errors p_i of `base` and r_i of `extended`, the
    total must fall by `FURTHER_LAW_GAIN`, and one of three sums must exceed `FURTHER_LAW_ERRORS` standard errors: of
    p_i - r_i; of log(p_i / r_i), for folds with unequal errors; of p_i - r_i with the error of a ratio estimate."""
    floor = 1e-12 * base.error / len(base.errors)  # against division by zero
    logs = np.log(np.maximum(base.errors, floor) / np.maximum(extended.errors, floor)) if floor > 0 else np.zeros(1)
    gains = base.errors - extended.errors
    # Residuals of the gains about their ratio to the errors (Cochran, Sampling Techniques, 3rd ed., equation 6.4).
    residuals = gains - (1 - extended.error / max(base.error, 1e-300)) * base.errors
    passes = _is_significant(gains, gains) or _is_significant(logs, logs) or _is_significant(gains, residuals)
    return extended.error < (1 - FURTHER_LAW_GAIN) * base.error and passes


def _is_significant(gains: FloatArray, residuals: FloatArray) -> bool:
    """Whether the sum of the gains exceeds `FURTHER_LAW_ERRORS` standard errors, from the scatter of `residuals`."""
    standard_error = float(np.std(residuals, ddof=1) * np.sqrt(len(residuals))) if len(residuals) > 1 else np.inf
    return float(gains.sum()) > FURTHER_LAW_ERRORS * standard_error


def _fit_linear_structure(regression: Regression) -> Structure:
    """Cross-validate the base alone."""
    return Structure((), regression.cross_validate(regression.select_columns(())))


def _add_law_to_each(regression: Regression, beam: Sequence[Structure]) -> list[Structure]:
    """Add one more law to each structure: the best physical one of each set of effects, sorted by error."""
    best: dict[tuple[tuple[str, int], ...], Structure] = {}
    for structure in beam:
        keys = {regression.laws[k].key for k in structure.laws}
        sums = [
            tuple(sorted((*structure.laws, index)))
            for index, law in enumerate(regression.laws)
            if law.key not in keys and not any(_have_common_column(law.key, key) for key in keys)
        ]
        errors = regression.cross_validate_each([regression.select_columns(laws) for laws in sums])
        for grown in map(Structure, sums, errors):
            effects = tuple(sorted(regression.laws[k].key for k in grown.laws))
            if (effects not in best or grown.error < best[effects].error) and _is_physical(regression, grown.laws):
                best[effects] = grown
    return sorted(best.values(), key=lambda s: s.error)


SLIDING = (
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "position_dependent_friction", "drifting_friction"
)  # fmt: skip
"""Laws that share the column of dry friction: two of them along one channel have no unique levels."""


def _have_common_column(first: tuple[str, int], second: tuple[str, int]) -> bool:
    """Whether two laws (effect and channel each) share the column of dry friction."""
    return first[1] == second[1] and first[0] in SLIDING and second[0] in SLIDING


def _is_physical(regression: Regression, laws: Sequence[int]) -> bool:
    """Whether the fitted weights of all these laws have physical signs."""
    return all(values is not None for values in fit_values(regression, laws))


def fit_values(regression: Regression, laws: Sequence[int]) -> list[dict[str, float] | None]:
    """Fit the parameters of each law, all together; None where the signs of its weights are not physical."""
    columns = regression.select_columns(laws)
    weights = regression.fit_weights(columns)
    mass = float(weights[regression.base_terms.driven_channel]) if regression.mass is None else regression.mass
    first_weight, values = regression.base_column_count, []
    for law_index in laws:
        law, column_range = regression.laws[law_index], regression.column_ranges[law_index]
        count = column_range.stop - column_range.start
        values.append(law.convert_weights(weights[first_weight : first_weight + count], law.numbers, mass))
        first_weight += count
    return values


def _add_cogging_laws(regression: Regression, scales: Sequence[Scales]) -> Regression:
    """Add cogging at the pitches in the residual without laws, then at those in the residual with the best law."""
    regression = _add_pitches(regression, scales, ())
    extended = _add_law_to_each(regression, [_fit_linear_structure(regression)])
    return _add_pitches(regression, scales, extended[0].laws) if extended else regression


def _add_pitches(regression: Regression, scales: Sequence[Scales], laws: Sequence[int]) -> Regression:
    """Add cogging at the pitches that the residual of these laws shows."""
    residuals = regression.compute_residuals(regression.select_columns(laws))
    cogging = [
        make_cogging_law(c, pitch, scale)
        for c, scale in enumerate(scales)
        for pitch in find_likely_pitches(regression.motions, residuals, c, scale)
    ]
    return append_laws(regression, cogging) if cogging else regression


def refine_parameters(regression: Regression, structures: Iterable[Structure]) -> Regression:
    """Refine the nonlinear parameters of the structures' laws to the least cross-validated error, each law in the first
    structure that has it."""
    regression, refined = copy_columns(regression), set[int]()
    for structure in structures:
        for index_in_sum, law_index in enumerate(structure.laws):
            if law_index not in refined and regression.laws[law_index].bounds:
                refined.add(law_index)
                reduced = replace(keep_laws(regression, structure.laws), test=())  # only the parameters are used
                regression = overwrite_law(regression, law_index, _refine_law(reduced, index_in_sum)) or regression
    return regression


def _refine_law(regression: Regression, index_in_sum: int) -> Law:
    """Refine one law of a structure by steps to its best neighbour. regression: with the structure's laws alone."""
    laws = tuple(range(len(regression.laws)))
    least_error = float(regression.cross_validate(regression.select_columns(laws)).sum())
    for step_share in STEP_SHARES.get(regression.laws[index_in_sum].effect, (1.0,)):
        for _ in range(MOST_PASSES):
            trials = []
            for neighbour in _list_neighbours(regression.laws[index_in_sum], step_share):
                trial = try_law(regression, index_in_sum, neighbour)
                if trial is not None and _is_physical(trial, laws):
                    trials.append((float(trial.cross_validate(trial.select_columns(laws)).sum()), trial))
            if not trials or min(trials, key=lambda pair: pair[0])[0] >= least_error * (1 - 1e-4):  # converged
                break
            least_error, regression = min(trials, key=lambda pair: pair[0])
    return regression.laws[index_in_sum]


def _list_neighbours(law: Law, step_share: float) -> Iterator[Law]:
    """List the law with each nonlinear parameter moved by this share of each factor's step, within its bounds."""
    for index, (low, high) in enumerate(law.bounds):
        for factor in STEP_FACTORS:
            value = law.numbers[index] * (1 + (factor - 1) * step_share)
            if low <= value <= high:
                numbers = (*law.numbers[:index], float(value), *law.numbers[index + 1 :])
                yield replace(law, numbers=numbers)


WIDTH_ALONE = ("coulomb_friction", "condition_dependent_friction")
"""Laws whose only nonlinear parameter is the width of a smoothed sign."""


def choose_simplest_structure(search: StructureSearch) -> Structure:
    """Choose the sum with the fewest parameters at about the least error; add laws that explain most of the rest."""
    limit = search.best.error + SIMPLER_SHORTFALL * (search.linear.error - search.best.error)
    sums = [s for s in search.ranked if s.error <= limit]
    simplest = min(sums, key=lambda s: (count_parameters(search.regression, s.laws), s.error), default=search.linear)
    least_error = fit_all_laws(search.regression, range(search.regression.columns[0].shape[1]))[0]
    while (extended := add_further_laws(search, simplest, least_error)) is not None:
        simplest = extended
    return simplest


def add_further_laws(search: StructureSearch, base: Structure, all_laws_error: float) -> Structure | None:
    """Add laws to `base` that explain most of what all laws together could; None without such laws."""
    limit = base.error - max(FURTHER_LAW_EXCESS * (base.error - all_laws_error), FURTHER_LAW_SHARE * base.error)
    extensions = [
        s
        for s in search.ranked
        if _extends(search.regression, base.laws, s.laws) and s.error <= limit and improves_significantly(base, s)
    ]
    return min(extensions, key=lambda s: (count_parameters(search.regression, s.laws), s.error), default=None)


def _extends(regression: Regression, base: Sequence[int], extended: Sequence[int]) -> bool:
    """Whether `extended` contains all laws of `base` and more; Coulomb friction may be replaced by friction that
    depends on a condition."""
    covered, keys = set(extended), {regression.laws[law_index].key for law_index in extended}
    for law_index in base:
        effect, channel = regression.laws[law_index].key
        if effect == "coulomb_friction" and ("condition_dependent_friction", channel) in keys:
            covered.add(law_index)
    return set(base) < covered


def count_parameters(regression: Regression, laws: Sequence[int]) -> int:
    """Count the parameters of these laws. The width of a smoothed sign is not counted; a gravity torque counts as a
    parameter less, because it replaces the spring, and a law outside the catalogue as one more (description length)."""
    count = 0
    for law_index in laws:
        law, column_range = regression.laws[law_index], regression.column_ranges[law_index]
        count += column_range.stop - column_range.start + (0 if law.effect in WIDTH_ALONE else len(law.numbers))
        count += (law.effect in FREE_LAWS) - (law.effect == "gravity_torque")
    return count
