"""Rounds a law's exponents to whole or half numbers where their errors allow it, drops a memory that is shorter than a
sample, and simplifies the formula."""

import re
from dataclasses import replace
from functools import reduce

import numpy as np

from analysis.diagnosis.discovery.law_of_sum import laws_of
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, combine, hypothesis_of_claim
from analysis.diagnosis.errors.intervals import sensitivity_to_all, standard_errors
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit, fit
from analysis.diagnosis.search.search_context import FIRST_ROUNDS, SearchContext
from analysis.diagnosis.settings import INTERVAL_FACTOR, LAW_SNAP
from equalizer.effects.discovered_law import law_channels, law_effect, law_values
from equalizer.laws.law import Law, roles

_CUBE_WITH_MEMORY = re.compile(r"\b(\w+)\*lag\(\1\*\*2, (?:p(\d+)|0)\)")
_LIMIT = re.compile(r"(\w+) \+ p0\*\((.+) - \1\)")
"""A signal plus a share of a soft limit of it less itself (`grammar.bent_terms`)."""


def snap_exponents(context: SearchContext, fitted: Fitted) -> Fitted:
    """The fit repeated with exponents held at whole or half numbers; unchanged where none is near one, or where that
    costs too much."""
    t = len(fitted.deviations)
    of_all = sensitivity_to_all(context.measure, context.tuning, fitted.deviations, fitted.hypothesis, context.map_)
    errors = standard_errors(context.measure, fitted, of_all)[t:]
    plain = _with_simple_exponents(context, fitted.hypothesis, errors)
    if plain is None:
        return fitted
    start = evaluate_fit(context.measure, context.tuning, fitted.deviations, plain)
    known = replace(of_all, columns=of_all.columns[:t], squares=of_all.squares[:t, :t])
    found = fit(context.measure, context.tuning, start, known, FIRST_ROUNDS)
    return found if found.cost <= fitted.cost * (1 + LAW_SNAP) else fitted


def _with_simple_exponents(context: SearchContext, whole: Hypothesis, errors: np.ndarray) -> Hypothesis | None:
    """The hypothesis with simple exponents; None where none changes. errors: (parameters,), standard errors."""
    recording = context.measure.records[0].recording
    parts, changed, first = [], False, 0
    for number, (claim, law) in enumerate(zip(whole.claims, laws_of(whole), strict=True)):
        count = len(claim.effect.parameters) * claim.groups
        own = errors[first : first + count]
        first += count
        if law is None:
            parts.append(_single_claim(whole, number))
            continue
        simple = _without_short_memory(law, 1 / recording.sample_rate_hz)
        simple = _simplify_exponents(law, own) if simple is law else simple
        changed |= simple is not law
        effect = law_effect(simple, law_channels(recording))
        parts.append(hypothesis_of_claim(Claim(effect, "one", claim.sites), [law_values(simple)]))
    if not changed:
        return None
    return reduce(combine, parts)


def _single_claim(whole: Hypothesis, number: int) -> Hypothesis:
    claim = whole.claims[number]
    return hypothesis_of_claim(claim, [dict(placed.values) for placed in whole.of_claim(number)])


def _without_short_memory(law: Law, sample_s: float) -> Law:
    """The law with the cube of a signal for the signal times its lagged square where the lag is less than a sample."""
    found = _CUBE_WITH_MEMORY.search(law.expression)
    if found is None or found[2] is None or law.numbers[int(found[2])] >= sample_s:
        return law
    # The number is written in and the place that held it with it, so that those after it move up.
    short = substitute_parameter(law, int(found[2]), 0.0)
    return replace(short, expression=_CUBE_WITH_MEMORY.sub(r"\1**3", short.expression, count=1))


def _simplify_exponents(law: Law, errors: np.ndarray) -> Law:
    """The law with exponents near a half or a whole number written into the formula. errors: of their logarithms."""
    found = law
    for place, role in sorted(roles(law.tree).items(), reverse=True):
        value = law.numbers[place]
        if role != "exponent" or value <= 0:
            continue
        near = max(round(2 * value) / 2, 0.5)
        reach = 1.96 * INTERVAL_FACTOR * float(errors[place]) * value
        if abs(value - near) <= max(reach, LAW_SNAP * value):
            found = substitute_parameter(found, place, near)
    if found.numbers == law.numbers:
        found = _simplify_limit(law, float(errors[0]) * abs(law.numbers[0]))
    return replace(found, expression=simplify_powers(found.expression.removeprefix("1*")))


def is_whole_limit(law: Law, within: float) -> bool:
    """Whether it is a signal plus p0 times a soft limit less the signal, with p0 near 1: the limit itself."""
    return bool(_LIMIT.fullmatch(law.expression)) and abs(law.numbers[0] - 1) <= within


def _simplify_limit(law: Law, error: float) -> Law:
    """A soft limit alone where its factor's interval holds 1 and does not reach zero. error: of the factor."""
    reach = 1.96 * INTERVAL_FACTOR * error
    limit = _LIMIT.fullmatch(law.expression)
    if limit is None or not reach < 1 or not is_whole_limit(law, max(reach, LAW_SNAP)):
        return law
    return substitute_parameter(replace(law, expression=f"p0*{limit[2]}"), 0, 1.0)


def substitute_parameter(law: Law, place: int, value: float) -> Law:
    """The law with the free parameter `place` replaced by a value in the formula."""
    text = re.sub(rf"\bp{place}\b", f"{value:g}", law.expression)
    renamed = re.sub(r"\bp(\d+)\b", lambda found: f"p{int(found[1]) - (int(found[1]) > place)}", text)
    numbers = (*law.numbers[:place], *law.numbers[place + 1 :])
    return replace(law, expression=renamed, numbers=numbers, units=())


def simplify_powers(expression: str) -> str:
    """The formula with powers of whole exponents written without absolute values where these are not needed."""

    def signed(found: re.Match[str]) -> str:
        name, power = found[1], int(found[2])
        if power % 2:
            return name if power == 1 else f"{name}**{power}"
        return f"{name}*abs({name})" if power == 2 else f"{name}*abs({name})**{power - 1}"

    def plain(found: re.Match[str]) -> str:
        name, power = found[1], int(found[2])
        return f"abs({name})" if power == 1 else f"{name}**{power}" if power % 2 == 0 else f"abs({name})**{power}"

    expression = re.sub(r"abs\((\w+)\)\*\*(\d+)(?!\.)\*sign\(\1\)", signed, expression)
    expression = re.sub(r"abs\((\w+)\)\*\*(\d+)(?![\d.])", plain, expression)
    return re.sub(r"(?<=[\w)])\*\*1(?![\d.])", "", expression)
