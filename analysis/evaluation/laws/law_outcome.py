"""Outcome of a single case of a bank of laws: the concealed law, the diagnosis, and its error."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Candidate, NamedEffect
from analysis.evaluation.blind_test.outcome import AnsweredCase
from equalizer.effects.discovered_law import has_memory
from equalizer.laws.law import Law, law_of

CLOSE = 0.05
"""Relative error up to which a law counts as the same function."""


@dataclass(frozen=True, slots=True)
class TrueLaw:
    """The law that was concealed in a case: formula, axes, numbers, and all forms of it that count as right."""

    law: str
    formula: str
    axes: tuple[str, ...]
    acts_on: tuple[str, ...]
    """Ways in which it can be expressed: as a force, a command or a response."""
    variables: tuple[tuple[str, ...], ...]
    """Per axis, all readings of it: variables, sorted, with spaces between."""
    memory: bool
    numbers: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class LawOutcome(AnsweredCase):
    """A case of a bank of laws. kind: law, nothing, decoy (an effect of the catalogue) or mode (a linear one)."""

    concealed: str
    truth: TrueLaw | None
    errors: tuple[float, ...] = ()
    """Error of the reported laws (`law_error`): in the visited range, and at a higher level."""

    @property
    def named(self) -> tuple[Law, ...]:
        """Laws that the diagnosis names, without effects of the catalogue; empty where it failed."""
        return _collect_laws(() if self.diagnosis is None else self.diagnosis.effects)

    @property
    def candidates(self) -> tuple[Law, ...]:
        """Laws among the candidates that the diagnosis does not name; empty where it failed."""
        return _collect_laws(() if self.diagnosis is None else self.diagnosis.candidates)

    @property
    def laws(self) -> tuple[Law, ...]:
        """Named, or where none is, the candidates."""
        return self.named or self.candidates

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects that the catalogue holds."""
        return (
            () if self.diagnosis is None else tuple(each.effect for each in self.diagnosis.effects if each.law is None)
        )

    @property
    def structured(self) -> bool:
        """Place, axis, variables and memory are right."""
        return self.truth is not None and bool(self.laws) and _has_true_structure(self.laws, self.truth)

    @property
    def close(self) -> bool:
        """Whether `laws` are the concealed function, within `CLOSE` over the visited range."""
        return bool(self.laws) and bool(self.errors) and self.errors[0] <= CLOSE

    @property
    def close_louder(self) -> bool:
        """Whether `laws` are the concealed function, within `CLOSE` at a higher level than recorded."""
        return bool(self.laws) and len(self.errors) > 1 and self.errors[1] <= CLOSE

    @property
    def wrongly_explained(self) -> bool:
        """A law is named as the explanation although nothing is there, or a law of another structure."""
        return bool(self.named) and self.verdict == "explained" and not self.structured

    @property
    def false_law(self) -> bool:
        """Whether a law is named where none was concealed."""
        return self.truth is None and bool(self.named)

    @property
    def missed(self) -> bool:
        """Whether the answer is wrong: the diagnosis failed, named a false law, explained wrongly, or returned a law
        that shows with another structure or function, or not at all."""
        if self.diagnosis is None or self.false_law or self.wrongly_explained:
            return True
        return self.truth is not None and self.detectable and not (self.structured and self.close)


def _collect_laws(found: Sequence[NamedEffect] | Sequence[Candidate]) -> tuple[Law, ...]:
    return tuple(law_of(each.law.expression, each.law.acts_on, each.law.axis) for each in found if each.law is not None)


def _has_true_structure(laws: Sequence[Law], truth: TrueLaw) -> bool:
    laws_by_axis = {axis: [law for law in laws if law.axis[-1] == axis] for axis in {law.axis[-1] for law in laws}}
    if set(laws_by_axis) != set(truth.axes):
        return False
    for axis, readings in zip(truth.axes, truth.variables, strict=True):
        variables = " ".join(sorted({name for law in laws_by_axis[axis] for name in law.variables}))
        remembers = any(has_memory(law) for law in laws_by_axis[axis])
        if variables not in readings or remembers != truth.memory:
            return False
        if any(law.acts_on not in truth.acts_on for law in laws_by_axis[axis]):
            return False
    return True
