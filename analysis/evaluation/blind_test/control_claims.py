"""Controls of the blind test: claims about the answers of a diagnosis to inputs that were changed in a known way.

A recording that is shuffled or silent must give no named effect (negative control); a recording that is mirrored, or
whose axes are exchanged, must give the corresponding answer. A claim is a predicate on the answers to a control's
inputs (`CLAIMS`); an answer is None where the diagnosis refused or failed. `study.evaluation.challenge.controls` makes
the inputs.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from analysis.diagnosis.document import Diagnosis

NAMED_PROBABILITY = 0.5
"""Smallest probability of an effect that counts as named. Chosen by hand."""
MAGNITUDE_TOLERANCE = 0.02
"""Largest difference between the magnitudes of a parameter in the answers to a recording and to its mirror image,
relative to the former. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class ControlOutcome:
    """A control's claim, whether the claim is true of the answers, and the answers."""

    name: str
    claim: str
    """Key of `CLAIMS`."""
    held: bool
    """Whether the claim is true of the answers."""
    said: tuple[str, ...]
    """Each answer in words."""


def judge_control(name: str, claim: str, answers: Sequence[Diagnosis | None]) -> ControlOutcome:
    """Judge a claim. answers: in the order of the control's inputs. Raises KeyError for a claim that is not in
    `CLAIMS`."""
    return ControlOutcome(name, claim, CLAIMS[claim](answers), tuple(map(_format_answer, answers)))


def _has_no_named_effect(answers: Sequence[Diagnosis | None]) -> bool:
    """Whether no effect of any answer has a probability of `NAMED_PROBABILITY` or more; None counts as no effect."""
    return not any(
        effect.probability >= NAMED_PROBABILITY for answer in answers if answer is not None for effect in answer.effects
    )


def _has_no_explained_answer(answers: Sequence[Diagnosis | None]) -> bool:
    """Whether no answer has the verdict "explained"; None counts as not explained."""
    return all(answer is None or answer.verdict != "explained" for answer in answers)


def _has_no_mismatch(answers: Sequence[Diagnosis | None]) -> bool:
    """Whether every verdict is "no_mismatch" or "parameters" (only parameters differ); False if an answer is None."""
    return all(answer is not None and answer.verdict in ("no_mismatch", "parameters") for answer in answers)


def _has_equal_answers(answers: Sequence[Diagnosis | None], with_axes: bool = True) -> bool:
    """Whether all answers have the same verdict, effects and, if `with_axes`, axes, and at least one effect; False if
    any is None."""
    distinct_answers = {_list_verdict_and_effects(answer, with_axes) for answer in answers if answer is not None}
    return len(distinct_answers) == 1 and None not in answers and bool(answers[0] and answers[0].effects)


def _has_exchanged_axes(answers: Sequence[Diagnosis | None]) -> bool:
    """Whether two answers have the same verdict and effects, at least one, and each effect is on another axis in the
    second; False where an effect has no axis or an answer is None."""
    if not _has_equal_answers(answers, with_axes=False):
        return False
    first_axes, second_axes = ([effect.axis for effect in answer.effects] for answer in answers if answer is not None)
    return all(
        None not in axis_pair and axis_pair[0] != axis_pair[1]
        for axis_pair in zip(first_axes, second_axes, strict=True)
    )


def _has_opposite_signs(answers: Sequence[Diagnosis | None]) -> bool:
    """Whether two answers have the same verdict, effects and axes, and the first parameter of their first effect has
    the same magnitude (`MAGNITUDE_TOLERANCE`) and the opposite sign; False if an answer is None or has no effect."""
    main_parameters = [
        next(iter(answer.effects[0].parameters.values())).value for answer in answers if answer and answer.effects
    ]
    if len(main_parameters) != len(answers) or not _has_equal_answers(answers):
        return False
    return abs(main_parameters[0] + main_parameters[1]) <= MAGNITUDE_TOLERANCE * abs(main_parameters[0])


def _list_verdict_and_effects(answer: Diagnosis, with_axes: bool) -> tuple[object, ...]:
    """List the verdict, then each effect with its axis, or with None if `with_axes` is False; answers are compared by
    it."""
    return answer.verdict, *((effect.effect, effect.axis if with_axes else None) for effect in answer.effects)


def _format_answer(answer: Diagnosis | None) -> str:
    """Format verdict and effects, such as "explained: coulomb_friction of x"; "no answer" for None."""
    if answer is None:
        return "no answer"
    effects_text = ", ".join(
        f"{effect.effect}{f' of {effect.axis}' if effect.axis else ''}" for effect in answer.effects
    )
    return answer.verdict.replace("_", " ") + (f": {effects_text}" if effects_text else "")


CLAIMS: Mapping[str, Callable[[Sequence[Diagnosis | None]], bool]] = {
    "no name": _has_no_named_effect,
    "not explained": _has_no_explained_answer,
    "nothing": _has_no_mismatch,
    "same": _has_equal_answers,
    "same but axes": partial(_has_equal_answers, with_axes=False),
    "axis exchanged": _has_exchanged_axes,
    "opposite": _has_opposite_signs,
}
"""Predicate on the answers, by the name of the claim."""
