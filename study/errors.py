"""Errors that the screen and the command line show: what happened, what was saved, what to do now; and exit codes."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import Any


class ExitCode(IntEnum):
    """Exit codes of the command `hapteq`. Scripts may rely on them."""

    DONE = 0
    ERROR = 1
    """A `StudyError` of any other kind."""
    WRONG_USE = 2
    """An invalid command line, file or setting."""
    DEVICE = 3
    """The device: missing, failed, lost during a session, or found not in order by `hapteq doctor`."""
    INTERRUPTED = 130
    """Ctrl-C, or a terminal that was closed."""


class StudyError(Exception):
    """Base class of errors that a user can act on.

    `happened` and `do_now` are whole sentences; `saved` says which data are safe, where data could have been lost.
    """

    exit_code = ExitCode.ERROR

    def __init__(self, title: str, happened: str, do_now: str, saved: str = "") -> None:
        super().__init__(title)
        self.title = title
        self.happened = happened
        self.saved = saved
        self.do_now = do_now

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by attributes: errors cross process boundaries, also those of a subclass with another constructor."""
        return _restore_error, (type(self), self.__dict__)

    def __str__(self) -> str:
        return " ".join(part for part in (f"{self.title}.", self.happened, self.saved, self.do_now) if part)


class WrongUseError(StudyError):
    """The command line requests something that is impossible."""

    exit_code = ExitCode.WRONG_USE


class DeviceError(StudyError):
    """The device cannot be used, or stopped working."""

    exit_code = ExitCode.DEVICE


class UserInterruptError(StudyError):
    """Ctrl-C was pressed or the terminal was closed; the results so far are safe."""

    exit_code = ExitCode.INTERRUPTED


@contextmanager
def resumable(happened: str, saved: str, further_types: tuple[type[UserInterruptError], ...] = ()) -> Iterator[None]:
    """Context that turns Ctrl-C into a UserInterruptError which says that the same command continues the work.
    further_types: (UserInterruptError,) where a part of the work raises its own error, which this error then
    replaces."""
    caught: tuple[type[BaseException], ...] = (KeyboardInterrupt, *further_types)
    try:
        yield
    except caught as interruption:
        raise UserInterruptError(
            "Interrupted", happened, "Run the same command again: it continues where it stopped.", saved
        ) from interruption


def _restore_error(kind: type[StudyError], fields: dict[str, Any]) -> StudyError:
    error = kind.__new__(kind)
    error.__dict__.update(fields)
    error.args = (error.title,)
    return error
