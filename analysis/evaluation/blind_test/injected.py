"""Outcomes of faults that were injected into real recordings, and how often the diagnosis was right."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate, compute_share

DETECTABLE = 1.25
"""Factor by which a fault must change the held-out error of the device's base model, up or down, to count as
detectable. By hand."""
AnswerClass = Literal["named", "in class", "other name, right place", "wrong", "unnamed", "nothing named"]
ANSWER_CLASSES: tuple[AnswerClass, ...] = get_args(AnswerClass)


@dataclass(frozen=True, slots=True)
class InjectedOutcome:
    """A case of injected faults: what was injected, by how much it shows, and what the diagnosis said."""

    recording: str
    effects: tuple[str, ...]
    """Injected faults; none, or two where two were injected at once."""
    places: tuple[str, ...]
    """Place of each fault."""
    strength: float
    values: Mapping[str, float]
    change: float | None
    """Held-out error with the fault over that without it, of a base model that is fitted to the clean half; None where
    there was no such model."""
    verdict: str
    named: tuple[str, ...]
    named_places: tuple[str, ...]
    returned: tuple[str, ...]
    seconds: float
    failed: str = ""

    @property
    def injected(self) -> str:
        """The injected effects in a line, joined by " + "; empty without any."""
        return " + ".join(self.effects)

    @property
    def detectable(self) -> bool:
        """Whether the fault changes the error by the factor `DETECTABLE`, up or down; False without a fault, or where
        `change` is not known."""
        if not self.effects or self.change is None:
            return False
        return self.change >= DETECTABLE or self.change <= 1 / DETECTABLE

    @property
    def answer_class(self) -> AnswerClass:
        """Class of the answer, by the worst of its names: every name is an injected fault ("named"); an injected fault
        is in the returned set ("in class"); the other names are at the right places; or "wrong". With two faults at
        once, naming one of them is right."""
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
    def right(self) -> bool:
        """Whether `judged` is "named", "in class" or, without a fault, "nothing named"."""
        return self.answer_class in ("named", "in class", "nothing named")


def read_outcome(label: Mapping[str, Any], answer: Mapping[str, Any]) -> InjectedOutcome:
    """Outcome from a sealed label and the document that the diagnosis wrote."""
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
    """Shares of right and wrong answers, with Wilson's 95 % intervals."""
    faults = [outcome for outcome in outcomes if outcome.detectable]
    undetectable = [outcome for outcome in outcomes if outcome.effects and not outcome.detectable]
    faultless = [outcome for outcome in outcomes if not outcome.effects]
    return (
        compute_share("nothing injected, nothing named", faultless, lambda case: case.right),
        compute_share("detectable faults named, or in the class", faults, lambda case: case.right),
        compute_share(
            "detectable faults, another name at the right place", faults, _make_class_test("other name, right place")
        ),
        compute_share("detectable faults, a wrong fault named", faults, _make_class_test("wrong")),
        compute_share("too weak to ask for, named all the same", undetectable, lambda case: case.right),
        compute_share("too weak to ask for, a wrong fault named", undetectable, _make_class_test("wrong")),
    )


def _make_class_test(answer_class: AnswerClass) -> Callable[[InjectedOutcome], bool]:
    return lambda case: case.answer_class == answer_class


@dataclass(frozen=True, slots=True)
class Tally:
    """One row of a table: a kind of fault, or a recording."""

    name: str
    fault_count: int
    """Number of injected faults, detectable or not."""
    counts: tuple[int, ...]
    """Number of detectable faults per entry of `ANSWER_CLASSES` without its last."""
    right: IntervalEstimate
    faultless: IntervalEstimate
    """Cases without a fault in which nothing was named."""


def make_tallies(outcomes: Sequence[InjectedOutcome], key: Callable[[InjectedOutcome], str]) -> tuple[Tally, ...]:
    """Groups by key, in the order of names; outcomes with an empty key are left out."""
    return tuple(
        _make_tally(name, [outcome for outcome in outcomes if key(outcome) == name])
        for name in sorted({*map(key, outcomes)} - {""})
    )


def _make_tally(name: str, outcomes: Sequence[InjectedOutcome]) -> Tally:
    faults = [outcome for outcome in outcomes if outcome.effects]
    detectable = [fault for fault in faults if fault.detectable]
    faultless = [outcome for outcome in outcomes if not outcome.effects]
    counts = tuple(
        sum(case.answer_class == answer_class for case in detectable) for answer_class in ANSWER_CLASSES[:-1]
    )
    return Tally(
        name,
        len(faults),
        counts,
        compute_share(name, detectable, lambda case: case.right),
        compute_share(name, faultless, lambda case: case.right),
    )
