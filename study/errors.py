"""Base error for screen and command line: what happened, what was saved, what to do now."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import Any


class ExitCode(IntEnum):
    """Exit codes of `hapteq`, a contract with those who script it."""

    DONE = 0
    ERROR = 1
    """A `StudyError` of any other kind."""
    WRONG_USE = 2
    """A command line, a file or a setting that cannot be meant."""
    DEVICE = 3
    """The device: missing, failed, lost during a session, or found not in order by `hapteq doctor`."""
    INTERRUPTED = 130
    """Ctrl-C, or a terminal that was closed."""


class StudyError(Exception):
    """An error that a person can act on.

    `happened` and `do_now` are whole sentences; `saved` says what is safe, where anything was at stake.
    """

    exit_code = ExitCode.ERROR

    def __init__(self, title: str, happened: str, do_now: str, saved: str = "") -> None:
        super().__init__(title)
        self.title = title
        self.happened = happened
        self.saved = saved
        self.do_now = do_now

    def __reduce__(self) -> tuple[Any, ...]:
        """Errors cross process boundaries; a subclass with its own constructor must survive pickling too."""
        return _restore_error, (type(self), self.__dict__)

    def __str__(self) -> str:
        return " ".join(part for part in (f"{self.title}.", self.happened, self.saved, self.do_now) if part)


class WrongUseError(StudyError):
    """The command line asked for something that cannot be."""

    exit_code = ExitCode.WRONG_USE


class DeviceError(StudyError):
    """The device cannot be used, or stopped working."""

    exit_code = ExitCode.DEVICE


class UserInterruptError(StudyError):
    """Ctrl-C was pressed or the terminal closed, and what was done so far is safe."""

    exit_code = ExitCode.INTERRUPTED


@contextmanager
def resumable(happened: str, saved: str, also: tuple[type[UserInterruptError], ...] = ()) -> Iterator[None]:
    """Turn Ctrl-C into a UserInterruptError which says that the same command continues. also: UserInterruptError, where
    a part of the work raises its own, which says less."""
    caught: tuple[type[BaseException], ...] = (KeyboardInterrupt, *also)
    try:
        yield
    except caught as interruption:
        raise UserInterruptError(
            "Interrupted", happened, "Run the same command again: it goes on where it stopped.", saved
        ) from interruption


def _restore_error(kind: type[StudyError], fields: dict[str, Any]) -> StudyError:
    error = kind.__new__(kind)
    error.__dict__.update(fields)
    error.args = (error.title,)
    return error
