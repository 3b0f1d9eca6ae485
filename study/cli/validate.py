"""`hapteq validate`: check any of our files and say in words what is wrong."""

import json
from pathlib import Path
from typing import Annotated

import typer


def validate(
    files: Annotated[list[Path], typer.Argument(help="Files or session folders.")],
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Check files: recordings, models, protocols, tables, logs; and models against the recordings that are given with
    them. Exit code 1 if anything is wrong."""
    from study.errors import ExitCode
    from study.workflows.files.validate_apart import validate_files
    from study.workflows.files.validate_together import check_model_channels

    validations = check_model_channels(list(validate_files(files)))
    if as_json:
        rows = [
            {"file": str(v.path), "kind": v.kind, "problems": list(v.problems), "notes": list(v.notes)}
            for v in validations
        ]
        typer.echo(json.dumps(rows, indent=2))
    for validation in [] if as_json else validations:
        typer.echo(f"{validation.path}: {validation.kind}: {'not valid' if validation.problems else 'valid'}")
        for problem in validation.problems:
            typer.echo(f"  {problem}")
        for note in validation.notes:
            typer.echo(f"  Note: {note}")
    if any(v.problems for v in validations):
        raise typer.Exit(ExitCode.ERROR)
