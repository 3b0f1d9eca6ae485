"""Base class of errors that list all problems of a document, a model or a table at once, not only the first."""


class ListedProblemsError(ValueError):
    """Base class. `problems`: one sentence for each problem; the message joins them by semicolons."""

    def __init__(self, problems: tuple[str, ...]) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems
