"""Converts laws that a force balance named to hypotheses of a simulation, with starting parameters."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.structures import values_of
from analysis.diagnosis.confirm.require_gain import CONSTANT
from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, Hypothesis, combine, hypothesis_of_claim
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.catalogue import EFFECTS
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_OWN = re.compile(r"\b[qvf]\b")
_PREFIX = {"q": "", "v": "v", "f": "f"}
"""Signals of an axis in the language of laws, by their names in a balance's formula."""


def can_be_played(own: int, judged: JudgedLaw) -> bool:
    """Whether a simulation can use the law: it has a formula, or is an effect of the catalogue on its own axis with all
    parameters in their bounds. own: channel of the axis."""
    if judged.formula is not None:
        return True
    effect = EFFECTS.get(judged.law.effect)
    if effect is None or judged.law.channel != own:
        return False
    return all(
        parameter.name in judged.values and parameter.lower <= judged.values[parameter.name] <= parameter.upper
        for parameter in effect.parameters
    )


def refit_laws(balances: Sequence[Balance], named: Sequence[tuple[int, JudgedLaw]]) -> list[tuple[int, JudgedLaw]]:
    """The laws with the parameters that the balances give when only these laws are fitted."""
    found = []
    for axis, law in named:
        if not law.has_column:
            found.append((axis, law))
            continue
        regression = balances[axis].search.regression
        places = [other.place for of, other in named if of == axis and other.has_column]
        values = values_of(regression, places)[places.index(law.place)]
        found.append((axis, law if values is None else _with_values(law, values)))
    return found


def _with_values(judged: JudgedLaw, values: dict[str, float]) -> JudgedLaw:
    formula = judged.formula if judged.law.formula is None else judged.law.formula(values)
    return replace(judged, values=values, formula=formula)


def find_special_case(
    balances: Sequence[Balance], named: Sequence[tuple[int, JudgedLaw]], refining: tuple[int, JudgedLaw]
) -> tuple[int, JudgedLaw] | None:
    """The law of the same axis that another one refines, still with that one's parameters; None where the balance does
    not hold it, or it is named."""
    axis, judged = refining
    effect = EFFECTS.get(judged.law.effect)
    taken = {law.law.effect for of, law in named if of == axis}
    for place, law in enumerate(balances[axis].search.regression.laws):
        alike = law.channel == judged.law.channel and law.effect not in taken
        if effect is not None and alike and law.effect in effect.simpler:
            return axis, replace(judged, place=place, law=law)
    return None


def constants_of(balances: Sequence[Balance]) -> Hypothesis:
    """Constant forces along the axes: a weight, or the offset of an amplifier or sensor, which mass, damping and
    stiffness do not describe."""
    whole = NOTHING
    for axis, balance in enumerate(balances):
        regression = balance.search.regression
        if regression.prior is not None:
            continue
        force = -float(regression.weights(regression.columns_of(()))[-1])
        if force:
            claim = Claim(EFFECTS[CONSTANT], "one", (axis,))
            whole = combine(whole, hypothesis_of_claim(claim, [{"force": force}]))
    return whole


def hypothesis_of_judged(axis: int, judged: JudgedLaw, recording: Recording) -> Hypothesis:
    """A named law of the balance as a hypothesis to simulate. recording: whose channels a formula's signals are."""
    if judged.formula is not None:
        # Imported here: few diagnoses have such a law.
        from analysis.diagnosis.errors.law_hypothesis import hypothesis_of_law
        from equalizer.effects.discovered_law import axis_names
        from equalizer.laws.law import Law

        name, formula = axis_names(recording.command.channels)[axis], judged.formula
        text = _OWN.sub(lambda signal: f"{_PREFIX[signal[0]]}{name}", formula.text)
        return hypothesis_of_law(Law(text, formula.numbers, (), formula.acts_on, name), axis, recording)
    known = EFFECTS_BY_NAME[judged.law.effect].parameters
    return hypothesis_of_claim(
        Claim(EFFECTS[judged.law.effect], "one", (axis,)),
        [{p.name: judged.values[p.name] for p in known if p.name in judged.values}],
    )


def parameters_beside_laws(tuning: Tuning, balances: Sequence[Balance], laws: Sequence[int]) -> FloatArray:
    """Deviations of mass, damping and stiffness to their values beside the laws of the only balance; zeros
    otherwise."""
    start = np.zeros(len(tuning.names))
    if any(balance.search.regression.prior is not None for balance in balances):
        return start
    model = tuning.model
    if len(balances) != 1 or model.coordinates != 1:
        return start
    regression = balances[0].search.regression
    weights = regression.weights(regression.columns_of(laws))[: regression.matrices]
    given = (model.mass, model.damping, model.stiffness)
    for place, (weight, matrix) in enumerate(zip(weights, given, strict=False)):
        if tuning.deviation[place] == 0:  # it is not changed
            continue
        if place == 0:
            weight = max(weight, matrix[0, 0] / 10)
        start[place] = np.clip((weight - matrix[0, 0]) / tuning.deviation[place], -3.9, 3.9)
    return start
