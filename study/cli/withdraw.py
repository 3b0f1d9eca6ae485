"""`hapteq withdraw`: a participant withdraws; the data are erased."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.study import DataOption


def withdraw(
    session: Annotated[str, typer.Argument(help="Any session of the participant.")],
    data: DataOption = Path("data"),
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Erase all sessions of a session's participant in this data folder; a tombstone stays."""
    from study.devices.clock import RealClock
    from study.store.archive import SessionFolder, session_folders
    from study.workflows.withdraw_participant import plan_withdrawal
    from study.workflows.withdraw_participant import withdraw as erase

    path = Path(session) if Path(session).is_dir() else data / session
    folder = SessionFolder(path.resolve())
    if folder.name not in [f.name for f in session_folders(folder.path.parent)]:
        from study.errors import WrongUseError

        raise WrongUseError(
            "There is no such session", f"'{session}' was not found in {data}.", "Give its folder, or --data."
        )
    plan = plan_withdrawal(folder)
    made_from_them = f", and the analysis in {plan.analysis}" if plan.analysis else ""
    typer.echo(f"To be erased for good: {', '.join(plan.sessions)}{made_from_them}", err=True)
    if not yes and not typer.confirm("Erase them?", err=True):
        typer.echo("Nothing was erased.", err=True)
        return
    erase(folder.path.parent, plan, RealClock().utc())
    typer.echo(f"Erased: {', '.join(plan.sessions)}")
    if plan.analysis is not None:
        typer.echo(f"Erased too, because it was made from them: {plan.analysis}. Run hapteq analyze again.", err=True)
    typer.echo("Analyses written elsewhere with --out, and copies, still hold the numbers: erase them.", err=True)
