"""Round the exponents of a discovered law to whole or half numbers where their standard errors allow it, drop a lag
that is shorter than a sample, and simplify the formula. Called by `discover` and `validation`."""

import re
from dataclasses import replace
from functools import reduce

import numpy as np

from analysis.diagnosis.discovery.convert_sum import list_fitted_laws
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit, fit
from analysis.diagnosis.errors.standard_errors import compute_full_sensitivity, compute_standard_errors
from analysis.diagnosis.limits import INTERVAL_HALF_WIDTH, LAW_ROUNDING_TOLERANCE
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.search_context import FIRST_FIT_STEPS, SearchContext
from equalizer.effects.discovered_law import collect_channels, get_law_values, make_law_effect
from equalizer.laws.law import Law, find_parameter_roles

_LAGGED_CUBE_PATTERN = re.compile(r"\b(\w+)\*lag\(\1\*\*2, (?:p(\d+)|0)\)")
"""signal * lag(signal**2, time constant), which without the lag is the signal's cube."""
_SOFT_LIMIT_PATTERN = re.compile(r"(\w+) \+ p0\*\((.+) - \1\)")
"""signal + p0 * (soft limit of the signal - signal); see `grammar.generate_soft_limit_terms`."""


def snap_exponents(context: SearchContext, fitted: Fitted) -> Fitted:
    """Repeat the fit with exponents fixed at whole or half numbers and without short lags; unchanged where no law
    becomes simpler, or where the cost rises by a share of more than `LAW_ROUNDING_TOLERANCE`."""
    if not any(law is not None and _can_simplify(law) for law in list_fitted_laws(fitted.hypothesis)):
        return fitted
    tuned_count = len(fitted.deviations)
    sensitivity = compute_full_sensitivity(
        context.measure, context.tuning, fitted.deviations, fitted.hypothesis, context.map_
    )
    errors = compute_standard_errors(context.measure, fitted, sensitivity)[tuned_count:]
    simplified = _simplify_laws(context, fitted.hypothesis, errors)
    if simplified is None:
        return fitted
    start_fit = evaluate_fit(context.measure, context.tuning, fitted.deviations, simplified)
    model_sensitivity = replace(
        sensitivity, columns=sensitivity.columns[:tuned_count], gram=sensitivity.gram[:tuned_count, :tuned_count]
    )
    refitted = fit(context.measure, context.tuning, start_fit, model_sensitivity, FIRST_FIT_STEPS)
    return refitted if refitted.cost <= fitted.cost * (1 + LAW_ROUNDING_TOLERANCE) else fitted


def converge_and_snap(context: SearchContext, fitted: Fitted) -> Fitted:
    """Continue the fit until it converges, then call `snap_exponents`."""
    return snap_exponents(context, refine(context, fitted))


def _can_simplify(law: Law) -> bool:
    """Whether a law has an exponent, a lag or a soft limit that might be simplified: only then are standard
    errors needed, which take a simulation per parameter."""
    has_exponent = "exponent" in find_parameter_roles(law.tree).values()
    return (
        has_exponent
        or _LAGGED_CUBE_PATTERN.search(law.expression) is not None
        or _SOFT_LIMIT_PATTERN.fullmatch(law.expression) is not None
    )


def _simplify_laws(context: SearchContext, hypothesis: Hypothesis, errors: np.ndarray) -> Hypothesis | None:
    """Simplify the laws of a hypothesis; None where none changes. errors: (parameters,), standard errors of the
    coordinates."""
    recording = context.measure.records[0].recording
    claim_hypotheses, any_simplified, first_parameter = [], False, 0
    for claim_index, (claim, law) in enumerate(zip(hypothesis.claims, list_fitted_laws(hypothesis), strict=True)):
        parameter_count = len(claim.effect.parameters) * claim.group_count
        claim_errors = errors[first_parameter : first_parameter + parameter_count]
        first_parameter += parameter_count
        if law is None:
            claim_hypotheses.append(_extract_claim(hypothesis, claim_index))
            continue
        simplified_law = _drop_short_lag(law, 1 / recording.sample_rate_hz)
        simplified_law = _simplify_exponents(law, claim_errors) if simplified_law is law else simplified_law
        any_simplified |= simplified_law != law
        effect = make_law_effect(simplified_law, collect_channels(recording))
        claim_hypotheses.append(
            make_claim_hypothesis(Claim(effect, "one", claim.sites), [get_law_values(simplified_law)])
        )
    if not any_simplified:
        return None
    return reduce(combine_hypotheses, claim_hypotheses)


def _extract_claim(hypothesis: Hypothesis, claim_index: int) -> Hypothesis:
    """Extract the hypothesis of one claim alone, with its present values."""
    claim = hypothesis.claims[claim_index]
    return make_claim_hypothesis(
        claim, [dict(placed_effect.values) for placed_effect in hypothesis.list_effects_of(claim_index)]
    )


def _drop_short_lag(law: Law, sample_s: float) -> Law:
    """Replace signal * lagged square in a law by the cube of the signal where the lag is less than a sample."""
    lagged_cube = _LAGGED_CUBE_PATTERN.search(law.expression)
    if lagged_cube is None or lagged_cube[2] is None or law.numbers[int(lagged_cube[2])] >= sample_s:
        return law
    # The parameter is replaced by its value and removed, so that later parameters are renumbered.
    shortened = substitute_parameter(law, int(lagged_cube[2]), 0.0)
    return replace(shortened, expression=_LAGGED_CUBE_PATTERN.sub(r"\1**3", shortened.expression, count=1))


def _simplify_exponents(law: Law, errors: np.ndarray) -> Law:
    """Round exponents near half or whole numbers (0.5 at least) to these in the formula: within their 95 % interval, or
    relatively within the tolerance of `limits`; where no exponent changes, simplify the soft limit. errors: standard
    errors of their logarithms."""
    simplified = law
    for index, role in sorted(find_parameter_roles(law.tree).items(), reverse=True):
        value = law.numbers[index]
        if role != "exponent" or value <= 0:
            continue
        rounded = max(round(2 * value) / 2, 0.5)
        half_width = INTERVAL_HALF_WIDTH * float(errors[index]) * value
        if abs(value - rounded) <= max(half_width, LAW_ROUNDING_TOLERANCE * value):
            simplified = substitute_parameter(simplified, index, rounded)
    if simplified.numbers == law.numbers:
        simplified = _simplify_soft_limit(law, float(errors[0]) * abs(law.numbers[0]))
    return replace(simplified, expression=simplify_powers(simplified.expression.removeprefix("1*")))


def is_full_soft_limit(law: Law, tolerance: float) -> bool:
    """Whether the law is signal + p0 * (soft limit - signal) with p0 near 1, which is the soft limit itself."""
    return bool(_SOFT_LIMIT_PATTERN.fullmatch(law.expression)) and abs(law.numbers[0] - 1) <= tolerance


def _simplify_soft_limit(law: Law, error: float) -> Law:
    """Reduce a law to the soft limit alone where the interval of its factor p0 contains 1 and not 0. error: standard
    error of p0."""
    half_width = INTERVAL_HALF_WIDTH * error
    soft_limit = _SOFT_LIMIT_PATTERN.fullmatch(law.expression)
    if soft_limit is None or not half_width < 1 or not is_full_soft_limit(law, max(half_width, LAW_ROUNDING_TOLERANCE)):
        return law
    return substitute_parameter(replace(law, expression=f"p0*{soft_limit[2]}"), 0, 1.0)


def substitute_parameter(law: Law, index: int, value: float) -> Law:
    """Replace the free parameter p<index> by a value in the formula, and renumber later parameters."""
    expression = re.sub(rf"\bp{index}\b", f"{value:g}", law.expression)
    renumbered = re.sub(r"\bp(\d+)\b", lambda match: f"p{int(match[1]) - (int(match[1]) > index)}", expression)
    numbers = (*law.numbers[:index], *law.numbers[index + 1 :])
    return replace(law, expression=renumbered, numbers=numbers, units=())


def simplify_powers(expression: str) -> str:
    """Write powers of whole exponents in a formula without absolute values where these are not needed."""

    def write_signed_power(match: re.Match[str]) -> str:
        """abs(x)**n*sign(x) as x**n for odd n, else as x*abs(x)**(n - 1)."""
        name, power = match[1], int(match[2])
        if power % 2:
            return name if power == 1 else f"{name}**{power}"
        return f"{name}*abs({name})" if power == 2 else f"{name}*abs({name})**{power - 1}"

    def write_unsigned_power(match: re.Match[str]) -> str:
        """abs(x)**n as x**n for even n; for odd n only the exponent 1 is left out."""
        name, power = match[1], int(match[2])
        return f"abs({name})" if power == 1 else f"{name}**{power}" if power % 2 == 0 else f"abs({name})**{power}"

    expression = re.sub(r"abs\((\w+)\)\*\*(\d+)(?!\.)\*sign\(\1\)", write_signed_power, expression)
    expression = re.sub(r"abs\((\w+)\)\*\*(\d+)(?![\d.])", write_unsigned_power, expression)
    return re.sub(r"(?<=[\w)])\*\*1(?![\d.])", "", expression)
