"""`hapteq study`: take the study, as a person or as a simulated participant."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption
from study.cli.seed import check_seed
from study.tui.keys.answer_keys import parse_keys

DataOption = Annotated[Path, typer.Option("--data", help="Folder of all sessions.", show_default=True)]
DeviceOption = Annotated[
    str,
    typer.Option(
        "--device",
        help="simulated, omega3, omega6, omega7, delta3, sigma7, replay:FILE.h5, or simulated:CAL.h5 (as calibrated).",
    ),
]
HandsOffOption = Annotated[
    bool,
    typer.Option(
        "--hands-off",
        help="For scripts, which cannot press Enter: no hand is on the handle of the real device, and none will be.",
    ),
]
KeysOption = Annotated[
    str, typer.Option(metavar="A,B", help="Keys that answer 1 and 2 beside the digits, such as f,j.")
]

ProtocolOption = Annotated[
    str | None,
    typer.Option(
        help="A shipped protocol's name, or a file [default: direction_threshold; with --model: equalized_threshold]."
    ),
]
ModelOption = Annotated[
    Path | None, typer.Option(help="Identified model MODEL.h5: stimuli are accelerations, equalized through it.")
]

ObserverOption = Annotated[
    str | None,
    typer.Option(
        help="Let a simulated participant take it: ideal, lapsing, biased, guesser, alternator, always_1, "
        "always_2, vibration_only, intensity_cue, delivered, repeating, "
        "criterion_drift, drifting, scripted, or person (one of a simulated population)."
    ),
]
PlainOption = Annotated[bool, typer.Option("--plain", help="Line mode; answers may also come from a pipe.")]


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
    from study.cli.screen import has_keys, has_screen, open_screen

    answer_keys, protocol = parse_keys(keys), protocol_or_default(protocol, model)
    if observer is None and not plain and has_screen():
        from study.tui.app.app_start import AppStart
        from study.tui.engine.to_engine import Begin, SessionOrder

        equalizer = "" if model is None else str(model)
        order = None if subject is None else SessionOrder(protocol, device, subject, str(data), seed, equalizer)
        first = None if order is None else Begin(order)
        open_screen(AppStart(str(data), device, answer_keys, first, protocol, seed, equalizer), as_json)
        return
    from study.cli.conduct import SittingOptions, begin

    if observer is None and not plain and not has_keys():
        typer.echo("No terminal here: a simulated participant ('ideal') takes the session.", err=True)
        observer = "ideal"
    sitter = SittingOptions(observer=observer, subject=subject, keys=answer_keys, hands_off=hands_off)
    begin(sitter, protocol_name=protocol, device=device, data=data, seed=seed, as_json=as_json, model=model)


def protocol_or_default(protocol: str | None, model: Path | None) -> str:
    """The protocol's name; the default depends on whether stimuli are equalized."""
    return protocol or ("direction_threshold" if model is None else "equalized_threshold")
