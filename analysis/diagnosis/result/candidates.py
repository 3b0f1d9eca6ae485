"""What a force balance adds to the findings: classes of laws that cannot be parted, candidates, what all laws reach."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.weigh import Balance, Weighed
from analysis.diagnosis.document import Candidate, Diagnosis, NamedEffect, Rival
from analysis.diagnosis.result.findings import Reached
from equalizer.effects.placing import axis_letter
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

MOST = 6


def with_balances(diagnosis: Diagnosis, balances: Sequence[Balance], channels: tuple[str, ...]) -> Diagnosis:
    """channels: of the commands. A constant force that no balance names is a number of the model, no effect."""
    if not balances:
        return diagnosis
    weighed = {
        (one.law.effect, axis_letter(channels[axis], channels)): one
        for axis, balance in enumerate(balances)
        for one in balance.laws
    }
    constants = {
        f"constant force {one.axis}": one.parameters["force"].value
        for one in diagnosis.effects
        if one.effect == "constant_force" and (one.effect, one.axis or "") not in weighed
    }
    effects = tuple(
        _with_class(one, weighed.get((one.effect, one.axis or "")))
        for one in diagnosis.effects
        if f"{one.effect.replace('_', ' ')} {one.axis}" not in constants
    )
    named = {(name, one.axis) for one in effects for name in (one.effect, *one.class_)}
    found = [
        _candidate(one, axis_letter(channels[axis], channels))
        for axis, balance in enumerate(balances)
        for one in (*balance.laws, *balance.others)
    ]
    left = [one for one in found if (one.effect, one.axis) not in named]
    retuned = {**diagnosis.retuned, **constants}
    return replace(diagnosis, effects=effects, retuned=retuned, candidates=_once(left)[:MOST])


def reached_of(diagnosis: Diagnosis, balances: Sequence[Balance], channels: tuple[str, ...]) -> tuple[Reached, ...]:
    """Of the laws that the document names; see `with_balances`."""
    found = []
    for axis, balance in enumerate(balances):
        letter = axis_letter(channels[axis], channels)
        names = {one.effect for one in diagnosis.effects if one.axis in (letter, None, "")}
        laws = [one.place for one in balance.laws if one.law.effect in names]
        power = float(np.sum(balance.left_by(laws)))
        linear = float(np.sum(balance.left_by(())))
        rms = balance.linear * np.sqrt(power / linear) if linear > 0 else 0.0
        found.append(Reached(letter, balance.linear, float(rms), balance.ceiling, bool(laws)))
    return tuple(found)


def _once(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Each effect at its best place."""
    first: dict[str, Candidate] = {}
    for one in candidates:
        first.setdefault(one.effect, one)
    return tuple(first.values())


def _with_class(effect: NamedEffect, weighed: Weighed | None) -> NamedEffect:
    if weighed is None:
        return effect
    rivals = tuple(
        Rival(name, 0.0, True, "as good in its place on held-out data")
        for name in weighed.alike
        if name not in {one.effect for one in effect.rivals}
    )
    alike = (effect.effect, *weighed.alike) if weighed.alike else ()
    return replace(
        effect,
        share=min(max(weighed.share, 0.0), 1.0),
        probability=weighed.probability,
        rivals=(*effect.rivals, *rivals),
        class_=alike,
    )


def _candidate(one: Weighed, axis: str) -> Candidate:
    known = EFFECTS_BY_NAME.get(one.law.effect)
    return Candidate(
        effect=one.law.effect,
        place=known.place if known is not None else "mechanism",
        axis=axis or None,
        parameters=one.values,
        held_out_gain=min(max(one.gain, 0.0), 1.0),
        share_of_black_box=min(max(one.share, 0.0), 1.0),
        why_not=one.why_not or "simulations of the whole recording do not bear it out",
    )
