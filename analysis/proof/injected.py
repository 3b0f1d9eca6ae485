"""Faults that were injected into real recordings: what was said of each, and how often that was right."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analysis.proof.share import Figure, share

DETECTABLE = 1.25
"""Times what the device's own model leaves, from which on an injected fault ought to be seen."""


@dataclass(frozen=True, slots=True)
class InjectedOutcome:
    recording: str
    effect: str
    """Empty where nothing was injected."""
    strength: float
    values: Mapping[str, float]
    adds: float
    """Error with the fault over error without it, of the model that knows what is really there."""
    verdict: str
    named: tuple[str, ...]
    returned: tuple[str, ...]
    seconds: float
    failed: str = ""

    @property
    def detectable(self) -> bool:
        return bool(self.effect) and self.adds >= DETECTABLE

    @property
    def right(self) -> bool:
        """The injected fault is in the returned set; where nothing was injected, nothing is named."""
        if self.failed:
            return False
        return self.effect in self.returned if self.effect else not self.named


def outcome_of(label: Mapping[str, Any], answer: Mapping[str, Any]) -> InjectedOutcome:
    """From a sealed label and what the diagnosis wrote."""
    diagnosis = answer.get("diagnosis", {})
    effects = diagnosis.get("effects", [])
    named = [one["effect"] for one in effects]
    rivals = [rival["effect"] for one in effects for rival in one["rivals"] if rival["inseparable"]]
    return InjectedOutcome(
        recording=str(label["recording"]),
        effect=str(label["effect"]),
        strength=float(label["strength"]),
        values=dict(label["values"]),
        adds=float(label["adds"]),
        verdict=str(diagnosis.get("verdict", "failed")),
        named=tuple(named),
        returned=tuple(dict.fromkeys([*named, *rivals])),
        seconds=float(answer.get("seconds", 0.0)),
        failed=str(answer.get("failed", "")),
    )


def injected_figures(outcomes: Sequence[InjectedOutcome]) -> tuple[Figure, ...]:
    """With Wilson's 95 % intervals."""
    faults = [one for one in outcomes if one.detectable]
    weak = [one for one in outcomes if one.effect and not one.detectable]
    nothing = [one for one in outcomes if not one.effect]
    kinds = sorted({one.effect for one in faults})
    return (
        share("detectable faults named (in the returned set)", faults, lambda one: one.right),
        share("detectable faults named first", faults, lambda one: one.named[:1] == (one.effect,)),
        share("too weak to ask for, named all the same", weak, lambda one: one.right),
        share("nothing injected, something named", nothing, lambda one: not one.right),
        *(share(kind, [one for one in faults if one.effect == kind], lambda one: one.right) for kind in kinds),
    )
