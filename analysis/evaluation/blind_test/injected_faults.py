"""Score the diagnosis on faults that were injected into real recordings: class of each answer, shares of each class."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate, compute_share

LEAST_DETECTABLE_CHANGE = 1.25
"""Least factor by which a fault changes the held-out error of the device's base model, up or down, to count as
detectable. Chosen by hand."""
AnswerClass = Literal["named", "in class", "other name, right place", "wrong", "unnamed", "nothing named"]
"""Class of the answer to a case, see `InjectedOutcome.answer_class`."""
ANSWER_CLASSES: tuple[AnswerClass, ...] = get_args(AnswerClass)
"""The last is the correct answer to a case without a fault."""


@dataclass(frozen=True, slots=True)
class InjectedOutcome:
    """A case of injected faults: what was injected, how much it changes the recording, and the answer of the
    diagnosis."""

    recording: str
    effects: tuple[str, ...]
    """Names of the injected faults; none, or two where two were injected at once."""
    places: tuple[str, ...]
    """Place of each fault on the signal path: mechanism, hand, actuator or sensor."""
    strength: float
    """Strength of the faults, 0 (weakest) to 1 (strongest); 0 without a fault."""
    values: Mapping[str, float]
    """Parameters of the faults by name, in the units of the recording."""
    change: float | None
    """Held-out error with the fault over that without it, of a base model that is fitted to the clean half; None where
    there was no such model."""
    verdict: str
    """Verdict of the diagnosis; "failed" without a diagnosis."""
    named: tuple[str, ...]
    named_places: tuple[str, ...]
    returned: tuple[str, ...]
    """The named effects and the rivals that the recording does not distinguish from these."""
    seconds: float
    """Duration of the diagnosis, s."""
    failed: str = ""
    """Why the diagnosis failed; empty if it did not."""

    @property
    def injected(self) -> str:
        """Names of the injected faults, joined by " + "; empty without any."""
        return " + ".join(self.effects)

    @property
    def detectable(self) -> bool:
        """Whether the fault changes the error by at least the factor `LEAST_DETECTABLE_CHANGE`, up or down; False
        without a fault, or where `change` is None."""
        if not self.effects or self.change is None:
            return False
        return self.change >= LEAST_DETECTABLE_CHANGE or self.change <= 1 / LEAST_DETECTABLE_CHANGE

    @property
    def answer_class(self) -> AnswerClass:
        """Class of the answer.

        Without a fault: "nothing named"; "wrong" where the diagnosis names an effect or fails. With faults: "unnamed"
        without a name; "named" if every name is an injected fault, of which one of two suffices; "in class" if an
        injected fault is in the returned set and there are at most as many names as faults; "other name, right place"
        if all names that are no injected fault are at places of injected faults; else "wrong".
        """
        if not self.effects:
            return "wrong" if self.named or self.failed else "nothing named"
        if not self.named:
            return "unnamed"
        other_places = [
            place for name, place in zip(self.named, self.named_places, strict=True) if name not in self.effects
        ]
        if not other_places:
            return "named"
        if set(self.effects) & set(self.returned) and len(self.named) <= len(self.effects):
            return "in class"
        return "other name, right place" if set(other_places) <= set(self.places) else "wrong"

    @property
    def is_correct(self) -> bool:
        """Whether `answer_class` is "named", "in class" or, without a fault, "nothing named"."""
        return self.answer_class in ("named", "in class", "nothing named")


def read_outcome(label: Mapping[str, Any], answer: Mapping[str, Any]) -> InjectedOutcome:
    """Read the outcome from a sealed label and the document that the diagnosis wrote, both parsed from JSON; without a
    diagnosis the verdict is "failed". Raises KeyError where a key of the label, or of a named effect, is missing."""
    diagnosis = answer.get("diagnosis", {})
    effects = diagnosis.get("effects", [])
    names = [effect["effect"] for effect in effects]
    rivals = [rival["effect"] for effect in effects for rival in effect["rivals"] if rival["inseparable"]]
    return InjectedOutcome(
        recording=str(label["recording"]),
        effects=tuple(label["effects"]),
        places=tuple(label["places"]),
        strength=float(label["strength"]),
        values=dict(label["values"]),
        change=label["change"],
        verdict=str(diagnosis.get("verdict", "failed")),
        named=tuple(names),
        named_places=tuple(effect["place"] for effect in effects),
        returned=tuple(dict.fromkeys([*names, *rivals])),
        seconds=float(answer.get("seconds", 0.0)),
        failed=str(answer.get("failed", "")),
    )


def score_injections(outcomes: Sequence[InjectedOutcome]) -> tuple[IntervalEstimate, ...]:
    """Compute the shares of correct, misnamed and wrong answers, with Wilson's 95 % intervals: of cases without a fault
    (correct only), with detectable faults (all three), and with undetectable ones (correct and wrong)."""
    detectable_cases = [outcome for outcome in outcomes if outcome.detectable]
    undetectable_cases = [outcome for outcome in outcomes if outcome.effects and not outcome.detectable]
    faultless_cases = [outcome for outcome in outcomes if not outcome.effects]
    return (
        compute_share("nothing injected, nothing named", faultless_cases, lambda case: case.is_correct),
        compute_share("detectable faults named, or in the class", detectable_cases, lambda case: case.is_correct),
        compute_share(
            "detectable faults, another name at the right place",
            detectable_cases,
            _make_class_predicate("other name, right place"),
        ),
        compute_share("detectable faults, a wrong fault named", detectable_cases, _make_class_predicate("wrong")),
        compute_share("too weak to ask for, named all the same", undetectable_cases, lambda case: case.is_correct),
        compute_share("too weak to ask for, a wrong fault named", undetectable_cases, _make_class_predicate("wrong")),
    )


def _make_class_predicate(answer_class: AnswerClass) -> Callable[[InjectedOutcome], bool]:
    """Make the predicate whether the answer to a case is of this class."""
    return lambda case: case.answer_class == answer_class


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts and shares of a group of cases, such as those of one kind of fault or of one recording."""

    name: str
    fault_count: int
    """Number of cases with a fault, detectable or not."""
    counts: tuple[int, ...]
    """Number of cases with a detectable fault per class of `ANSWER_CLASSES`, without the last class."""
    correct_share: IntervalEstimate
    """Share of the cases with a detectable fault whose answer is correct."""
    faultless: IntervalEstimate
    """Share of the cases without a fault in which nothing was named."""


def make_tallies(
    outcomes: Sequence[InjectedOutcome], get_group_name: Callable[[InjectedOutcome], str]
) -> tuple[Tally, ...]:
    """Make the tally of each group, ordered by name. get_group_name: gives the name of an outcome's group; outcomes
    with an empty one are left out."""
    return tuple(
        _make_tally(name, [outcome for outcome in outcomes if get_group_name(outcome) == name])
        for name in sorted({*map(get_group_name, outcomes)} - {""})
    )


def _make_tally(name: str, outcomes: Sequence[InjectedOutcome]) -> Tally:
    """Make the tally of the outcomes of a group."""
    faulty_cases = [outcome for outcome in outcomes if outcome.effects]
    detectable_cases = [faulty_case for faulty_case in faulty_cases if faulty_case.detectable]
    faultless_cases = [outcome for outcome in outcomes if not outcome.effects]
    counts = tuple(
        sum(case.answer_class == answer_class for case in detectable_cases) for answer_class in ANSWER_CLASSES[:-1]
    )
    return Tally(
        name,
        len(faulty_cases),
        counts,
        compute_share(name, detectable_cases, lambda case: case.is_correct),
        compute_share(name, faultless_cases, lambda case: case.is_correct),
    )
