"""Output of the commands' results: the option `--json`, and printing of a session's or a study's analysis."""

import json
from collections.abc import Iterable
from typing import Annotated, Any

import typer

from study.workflows.results.written_analysis import WrittenAnalysis

JsonOption = Annotated[bool, typer.Option("--json", help="Results as one JSON document on stdout.")]


def print_results(analysis: WrittenAnalysis, as_json: bool) -> None:
    """Print an analysis: as one JSON document on stdout, or its table on stdout, warnings and report path on stderr."""
    if as_json:
        typer.echo(json.dumps(analysis.as_document(), indent=2))
        return
    print_table(analysis.table, analysis.warnings, str(analysis.report))


def print_table(table: Iterable[str], warnings: Iterable[str], report: str) -> None:
    """Print the lines of a table on stdout, warnings and the path of the report on stderr."""
    for line in table:
        typer.echo(line)
    print_notes(warnings)
    typer.echo(f"Report: {report}", err=True)


def print_summary(summary: dict[str, Any], lines: Iterable[str], as_json: bool) -> None:
    """Print a result on stdout: the summary as one JSON document, or else the lines, which say the same."""
    typer.echo(json.dumps(summary, indent=2) if as_json else "\n".join(lines))


def print_notes(notes: Iterable[str]) -> None:
    """Print each note as a line on stderr."""
    for note in notes:
        typer.echo(f"Note: {note}", err=True)
