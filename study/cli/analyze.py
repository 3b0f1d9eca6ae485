"""Command `hapteq analyze`: computes thresholds, ANOVA, figures and the report of all sessions in a folder."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption, print_results


def analyze(
    data: Annotated[Path, typer.Argument(help="Folder of sessions, one session, or an export as psych-ds or csv.")],
    out: Annotated[Path | None, typer.Option(help="Where results go; default: 'analysis' in the folder.")] = None,
    ellipsoid: Annotated[
        Path | None, typer.Option(help="A recording of the ellipsoid protocol, to be added to the report.")
    ] = None,
    protocol: Annotated[
        str | None, typer.Option(help="Which protocol's sessions, where the folder holds several.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute thresholds of all sessions and their ANOVA: write thresholds.csv, anova.json, figures and report.html."""
    from study.workflows.results.analysis_files import ANALYSIS_NAME
    from study.workflows.results.analyze_data import analyze_data

    out = out if out is not None else data / ANALYSIS_NAME
    print_results(analyze_data(data, out, ellipsoid, protocol), as_json)
