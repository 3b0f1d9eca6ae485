"""Command `hapteq withdraw`: erases the data of a participant who withdraws the consent.

Lists what will be erased and asks for confirmation; `study.workflows.session.withdraw_participant` erases.
"""

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

    After an interruption, the same command continues. Symbolic links are not followed. Data that may be the
    participant's, but are not proved to be, are listed.
    """
    from study.devices.clock import RealClock
    from study.workflows.session.withdraw_participant import (
        find_session_to_withdraw,
        list_remaining_copies,
        plan_withdrawal,
    )
    from study.workflows.session.withdraw_participant import withdraw as erase

    folder = find_session_to_withdraw(session, data)
    data_folder = folder.path.parent
    plan = plan_withdrawal(folder)
    derived_text = ", ".join(str(data_folder / name) for name in plan.derived_roots)
    analysis_note = f", and the analysis in {derived_text}" if derived_text else ""
    typer.echo(f"To be erased for good, in {data_folder}: {', '.join(plan.sessions)}{analysis_note}", err=True)
    for sentence in plan.doubtful:
        typer.echo(f"Not to be erased: {sentence}", err=True)
    kept = "Nothing was erased."
    if folder.withdrawal.exists():
        kept = f"Nothing more was erased; no session of {plan.subject} counts as data any more."
    if not yes and not _ask_whether_to_erase(kept):
        typer.echo(kept, err=True)
        return
    erased = erase(data_folder, plan, RealClock().utc())
    typer.echo(f"Erased: {', '.join(erased.sessions)}")
    if derived_text := ", ".join(str(data_folder / name) for name in erased.derived_roots):
        typer.echo(f"Erased too, because it was made from them: {derived_text}. Run hapteq analyze again.", err=True)
    found_later = (f"Not erased: {sentence}" for sentence in erased.doubtful if sentence not in plan.doubtful)
    for sentence in (*found_later, *list_remaining_copies(data_folder, erased)):
        typer.echo(sentence, err=True)


def _ask_whether_to_erase(kept: str) -> bool:
    """Ask for the confirmation. kept: what is told without one. Raises UserInterruptError at Ctrl-C and at the end of
    the input."""
    from study.errors import UserInterruptError

    try:
        return typer.confirm("Erase them?", err=True)
    except typer.Abort as interruption:
        raise UserInterruptError(
            "Not confirmed",
            "The question was not answered.",
            "Run the command again, or with --yes, which does not ask.",
            saved=kept,
        ) from interruption
