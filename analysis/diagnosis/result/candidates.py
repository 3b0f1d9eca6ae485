"""Adds the results of force balances to the findings: classes of effects, shares, candidates, and balance errors.

A class holds effects that the data cannot distinguish; a candidate is a law that was found but is not confirmed. Gains
are shares of the squared force error on held-out data (`judged_law`).
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from analysis.diagnosis.confirm.require_gain import CONSTANTS
from analysis.diagnosis.document import Candidate, Diagnosis, NamedEffect, Rival
from analysis.diagnosis.effect_words import noun_of, place_of
from analysis.diagnosis.result.candidate_wording import REFINED
from analysis.diagnosis.result.findings import BalanceErrors
from analysis.diagnosis.settings import FURTHER_LAW_GAIN, LAW_OF_CEILING
from analysis.wording import conjoin
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.placing import axis_letter

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance
    from analysis.diagnosis.balance.judged_law import JudgedLaw


_NAME, _FREE, _OWN_SIGNAL = re.compile(r"[A-Za-z_]\w*"), re.compile(r"^p\d+$"), re.compile(r"^([vf]?)[xyz]$")
"""Names in a formula; names of its free parameters; names of the position, velocity or command of an axis."""
_NUMBER = re.compile(r"(?<![A-Za-z_\d])\d[\d.]*(?:[eE][+-]?\d+)?")
MOST = 6
"""Most candidates that a diagnosis lists. By hand."""
REFINING = {
    "drifting_friction": ("coulomb_friction",),
    "condition_dependent_friction": ("coulomb_friction",),
    "drifting_force": ("constant_force",),
}
"""Laws without a simulation, and the special cases that each contains."""
# PLAINER, ALIKE and BEYOND: reasons in the document for which an effect is not named.
PLAINER = (
    "its special case, which is named, has hardly a larger error in a simulation, which does not determine the "
    "further parameters"
)
ALIKE = "equally good in its place on held-out data"
LATE = ("transport_delay", "amplifier_lag", "sensor_lag", "logger_offset")
"""Effects that delay a signal: with a single measured response, a late command and a late reading are equivalent."""


BEYOND = "a mode, lag or relaxation that the model lacks: linear dynamics, which simulations did not confirm"


def beside_given(
    diagnosis: Diagnosis,
    balances: "Sequence[Balance]",
    unconfirmed: Sequence[Candidate],
    channels: tuple[str, ...],
) -> Diagnosis:
    """The diagnosis with classes and candidates, where a model was given. unconfirmed: effects that the search by
    simulation found and did not name. channels: of the commands."""
    alike = {
        (law.law.effect, axis_letter(channels[axis], channels)): law.alike
        for axis, balance in enumerate(balances)
        for law in balance.laws
    }
    effects = tuple(
        replace(effect, class_=_class_of(effect, alike.get((effect.effect, effect.axis or ""), ())))
        for effect in diagnosis.effects
    )
    named = {(name, effect.axis) for effect in effects for name in (effect.effect, *effect.class_)}
    weighed = [
        (axis_letter(channels[axis], channels), law)
        for axis, balance in enumerate(balances)
        for law in (*balance.laws, *balance.others)
    ]
    by_balance = [
        _candidate(replace(law, why_not=BEYOND) if law.law.linear else law, axis)
        for axis, law in sorted(weighed, key=lambda placed: (_rank(placed[1]), -placed[1].gain))
        if law.share >= LAW_OF_CEILING and law.gain >= FURTHER_LAW_GAIN
    ]
    both = sorted((*unconfirmed, *by_balance), key=lambda each: -each.held_out_gain)
    left = [each for each in both if (each.effect, each.axis) not in named]
    return replace(diagnosis, effects=effects, candidates=_once(left)[:MOST])


def _class_of(effect: NamedEffect, alike: tuple[str, ...]) -> tuple[str, ...]:
    """The effect with its rivals that neither simulation nor balance can distinguish from it; empty without any. alike:
    rivals by the balance."""
    passed = {rival.effect for rival in effect.rivals if not rival.inseparable}
    names = [rival.effect for rival in effect.rivals if rival.inseparable]
    names += [name for name in alike if name not in passed]
    return tuple(dict.fromkeys((effect.effect, *names))) if names else ()


def with_balances(
    diagnosis: Diagnosis,
    balances: "Sequence[Balance]",
    channels: tuple[str, ...],
    unconfirmed: Sequence[Candidate] = (),
) -> Diagnosis:
    """The diagnosis with classes, shares and candidates of the balances, where no model was given. channels: of the
    commands; unconfirmed: effects of actuator and sensor that a search found, listed after the laws of the motion. A
    constant force that no balance names is a parameter of the model, not an effect."""
    if not balances:
        return diagnosis
    weighed = [
        (law, axis_letter(channels[axis], channels), _compute_explained_share(balance, law))
        for axis, balance in enumerate(balances)
        for law in balance.laws
    ]
    constants = {
        f"{effect.effect.replace('_', ' ')} {effect.axis}": effect.parameters[CONSTANTS[effect.effect]].value
        for effect in diagnosis.effects
        if effect.effect in CONSTANTS and _weigh_law(effect, weighed) is None
    }
    effects = tuple(
        _with_class(effect, _weigh_law(effect, weighed))
        for effect in diagnosis.effects
        if f"{effect.effect.replace('_', ' ')} {effect.axis}" not in constants
    )
    named = {(name, effect.axis) for effect in effects for name in _names_covered_by(effect)}
    found = [
        (_rank(law), _candidate(law, axis_letter(channels[axis], channels), effects))
        for axis, balance in enumerate(balances)
        for law in (*balance.laws, *balance.others)
        if law.formula is None or (law.played_as, axis_letter(channels[axis], channels)) not in named
    ]
    found += [(1, each) for each in unconfirmed]
    left = [each for _, each in sorted(found, key=lambda ranked: ranked[0]) if (each.effect, each.axis) not in named]
    retuned = {**diagnosis.retuned, **constants}
    verdict = diagnosis.verdict
    if not effects and diagnosis.effects:
        verdict = "parameters" if verdict == "explained" else "unexplained"
    return replace(diagnosis, verdict=verdict, effects=effects, retuned=retuned, candidates=_once(left)[:MOST])


def _weigh_law(
    effect: NamedEffect, weighed: "Sequence[tuple[JudgedLaw, str, float]]"
) -> "tuple[JudgedLaw, float] | None":
    """The law of a balance that the named effect represents, and its share of the mismatch; None where no balance has
    it. weighed: laws with their axis and share."""
    for law, axis, share in weighed:
        same = (law.played_as, axis) == (effect.effect, effect.axis or "")
        if same and law.formula is not None and effect.law is not None:
            same = law.named and _form(effect.law.expression) == _form(law.formula.text)
        if same:
            return law, share
    return None


def _form(formula: str) -> list[str]:
    """Signals and functions of a formula in their order, to compare formulas; the axis's own signals have the names of
    a balance (x, vx and fx become q, v and f)."""
    names = (_FREE.sub("", name) for name in _NAME.findall(_NUMBER.sub("", formula)))
    return [_OWN_SIGNAL.sub(lambda own: own[1] or "q", name) for name in names if name]


def _names_covered_by(effect: NamedEffect) -> tuple[str, ...]:
    """Names that are not listed as candidates once the effect is named: its own, its class, and its refinements."""
    refined = (rival.effect for rival in effect.rivals if rival.why_not == REFINED)
    return (effect.effect, *effect.class_, *refined)


def _rank(weighed: "JudgedLaw") -> int:
    """Order of candidates: physics with a significant gain and possible parameters first; then a linear model of a
    higher order; and last laws that explain almost nothing."""
    if weighed.law.linear:
        return 2
    if weighed.share < LAW_OF_CEILING:
        return 3
    return 0 if weighed.possible and (weighed.gain_low > 0 or weighed.agreed) else 1


def linear_remarks(
    balances: "Sequence[Balance]", channels: tuple[str, ...], in_samples: bool = False
) -> tuple[str, ...]:
    """Remarks on the linear terms of the first model other than mass, damping and stiffness. channels: of the commands.
    in_samples: times are in samples."""
    texts = []
    for channel, balance in zip(channels, balances, strict=False):
        beside, motion = balance.search.regression.beside, balance.search.regression.motions[0]
        laws = [law.effect for law in balance.linear_laws]
        late = f"{beside.delay_s:.3g} samples" if in_samples else f"{1e3 * beside.delay_s:.3g} ms"
        parts = [f"a delay of the command of {late} (or a lag)"] if beside.delay_s else []
        parts += [noun_of(name) for name in dict.fromkeys(laws)]
        if len(motion.channels) > len(balances):
            others = [name for k, name in enumerate(motion.channels) if k != beside.own]
            parts.append(f"the motion of {conjoin(others)}")
        if parts:
            where = f" along {channel}" if len(channels) > 1 else ""
            texts.append(
                f"In addition to mass, damping and stiffness, the first model contains{where} {conjoin(parts)}; "
                "linear terms are not counted as missing physics."
            )
    return tuple(texts)


def balance_errors(
    diagnosis: Diagnosis, balances: "Sequence[Balance]", channels: tuple[str, ...]
) -> tuple[BalanceErrors, ...]:
    """Errors of each axis's balance with the laws that the document names; see `with_balances`."""
    found = []
    for axis, balance in enumerate(balances):
        letter = axis_letter(channels[axis], channels)
        names = {effect.effect for effect in diagnosis.effects if effect.axis in (letter, None, "")}
        laws = [law.place for law in balance.laws if law.played_as in names]
        rms = balance.error_of(laws) if laws else balance.linear
        given = balance.search.regression.prior is not None
        found.append(BalanceErrors(letter, balance.linear, rms, balance.ceiling, bool(laws), balance.tested, given))
    return tuple(found)


def _once(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The candidates with each effect only once, at its best place; laws without a name are the same only if their
    formulas and axes are. candidates: the best first."""
    first: dict[object, Candidate] = {}
    for candidate in candidates:
        law = candidate.law
        first.setdefault(candidate.effect if law is None else (law.axis, law.expression), candidate)
    return tuple(first.values())


def _compute_explained_share(balance: "Balance", law: "JudgedLaw") -> float:
    """Share of the linear model's held-out error power that a law removes. `JudgedLaw.share` is relative to the
    decrease by all laws together, and for a law of the command to the linear error already."""
    whole = 1 - (balance.ceiling / max(balance.linear, 1e-300)) ** 2 if law.has_column else 1.0
    return min(max(whole * law.share, 0.0), 1.0)


def _with_class(effect: NamedEffect, found: "tuple[JudgedLaw, float] | None") -> NamedEffect:
    """The effect with its class, share and probability by the balance. found: the law of the balance, and its share of
    the mismatch; None where no balance has it."""
    if found is None:
        late = effect.effect in LATE
        return replace(effect, class_=tuple(dict.fromkeys((effect.effect, *LATE)))) if late else effect
    weighed, share = found
    known_rivals = {rival.effect for rival in effect.rivals}
    others = tuple(name for name in weighed.alike if name == weighed.stands_for or not refines(name, effect.effect))
    rivals = tuple(
        Rival(name, 0.0, name in others, ALIKE if name in others else REFINED)
        for name in weighed.alike
        if name not in known_rivals
    )
    own = (effect.effect,) if weighed.formula is None else (effect.effect, weighed.law.effect)
    alike = (*own, *others) if len(own) + len(others) > 1 else ()
    return replace(
        effect,
        share=share,
        probability=weighed.probability,
        rivals=(*effect.rivals, *rivals),
        class_=alike,
    )


def refines(effect: str, plain: str) -> bool:
    """Whether an effect contains another (plain) as a special case."""
    known = EFFECTS[effect].simpler if effect in EFFECTS else REFINING.get(effect, ())
    return plain in known


def _candidate(weighed: "JudgedLaw", axis: str, effects: Sequence[NamedEffect] = ()) -> Candidate:
    """A law of a balance as a candidate of the document. effects: the named effects."""
    plainer = any(refines(weighed.law.effect, named.effect) and named.axis == axis for named in effects)
    why_not = PLAINER if plainer else "simulations of the whole recording do not confirm it"
    return Candidate(
        effect=weighed.law.effect,
        place=place_of(weighed.law.effect),
        axis=axis or None,
        parameters=weighed.values,
        held_out_gain=min(max(weighed.gain, 0.0), 1.0),
        share_of_black_box=min(max(weighed.share, 0.0), 1.0),
        why_not=weighed.why_not or why_not,
    )
