"""Confirms laws that a force balance named by fitting them by output error.

Theory of operation. Used where the model itself was fitted to the recordings. Without a calibration the size of the
model's errors is unknown, so that a residual in units of noise is no evidence, but the gain on held-out data is. The
balance compares forces, where a wrong law may explain the model's own errors; a simulation compares responses.

1. The named laws are added to the re-tuned model one after the other and fitted by output error, starting from the
   balance's parameters, or from the model's own where these fail (`_fit_from_starts`).
2. With E the mean over channels of the log rms error on held-out samples, the laws are confirmed if

       E(with laws) <= E(without) + ln(CONFIRMED_LEAVES)         (a tenth less error)

   and if the model with the laws explains more than half of the held-out power (`held_out_gain.explains_half`).
3. A law whose amplitude's 95 % interval contains zero is withdrawn, or replaced by the special case that lacks the
   undetermined parameter, and the remaining laws are fitted again (`_find_vague_law`, `_prefer_special_case`).
4. The verdict is `explained` only if the noise is known from repeats, the residual is as good as noise, and held-out
   errors are at most `HELD_OUT_ERROR`; else `partly_explained`.

References: Ljung, System Identification (1999), section 16.6 (validation on fresh data); Swevers and others, IEEE
Control Systems 27(5):58 (2007) (laws by inverse dynamics, validated by simulation).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import JudgedLaw, family_of
from analysis.diagnosis.confirm.held_out_gain import explains_half
from analysis.diagnosis.confirm.laws_for_simulation import (
    can_be_played,
    constants_of,
    find_special_case,
    hypothesis_of_judged,
    parameters_beside_laws,
    refit_laws,
)
from analysis.diagnosis.confirm.require_gain import CONSTANT
from analysis.diagnosis.errors.hypothesis import combine
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import final_errors
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, as_good_as_noise
from analysis.diagnosis.settings import CONFIRMED_LEAVES, HELD_OUT_ERROR, INTERVAL_FACTOR
from equalizer.effects.catalogue import EFFECTS
from equalizer.signals.signal import FloatArray

VAGUE = 1.96 * INTERVAL_FACTOR
"""Half-width of a 95 % interval in standard errors, widened as in `identifiability`. A positive parameter is fitted as
its logarithm: if the half-width exceeds 1, the parameter counts as undetermined."""
_Named = list[tuple[int, JudgedLaw]]
"""Index of the axis, and the law that was named on it."""


@dataclass(frozen=True, slots=True, eq=False)
class _Confirming:
    """Starting point of every fit of named laws."""

    whole: SearchContext
    """Shared state of the search, with samples to fit and to choose by."""
    context: SearchContext
    """`whole`, fitted to all samples but the held-out ones."""
    balances: tuple[Balance, ...]
    repeats: bool
    """Whether the noise is known from repeats."""
    constants: int
    """Number of constant forces, which come before the laws."""
    before: FittedCandidate
    """The model with constants only, as it was given."""
    retuned: FittedCandidate
    """The same with its parameters fitted again."""
    confirmed: FittedCandidate
    """`retuned`, scored on the held-out samples."""
    plain: FittedCandidate
    """The better of `before` and `confirmed` on the held-out samples."""


def search_by_balance(context: SearchContext, balances: Sequence[Balance], repeats: bool) -> SearchResult | None:
    """The named laws of the balances as a search result. repeats: whether the noise is known from repeats; otherwise
    nothing counts as explained. None where nothing is named, or simulations do not confirm it."""
    named = [
        (axis, law)
        for axis, balance in enumerate(balances)
        for law in balance.named
        if law.law.effect != CONSTANT and can_be_played(balance.search.regression.beside.own, law)
    ]
    if not named:
        return None
    within = context.fit_to_all()
    constant = constants_of(balances)
    given = evaluate_fit(within.measure, within.tuning, np.zeros(len(within.tuning.names)), constant)
    before, retuned = within.with_test_score(within.candidate(given)), within.candidate(refine(within, given))
    confirmed = within.with_test_score(retuned)
    plain = Explanation(before, confirmed, confirmed, (), ()).plain
    begun = _Confirming(
        context, within, tuple(balances), repeats, len(constant.claims), before, retuned, confirmed, plain
    )
    found = _confirm(begun, named)
    return None if found is None else _prefer_special_case(begun, *found)


def _confirm(begun: _Confirming, named: Sequence[tuple[int, JudgedLaw]]) -> tuple[SearchResult, _Named] | None:
    """The result with those of the laws that simulations confirm, and these laws; None where there are none."""
    context, named = begun.context, refit_laws(begun.balances, named)
    while named:
        steps, after = _fit_from_starts(context, begun.balances, (begun.retuned, begun.plain), named)
        explained = Explanation(begun.before, begun.confirmed, after, tuple((step,) for step in steps), tuple(steps))
        vague: int | None = len(named) - 1
        errors: FloatArray | None = None
        if _is_borne_out(begun.plain, after) and explains_half(context.whole, after):
            errors = final_errors(context, explained)
            vague = _find_vague_law(explained, errors[len(context.tuning.names) :], begun.constants)
        if vague is None:
            test_error = float(np.nanmax(after.score.test, initial=0.0))
            whole = begun.repeats and as_good_as_noise(explained) and test_error <= HELD_OUT_ERROR
            judged = Judgement("explained" if whole else "partly_explained", True)
            return SearchResult(begun.whole, explained, judged, errors=errors), named
        simpler = None if errors is None else find_special_case(begun.balances, _remove_law(named, vague), named[vague])
        named = refit_laws(begun.balances, _remove_law(named, vague, simpler))
    return None


def _prefer_special_case(begun: _Confirming, found: SearchResult, named: _Named) -> SearchResult:
    """The result with a law replaced by its special case where its further parameters are undetermined (such as a
    stiffness before sliding) and the error hardly rises; else unchanged."""
    for place in open_refinements(found, begun.constants):
        simpler = find_special_case(begun.balances, _remove_law(named, place), named[place])
        other = None if simpler is None else _confirm(begun, _remove_law(named, place, simpler))
        if other is None or len(other[1]) < len(named):
            continue
        if other[0].found.after.held_out <= found.found.after.held_out - np.log(CONFIRMED_LEAVES):
            return other[0]
    return found


def _remove_law(named: _Named, place: int, instead: tuple[int, JudgedLaw] | None = None) -> _Named:
    """The named laws without that at `place`, or with `instead` in its place."""
    return [*named[:place], *([] if instead is None else [instead]), *named[place + 1 :]]


def _fit_from_starts(
    context: SearchContext,
    balances: Sequence[Balance],
    without: tuple[FittedCandidate, FittedCandidate],
    named: Sequence[tuple[int, JudgedLaw]],
) -> tuple[list[FittedCandidate], FittedCandidate]:
    """The fits after each law, and the last of them scored on the held-out samples too. They start from the linear
    parameters of the balance, or, where that fit is not confirmed, from those of the model if these do better. without:
    the re-tuned model, and the better model without laws on held-out samples."""
    retuned, plain = without
    released = parameters_beside_laws(context.tuning, balances, [law.place for _, law in named])
    steps = _steps(context, retuned, named, released)
    after = context.with_test_score(steps[-1])
    if np.any(released) and not _is_borne_out(plain, after):
        again = _steps(context, retuned, named, np.zeros(len(released)))
        other = context.with_test_score(again[-1])
        if other.held_out < after.held_out:
            return again, other
    return steps, after


def _steps(
    context: SearchContext, retuned: FittedCandidate, named: Sequence[tuple[int, JudgedLaw]], deviations: FloatArray
) -> list[FittedCandidate]:
    """The fits with the constants and the laws, added one after the other; for each constant, the re-tuned model.
    deviations: where the model's parameters start, in standard deviations."""
    whole = retuned.fitted.hypothesis
    steps = [retuned for _ in whole.claims]
    recording = context.measure.records[0].recording
    for axis, law in named:
        claimed = combine(whole, hypothesis_of_judged(axis, law, recording))
        start = evaluate_fit(context.measure, context.tuning, deviations, claimed)
        found = refine(context, start)
        steps.append(context.candidate(found))
        whole, deviations = found.hypothesis, found.deviations
    return steps


def _find_vague_law(explained: Explanation, errors: FloatArray, constants: int) -> int | None:
    """Index of a named law that may be absent; None = there is none. A law may be absent if the intervals of all
    parameters that can make it vanish contain the vanishing value, or those of all signed parameters that its special
    case lacks. Where the law only refines another of its family, or is outside the catalogue, one such parameter is
    enough. errors: standard errors of the parameters; constants: number of constant forces before the laws."""
    begin, hypothesis = 0, explained.steps[-1].fitted.hypothesis
    families = [family_of(claim.effect.name) for claim in hypothesis.claims]
    for place, claim in enumerate(hypothesis.claims):
        free = [parameter for parameter in claim.effect.parameters if not parameter.fixed]
        every = (place > constants and families[place] in families[constants:place]) or claim.effect.law is not None
        special = {parameter.name for name in claim.effect.simpler for parameter in EFFECTS[name].parameters}
        vague, beyond = [], []
        for number, parameter in enumerate(free, begin):
            size = {"log": 1.0, "signed": abs(float(hypothesis.point[number])), "linear": np.inf}[parameter.scale]
            if every or parameter.none is not None:
                vague.append(VAGUE * errors[number] >= size)
            if special and parameter.scale == "signed" and parameter.name not in special:
                beyond.append(VAGUE * errors[number] >= size)
        if place >= constants and (any(vague) if every else _all_of_some(vague) or _all_of_some(beyond)):
            return place - constants
        begin += len(free)
    return None


def _all_of_some(flags: Sequence[bool]) -> bool:
    """Whether there are flags and all are true."""
    return bool(flags) and all(flags)


def leaves_open(result: SearchResult) -> bool:
    """Whether the interval of any positive parameter of a law reaches zero, such as a stiffness before sliding."""
    return bool(_open_parameters(result))


def open_refinements(result: SearchResult, constants: int) -> tuple[int, ...]:
    """Indices of the named laws with a parameter whose interval reaches zero and which their special case lacks.
    constants: number of constant forces before the laws."""
    hypothesis = result.found.steps[-1].fitted.hypothesis
    found, begin, left_open = [], 0, set(_open_parameters(result))
    for place, claim in enumerate(hypothesis.claims):
        free = [parameter for parameter in claim.effect.parameters if not parameter.fixed]
        special = {parameter.name for name in claim.effect.simpler for parameter in EFFECTS[name].parameters}
        beyond = [begin + number for number, parameter in enumerate(free) if parameter.name not in special]
        if special and place >= constants and left_open & set(beyond):
            found.append(place - constants)
        begin += len(free)
    return tuple(found)


def _open_parameters(result: SearchResult) -> list[int]:
    """Indices of the positive parameters, over all claims in their order, whose intervals reach zero."""
    assert result.errors is not None
    numbers = result.found.steps[-1].fitted.hypothesis.parameters
    errors = result.errors[len(result.context.tuning.names) :]
    return [
        place
        for place, (number, error) in enumerate(zip(numbers, errors, strict=True))
        if number.parameter.scale == "log" and VAGUE * error >= 1
    ]


def _is_borne_out(plain: FittedCandidate, after: FittedCandidate) -> bool:
    """Whether the laws reduce the held-out error to `CONFIRMED_LEAVES` or less; True where nothing was held out."""
    return not np.isfinite(plain.held_out) or after.held_out <= plain.held_out + np.log(CONFIRMED_LEAVES)
