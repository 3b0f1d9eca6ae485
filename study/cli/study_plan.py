"""Command `hapteq study-plan`: print planned, finished and left-out participants, the orders of frequencies that are
still needed, and the next participant code."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.results import JsonOption
from study.cli.screen import read_terminal_width

if TYPE_CHECKING:
    from study.workflows.views.plan_study import PlannedStudy


def study_plan(
    data: Annotated[Path, typer.Argument(help="Folder of the sessions.")] = Path("data"),
    protocol: Annotated[
        str | None, typer.Option(help="Name or file. Default: all that have sessions in the folder.")
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Of simulated participants, who are counted apart.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Say who is planned, done and left out, which orders of the frequencies are still needed, and who comes next.

    Planned is what analysis.participants of the protocol declares.
    """
    from study.workflows.views.plan_study import list_planned_studies, summarise_plans

    planned_studies = list_planned_studies(data, protocol, simulated)
    if as_json:
        typer.echo(json.dumps(summarise_plans(planned_studies), indent=2))
        return
    for index, planned_study in enumerate(planned_studies):
        for line in (*[""] * (index > 0), *_format_plan(planned_study, read_terminal_width())):
            typer.echo(line)


def _format_plan(planned_study: "PlannedStudy", width_cells: int | None) -> Iterator[str]:
    """Format a plan as lines: summary, then a table of the orders if they are balanced. width_cells: width of the
    terminal in character cells; None = not limited."""
    from study.tui.text_rows import align_rows, wrap_hanging
    from study.workflows.views.plan_study import describe_order, format_plan_lines

    for line in format_plan_lines(planned_study):
        yield from wrap_hanging(line, 2, width_cells)
    if planned_study.plan.cells:
        header = ("order", "frequencies", "wanted", "done", "begun", "needed")
        rows = [
            (str(order_number), describe_order(cell), *map(str, (cell.required, cell.done, cell.begun, cell.needed)))
            for order_number, cell in enumerate(planned_study.plan.cells, start=1)
        ]
        yield from align_rows((header, *rows), width_cells)
