"""Outcome of one blind-test case after its label is revealed: the concealed effects, the diagnosis and its errors.

A bank is a set of simulated recordings, with concealed effects or none. Outcomes are made by
`study.evaluation.bank.prove`; `laws.law_outcome` extends `AnsweredCase`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, isnan

from analysis.diagnosis.document import Diagnosis, NamedEffect

DETECTABLE_ERROR = 1.25
"""Ratio of the re-tuned model's rms error to the noise's rms, in the worst channel, on held-out samples, above which an
effect counts as detectable: the model then leaves an error of sqrt(1.25² - 1) = 0.75 of the noise. Chosen."""


@dataclass(frozen=True, slots=True)
class ConcealedEffect:
    """An effect that was concealed in a case, with its place and true parameters."""

    effect: str
    """Name of the effect."""
    place: str
    """Place at which it acts, such as "sensor" or "actuator"."""
    axis: str | None
    """Its axis; None for an effect without one."""
    values: Mapping[str, float]
    """True parameters by name, in the effect's units."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnsweredCase:
    """A case of a bank with its diagnosis and the errors of the models."""

    number: int
    """Number of the case in its bank."""
    seed: int
    """Seed of the case's random draws."""
    kind: str
    """Kind of case; the subclasses list the kinds."""
    axes: tuple[str, ...]
    """Axes of the device."""
    adds: float
    """Simulated change of the readings by the concealed effects: its rms over the noise's rms, in the worst channel."""
    diagnosis: Diagnosis | None
    """None where it failed."""
    channel_errors: Mapping[str, Mapping[str, float]]
    """Rms error on held-out samples over the noise's rms: by stage ("before", "retuned", "after"), then by channel."""
    seconds: float
    """Processor time of the diagnosis (s); NaN where it was not recorded."""

    @property
    def verdict(self) -> str:
        """Verdict of the diagnosis; "failed" where there is no diagnosis."""
        return "failed" if self.diagnosis is None else self.diagnosis.verdict

    @property
    def detectable(self) -> bool:
        """Whether the re-tuned model leaves a detectable error; a failed diagnosis counts as if it did."""
        return self.diagnosis is None or self.compute_worst_error("retuned") > DETECTABLE_ERROR

    def compute_worst_error(self, stage: str) -> float:
        """Compute the rms error on held-out samples over the noise's rms, in the channel where it is largest; NaN where
        no errors are known. Channels of unknown error (NaN) are left out. stage: "before", "retuned" or "after"."""
        errors = self.channel_errors.get(stage, {}).values()
        return max((error for error in errors if not isnan(error)), default=float("nan"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome(AnsweredCase):
    """A case of a bank of effects. kind: nothing, single, pair, outside (the catalogue) or without (the true effect was
    excluded from the diagnosis)."""

    bank: str
    """main, dirty (with additional disturbances) or engine (a second physics engine)."""
    model: str
    """Origin of the model: calibrated, or re-tuned to the device."""
    concealed: tuple[ConcealedEffect, ...]
    strengths: tuple[float, ...]
    """Strength of each concealed effect within the range of the draws: 0 = the weakest, 1 = the strongest."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the concealed effects, in the order of `concealed`."""
        return tuple(concealed.effect for concealed in self.concealed)

    @property
    def named(self) -> tuple[NamedEffect, ...]:
        """Effects that the diagnosis names, with their parameters; empty where it failed."""
        return () if self.diagnosis is None else self.diagnosis.effects

    @property
    def named_effect_names(self) -> tuple[str, ...]:
        """Names of the effects in `named`."""
        return tuple(effect.effect for effect in self.named)

    @property
    def is_seen_by_ideal_observer(self) -> bool:
        """Whether the effects would be detectable without re-tuning, which hides part of them: from the difference of
        two simulations with and without them, `adds`, and independent noise, added in power."""
        return hypot(1.0, self.adds) > DETECTABLE_ERROR

    @property
    def is_correct(self) -> bool:
        """Whether exactly the concealed effects are named; places and parameters are scored in `score`. A failed
        diagnosis names none, so that it is correct only where nothing is concealed."""
        return sorted(self.named_effect_names) == sorted(self.names)

    @property
    def returned(self) -> tuple[str, ...]:
        """Names of the named effects and their inseparable rivals; empty where the diagnosis failed."""
        return () if self.diagnosis is None else self.diagnosis.returned_set
