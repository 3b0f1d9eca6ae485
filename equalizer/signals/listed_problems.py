"""Base class of the validation errors of documents, models and tables: they list all problems, not only the first.

Subclasses are raised, for example, by `equalizer.plant.mechanical_model`, `equalizer.tracking.feedforward.trajectory`
and `study.store.disk.csv_rows`.
"""


class ListedProblemsError(ValueError):
    """An input has one or more problems. `problems`: a sentence for each; the message joins them by semicolons."""

    def __init__(self, problems: tuple[str, ...]) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems
