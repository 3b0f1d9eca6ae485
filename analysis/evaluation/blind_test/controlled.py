"""Controls of the blind test: claims about the answers of a diagnosis to inputs that were changed in a known way.

A recording that is shuffled or silent must give no named effect (negative control); a recording that is mirrored, or
whose axes are exchanged, must give the corresponding answer. A claim is a predicate on the answers to a control's
inputs (`CLAIMS`); `study.evaluation.challenge.controls` makes these inputs.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Diagnosis

CONFIDENT = 0.5
"""Least probability of an effect that counts as named."""
SAME_NUMBER = 0.02
"""Largest difference between the magnitudes of a parameter in the answers to a recording and to its mirror image,
relative to the first."""


@dataclass(frozen=True, slots=True)
class ControlOutcome:
    """A control's claim, whether it held, and the answers by which that was judged."""

    name: str
    claim: str
    held: bool
    said: tuple[str, ...]
    """Each answer in words; written to the proof's JSON under this name."""


def judge_control(name: str, claim: str, answers: Sequence[Diagnosis | None]) -> ControlOutcome:
    """Judge a claim on the answers, in the order of the control's inputs. None = the diagnosis refused or failed.
    Raises KeyError for a claim that `CLAIMS` lacks."""
    return ControlOutcome(name, claim, CLAIMS[claim](answers), tuple(map(_format_answer, answers)))


def _names_nothing(answers: Sequence[Diagnosis | None]) -> bool:
    """No effect has a probability of `CONFIDENT` or more; a refusal names nothing."""
    return not any(
        effect.probability >= CONFIDENT for answer in answers if answer is not None for effect in answer.effects
    )


def _explains_nothing(answers: Sequence[Diagnosis | None]) -> bool:
    """No answer has the verdict "explained"; a refusal explains nothing."""
    return all(answer is None or answer.verdict != "explained" for answer in answers)


def _no_mismatch(answers: Sequence[Diagnosis | None]) -> bool:
    """Every answer finds no mismatch, or only parameters that differ; a refusal does not count."""
    return all(answer is not None and answer.verdict in ("no_mismatch", "parameters") for answer in answers)


def _same_answers(answers: Sequence[Diagnosis | None]) -> bool:
    """The same verdict, effects and axes, and at least one effect."""
    distinct = {_list_verdict_and_effects(answer, with_axes=True) for answer in answers if answer is not None}
    return len(distinct) == 1 and None not in answers and bool(answers[0] and answers[0].effects)


def _same_but_axes(answers: Sequence[Diagnosis | None]) -> bool:
    """The same verdict and effects, and at least one effect; axes may differ."""
    distinct = {_list_verdict_and_effects(answer, with_axes=False) for answer in answers if answer is not None}
    return len(distinct) == 1 and None not in answers and bool(answers[0] and answers[0].effects)


def _axis_exchanged(answers: Sequence[Diagnosis | None]) -> bool:
    """Two answers with the same verdict and effects, each effect on a different axis."""
    if not _same_but_axes(answers):
        return False
    first, second = ([effect.axis for effect in answer.effects] for answer in answers if answer is not None)
    return all(None not in pair and pair[0] != pair[1] for pair in zip(first, second, strict=True))


def _opposite_sign(answers: Sequence[Diagnosis | None]) -> bool:
    """Two answers with the same effects and axes; the first parameter of the first effect has the same magnitude
    (`SAME_NUMBER`) and the opposite sign."""
    mains = [next(iter(answer.effects[0].parameters.values())).value for answer in answers if answer and answer.effects]
    if len(mains) != len(answers) or not _same_answers(answers):
        return False
    return abs(mains[0] + mains[1]) <= SAME_NUMBER * abs(mains[0])


def _list_verdict_and_effects(diagnosis: Diagnosis, with_axes: bool) -> tuple[object, ...]:
    return diagnosis.verdict, *((effect.effect, effect.axis if with_axes else None) for effect in diagnosis.effects)


def _format_answer(diagnosis: Diagnosis | None) -> str:
    if diagnosis is None:
        return "no answer"
    names_text = ", ".join(
        f"{effect.effect}{f' of {effect.axis}' if effect.axis else ''}" for effect in diagnosis.effects
    )
    return diagnosis.verdict.replace("_", " ") + (f": {names_text}" if names_text else "")


CLAIMS: Mapping[str, Callable[[Sequence[Diagnosis | None]], bool]] = {
    "no name": _names_nothing,
    "not explained": _explains_nothing,
    "nothing": _no_mismatch,
    "same": _same_answers,
    "same but axes": _same_but_axes,
    "axis exchanged": _axis_exchanged,
    "opposite": _opposite_sign,
}
"""Predicate on the answers, by the name of the claim."""
