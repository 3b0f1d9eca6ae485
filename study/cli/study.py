"""Command `hapteq study`: run a new session of a study, with a person or a simulated participant.

In a terminal or browser, the session is shown on full screens (`study.cli.screen`); with `--plain`, without either, or
with a simulated participant, `study.cli.conduct` runs it. Both are imported when the command runs, to start quickly.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.seed import check_seed
from study.cli.session_options import (
    DataOption,
    DeviceOption,
    HandsOffOption,
    KeysOption,
    ModelOption,
    ObserverOption,
    PlainOption,
    ProtocolOption,
    choose_protocol,
)
from study.tui.keys.answer_keys import parse_keys


def study(
    protocol: ProtocolOption = None,
    device: DeviceOption = "simulated",
    subject: Annotated[str | None, typer.Option(help="Participant code, letters and digits.")] = None,
    observer: ObserverOption = None,
    model: ModelOption = None,
    plain: PlainOption = False,
    data: DataOption = Path("data"),
    seed: Annotated[
        int | None, typer.Option(min=0, callback=check_seed, help="Seed of all draws; drawn and logged if not given.")
    ] = None,
    keys: KeysOption = "1,2",
    hands_off: HandsOffOption = False,
    as_json: JsonOption = False,
) -> None:
    """Take the study: instructions, training, one staircase per frequency, thresholds and a report."""
    from study.cli.screen import has_keyboard, has_screen, open_screen

    answer_keys, protocol = parse_keys(keys), choose_protocol(protocol, model)
    if observer is None and not plain and has_screen():
        from study.tui.app.start_options import StartOptions
        from study.tui.engine.to_engine import BeginSession, SessionOrder

        equalizer = "" if model is None else str(model)
        session_order = None if subject is None else SessionOrder(protocol, device, subject, str(data), seed, equalizer)
        begin_message = None if session_order is None else BeginSession(session_order)
        open_screen(StartOptions(str(data), device, answer_keys, begin_message, protocol, seed, equalizer), as_json)
        return
    from study.cli.conduct import SittingOptions, run_new_session

    if observer is None and not plain and not has_keyboard():
        typer.echo("No terminal here: a simulated participant ('ideal') takes the session.", err=True)
        observer = "ideal"
    sitting_options = SittingOptions(observer=observer, subject=subject, keys=answer_keys, hands_off=hands_off)
    run_new_session(
        sitting_options, protocol_name=protocol, device=device, data=data, seed=seed, as_json=as_json, model=model
    )
