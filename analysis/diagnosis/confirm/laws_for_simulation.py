"""Convert laws named by a force balance to hypotheses for output-error fits, with starting parameters.

A law of the catalogue becomes the effect of the same name with the fitted parameters; a law outside the catalogue
becomes a formula in the language of `equalizer.laws`. Called by `confirm_laws`.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance, judge_structure
from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.laws.law import Formula
from analysis.diagnosis.balance.structures import Structure, fit_values
from analysis.diagnosis.confirm.require_gain import CONSTANT_FORCE
from analysis.diagnosis.errors.hypothesis import (
    NO_EFFECTS,
    Claim,
    Hypothesis,
    combine_hypotheses,
    make_claim_hypothesis,
)
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import Effect, Parameter
from equalizer.laws.law import Law
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

_AXIS_SIGNALS = re.compile(r"\b[qvf]\b")
"""Symbols of a formula for position (q), velocity (v) and command (f) of the law's axis."""
_SIGNAL_PREFIX = {"q": "", "v": "v", "f": "f"}
"""Prefix of an axis's name in the language of laws, by the symbol in a formula of the balance."""
_EXTREME_MAGNITUDE = 1e30
"""Limit of a parameter that is not in SI; its reciprocal is the least positive value. Beyond any unit of a device."""
_LARGEST_STARTING_DEVIATION = 3.9
"""Largest starting deviation of a model parameter, in standard deviations: just within `RETUNING_BOUND`."""


def write_law(formula: Formula, axis_letter: str) -> Law:
    """Write a formula of the balance as a law of an axis: the signals q, v and f become, on axis x, x, vx and fx."""
    law_text = _AXIS_SIGNALS.sub(lambda symbol: f"{_SIGNAL_PREFIX[symbol[0]]}{axis_letter}", formula.text)
    return Law(law_text, formula.numbers, (), formula.acts_on, axis_letter)


def can_be_simulated(driven_channel: int, judged_law: JudgedLaw, units: UnitSystem | None = None) -> bool:
    """Whether a simulation can use the law: it has a formula, or is an effect of the catalogue that depends on the
    motion along its force and has values of all parameters within their bounds (included). driven_channel: index of the
    channel of that motion. units: of the model, None in SI."""
    if judged_law.formula is not None:
        return True
    effect = _select_effect(judged_law.law.effect, units)
    if effect is None or judged_law.law.channel != driven_channel:
        return False
    return all(
        parameter.name in judged_law.values and parameter.lower <= judged_law.values[parameter.name] <= parameter.upper
        for parameter in effect.parameters
    )


def _select_effect(name: str, units: UnitSystem | None) -> Effect | None:
    """Select an effect of the catalogue; None where it has none of that name. The bounds of its parameters are in SI.
    With other units (a motion in counts, a command in A) they have no meaning for parameters in these units, which are
    then limited by `_EXTREME_MAGNITUDE` alone."""
    effect = EFFECTS.get(name)
    if effect is None or units is None:
        return effect
    si_units = {parameter.name: parameter.unit for parameter in EFFECTS_BY_NAME[name].parameters}
    return replace(
        effect,
        parameters=tuple(
            parameter
            if units.express(unit := si_units.get(parameter.name, "1")) == unit
            else replace(parameter, lower=_widen_lower_bound(parameter), upper=_EXTREME_MAGNITUDE)
            for parameter in effect.parameters
        ),
    )


def _widen_lower_bound(parameter: Parameter) -> float:
    """Widen the lower bound of a parameter that is not in SI; its sign, or zero, stays."""
    if parameter.scale == "log":
        return 1 / _EXTREME_MAGNITUDE
    return -_EXTREME_MAGNITUDE if parameter.lower < 0 else parameter.lower


def refit_laws(balances: Sequence[Balance], named_laws: Sequence[tuple[int, JudgedLaw]]) -> list[tuple[int, JudgedLaw]]:
    """Fit the parameters of the laws again, with only these laws in each axis's balance. named_laws: axis index and
    law. Laws without a column in the regression, or without valid fitted values, stay unchanged."""
    refitted = []
    for axis, law in named_laws:
        if not law.has_column:
            refitted.append((axis, law))
            continue
        regression = balances[axis].search.regression
        law_indices = [
            other_law.law_index for other_axis, other_law in named_laws if other_axis == axis and other_law.has_column
        ]
        values = fit_values(regression, law_indices)[law_indices.index(law.law_index)]
        refitted.append((axis, law if values is None else _replace_values(law, values)))
    return refitted


def _replace_values(judged_law: JudgedLaw, values: dict[str, float]) -> JudgedLaw:
    """Replace the parameters of a law, also in its formula where it has one."""
    formula = judged_law.formula if judged_law.law.formula is None else judged_law.law.formula(values)
    return replace(judged_law, values=values, formula=formula)


def find_special_case(
    balances: Sequence[Balance], named_laws: Sequence[tuple[int, JudgedLaw]], refining_law: tuple[int, JudgedLaw]
) -> tuple[int, JudgedLaw] | None:
    """Find a special case of a law on the same axis, such as Coulomb friction of Stribeck friction; it has the
    parameters of the given law until `refit_laws`. None where the balance contains no special case, or only such as are
    named already. named_laws: the other named laws; refining_law: axis index and law."""
    axis, judged_law = refining_law
    refining_effect = EFFECTS.get(judged_law.law.effect)
    named_effects = {law.law.effect for law_axis, law in named_laws if law_axis == axis}
    for law_index, law in enumerate(balances[axis].search.regression.laws):
        is_unnamed = law.channel == judged_law.law.channel and law.effect not in named_effects
        if refining_effect is not None and is_unnamed and law.effect in refining_effect.simpler:
            return axis, replace(judged_law, law_index=law_index, law=law)
    return None


def judge_special_cases(balances: Sequence[Balance], claims: Sequence[Claim]) -> tuple[Balance, ...]:
    """Judge the balances again with the special cases that simulations preferred to laws of theirs, so that gains and
    shares are those of the named effects; other balances are unchanged. The rivals are those of the replaced laws,
    which were named for being distinguished from all others. claims: the named effects."""
    return tuple(
        _judge_special_cases_of_axis(balances, axis, {claim.effect.name for claim in claims if axis in claim.sites})
        for axis in range(len(balances))
    )


def _judge_special_cases_of_axis(balances: Sequence[Balance], axis: int, named_effects: set[str]) -> Balance:
    """Judge one balance again, as `judge_special_cases`. named_effects: names of the effects on this axis."""
    balance, special_indices = balances[axis], {}
    for judged_law in balance.named:
        special_case = find_special_case(balances, [(axis, law) for law in balance.laws], (axis, judged_law))
        is_replaced = judged_law.has_column and judged_law.simulated_as not in named_effects
        if is_replaced and special_case is not None and special_case[1].law.effect in named_effects:
            special_indices[judged_law.law_index] = special_case[1].law_index
    if not special_indices:
        return balance
    regression = balance.search.regression
    indices = tuple(dict.fromkeys(special_indices.get(index, index) for index in balance.chosen.laws))
    chosen = Structure(indices, regression.cross_validate(regression.select_columns(indices)))
    judged = judge_structure(balance.search, chosen)
    command_laws, further_command_laws = (
        tuple(law for law in laws if not law.has_column) for laws in (balance.laws, balance.further_laws)
    )
    earlier_laws = {special_indices.get(law.law_index, law.law_index): law for law in balance.laws}
    return replace(
        judged,
        laws=(*command_laws, *(_keep_judgement(law, earlier_laws[law.law_index]) for law in judged.laws)),
        further_laws=tuple(sorted((*judged.further_laws, *further_command_laws), key=lambda law: -law.gain)),
        linear_error=balance.linear_error,
    )


def _keep_judgement(law: JudgedLaw, earlier: JudgedLaw) -> JudgedLaw:
    """Keep the reason not to name a law. A special case gets the name, the rivals and the probability of the earlier
    law, which it replaced and which becomes a rival itself."""
    if law.law_index == earlier.law_index:
        return replace(law, objection=earlier.objection)
    rivals = (earlier.law.effect, *earlier.equivalents)
    return replace(
        law,
        objection=earlier.objection,
        equivalents=tuple(effect for effect in rivals if effect != law.law.effect),
        probability=earlier.probability,
    )


def estimate_constant_forces(balances: Sequence[Balance]) -> Hypothesis:
    """Estimate the constant forces along the axes, N (N m): a weight, or the offset of an amplifier or sensor. Axes
    whose balance has a given model, or whose constant is 0, are left out."""
    hypothesis = NO_EFFECTS
    for axis, balance in enumerate(balances):
        regression = balance.search.regression
        if regression.prior is not None:
            continue
        constant_force = -float(regression.fit_weights(regression.select_columns(()))[-1])
        if constant_force:
            claim = Claim(EFFECTS[CONSTANT_FORCE], "one", (axis,))
            hypothesis = combine_hypotheses(hypothesis, make_claim_hypothesis(claim, [{"force": constant_force}]))
    return hypothesis


def make_hypothesis(
    axis: int, judged_law: JudgedLaw, recording: Recording, units: UnitSystem | None = None
) -> Hypothesis:
    """Convert a named law of the balance of an axis (index) to a hypothesis. recording: one with the channels that a
    formula refers to. units: of the model, None in SI."""
    if judged_law.formula is not None:
        # Imported here to save start-up time: few diagnoses have such a law.
        from analysis.diagnosis.errors.law_hypothesis import make_law_hypothesis
        from equalizer.effects.discovered_law import derive_axis_letters

        axis_letter = derive_axis_letters(recording.command.channels)[axis]
        return make_law_hypothesis(write_law(judged_law.formula, axis_letter), axis, recording)
    effect, parameters = _select_effect(judged_law.law.effect, units), EFFECTS_BY_NAME[judged_law.law.effect].parameters
    assert effect is not None
    return make_claim_hypothesis(
        Claim(effect, "one", (axis,)),
        [
            {
                parameter.name: judged_law.values[parameter.name]
                for parameter in parameters
                if parameter.name in judged_law.values
            }
        ],
    )


def compute_starting_deviations(tuning: Tuning, balances: Sequence[Balance], laws: Sequence[int]) -> FloatArray:
    """Compute the starting deviations of mass, damping and stiffness, in standard deviations: from the model's values
    to those that the balance fits together with the laws. Zeros unless there is a single balance, without a given
    model, and the model has one coordinate. A mass is at least a tenth of the model's (chosen). laws: indices of the
    named laws in the regression."""
    deviations = np.zeros(len(tuning.names))
    if any(balance.search.regression.prior is not None for balance in balances):
        return deviations
    model = tuning.model
    if len(balances) != 1 or model.coordinates != 1:
        return deviations
    regression = balances[0].search.regression
    weights = regression.fit_weights(regression.select_columns(laws))[: regression.matrix_column_count]
    matrices = (model.mass, model.damping, model.stiffness)
    for parameter_index, (weight, matrix) in enumerate(zip(weights, matrices, strict=False)):
        if tuning.deviation[parameter_index] == 0:  # the parameter is not tuned
            continue
        if parameter_index == 0:
            weight = max(weight, matrix[0, 0] / 10)
        deviations[parameter_index] = (weight - matrix[0, 0]) / tuning.deviation[parameter_index]
    return np.clip(deviations, -_LARGEST_STARTING_DEVIATION, _LARGEST_STARTING_DEVIATION)
