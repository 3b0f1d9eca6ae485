"""`hapteq analyze`: thresholds, ANOVA, figures and the report of all sessions in a folder."""

from pathlib import Path
from typing import Annotated

import typer


def analyze(
    data: Annotated[Path, typer.Argument(help="Folder of sessions, or one session.")],
    out: Annotated[Path | None, typer.Option(help="Where results go; default: 'analysis' in the folder.")] = None,
    ellipsoid: Annotated[
        Path | None, typer.Option(help="A recording of the ellipsoid protocol, to be added to the report.")
    ] = None,
    protocol: Annotated[
        str | None, typer.Option(help="Which protocol's sessions, where the folder holds several.")
    ] = None,
) -> None:
    """Write thresholds.csv, anova.json, figures and report.html."""
    from study.workflows.analyze_data import analyze_data

    written = analyze_data(data, out if out is not None else data / "analysis", ellipsoid, protocol)
    for line in written.table:
        typer.echo(line)
    for warning in written.warnings:
        typer.echo(f"Note: {warning}", err=True)
    typer.echo(f"Report: {written.report}", err=True)
