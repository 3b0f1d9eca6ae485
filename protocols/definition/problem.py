"""Validation problem of one key of a protocol file, and the error that reports such problems.

Raised by the validators of `protocols.definition`; `protocols.document.validation_messages` completes the keys. The
reading of protocols and of translations reports its own problems by the same class.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem with one key. As text it is a sentence: the key, the problem, the allowed values."""

    key: str
    """Dotted path such as `staircase.start_n` or `staircase.steps[2].step_db`; list entries count from 1."""
    problem: str
    """Predicate of the sentence: "is 5, which is too large"."""
    allowed: str
    """Allowed values, as a phrase."""

    def __str__(self) -> str:
        return f"{self.key} {self.problem}. Allowed: {self.allowed}."

    def prefix_key(self, parent: str) -> "Problem":
        """Return the same problem with its key prefixed by the table `parent` and a dot; an empty key or an empty
        `parent` is left out."""
        return Problem(".".join(part for part in (parent, self.key) if part), self.problem, self.allowed)


class InconsistentError(ValueError):
    """Values of a table are invalid together. `problems`: their keys are relative to the table."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        super().__init__(" ".join(str(problem) for problem in problems))
        self.problems = problems


def refuse(problems: list[Problem]) -> None:
    """Raise InconsistentError with the problems; do nothing for an empty list."""
    if problems:
        raise InconsistentError(tuple(problems))
