"""Controls of a diagnosis: claims about its answers when its input is changed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Diagnosis

CONFIDENT = 0.5
"""A probability from which a name is a confident one."""
SAME_NUMBER = 0.02
"""Largest relative difference of parameters, their sign apart, between answers to mirrored recordings."""


@dataclass(frozen=True, slots=True)
class ControlOutcome:
    """A control's claim, whether it held, and the answers by which that was judged."""

    name: str
    claim: str
    held: bool
    said: tuple[str, ...]
    """Each answer in words; the field of this name in the proof's JSON."""


def judge_control(name: str, claim: str, answers: Sequence[Diagnosis | None]) -> ControlOutcome:
    """Judge a claim on answers; None = refused or failed, which names nothing. Raises KeyError for an unknown claim."""
    return ControlOutcome(name, claim, CLAIMS[claim](answers), tuple(map(_answer_text, answers)))


def _names_nothing(answers: Sequence[Diagnosis | None]) -> bool:
    return not any(
        effect.probability >= CONFIDENT for answer in answers if answer is not None for effect in answer.effects
    )


def _not_explained(answers: Sequence[Diagnosis | None]) -> bool:
    return all(answer is None or answer.verdict != "explained" for answer in answers)


def _no_mismatch(answers: Sequence[Diagnosis | None]) -> bool:
    return all(answer is not None and answer.verdict in ("no_mismatch", "parameters") for answer in answers)


def _same_answers(answers: Sequence[Diagnosis | None]) -> bool:
    """The same verdict, effects and axes, and at least one effect."""
    distinct = {_verdict_and_effects(answer, with_axes=True) for answer in answers if answer is not None}
    return len(distinct) == 1 and None not in answers and bool(answers[0] and answers[0].effects)


def _same_but_axes(answers: Sequence[Diagnosis | None]) -> bool:
    distinct = {_verdict_and_effects(answer, with_axes=False) for answer in answers if answer is not None}
    return len(distinct) == 1 and None not in answers and bool(answers[0] and answers[0].effects)


def _axis_exchanged(answers: Sequence[Diagnosis | None]) -> bool:
    """The same effects, each at the other axis."""
    if not _same_but_axes(answers):
        return False
    first, second = ([effect.axis for effect in answer.effects] for answer in answers if answer is not None)
    return all(None not in pair and pair[0] != pair[1] for pair in zip(first, second, strict=True))


def _opposite_sign(answers: Sequence[Diagnosis | None]) -> bool:
    """One effect, its main number with the other sign."""
    mains = [next(iter(answer.effects[0].parameters.values())).value for answer in answers if answer and answer.effects]
    if len(mains) != len(answers) or not _same_answers(answers):
        return False
    return abs(mains[0] + mains[1]) <= SAME_NUMBER * abs(mains[0])


def _verdict_and_effects(diagnosis: Diagnosis, with_axes: bool) -> tuple[object, ...]:
    return diagnosis.verdict, *((effect.effect, effect.axis if with_axes else None) for effect in diagnosis.effects)


def _answer_text(diagnosis: Diagnosis | None) -> str:
    if diagnosis is None:
        return "no answer"
    named = ", ".join(f"{effect.effect}{f' of {effect.axis}' if effect.axis else ''}" for effect in diagnosis.effects)
    return diagnosis.verdict.replace("_", " ") + (f": {named}" if named else "")


CLAIMS: Mapping[str, Callable[[Sequence[Diagnosis | None]], bool]] = {
    "no name": _names_nothing,
    "not explained": _not_explained,
    "nothing": _no_mismatch,
    "same": _same_answers,
    "same but axes": _same_but_axes,
    "axis exchanged": _axis_exchanged,
    "opposite": _opposite_sign,
}
