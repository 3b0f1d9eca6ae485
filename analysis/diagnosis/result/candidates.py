"""Add the candidates and the other results of force balances to a diagnosis: classes, shares, and balance errors.

A class contains effects that the data cannot distinguish; a candidate is a law that was found but not confirmed. Gains
are fractions of the squared force error (`judged_law`). channels: names of the commands, in the order of the balances.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from analysis.diagnosis.confirm.require_gain import CONSTANT_EFFECTS
from analysis.diagnosis.document import Candidate, Diagnosis, FoundLaw, NamedEffect, Rival, make_found_law
from analysis.diagnosis.effect_words import get_noun, get_place
from analysis.diagnosis.limits import FURTHER_LAW_GAIN, LAW_REDUCTION_SHARE
from analysis.diagnosis.result.candidate_wording import REFINEMENT_REASON
from analysis.diagnosis.result.findings import BalanceErrors
from analysis.wording import conjoin
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.placing import shorten_axis_name

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance
    from analysis.diagnosis.balance.judged_law import JudgedLaw


_NAME, _FREE_PARAMETER, _AXIS_SIGNAL = re.compile(r"[A-Za-z_]\w*"), re.compile(r"^p\d+$"), re.compile(r"^([vf]?)[xyz]$")
"""Regular expressions: names in a formula; its free parameters; position, velocity (v) or command (f) of an axis; below
that, unsigned numbers."""
_NUMBER = re.compile(r"(?<![A-Za-z_\d])\d[\d.]*(?:[eE][+-]?\d+)?")
MOST_CANDIDATES = 6
"""Largest number of candidates that a diagnosis lists. Chosen by hand."""
SPECIAL_CASES = {
    "drifting_friction": ("coulomb_friction",),
    "condition_dependent_friction": ("coulomb_friction",),
    "drifting_force": ("constant_force",),
}
"""Laws without a simulation, and the special cases that each contains."""
# SPECIAL_CASE, EQUALLY_GOOD and LINEAR_DYNAMICS: reasons in `diagnosis.json` for which an effect is not named.
SPECIAL_CASE = (
    "its special case, which is named, has hardly a larger error in a simulation, which does not determine the "
    "further parameters"
)
EQUALLY_GOOD = "equally good in its place on held-out data"
DELAY_EFFECTS = ("transport_delay", "amplifier_lag", "sensor_lag", "logger_offset")
"""Effects that delay a signal: where each command moves a single measured response, a late command and a late reading
are equivalent. The class is also stated for coupled axes, where it may be too wide."""
LINEAR_DYNAMICS = "a mode, lag or relaxation that the model lacks: linear dynamics, which simulations did not confirm"


def add_balances_with_given_model(
    diagnosis: Diagnosis, balances: "Sequence[Balance]", unconfirmed: Sequence[Candidate], channels: tuple[str, ...]
) -> Diagnosis:
    """Add classes and candidates to the diagnosis of a search, for a model that the user gave. unconfirmed: effects
    that the search by simulation found and did not name."""
    equivalents = {
        (law.law.effect, shorten_axis_name(channels[axis], channels)): law.equivalents
        for axis, balance in enumerate(balances)
        for law in balance.laws
    }
    effects = tuple(
        replace(effect, class_=_find_class(effect, equivalents.get((effect.effect, effect.axis or ""), ())))
        for effect in diagnosis.effects
    )
    named_keys = {(name, effect.axis) for effect in effects for name in (effect.effect, *effect.class_)}
    judged_laws = [
        (shorten_axis_name(channels[axis], channels), law)
        for axis, balance in enumerate(balances)
        for law in (*balance.laws, *balance.further_laws)
    ]
    balance_candidates = [
        _make_candidate(replace(law, objection=LINEAR_DYNAMICS) if law.law.is_linear else law, axis, channels)
        for axis, law in sorted(judged_laws, key=lambda entry: (_rank_law(entry[1]), -entry[1].gain))
        if law.share >= LAW_REDUCTION_SHARE and law.gain >= FURTHER_LAW_GAIN
    ]
    ranked = sorted((*unconfirmed, *balance_candidates), key=lambda candidate: -candidate.held_out_gain)
    unnamed = [candidate for candidate in ranked if (candidate.effect, candidate.axis) not in named_keys]
    return replace(diagnosis, effects=effects, candidates=_deduplicate(unnamed)[:MOST_CANDIDATES])


def _find_class(effect: NamedEffect, equivalents: tuple[str, ...]) -> tuple[str, ...]:
    """Find the class of an effect: its name and its rivals that neither simulation nor balance can distinguish from it;
    empty without such rivals. equivalents: rivals by the balance."""
    distinguished_names = {rival.effect for rival in effect.rivals if not rival.inseparable}
    class_names = [rival.effect for rival in effect.rivals if rival.inseparable]
    class_names += [name for name in equivalents if name not in distinguished_names]
    return tuple(dict.fromkeys((effect.effect, *class_names))) if class_names else ()


def add_balances_with_fitted_model(
    diagnosis: Diagnosis,
    balances: "Sequence[Balance]",
    channels: tuple[str, ...],
    unconfirmed: Sequence[Candidate] = (),
) -> Diagnosis:
    """Add classes, shares and candidates to the diagnosis, for a model that was fitted to the same recordings;
    unchanged without balances. unconfirmed: effects of actuator and sensor that a search found, listed after the laws
    of ranks 0 and 1 (`_rank_law`). A constant force or sensor offset that no balance contains becomes a re-tuned
    parameter; where no effect remains, the verdict "explained" becomes "parameters", and any other "unexplained"."""
    if not balances:
        return diagnosis
    judged_laws = [
        (law, shorten_axis_name(channels[axis], channels), _compute_explained_share(balance, law))
        for axis, balance in enumerate(balances)
        for law in balance.laws
    ]
    unnamed_constants = {
        f"{effect.effect.replace('_', ' ')} {effect.axis}": effect.parameters[CONSTANT_EFFECTS[effect.effect]].value
        for effect in diagnosis.effects
        if effect.effect in CONSTANT_EFFECTS and _find_matching_law(effect, judged_laws) is None
    }
    effects = tuple(
        _add_balance_results(effect, _find_matching_law(effect, judged_laws))
        for effect in diagnosis.effects
        if f"{effect.effect.replace('_', ' ')} {effect.axis}" not in unnamed_constants
    )
    named_keys = {(name, effect.axis) for effect in effects for name in _list_covered_names(effect)}
    ranked = [
        (_rank_law(law), _make_candidate(law, shorten_axis_name(channels[axis], channels), channels, effects))
        for axis, balance in enumerate(balances)
        for law in (*balance.laws, *balance.further_laws)
        if law.formula is None or (law.simulated_as, shorten_axis_name(channels[axis], channels)) not in named_keys
    ]
    ranked += [(1, candidate) for candidate in unconfirmed]
    unnamed = [c for _, c in sorted(ranked, key=lambda entry: entry[0]) if (c.effect, c.axis) not in named_keys]
    retuned = {**diagnosis.retuned, **unnamed_constants}
    verdict = diagnosis.verdict
    if not effects and diagnosis.effects:
        verdict = "parameters" if verdict == "explained" else "unexplained"
    return replace(
        diagnosis, verdict=verdict, effects=effects, retuned=retuned, candidates=_deduplicate(unnamed)[:MOST_CANDIDATES]
    )


def _find_matching_law(
    effect: NamedEffect, judged_laws: "Sequence[tuple[JudgedLaw, str, float]]"
) -> "tuple[JudgedLaw, float] | None":
    """Find the law of a balance that the named effect represents, with its share of the mismatch; None where no balance
    has it. judged_laws: laws with their axis and share."""
    for law, axis, share in judged_laws:
        is_match = (law.simulated_as, axis) == (effect.effect, effect.axis or "")
        if is_match and law.formula is not None and effect.law is not None:
            is_match = law.named and _extract_form(effect.law.expression) == _extract_form(law.formula.text)
        if is_match:
            return law, share
    return None


def _extract_form(formula: str) -> list[str]:
    """Extract the signals and functions of a formula in their order, without numbers and free parameters, to compare
    formulas. Signals of an axis get the names of a balance (x, vx and fx become q, v and f)."""
    names = (_FREE_PARAMETER.sub("", name) for name in _NAME.findall(_NUMBER.sub("", formula)))
    return [_AXIS_SIGNAL.sub(lambda match: match[1] or "q", name) for name in names if name]


def _list_covered_names(effect: NamedEffect) -> tuple[str, ...]:
    """List the names that are no candidates once the effect is named: its own, its class, and its refinements."""
    refinement_names = (rival.effect for rival in effect.rivals if rival.why_not == REFINEMENT_REASON)
    return (effect.effect, *effect.class_, *refinement_names)


def _rank_law(judged_law: "JudgedLaw") -> int:
    """Rank a candidate, 0 first. 0: physically possible parameters and a significant gain; 1: other laws; 2: linear
    laws; 3: laws that explain almost nothing (`LAW_REDUCTION_SHARE`)."""
    if judged_law.law.is_linear:
        return 2
    if judged_law.share < LAW_REDUCTION_SHARE:
        return 3
    return 0 if judged_law.is_physical and (judged_law.gain_low > 0 or judged_law.confirmed_by_folds) else 1


def describe_linear_terms(
    balances: "Sequence[Balance]", channels: tuple[str, ...], in_samples: bool = False
) -> tuple[str, ...]:
    """Describe the linear terms of the fitted model other than mass, damping and stiffness. in_samples: whether times
    are in samples, for recordings without a time axis."""
    remarks = []
    for channel, balance in zip(channels, balances, strict=False):
        base_terms, motion = balance.search.regression.base_terms, balance.search.regression.motions[0]
        law_names = [law.effect for law in balance.linear_laws]
        delay_text = f"{base_terms.delay_s:.3g} samples" if in_samples else f"{1e3 * base_terms.delay_s:.3g} ms"
        term_texts = [f"a delay of {delay_text} from force to motion (or a lag)"] if base_terms.delay_s else []
        term_texts += [get_noun(name) for name in dict.fromkeys(law_names)]
        if len(motion.channels) > len(balances):
            further_motions = [name for index, name in enumerate(motion.channels) if index != base_terms.driven_channel]
            term_texts.append(f"the motion of {conjoin(further_motions)}")
        if term_texts:
            place = f" along {channel}" if len(channels) > 1 else ""
            remarks.append(
                f"In addition to mass, damping and stiffness, the first model contains{place} {conjoin(term_texts)}; "
                "linear terms are not counted as missing physics."
            )
    return tuple(remarks)


def collect_balance_errors(
    diagnosis: Diagnosis, balances: "Sequence[Balance]", channels: tuple[str, ...]
) -> tuple[BalanceErrors, ...]:
    """Collect the errors of each axis's balance on held-out data, without and with the named laws."""
    errors = []
    for axis, balance in enumerate(balances):
        letter = shorten_axis_name(channels[axis], channels)
        named_effects = {effect.effect for effect in diagnosis.effects if effect.axis in (letter, None, "")}
        law_indices = [law.law_index for law in balance.laws if law.simulated_as in named_effects]
        linear_error, all_laws_error = balance.linear_error, balance.all_laws_error
        named_error = balance.compute_error(law_indices) if law_indices else linear_error
        has_prior = balance.search.regression.prior is not None
        errors.append(
            BalanceErrors(
                letter, linear_error, named_error, all_laws_error, bool(law_indices), balance.tested, has_prior
            )
        )
    return tuple(errors)


def _deduplicate(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Remove repeated effects, each of which stays at its highest rank; laws outside the catalogue are equal only if
    their formulas and axes are. candidates: the best first."""
    unique_candidates: dict[object, Candidate] = {}
    for candidate in candidates:
        law = candidate.law
        unique_candidates.setdefault(candidate.effect if law is None else (law.axis, law.expression), candidate)
    return tuple(unique_candidates.values())


def _compute_explained_share(balance: "Balance", law: "JudgedLaw") -> float:
    """Compute the share of the linear model's held-out error power that a law removes, 0 to 1. `JudgedLaw.share` is
    relative to the decrease by all laws together, and is converted; that of a law of the command is already relative to
    the linear model's error."""
    total_share = 1 - (balance.all_laws_error / max(balance.linear_error, 1e-300)) ** 2 if law.has_column else 1.0
    return min(max(total_share * law.share, 0.0), 1.0)


def _add_balance_results(effect: NamedEffect, law_and_share: "tuple[JudgedLaw, float] | None") -> NamedEffect:
    """Add class, share, probability and rivals by the balance to an effect. law_and_share: the law of the balance, and
    its share of the mismatch; None where no balance has it: then only a delay gets a class (`DELAY_EFFECTS`)."""
    if law_and_share is None:
        is_delay = effect.effect in DELAY_EFFECTS
        return replace(effect, class_=tuple(dict.fromkeys((effect.effect, *DELAY_EFFECTS)))) if is_delay else effect
    # Imported on demand: without balances it is not needed.
    from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS

    law, share = law_and_share
    known_rivals = {rival.effect for rival in effect.rivals}
    rival_names = [name for name in law.equivalents if name not in FREE_LAWS]  # no name, but another form of a formula
    equivalents = tuple(
        name for name in rival_names if name == law.stands_for or not is_refinement_of(name, effect.effect)
    )
    rivals = tuple(
        Rival(name, 0.0, name in equivalents, EQUALLY_GOOD if name in equivalents else REFINEMENT_REASON)
        for name in rival_names
        if name not in known_rivals
    )
    effect_names = (effect.effect,) if law.formula is None or law.is_free else (effect.effect, law.law.effect)
    class_names = (*effect_names, *equivalents) if len(effect_names) + len(equivalents) > 1 else ()
    return replace(
        effect, share=share, probability=law.probability, rivals=(*effect.rivals, *rivals), class_=class_names
    )


def is_refinement_of(effect: str, special_case: str) -> bool:
    """Whether an effect contains the effect `special_case` as a special case."""
    special_cases = EFFECTS[effect].simpler if effect in EFFECTS else SPECIAL_CASES.get(effect, ())
    return special_case in special_cases


def _make_candidate(
    judged_law: "JudgedLaw", axis: str, channels: tuple[str, ...], effects: Sequence[NamedEffect] = ()
) -> Candidate:
    """Make a candidate of the document from a law of a balance. axis: its letter. effects: the named effects."""
    has_named_special_case = any(
        is_refinement_of(judged_law.law.effect, effect.effect) and effect.axis == axis for effect in effects
    )
    default_reason = SPECIAL_CASE if has_named_special_case else "simulations of the whole recording do not confirm it"
    law = _write_found_law(judged_law, axis, channels) if judged_law.is_free else None
    effect = judged_law.law.effect if law is None else judged_law.simulated_as
    return Candidate(
        effect=effect,
        place=get_place(effect),
        axis=axis or None,
        parameters=judged_law.values,
        held_out_gain=min(max(judged_law.gain, 0.0), 1.0),
        share_of_black_box=min(max(judged_law.share, 0.0), 1.0),
        why_not=judged_law.objection or default_reason,
        law=law,
    )


def _write_found_law(judged_law: "JudgedLaw", axis: str, channels: tuple[str, ...]) -> FoundLaw | None:
    """Write the formula of a law outside the catalogue for the document; None without a formula or axis letter."""
    # Imported on demand: few diagnoses have such a law.
    from analysis.diagnosis.confirm.laws_for_simulation import write_law
    from equalizer.effects.discovered_law import derive_axis_letters

    short_names = (shorten_axis_name(name, channels) for name in channels)
    letters = dict(zip(short_names, derive_axis_letters(channels), strict=False))  # letters exist for three axes
    if judged_law.formula is None or axis not in letters:
        return None
    return make_found_law(replace(write_law(judged_law.formula, letters[axis]), axis=axis))
