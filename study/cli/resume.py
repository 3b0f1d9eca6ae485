"""`hapteq resume`: go on with a session after a crash or a pause."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.study import DataOption, DeviceOption, KeysOption
from study.tui.answer_keys import parse_keys


def resume(
    session: Annotated[str, typer.Argument(help="Session folder, or its name in the data folder.")],
    device: DeviceOption = "simulated",
    data: DataOption = Path("data"),
    keys: KeysOption = "1,2",
    as_json: JsonOption = False,
) -> None:
    """Go on with a session where it stopped. No answer is lost; a trial without an answer is drawn again."""
    from study.cli.conduct import go_on

    go_on(session, device=device, data=data, as_json=as_json, keys=parse_keys(keys))
