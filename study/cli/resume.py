"""Command `hapteq resume`: continue an unfinished session, for example after a crash or a pause.

On full screens (`study.cli.screen`); line by line, or with a simulated participant, by `study.cli.conduct`.
"""

import json
from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.session_options import DataOption, DeviceOption, HandsOffOption, KeysOption, PlainOption
from study.tui.keys.answer_keys import parse_keys

LOG_NAME = "events.jsonl"
"""Name of a session's event log. A copy of `study.store.sessions.event_log.LOG_NAME`: importing that module would delay
the first display of the screen."""


def resume(
    session: Annotated[str, typer.Argument(help="Session folder, or its name in the data folder.")],
    device: DeviceOption = "simulated",
    plain: PlainOption = False,
    data: DataOption = Path("data"),
    keys: KeysOption = "1,2",
    hands_off: HandsOffOption = False,
    as_json: JsonOption = False,
) -> None:
    """Continue a session where it stopped. No answer is lost; a trial without an answer is presented again."""
    from study.cli.screen import has_screen, open_screen

    answer_keys = parse_keys(keys)
    if not plain and has_screen() and not _has_simulated_participant(session, data):
        from study.tui.app.start_options import StartOptions
        from study.tui.engine.to_engine import Resume

        open_screen(StartOptions(str(data), device, answer_keys, Resume(session, device, str(data))), as_json)
        return
    from study.cli.conduct import run_resumed_session

    run_resumed_session(session, device=device, data=data, as_json=as_json, keys=answer_keys, hands_off=hands_off)


def _has_simulated_participant(session: str, data: Path) -> bool:
    """Whether the first event of the session's log states a simulated participant, for whom no screen is opened. False
    if no log can be read."""
    from study.regular_file import MAX_DOCUMENT_BYTES, open_regular

    for folder in (Path(session), data / session):
        try:
            with open_regular(folder / LOG_NAME) as log:
                return json.loads(log.readline(MAX_DOCUMENT_BYTES)).get("observer") is not None
        except (OSError, ValueError, AttributeError, RecursionError):
            continue
    return False
