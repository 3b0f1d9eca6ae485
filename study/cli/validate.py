"""Command `hapteq validate`: checks files of hapteq, and prints their problems in words.

Options and output only; `study.workflows.files` validates: `validate_in_process` each file, `check_model_channels`
models against recordings.
"""

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
    from study.workflows.files.check_model_channels import check_model_channels
    from study.workflows.files.validate_in_process import validate_files

    validations = check_model_channels(list(validate_files(files)))
    if as_json:
        document = [
            {
                "file": str(file_validation.path),
                "kind": file_validation.kind,
                "problems": list(file_validation.problems),
                "notes": list(file_validation.notes),
            }
            for file_validation in validations
        ]
        typer.echo(json.dumps(document, indent=2))
    for validation in [] if as_json else validations:
        typer.echo(f"{validation.path}: {validation.kind}: {'not valid' if validation.problems else 'valid'}")
        for problem in validation.problems:
            typer.echo(f"  {problem}")
        for note in validation.notes:
            typer.echo(f"  Note: {note}")
    if any(file_validation.problems for file_validation in validations):
        raise typer.Exit(ExitCode.ERROR)
