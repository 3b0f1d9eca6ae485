"""Base class of the validation errors of documents, models and tables: they list all problems, not only the first.

Subclasses are raised, for example, by `equalizer.plant.mechanical_model`, `equalizer.tracking.feedforward.trajectory`
and `study.store.disk.csv_rows`.
"""

from collections.abc import Iterable, Mapping
from typing import Any, cast


class ListedProblemsError(ValueError):
    """An input has one or more problems. `problems`: a sentence for each; the message joins them by semicolons."""

    def __init__(self, problems: tuple[str, ...]) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems


def format_validation_problems(errors: Iterable[Mapping[str, object]]) -> tuple[str, ...]:
    """Format each error that pydantic found, as in "changes.0: Input should be an object": path of the entry, message.
    errors: as of `ValidationError.errors()`."""
    return tuple(f"{'.'.join(map(str, cast(tuple[Any, ...], error['loc'])))}: {error['msg']}" for error in errors)
