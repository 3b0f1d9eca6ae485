"""Output of results: lines for a person or one JSON document on stdout; messages on stderr."""

import json
from dataclasses import asdict
from typing import Annotated

import typer

from study.workflows.results.written_analysis import WrittenAnalysis

JsonOption = Annotated[bool, typer.Option("--json", help="Results as one JSON document on stdout.")]


def print_results(analysis: WrittenAnalysis, as_json: bool) -> None:
    """Print the results of a session or analysis."""
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
