"""Confirm, by output-error fits (simulation), the laws that a force balance named.

Called by `diagnose` for a model that was fitted to the recordings, and by `decide_with_model` for a given one. Without
a calibration, the size of the model's errors is unknown, so that a residual in units of noise is no evidence, but the
gain on held-out data is. The balance compares forces, where a wrong law may explain the model's own errors; a
simulation compares responses.

1. The named laws are added to the re-tuned model one after the other and fitted by output error, starting from the
   balance's parameters, or from the model's own where these fail (`_fit_from_starts`).
2. With E the mean over channels of the log rms error on held-out samples, the laws are confirmed if

       E(with laws) <= E(without) + ln(CONFIRMED_RATIO)          (a tenth less error)

   and if the model with them explains more than half of the held-out power (`explains_half`). Else the last is dropped.
3. A law whose amplitude's 95 % interval contains zero is withdrawn, or replaced by the special case that lacks the
   undetermined parameter, and the remaining laws are fitted again (`_find_undetermined_law`, `_prefer_special_case`).
4. The verdict is `explained` only if the noise is known from repeats, the residual is as good as noise, and held-out
   errors are at most `HELD_OUT_ERROR`; else `partly_explained`.

References: Ljung, System Identification (1999), section 16.6 (validation on fresh data); Swevers and others, IEEE
Control Systems 27(5):58 (2007) (laws by inverse dynamics, validated by simulation)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import JudgedLaw, find_family
from analysis.diagnosis.confirm.held_out_gain import explains_half
from analysis.diagnosis.confirm.laws_for_simulation import (
    can_be_simulated,
    compute_starting_deviations,
    estimate_constant_forces,
    find_special_case,
    make_hypothesis,
    refit_laws,
)
from analysis.diagnosis.confirm.require_gain import CONSTANT_FORCE
from analysis.diagnosis.errors.hypothesis import combine_hypotheses
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import CONFIRMED_RATIO, HELD_OUT_ERROR, INTERVAL_HALF_WIDTH
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import compute_final_errors
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, is_near_noise
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import Effect
from equalizer.signals.signal import FloatArray

_NamedLaw = tuple[int, JudgedLaw]
"""Index of an axis, and a law named on it."""


@dataclass(frozen=True, slots=True, eq=False)
class _ConfirmationStart:
    """Starting point of the fits of named laws."""

    search_context: SearchContext
    """Shared state of the search."""
    full_context: SearchContext
    """`search_context`, fitted to all samples but the held-out ones."""
    balances: tuple[Balance, ...]
    noise_known: bool
    """Whether the noise is known from repeats."""
    constant_count: int
    """Number of constant forces, which come before the laws."""
    as_given: FittedCandidate
    """The model with constants only, as it was given."""
    retuned: FittedCandidate
    """`as_given` with the model's parameters fitted again."""
    tested: FittedCandidate
    """`retuned`, scored on the held-out samples."""
    baseline: FittedCandidate
    """The better of `as_given` and `tested` on the held-out samples."""


def search_by_balance(context: SearchContext, balances: Sequence[Balance], noise_known: bool) -> SearchResult | None:
    """Convert the named laws of the balances (one per axis) to a search result; None where none can be simulated, or
    simulations confirm none. noise_known: whether the noise is known from repeats; else the verdict is not
    `explained`."""
    named_laws = [
        (axis, law)
        for axis, balance in enumerate(balances)
        for law in balance.named
        if law.law.effect != CONSTANT_FORCE
        and can_be_simulated(balance.search.regression.base_terms.driven_channel, law, context.tuning.model.units)
    ]
    if not named_laws:
        return None
    full_context = context.join_fit_and_choose()
    forces = estimate_constant_forces(balances)
    given_fit = evaluate_fit(
        full_context.measure, full_context.tuning, np.zeros(len(full_context.tuning.names)), forces
    )
    as_given, retuned = (
        full_context.with_test_score(full_context.score_fit(given_fit)),
        full_context.score_fit(refine(full_context, given_fit)),
    )
    tested = full_context.with_test_score(retuned)
    baseline = Explanation(as_given, tested, tested, (), ()).plain
    start = _ConfirmationStart(
        context, full_context, tuple(balances), noise_known, len(forces.claims), as_given, retuned, tested, baseline
    )
    confirmed_laws = _confirm_by_simulation(start, named_laws)
    return None if confirmed_laws is None else _prefer_special_case(start, *confirmed_laws)


def _confirm_by_simulation(
    start: _ConfirmationStart, named_laws: Sequence[_NamedLaw]
) -> tuple[SearchResult, list[_NamedLaw]] | None:
    """Fit the laws until all are confirmed. Undetermined ones are dropped or replaced by a special case; the last one
    is dropped where too little held-out error is explained. Returns the result and these laws; None where none is
    left."""
    context, named_laws = start.full_context, refit_laws(start.balances, named_laws)
    while named_laws:
        steps, with_laws = _fit_from_starts(context, start.balances, (start.retuned, start.baseline), named_laws)
        explanation = Explanation(
            start.as_given, start.tested, with_laws, tuple((step,) for step in steps), tuple(steps)
        )
        undetermined_index: int | None = len(named_laws) - 1
        errors: FloatArray | None = None
        if _lowers_held_out_error(start.baseline, with_laws) and explains_half(context.full_measure, with_laws):
            errors = compute_final_errors(context, explanation)
            undetermined_index = _find_undetermined_law(
                explanation, errors[len(context.tuning.names) :], start.constant_count
            )
        if undetermined_index is None:
            test_error = float(np.nanmax(with_laws.score.test, initial=0.0))
            is_complete = start.noise_known and is_near_noise(explanation) and test_error <= HELD_OUT_ERROR
            judgement = Judgement("explained" if is_complete else "partly_explained", True)
            return SearchResult(start.search_context, explanation, judgement, errors=errors), named_laws
        special_case = None
        if errors is not None:
            remaining_laws = _remove_law(named_laws, undetermined_index)
            special_case = find_special_case(start.balances, remaining_laws, named_laws[undetermined_index])
        named_laws = refit_laws(start.balances, _remove_law(named_laws, undetermined_index, special_case))
    return None


def _prefer_special_case(start: _ConfirmationStart, result: SearchResult, named_laws: list[_NamedLaw]) -> SearchResult:
    """Replace a law by its special case where its further parameters are undetermined (such as a stiffness before
    sliding), no law is lost, and the held-out error rises by at most the factor 1 / CONFIRMED_RATIO; else unchanged."""
    for index in find_open_refinements(result, start.constant_count):
        special_case = find_special_case(start.balances, _remove_law(named_laws, index), named_laws[index])
        alternative = (
            None
            if special_case is None
            else _confirm_by_simulation(start, _remove_law(named_laws, index, special_case))
        )
        if alternative is None or len(alternative[1]) < len(named_laws):
            continue
        if alternative[0].found.after.held_out_error <= result.found.after.held_out_error - np.log(CONFIRMED_RATIO):
            return alternative[0]
    return result


def _remove_law(named_laws: list[_NamedLaw], index: int, replacement: _NamedLaw | None = None) -> list[_NamedLaw]:
    """Remove the named law at `index`, or put `replacement` in its place."""
    return [*named_laws[:index], *([] if replacement is None else [replacement]), *named_laws[index + 1 :]]


def _fit_from_starts(
    context: SearchContext,
    balances: Sequence[Balance],
    reference_fits: tuple[FittedCandidate, FittedCandidate],
    named_laws: Sequence[_NamedLaw],
) -> tuple[list[FittedCandidate], FittedCandidate]:
    """Fit the laws one after the other; returns the fit after each law, and the last of them scored on the held-out
    samples too. They start from the linear parameters of the balance, or, where that fit is not confirmed, from those
    of the model if these do better. reference_fits: the re-tuned model, and `_ConfirmationStart.baseline`."""
    retuned, baseline = reference_fits
    balance_deviations = compute_starting_deviations(context.tuning, balances, [law.law_index for _, law in named_laws])
    steps = _fit_steps(context, retuned, named_laws, balance_deviations)
    with_laws = context.with_test_score(steps[-1])
    if np.any(balance_deviations) and not _lowers_held_out_error(baseline, with_laws):
        steps_from_model = _fit_steps(context, retuned, named_laws, np.zeros(len(balance_deviations)))
        with_laws_from_model = context.with_test_score(steps_from_model[-1])
        if with_laws_from_model.held_out_error < with_laws.held_out_error:
            return steps_from_model, with_laws_from_model
    return steps, with_laws


def _fit_steps(
    context: SearchContext,
    retuned: FittedCandidate,
    named_laws: Sequence[_NamedLaw],
    deviations: FloatArray,
) -> list[FittedCandidate]:
    """Fit with the laws added one after the other; for each constant force before them, the re-tuned model is returned.
    deviations: starting values of the model's parameters, in standard deviations from the given ones."""
    hypothesis = retuned.fitted.hypothesis
    steps = [retuned for _ in hypothesis.claims]
    recording, units = context.measure.records[0].recording, context.tuning.model.units
    for axis, law in named_laws:
        extended = combine_hypotheses(hypothesis, make_hypothesis(axis, law, recording, units))
        start = evaluate_fit(context.measure, context.tuning, deviations, extended)
        fitted = refine(context, start)
        steps.append(context.score_fit(fitted))
        hypothesis, deviations = fitted.hypothesis, fitted.deviations
    return steps


def _find_undetermined_law(explanation: Explanation, errors: FloatArray, constant_count: int) -> int | None:
    """Find the index of the first named law that may be absent; None if there is none. A law may be absent if the
    intervals of all parameters that can make it vanish contain the vanishing value, or those of all signed parameters
    that a special case of it lacks. Where the law only refines an earlier one of its family, or is outside the
    catalogue, one parameter is enough. errors: standard errors of the laws' parameters; constant_count: constant forces
    before the laws."""
    first_parameter, hypothesis = 0, explanation.steps[-1].fitted.hypothesis
    law_families = [find_family(claim.effect.name) for claim in hypothesis.claims]
    for index, claim in enumerate(hypothesis.claims):
        free_parameters = [parameter for parameter in claim.effect.parameters if not parameter.fixed]
        any_suffices = (
            index > constant_count and law_families[index] in law_families[constant_count:index]
        ) or claim.effect.law is not None
        may_vanish: list[bool] = []
        zero_by_name: dict[str, bool] = {}
        for parameter_index, parameter in enumerate(free_parameters, first_parameter):
            vanishing_distance = {
                "log": 1.0,
                "signed": abs(float(hypothesis.point[parameter_index])),
                "linear": np.inf,
            }[parameter.scale]
            if any_suffices or parameter.none is not None:
                reaches_vanishing = INTERVAL_HALF_WIDTH * errors[parameter_index] >= vanishing_distance
                may_vanish.append(bool(np.isfinite(vanishing_distance) and reaches_vanishing))
            if claim.effect.simpler and parameter.scale == "signed":
                zero_by_name[parameter.name] = INTERVAL_HALF_WIDTH * errors[parameter_index] >= vanishing_distance
        if index >= constant_count and (
            any(may_vanish)
            if any_suffices
            else _has_only_true(may_vanish) or _may_be_special_case(claim.effect, zero_by_name)
        ):
            return index - constant_count
        first_parameter += len(free_parameters)
    return None


def _may_be_special_case(effect: Effect, zero_by_name: Mapping[str, bool]) -> bool:
    """Whether all signed parameters that a special case of the effect lacks may be zero. zero_by_name: whether the
    interval of a signed parameter contains zero."""
    special_cases = [{parameter.name for parameter in EFFECTS[name].parameters} for name in effect.simpler]
    return any(
        _has_only_true([zero_by_name[name] for name in zero_by_name if name not in kept_names])
        for kept_names in special_cases
    )


def _has_only_true(flags: Sequence[bool]) -> bool:
    """Whether there are flags and all are true."""
    return bool(flags) and all(flags)


def has_open_parameter(result: SearchResult) -> bool:
    """Whether the interval of any positive parameter of a law reaches zero, such as a stiffness before sliding."""
    return bool(_find_open_parameters(result))


def find_open_refinements(result: SearchResult, constant_count: int) -> tuple[int, ...]:
    """Find the indices of the named laws with a parameter whose interval reaches zero and which their special cases
    lack. constant_count: number of constant forces before the laws."""
    hypothesis = result.found.steps[-1].fitted.hypothesis
    indices, first_parameter, open_parameters = [], 0, set(_find_open_parameters(result))
    for index, claim in enumerate(hypothesis.claims):
        free_parameters = [parameter for parameter in claim.effect.parameters if not parameter.fixed]
        special_case_names = {parameter.name for name in claim.effect.simpler for parameter in EFFECTS[name].parameters}
        extra_parameters = [
            first_parameter + position
            for position, parameter in enumerate(free_parameters)
            if parameter.name not in special_case_names
        ]
        if special_case_names and index >= constant_count and open_parameters & set(extra_parameters):
            indices.append(index - constant_count)
        first_parameter += len(free_parameters)
    return tuple(indices)


def _find_open_parameters(result: SearchResult) -> list[int]:
    """Find the indices of the positive parameters, over all claims in their order, whose intervals reach zero: they are
    fitted as logarithms, so that this is a half width of at least 1."""
    assert result.errors is not None
    fitted_parameters = result.found.steps[-1].fitted.hypothesis.parameters
    errors = result.errors[len(result.context.tuning.names) :]
    return [
        index
        for index, (fitted_parameter, error) in enumerate(zip(fitted_parameters, errors, strict=True))
        if fitted_parameter.parameter.scale == "log" and INTERVAL_HALF_WIDTH * error >= 1
    ]


def _lowers_held_out_error(baseline: FittedCandidate, with_laws: FittedCandidate) -> bool:
    """Whether the laws reduce the held-out error to `CONFIRMED_RATIO` times the baseline's or less; True where nothing
    was held out. `held_out_error` is the log rms error of the module docstring."""
    return not np.isfinite(baseline.held_out_error) or with_laws.held_out_error <= baseline.held_out_error + np.log(
        CONFIRMED_RATIO
    )
