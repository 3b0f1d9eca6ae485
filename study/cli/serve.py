"""`hapteq serve`: the screen of `hapteq study` in a browser."""

import sys
from importlib.util import find_spec
from ipaddress import ip_address
from typing import Annotated, Any

import typer

from study.errors import StudyError, WrongUseError
from study.tui.keys.answer_keys import parse_keys

CONTEXT_SETTINGS = {"allow_extra_args": True, "ignore_unknown_options": True}
"""Options that `serve` does not know are passed on to `hapteq study`."""

EVERYWHERE = ("0.0.0.0", "::", "")
"""Addresses to listen on that no browser can open."""


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
    """Show the study in a browser; all options of `hapteq study` may follow. The address holds a secret token."""
    command = [sys.executable, "-P", "-m", "study", "study", *_study_options(context)]
    if host in EVERYWHERE:
        raise WrongUseError(
            "No browser can open this address",
            f"'{host}' means every address of this machine.",
            "Give the one by which the other machine reaches this one, such as --host 192.168.1.20.",
        )
    if not open_to_network and not _is_this_machine(host):
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
    _serve(command, host, port)


def _is_this_machine(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _serve(command: list[str], host: str, port: int) -> None:
    from study.tui.web_server import ScreenServer

    try:
        ScreenServer(command, host, port, print_line=lambda sentence: typer.echo(sentence, err=True)).serve()
    except OSError as problem:
        raise StudyError(
            "The page cannot be served",
            f"{problem.strerror or problem}.",
            "Choose another --port, or another --host.",
        ) from problem


def _study_options(context: typer.Context) -> list[str]:
    """Read by `hapteq study` itself, so that a wrong one is refused here and not in the browser."""
    group: Any = context.parent.command if context.parent is not None else None
    options = list(context.args)
    values = group.commands["study"].make_context("study", list(options), parent=context.parent).params
    parse_keys(values["keys"])
    for name in ("plain", "observer"):
        if values.get(name):
            raise WrongUseError(
                "There would be no screen to serve",
                f"With --{name} hapteq study opens none.",
                f"Leave --{name} out, or run hapteq study {' '.join(options)} in a terminal.",
            )
    return options
