"""`hapteq serve`: the screen of `hapteq study` in a browser."""

import sys
from importlib.util import find_spec
from typing import Annotated, Any

import typer

from study.errors import StudyError, WrongUseError
from study.tui.answer_keys import parse_keys

PASSES_OPTIONS_ON = {"allow_extra_args": True, "ignore_unknown_options": True}
"""What serve does not know are options of `hapteq study`."""

LOCAL = ("localhost", "127.0.0.1")
EVERYWHERE = ("0.0.0.0", "::", "")
"""Addresses to listen on that no browser can open."""


def serve(
    context: typer.Context,
    port: Annotated[int, typer.Option(min=1, max=65535, help="Where the page is.")] = 8000,
    host: Annotated[
        str, typer.Option(help="This machine's name or address as others reach it; localhost keeps it to itself.")
    ] = "localhost",
) -> None:
    """Show the study in a browser; all options of `hapteq study` may follow."""
    command = [sys.executable, "-P", "-m", "study", "study", *_study_options(context)]
    if host in EVERYWHERE:
        raise WrongUseError(
            "No browser can open this address",
            f"'{host}' means every address of this machine.",
            "Give the one by which the other machine reaches this one, such as --host 192.168.1.20.",
        )
    if find_spec("textual_serve") is None:
        raise StudyError(
            "The browser needs one more package",
            "textual-serve is not installed.",
            f"Install it: {sys.executable} -m pip install textual-serve",
        )
    if host not in LOCAL:
        typer.echo(
            f"Anybody who reaches {host}:{port} can drive the device and see the participants' codes: there is no "
            "password. Use a network that you trust.",
            err=True,
        )
    _serve(command, host, port)


def _serve(command: list[str], host: str, port: int) -> None:
    from study.tui.web_server import ScreenServer

    try:
        ScreenServer(command, host, port, say=lambda sentence: typer.echo(sentence, err=True)).serve()
    except OSError as problem:
        raise StudyError(
            "The page cannot be served",
            f"{problem.strerror or problem}.",
            "Choose another --port, or another --host.",
        ) from problem


def _study_options(context: typer.Context) -> list[str]:
    """Read by `hapteq study` itself, so that a wrong one is told here and not in the browser."""
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
