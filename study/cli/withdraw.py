"""`hapteq withdraw`: a participant withdraws; the data are erased."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.session_options import DataOption


def withdraw(
    session: Annotated[str, typer.Argument(help="Any session of the participant.")],
    data: DataOption = Path("data"),
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Erase all sessions of a session's participant in this data folder; a tombstone stays.

    Interrupted, the same command continues. Links are not followed. Data that are not proved to be the participant's
    are listed.
    """
    from study.devices.clock import RealClock
    from study.workflows.session.withdraw_participant import (
        find_session_to_withdraw,
        list_remaining_copies,
        plan_withdrawal,
    )
    from study.workflows.session.withdraw_participant import withdraw as erase

    folder = find_session_to_withdraw(session, data)
    place = folder.path.parent
    plan = plan_withdrawal(folder)
    derived_paths = ", ".join(str(place / name) for name in plan.derived_roots)
    analysis = f", and the analysis in {derived_paths}" if derived_paths else ""
    typer.echo(f"To be erased for good: {', '.join(plan.sessions)}{analysis}", err=True)
    for sentence in plan.doubtful:
        typer.echo(f"Not to be erased: {sentence}", err=True)
    if not yes and not typer.confirm("Erase them?", err=True):
        typer.echo("Nothing was erased.", err=True)
        return
    copy_notes = list_remaining_copies(place, plan)
    erase(place, plan, RealClock().utc())
    typer.echo(f"Erased: {', '.join(plan.sessions)}")
    if derived_paths:
        typer.echo(f"Erased too, because it was made from them: {derived_paths}. Run hapteq analyze again.", err=True)
    for sentence in copy_notes:
        typer.echo(sentence, err=True)
