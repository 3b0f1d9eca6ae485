"""Progress bars on stderr, as context managers that yield a callback.

Without a terminal, as in a log, a bar is written once, when it ends; `show_steps` and `show_run_and_trial` write
nothing.
"""

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

from study.session.views.participant_views import Question


@contextmanager
def show_run_and_trial(title: str) -> Iterator[Callable[[Question], None]]:
    """Show the run and trial of a simulated participant, without a bar, because the length of a staircase is unknown.
    The yielded function takes the current question."""
    columns = (TextColumn("{task.description}"), TextColumn("{task.fields[where]}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(file=sys.stderr), transient=True) as progress:
        task_id = progress.add_task(title, where="")

        def show_question(question: Question) -> None:
            run_text = f"{question.phase.value} run {question.run_number} of {question.runs_in_phase}"
            progress.update(task_id, where=f"{run_text}, trial {question.trial_number}")

        yield show_question


@contextmanager
def show_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar at once. The yielded function takes the completed amount, in the unit of `total`."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(file=sys.stderr)) as progress:
        task_id = progress.add_task(title, total=total)
        yield lambda completed: progress.update(task_id, completed=completed)


@contextmanager
def show_late_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar from the first call of the yielded function on, because files may have to be read or a
    question asked before. Without a call, nothing is shown. title, total: see `show_bar`."""
    with ExitStack() as stack:

        @cache
        def start_bar() -> Callable[[float], None]:
            return stack.enter_context(show_bar(title, total))

        yield lambda completed: start_bar()(completed)


@contextmanager
def show_share(title: str) -> Iterator[Callable[[float], None]]:
    """Show a bar in percent as `show_late_bar` does. The yielded function takes the share done, 0 to 1."""
    with show_late_bar(f"{title} (%)", total=100) as show_percent:
        yield lambda share: show_percent(round(100 * share))


@contextmanager
def show_steps(title: str) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar with the name of the current step, from the first call of the yielded function on, which
    takes this name and the share done, 0 to 1."""
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    is_silent = not sys.stderr.isatty()
    with ExitStack() as stack:

        @cache
        def start_bar() -> tuple[Progress, TaskID]:
            progress = stack.enter_context(Progress(*columns, console=Console(file=sys.stderr), disable=is_silent))
            return progress, progress.add_task(title, total=1.0)

        def show_step(step_name: str, share: float) -> None:
            progress, task_id = start_bar()
            progress.update(task_id, description=f"{title}: {step_name}", completed=share)

        yield show_step
