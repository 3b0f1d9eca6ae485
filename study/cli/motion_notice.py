"""Notice that a real device is going to move, and its confirmation by Enter at the terminal."""

import sys

import typer

from study.errors import WrongUseError


def announce_motion(notice: str, hands_off: bool, hand_on_handle: bool = False) -> None:
    """Print the notice to stderr, and wait for Enter where standard input is a keyboard.

    hands_off: whether the user states that no hand is on the handle (--hands-off); then no confirmation is required
    without a keyboard. hand_on_handle: whether the motion is meant for a held handle, which always requires it. Raises
    WrongUseError where `require_confirmation` does, and KeyboardInterrupt at the end of the input.
    """
    from study.cli.screen import has_keyboard

    typer.echo(notice, err=True)
    require_confirmation(hands_off, hand_on_handle)
    if has_keyboard():
        typer.echo("Press Enter to begin. ", err=True, nl=False)
        if not sys.stdin.readline():  # the end of the input (Ctrl-D, a closed terminal) is no confirmation
            raise KeyboardInterrupt


def require_confirmation(hands_off: bool, hand_on_handle: bool = False) -> None:
    """Raise WrongUseError unless a person can confirm the motion at a keyboard, or `hands_off` is stated for a motion
    without a hand. hands_off, hand_on_handle: see `announce_motion`."""
    from study.cli.screen import has_keyboard

    if has_keyboard() or (hands_off and not hand_on_handle):
        return
    raise WrongUseError(
        "The device was not moved: its notice was not confirmed",
        "There is no terminal in which a person could press Enter.",
        "Run it in a terminal: a hand must be on the handle before it moves."
        if hand_on_handle
        else "Run it in a terminal; or, where no hand is on the handle and the workspace is free, add --hands-off.",
        saved="Nothing moved.",
    )
