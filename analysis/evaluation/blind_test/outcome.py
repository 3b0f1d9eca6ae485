"""Outcome of a single case of a bank once its label is revealed: the concealed effects, and the diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot

from analysis.diagnosis.document import Diagnosis, NamedEffect

DETECTABLE = 1.25
"""Ratio of the re-tuned model's rms error to the noise's rms, in the worst channel, on held-out samples, above which an
effect counts as detectable: the model then leaves an error of sqrt(1.25² - 1) = 0.75 of the noise. By hand."""


@dataclass(frozen=True, slots=True)
class Concealed:
    """An effect that was concealed in a case, with its place and true parameters."""

    effect: str
    place: str
    axis: str | None
    values: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnsweredCase:
    """A case of a sealed bank with its diagnosis and its errors."""

    number: int
    seed: int
    kind: str
    axes: tuple[str, ...]
    adds: float
    """Change of the readings by what is concealed, simulated: its rms over the noise's rms, in the worst channel."""
    diagnosis: Diagnosis | None
    """The diagnosis; None where it failed."""
    channel_errors: Mapping[str, Mapping[str, float]]
    """Rms error on held-out samples over the noise's rms: by stage ("before", "retuned", "after"), then by channel."""
    seconds: float
    """Duration of the diagnosis (s)."""

    @property
    def verdict(self) -> str:
        """The diagnosis' verdict; "failed" where there is no diagnosis."""
        return "failed" if self.diagnosis is None else self.diagnosis.verdict

    @property
    def detectable(self) -> bool:
        """Whether the re-tuned model leaves a detectable error; a failed diagnosis counts as if it did."""
        return self.diagnosis is None or self.worst_error("retuned") > DETECTABLE

    def worst_error(self, stage: str) -> float:
        """Rms error on held-out samples over the noise's rms, in the worst channel; NaN where it is not known. stage:
        "before", "retuned" or "after"."""
        return max(self.channel_errors.get(stage, {}).values(), default=float("nan"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome(AnsweredCase):
    """A case of a bank of effects. kind: nothing, single, pair, outside (the catalogue) or without (the true effect was
    not to be considered)."""

    bank: str
    """main, dirty (more hidden extras) or engine (a second physics engine)."""
    model: str
    """Origin of the model: calibrated, or re-tuned to the device."""
    concealed: tuple[Concealed, ...]
    strengths: tuple[float, ...]
    """Of each concealed effect: 0 = the weakest that is drawn, 1 = the strongest."""

    @property
    def names(self) -> tuple[str, ...]:
        """The concealed effects, in the order of `concealed`."""
        return tuple(concealed.effect for concealed in self.concealed)

    @property
    def named(self) -> tuple[NamedEffect, ...]:
        """Effects that the diagnosis names, with their parameters; empty where it failed."""
        return () if self.diagnosis is None else self.diagnosis.effects

    @property
    def named_names(self) -> tuple[str, ...]:
        """The effects of `named`, without their parameters."""
        return tuple(effect.effect for effect in self.named)

    @property
    def seen_by_ideal_observer(self) -> bool:
        """Whether the effects show in a simulation of the same device with and without them, before a re-tuned model
        hides part of them: their change and the independent noise add up in power."""
        return hypot(1.0, self.adds) > DETECTABLE

    @property
    def right(self) -> bool:
        """Whether exactly the concealed effects are named; their places and parameters are scored elsewhere. A failed
        diagnosis names none: see `score.is_wrong_answer`, which counts it."""
        return sorted(self.named_names) == sorted(self.names)

    @property
    def returned(self) -> tuple[str, ...]:
        """The returned set: the named effects and their inseparable rivals; empty where the diagnosis failed."""
        return () if self.diagnosis is None else self.diagnosis.returned_set
