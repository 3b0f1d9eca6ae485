"""A discovered law as the diagnosis document writes it: a formula with its variables."""

from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic.dataclasses import dataclass

from equalizer.laws.law import ActsOn, Law, law_of


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class FoundLaw:
    """A law that has no name, as a formula."""

    expression: Annotated[str, Field(description="In the language of laws, docs/formats.md; numbers in SI.")]
    variables: Annotated[tuple[str, ...], Field(description="Signals that it needs.")]
    acts_on: Annotated[ActsOn, Field(description="force: added to it; command, response: in place of it.")]
    axis: str

    @model_validator(mode="after")
    def _in_the_language(self) -> Self:
        found = law_of(self.expression, self.acts_on, self.axis)
        if set(found.variables) != set(self.variables):
            needed = ", ".join(found.variables) or "no signals"
            raise ValueError(f"the law {self.expression} needs {needed}; its variables say otherwise")
        return self


def found_law(law: Law) -> FoundLaw:
    """The law's text, variables, place and axis as an entry of the document."""
    return FoundLaw(law.text, law.variables, law.acts_on, law.axis)


def law_text(law: FoundLaw) -> str:
    """ "F = -4.1*abs(vy)**1.5*sign(vy) N": the force that a law adds, or the command or reading that it replaces."""
    if law.acts_on == "force":
        return f"F = {law.expression} N"
    replaced = "command" if law.acts_on == "command" else "reading"
    return f"in place of the {replaced} of {law.axis}: {law.expression}"
