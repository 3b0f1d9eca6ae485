"""Base of the errors that list everything that is wrong with a document, a model or a table."""


class ListedProblemsError(ValueError):
    """An object that cannot be used. `problems`: one sentence each."""

    def __init__(self, problems: tuple[str, ...]) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems
