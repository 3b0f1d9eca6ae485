"""`hapteq protocol`: the protocols that come with hapteq, what is in one, and how to fix one before data come in."""

import json
from pathlib import Path
from typing import Annotated

import typer

from study.cli.command_table import Subcommands
from study.cli.session_options import DataOption

app = typer.Typer(
    cls=Subcommands,
    add_completion=False,
    help="List, show, translate and lock protocols.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

NameArgument = Annotated[str, typer.Argument(help="A shipped protocol's name, or a file.")]


@app.command("list")
def list_protocols() -> None:
    """The shipped protocols, one line each."""
    from study.store.formats.protocol_files import list_shipped_protocols, read_protocol

    for name in list_shipped_protocols():
        protocol = read_protocol(name).protocol
        typer.echo(f"{name:22} {protocol.kind:10} {protocol.title}")


@app.command("show")
def show(
    name: NameArgument,
    text: Annotated[bool, typer.Option("--text", help="The file as it is, to copy and change.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Every key of a protocol with its value, its default and the reason for it."""
    from protocols.document.explain import explain_protocol
    from protocols.document.hashing import hash_protocol
    from study.session.stimulus.limits import describe_forces
    from study.store.formats.protocol_files import read_protocol

    file = read_protocol(name)
    if text:
        typer.echo(file.text, nl=False)
        return
    fields = explain_protocol(file.protocol)
    if as_json:
        rows = [{"key": f.key, "value": f.value, "default": f.default, "reason": f.description} for f in fields]
        typer.echo(json.dumps({"hash": hash_protocol(file.protocol), "fields": rows}, indent=2, default=str))
        return
    typer.echo(f"{file.protocol.title} (hash {hash_protocol(file.protocol)[:12]})")
    typer.echo(f"Force at the handle: {describe_forces(file.protocol.safety)}.")
    for field in fields:
        typer.echo(f"\n{field.key} = {field.value}")
        typer.echo(f"    {field.description}")
        typer.echo(f"    Allowed: {field.allowed}.")


@app.command("texts")
def texts(
    language: Annotated[str, typer.Argument(help="en, de, es, or a file, which is checked first.")] = "en",
) -> None:
    """All texts that a participant reads, as a TOML file to translate, for [text] language in a protocol."""
    from study.store.formats.participant_texts import make_language_template

    typer.echo(make_language_template(language), nl=False)


@app.command("lock")
def lock(name: NameArgument, data: DataOption = Path("data")) -> None:
    """Fix a protocol before data come in: sessions in the data folder then refuse any other version of it.

    The lock states which parts of the analysis the protocol declares.
    """
    from importlib.metadata import version

    from analysis.psychophysics.two_analyses import describe_declaration
    from protocols.definition.study_protocol import StudyProtocol
    from study.devices.clock import RealClock
    from study.store.disk.privacy import make_folder
    from study.store.formats.protocol_files import lock_protocol, read_protocol

    file = read_protocol(name, data)
    make_folder(data, private=True)
    path = lock_protocol(file, data, RealClock().utc(), version("hapteq"))
    typer.echo(str(path))
    if isinstance(file.protocol, StudyProtocol):
        typer.echo(f"Fixed with all else: {describe_declaration(file.protocol.analysis)}", err=True)
