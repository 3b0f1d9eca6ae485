"""Progress on stderr: bars on a terminal, nothing where there is none."""

import sys
from collections.abc import Callable
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from study.session.views import Question


class AnswerCount:
    """Which run and trial a simulated participant is at. The length of a staircase is not known beforehand."""

    def __init__(self, title: str) -> None:
        columns = (TextColumn("{task.description}"), TextColumn("{task.fields[where]}"), TimeElapsedColumn())
        self._progress = Progress(*columns, console=Console(file=sys.stderr), transient=True)
        self._task = self._progress.add_task(title, where="")

    def show(self, question: Question) -> None:
        run = f"{question.phase.value} run {question.run_number} of {question.runs_in_phase}"
        where = f"{run}, trial {question.trial_number}"
        self._progress.update(self._task, where=where)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()


class Bar:
    """Done of total, with elapsed time."""

    def __init__(self, title: str, total: float) -> None:
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        self._progress = Progress(*columns, console=Console(file=sys.stderr))
        self._task = self._progress.add_task(title, total=total)

    def advance(self, by: float = 1) -> None:
        self._progress.advance(self._task, by)

    def at(self, done: float) -> None:
        self._progress.update(self._task, completed=done)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()


OnProgress = Callable[[float], None]
