"""Outcome of a single case of a bank of laws: the concealed law, the diagnosis, and the error of the law it found.

An answer is right if its structure (place, axis, variables, memory) is that of the concealed law and the relative error
of its function is at most `MAX_LAW_ERROR`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Candidate, NamedEffect
from analysis.evaluation.blind_test.outcome import AnsweredCase
from equalizer.effects.discovered_law import has_memory
from equalizer.laws.law import Law, parse_law

MAX_LAW_ERROR = 0.05
"""Relative error (`compute_law_error`) up to which a law counts as the concealed function. Chosen; names of figures in
`law_score` state it as 5 %."""


@dataclass(frozen=True, slots=True)
class TrueLaw:
    """The law that was concealed in a case: formula, axes, parameters, and all forms of it that count as right."""

    law: str
    formula: str
    axes: tuple[str, ...]
    """Letters of the axes at which it acts."""
    acts_on: tuple[str, ...]
    """Ways in which it can be expressed: as a force, a command or a response."""
    variables: tuple[tuple[str, ...], ...]
    """Per axis, the sets of variables that count as right: each as sorted names, separated by spaces."""
    memory: bool
    """Whether the law has states, such as a hysteresis."""
    numbers: Mapping[str, float]
    """Its parameters, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LawOutcome(AnsweredCase):
    """A case of a bank of laws. kind: law, nothing, decoy (an effect of the catalogue) or mode (a linear mode)."""

    concealed: str
    """What was concealed, by name."""
    truth: TrueLaw | None
    """The concealed law; None where no law was concealed."""
    errors: tuple[float, ...] = ()
    """Errors of `laws` (`compute_law_error`): first in the visited range, then at a higher level; empty where not
    computed."""

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
        """The named laws; the candidates where none is named."""
        return self.named or self.candidates

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the named effects that are in the catalogue."""
        return (
            ()
            if self.diagnosis is None
            else tuple(effect.effect for effect in self.diagnosis.effects if effect.law is None)
        )

    @property
    def structured(self) -> bool:
        """Whether place, axis, variables and memory of `laws` are right."""
        return self.truth is not None and bool(self.laws) and _has_true_structure(self.laws, self.truth)

    @property
    def close(self) -> bool:
        """Whether the error of `laws` is at most `MAX_LAW_ERROR` in the range of motion that the recording visits."""
        return bool(self.laws) and bool(self.errors) and self.errors[0] <= MAX_LAW_ERROR

    @property
    def close_louder(self) -> bool:
        """Whether the error of `laws` is at most `MAX_LAW_ERROR` at a higher level than recorded."""
        return bool(self.laws) and len(self.errors) > 1 and self.errors[1] <= MAX_LAW_ERROR

    @property
    def wrongly_explained(self) -> bool:
        """Whether a law is named with the verdict "explained" although its structure is wrong, or no law is present."""
        return bool(self.named) and self.verdict == "explained" and not self.structured

    @property
    def false_law(self) -> bool:
        """Whether a law is named where none was concealed."""
        return self.truth is None and bool(self.named)

    @property
    def is_wrong(self) -> bool:
        """Whether the answer is wrong: the diagnosis failed, named a law where there is none, or explained wrongly; or
        the concealed law is detectable, and no law of its structure and function was returned."""
        if self.diagnosis is None or self.false_law or self.wrongly_explained:
            return True
        return self.truth is not None and self.detectable and not (self.structured and self.close)


def _collect_laws(entries: Sequence[NamedEffect] | Sequence[Candidate]) -> tuple[Law, ...]:
    """Parse the laws among the named effects, or among the candidates, of a diagnosis."""
    return tuple(
        parse_law(entry.law.expression, entry.law.acts_on, entry.law.axis) for entry in entries if entry.law is not None
    )


def _has_true_structure(laws: Sequence[Law], truth: TrueLaw) -> bool:
    """Whether the laws act at the true axes and, per axis, have the true variables, memory and place of action."""
    laws_by_axis = {axis: [law for law in laws if law.axis[-1] == axis] for axis in {law.axis[-1] for law in laws}}
    if set(laws_by_axis) != set(truth.axes):
        return False
    for axis, variable_sets in zip(truth.axes, truth.variables, strict=True):
        variables = " ".join(sorted({name for law in laws_by_axis[axis] for name in law.variables}))
        has_states = any(has_memory(law) for law in laws_by_axis[axis])
        if variables not in variable_sets or has_states != truth.memory:
            return False
        if any(law.acts_on not in truth.acts_on for law in laws_by_axis[axis]):
            return False
    return True
