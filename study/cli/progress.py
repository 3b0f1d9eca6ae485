"""Progress on stderr: bars on a terminal, nothing in a log."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)

from study.session.views.views import Question


@contextmanager
def show_answer_count(title: str) -> Iterator[Callable[[Question], None]]:
    """Callback with the current run and trial of a simulated participant; the length of a staircase is unknown
    beforehand."""
    columns = (TextColumn("{task.description}"), TextColumn("{task.fields[where]}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(file=sys.stderr), transient=True) as progress:
        task = progress.add_task(title, where="")

        def show(question: Question) -> None:
            run = f"{question.phase.value} run {question.run_number} of {question.runs_in_phase}"
            progress.update(task, where=f"{run}, trial {question.trial_number}")

        yield show


@contextmanager
def show_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """Progress bar; the yielded function takes how much is done."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(file=sys.stderr)) as progress:
        task = progress.add_task(title, total=total)
        yield lambda completed: progress.update(task, completed=completed)


@contextmanager
def show_late_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """Progress bar that is drawn only at the first progress, because something may have to be read or asked first."""
    with ExitStack() as stack:

        @cache
        def start_bar() -> Callable[[float], None]:
            return stack.enter_context(show_bar(title, total))

        yield lambda completed: start_bar()(completed)


@contextmanager
def show_steps(title: str) -> Iterator[Callable[[str, float], None]]:
    """The yielded function takes the current step and the share that is done. Silent without a terminal."""
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    is_silent = not sys.stderr.isatty()
    with ExitStack() as stack:

        @cache
        def start_bar() -> tuple[Progress, TaskID]:
            progress = stack.enter_context(Progress(*columns, console=Console(file=sys.stderr), disable=is_silent))
            return progress, progress.add_task(title, total=1.0)

        def show(step_name: str, share: float) -> None:
            progress, task = start_bar()
            progress.update(task, description=f"{title}: {step_name}", completed=share)

        yield show
