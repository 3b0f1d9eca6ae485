"""Rounds exponents of a discovered law to whole or half numbers where their standard errors allow it, drops a memory
that is shorter than a sample, and simplifies the formula. Called by `discover`."""

import re
from dataclasses import replace
from functools import reduce

import numpy as np

from analysis.diagnosis.discovery.convert_sum import list_fitted_laws
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.intervals import compute_full_sensitivity, compute_standard_errors
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit, fit
from analysis.diagnosis.search.search_context import FIRST_FIT_ROUNDS, SearchContext
from analysis.diagnosis.settings import INTERVAL_FACTOR, LAW_SNAP
from equalizer.effects.discovered_law import law_channels, law_effect, law_values
from equalizer.laws.law import Law, find_parameter_roles

_CUBE_WITH_MEMORY = re.compile(r"\b(\w+)\*lag\(\1\*\*2, (?:p(\d+)|0)\)")
_LIMIT = re.compile(r"(\w+) \+ p0\*\((.+) - \1\)")
"""signal + p0 * (soft limit of the signal - signal); see `grammar.generate_soft_limit_terms`."""


def snap_exponents(context: SearchContext, fitted: Fitted) -> Fitted:
    """The fit repeated with exponents fixed at whole or half numbers; unchanged where no exponent is near one, or where
    the cost rises too much."""
    t = len(fitted.deviations)
    sensitivity = compute_full_sensitivity(
        context.measure, context.tuning, fitted.deviations, fitted.hypothesis, context.map_
    )
    errors = compute_standard_errors(context.measure, fitted, sensitivity)[t:]
    simplified = _round_exponents(context, fitted.hypothesis, errors)
    if simplified is None:
        return fitted
    start = evaluate_fit(context.measure, context.tuning, fitted.deviations, simplified)
    model_sensitivity = replace(sensitivity, columns=sensitivity.columns[:t], gram=sensitivity.gram[:t, :t])
    refitted = fit(context.measure, context.tuning, start, model_sensitivity, FIRST_FIT_ROUNDS)
    return refitted if refitted.cost <= fitted.cost * (1 + LAW_SNAP) else fitted


def _round_exponents(context: SearchContext, hypothesis: Hypothesis, errors: np.ndarray) -> Hypothesis | None:
    """The hypothesis with simple exponents; None where none changes. errors: (parameters,), standard errors."""
    recording = context.measure.records[0].recording
    parts, any_simplified, first = [], False, 0
    for number, (claim, law) in enumerate(zip(hypothesis.claims, list_fitted_laws(hypothesis), strict=True)):
        count = len(claim.effect.parameters) * claim.groups
        claim_errors = errors[first : first + count]
        first += count
        if law is None:
            parts.append(_extract_claim(hypothesis, number))
            continue
        simple = _drop_short_memory(law, 1 / recording.sample_rate_hz)
        simple = _simplify_exponents(law, claim_errors) if simple is law else simple
        any_simplified |= simple is not law
        effect = law_effect(simple, law_channels(recording))
        parts.append(make_claim_hypothesis(Claim(effect, "one", claim.sites), [law_values(simple)]))
    if not any_simplified:
        return None
    return reduce(combine_hypotheses, parts)


def _extract_claim(hypothesis: Hypothesis, number: int) -> Hypothesis:
    claim = hypothesis.claims[number]
    return make_claim_hypothesis(claim, [dict(placed.values) for placed in hypothesis.list_effects_of(number)])


def _drop_short_memory(law: Law, sample_s: float) -> Law:
    """The law with signal * lagged square replaced by the cube of the signal where the lag is less than a sample."""
    match = _CUBE_WITH_MEMORY.search(law.expression)
    if match is None or match[2] is None or law.numbers[int(match[2])] >= sample_s:
        return law
    # The parameter is replaced by its value and removed, so that later parameters are renumbered.
    shortened = substitute_parameter(law, int(match[2]), 0.0)
    return replace(shortened, expression=_CUBE_WITH_MEMORY.sub(r"\1**3", shortened.expression, count=1))


def _simplify_exponents(law: Law, errors: np.ndarray) -> Law:
    """The law with exponents near half or whole numbers rounded to these in the formula. errors: standard errors of
    their logarithms."""
    simplified = law
    for index, role in sorted(find_parameter_roles(law.tree).items(), reverse=True):
        value = law.numbers[index]
        if role != "exponent" or value <= 0:
            continue
        rounded = max(round(2 * value) / 2, 0.5)
        half_width = 1.96 * INTERVAL_FACTOR * float(errors[index]) * value
        if abs(value - rounded) <= max(half_width, LAW_SNAP * value):
            simplified = substitute_parameter(simplified, index, rounded)
    if simplified.numbers == law.numbers:
        simplified = _simplify_limit(law, float(errors[0]) * abs(law.numbers[0]))
    return replace(simplified, expression=simplify_powers(simplified.expression.removeprefix("1*")))


def is_full_limit(law: Law, tolerance: float) -> bool:
    """Whether the law is signal + p0 * (soft limit - signal) with p0 near 1, which is the soft limit itself."""
    return bool(_LIMIT.fullmatch(law.expression)) and abs(law.numbers[0] - 1) <= tolerance


def _simplify_limit(law: Law, error: float) -> Law:
    """The soft limit alone where the interval of its factor p0 contains 1 and not 0. error: standard error of p0."""
    half_width = 1.96 * INTERVAL_FACTOR * error
    limit = _LIMIT.fullmatch(law.expression)
    if limit is None or not half_width < 1 or not is_full_limit(law, max(half_width, LAW_SNAP)):
        return law
    return substitute_parameter(replace(law, expression=f"p0*{limit[2]}"), 0, 1.0)


def substitute_parameter(law: Law, index: int, value: float) -> Law:
    """The law with the free parameter p<index> replaced by a value in the formula, later parameters renumbered."""
    text = re.sub(rf"\bp{index}\b", f"{value:g}", law.expression)
    renamed = re.sub(r"\bp(\d+)\b", lambda match: f"p{int(match[1]) - (int(match[1]) > index)}", text)
    numbers = (*law.numbers[:index], *law.numbers[index + 1 :])
    return replace(law, expression=renamed, numbers=numbers, units=())


def simplify_powers(expression: str) -> str:
    """The formula with powers of whole exponents written without absolute values where these are not needed."""

    def signed_power(match: re.Match[str]) -> str:
        name, power = match[1], int(match[2])
        if power % 2:
            return name if power == 1 else f"{name}**{power}"
        return f"{name}*abs({name})" if power == 2 else f"{name}*abs({name})**{power - 1}"

    def unsigned_power(match: re.Match[str]) -> str:
        name, power = match[1], int(match[2])
        return f"abs({name})" if power == 1 else f"{name}**{power}" if power % 2 == 0 else f"abs({name})**{power}"

    expression = re.sub(r"abs\((\w+)\)\*\*(\d+)(?!\.)\*sign\(\1\)", signed_power, expression)
    expression = re.sub(r"abs\((\w+)\)\*\*(\d+)(?![\d.])", unsigned_power, expression)
    return re.sub(r"(?<=[\w)])\*\*1(?![\d.])", "", expression)
