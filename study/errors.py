"""Exception classes whose texts are shown to the user (cause, saved data, remedy), and the exit codes of `hapteq`."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import Any


class ExitCode(IntEnum):
    """Exit codes of the command `hapteq`. Scripts may rely on them."""

    DONE = 0
    ERROR = 1
    """An error of any other kind."""
    WRONG_USE = 2
    """A command line or setting that is not valid, or does not fit the files it names."""
    DEVICE = 3
    """The device: missing, failed, lost during a session, or found not in order by `hapteq doctor`."""
    INTERRUPTED = 130
    """Ctrl-C, or a terminal that was closed."""


class StudyError(Exception):
    """Base class of errors that a user can act on.

    title: the error in a few words. happened: the cause; do_now: the remedy; saved: which data are safe, where data
    could have been lost, else empty. All three are complete sentences.
    """

    exit_code = ExitCode.ERROR

    def __init__(self, title: str, happened: str, do_now: str, saved: str = "") -> None:
        super().__init__(title)
        self.title = title
        self.happened = happened
        self.saved = saved
        self.do_now = do_now

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by attributes, because errors are sent between processes and subclasses have other constructors."""
        return _restore_error, (type(self), self.__dict__)

    def __str__(self) -> str:
        return " ".join(part for part in (f"{self.title}.", self.happened, self.saved, self.do_now) if part)


class WrongUseError(StudyError):
    """A command line or setting is invalid, or does not fit the files it names."""

    exit_code = ExitCode.WRONG_USE


class DeviceError(StudyError):
    """The device cannot be used, or failed during use."""

    exit_code = ExitCode.DEVICE


class UserInterruptError(StudyError):
    """Ctrl-C was pressed or the terminal was closed."""

    exit_code = ExitCode.INTERRUPTED


@contextmanager
def convert_interrupts(
    happened: str, saved: str, further_types: tuple[type[UserInterruptError], ...] = ()
) -> Iterator[None]:
    """Context for resumable work that converts KeyboardInterrupt to a UserInterruptError whose remedy is to run the
    same command again. happened, saved: as in `StudyError`. further_types: (UserInterruptError,) to replace the errors
    that a part of the work raises at an interrupt, too."""
    interruption_types: tuple[type[BaseException], ...] = (KeyboardInterrupt, *further_types)
    try:
        yield
    except interruption_types as interruption:
        raise UserInterruptError(
            "Interrupted", happened, "Run the same command again: it continues where it stopped.", saved
        ) from interruption


def _restore_error(error_type: type[StudyError], fields: dict[str, Any]) -> StudyError:
    """Make an error of this class from its attributes (unpickling), without its constructor."""
    error = error_type.__new__(error_type)
    error.__dict__.update(fields)
    error.args = (error.title,)
    return error
