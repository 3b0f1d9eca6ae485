"""Notice that a real device is going to move, and its confirmation by the person beside it."""

import sys

import typer

from study.errors import WrongUseError


def announce(notice: str, hands_off: bool, hand_on_handle: bool = False) -> None:
    """Print the notice, and wait for Enter.

    Without a keyboard no person can confirm it: then hands_off, the caller's own word, is needed for a free handle,
    and a held one is not moved at all. Raises WrongUseError, or KeyboardInterrupt for a terminal that is closed.
    """
    from study.cli.screen import has_keys

    typer.echo(notice, err=True)
    require_confirmation(hands_off, hand_on_handle)
    if has_keys():
        typer.echo("Press Enter to begin. ", err=True, nl=False)
        if not sys.stdin.readline():  # closed, as by Ctrl-D, is not a confirmation
            raise KeyboardInterrupt


def require_confirmation(hands_off: bool, hand_on_handle: bool = False) -> None:
    """Require that a person can confirm what a real device will do. Raises WrongUseError where no person can confirm
    what a real device will do. Arguments as of `announce`."""
    from study.cli.screen import has_keys

    if has_keys() or (hands_off and not hand_on_handle):
        return
    raise WrongUseError(
        "The device was not moved: its notice was not confirmed",
        "There is no terminal in which a person could press Enter.",
        "Run it in a terminal: a hand must be on the handle before it moves."
        if hand_on_handle
        else "Run it in a terminal; or, where no hand is on the handle and the workspace is free, add --hands-off.",
        saved="Nothing moved.",
    )
