"""Output of the commands' results: the option `--json`, and printing of a session's or a study's analysis."""

import json
from dataclasses import asdict
from typing import Annotated

import typer

from study.workflows.results.written_analysis import WrittenAnalysis

JsonOption = Annotated[bool, typer.Option("--json", help="Results as one JSON document on stdout.")]


def print_results(analysis: WrittenAnalysis, as_json: bool) -> None:
    """Print an analysis: as one JSON document on stdout, or its table on stdout, warnings and report path on stderr."""
    if as_json:
        document = {
            "thresholds": [asdict(threshold) for threshold in analysis.thresholds],
            "warnings": list(analysis.warnings),
            "report": str(analysis.report),
        }
        typer.echo(json.dumps(document, indent=2))
        return
    for line in analysis.table:
        typer.echo(line)
    for warning in analysis.warnings:
        typer.echo(f"Note: {warning}", err=True)
    typer.echo(f"Report: {analysis.report}", err=True)
