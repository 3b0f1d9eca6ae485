"""Command `hapteq serve`: shows the screen of `hapteq study` in a browser, by a web server on this machine.

Checks the address to listen on and the options for `hapteq study`, then runs `study.tui.web_server`.
"""

import sys
from importlib.util import find_spec
from ipaddress import ip_address
from typing import Annotated, Any

import typer

from study.errors import StudyError, WrongUseError
from study.tui.keys.answer_keys import parse_keys

CONTEXT_SETTINGS = {"allow_extra_args": True, "ignore_unknown_options": True}
"""Settings of typer, read by `command_table`: options unknown to `serve` are accepted for `hapteq study`."""

WILDCARD_ADDRESSES = ("0.0.0.0", "::", "")
"""Addresses that mean every interface of this machine: a server can listen on them; a browser needs another."""


def serve(
    context: typer.Context,
    port: Annotated[int, typer.Option(min=1, max=65535, help="Where the page is.")] = 8000,
    host: Annotated[
        str, typer.Option(help="This machine's name or address as others reach it; localhost keeps it to itself.")
    ] = "localhost",
    open_to_network: Annotated[
        bool,
        typer.Option(
            "--open-to-network",
            help="Needed for any --host but localhost. It opens the port to every machine that reaches this address: "
            "one that has the page's address, token included, can take the study, drive the device within the caps, "
            "and read participants' codes and results. Nothing is encrypted: what is typed and shown, and the token, "
            "can be read on the way.",
        ),
    ] = False,
) -> None:
    """Show the study in a browser; all options of `hapteq study` may follow. The address contains a secret token."""
    command = [sys.executable, "-P", "-m", "study", "study", *_check_study_options(context)]
    if host in WILDCARD_ADDRESSES:
        raise WrongUseError(
            "No browser can open this address",
            f"'{host}' means every address of this machine.",
            "Give the one by which the other machine reaches this one, such as --host 192.168.1.20.",
        )
    if not open_to_network and not _is_loopback_host(host):
        raise WrongUseError(
            "Other machines would reach this page",
            f"--host {host} listens beyond this computer, and what is sent there is not encrypted.",
            "Leave --host out to keep it here, or add --open-to-network if that is wanted (hapteq serve --help says "
            "what it opens).",
            saved="Nothing was started.",
        )
    if find_spec("textual_serve") is None:
        raise StudyError(
            "The browser needs one more package",
            "textual-serve is not installed.",
            f"Install it: {sys.executable} -m pip install textual-serve",
        )
    _start_server(command, host, port)


def _is_loopback_host(host: str) -> bool:
    """Whether the host is "localhost" or a loopback address; False for any other name."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _start_server(command: list[str], host: str, port: int) -> None:
    """Serve the screen that `command` starts until the server is stopped. Raises StudyError where host and port cannot
    be used."""
    from study.tui.web_server import ScreenServer

    try:
        ScreenServer(command, host, port, print_line=lambda sentence: typer.echo(sentence, err=True)).serve()
    except OSError as error:
        raise StudyError(
            "The page cannot be served",
            f"{error.strerror or error}.",
            "Choose another --port, or another --host.",
        ) from error


def _check_study_options(context: typer.Context) -> list[str]:
    """Return the options for `hapteq study`, parsed once by that command, so that an invalid one is refused here and
    not in the browser. Raises WrongUseError for options with which it opens no screen."""
    command_group: Any = context.parent.command if context.parent is not None else None
    options = list(context.args)
    option_values = command_group.commands["study"].make_context("study", list(options), parent=context.parent).params
    parse_keys(option_values["keys"])
    for name in ("plain", "observer"):
        if option_values.get(name):
            raise WrongUseError(
                "There would be no screen to serve",
                f"With --{name} hapteq study opens none.",
                f"Leave --{name} out, or run hapteq study {' '.join(options)} in a terminal.",
            )
    return options
