"""Command `hapteq protocol` with its subcommands `list`, `show`, `texts` and `lock`.

They list the shipped protocols, explain every key of one, print the participant's texts for translation, and lock a
protocol before data are collected.
"""

import json
from pathlib import Path
from typing import Annotated

import typer

from study.cli.command_table import Subcommands
from study.cli.screen import print_file_text
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
    """List the shipped protocols, one line each."""
    from study.store.formats.protocol_files import list_shipped_protocols, read_protocol

    for name in list_shipped_protocols():
        protocol = read_protocol(name).protocol
        typer.echo(f"{name:22} {protocol.kind:10} {protocol.title}")


@app.command("show")
def show_protocol(
    name: NameArgument,
    print_text: Annotated[
        bool, typer.Option("--text", help="The file, with the texts of its language filled in, to copy and change.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Show every key of a protocol with its value, its default and the reason for it."""
    from protocols.document.explain import explain_protocol
    from protocols.document.hashing import hash_protocol
    from study.session.stimulus.limits import describe_forces
    from study.store.formats.protocol_files import read_protocol

    protocol_file = read_protocol(name)
    if print_text:
        print_file_text(protocol_file.text)
        return
    fields = explain_protocol(protocol_file.protocol)
    if as_json:
        field_rows = [
            {"key": setting.key, "value": setting.value, "default": setting.default, "reason": setting.description}
            for setting in fields
        ]
        typer.echo(
            json.dumps({"hash": hash_protocol(protocol_file.protocol), "fields": field_rows}, indent=2, default=str)
        )
        return
    typer.echo(f"{protocol_file.protocol.title} (hash {hash_protocol(protocol_file.protocol)[:12]})")
    typer.echo(f"Force at the handle: {describe_forces(protocol_file.protocol.safety)}.")
    for field in fields:
        typer.echo(f"\n{field.key} = {field.value}")
        typer.echo(f"    {field.description}")
        typer.echo(f"    Allowed: {field.allowed}.")


@app.command("texts")
def print_texts(
    language: Annotated[str, typer.Argument(help="en, de, es, or a file, which is checked first.")] = "en",
) -> None:
    """Print all texts that a participant reads, as a TOML file to translate, for [text] language in a protocol."""
    from study.store.formats.participant_texts import make_language_template

    print_file_text(make_language_template(language))


@app.command("lock")
def write_lock(name: NameArgument, data: DataOption = Path("data")) -> None:
    """Lock a protocol before data are collected: sessions in the data folder then refuse any other version of it.

    The lock states which parts of the analysis the protocol declares.
    """
    from importlib.metadata import version

    from analysis.psychophysics.two_analyses import describe_declaration
    from protocols.definition.study_protocol import StudyProtocol
    from study.devices.clock import RealClock
    from study.store.disk.privacy import make_folder
    from study.store.formats.protocol_files import lock_protocol, read_protocol

    protocol_file = read_protocol(name, data)
    make_folder(data, private=True)
    lock_path = lock_protocol(protocol_file, data, RealClock().utc(), version("hapteq"))
    typer.echo(str(lock_path))
    if isinstance(protocol_file.protocol, StudyProtocol):
        typer.echo(f"Fixed with all else: {describe_declaration(protocol_file.protocol.analysis)}", err=True)
