"""A problem with one key of a protocol file."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Problem:
    """Reads as a sentence: the key, what is wrong with it, what is allowed."""

    key: str
    """Dotted path such as `staircase.start_n` or `staircase.steps[2].step_db`; list entries count from 1."""
    problem: str
    """A predicate: "is 5, which is too large"."""
    allowed: str

    def __str__(self) -> str:
        return f"{self.key} {self.problem}. Allowed: {self.allowed}."

    def below(self, parent: str) -> "Problem":
        """The same problem with its key below the table `parent`."""
        return Problem(".".join(part for part in (parent, self.key) if part), self.problem, self.allowed)


class InconsistentError(ValueError):
    """Values that are valid individually but not together. Keys are relative to the table that raises it."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        super().__init__(" ".join(str(problem) for problem in problems))
        self.problems = problems


def refuse(problems: list[Problem]) -> None:
    """Raise InconsistentError when there are any."""
    if problems:
        raise InconsistentError(tuple(problems))
