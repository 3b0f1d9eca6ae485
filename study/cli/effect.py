"""Command `hapteq effect`: saves a discovered law (a formula of a missing force) as an effect for later diagnoses."""

from pathlib import Path
from typing import Annotated

import typer


def effect(
    law_source: Annotated[
        Path,
        typer.Argument(metavar="FOUND", help="A diagnosis (file or folder) or a mechanical model with a law."),
    ],
    out: Annotated[Path, typer.Option(help="The file to write, EFFECT.py; its name is the effect's name.")],
    number: Annotated[int, typer.Option(min=1, help="Which law, where there are several.")] = 1,
) -> None:
    """Write a discovered law as a file that defines an effect. `hapteq diagnose --effect-file EFFECT.py` then looks for
    it in other recordings, at every axis."""
    from study.workflows.diagnosis.effect_file import write_entry

    entry = write_entry(law_source, out, number)
    typer.echo(str(out))
    typer.echo(f"{entry.name}: {entry.law.text}, acts on {entry.law.acts_on}, found at {entry.law.axis}.")
    typer.echo(f"To look for it: hapteq diagnose REC.h5 --out FOLDER --effect-file {out}")
