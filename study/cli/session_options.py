"""Command-line options of several commands on sessions and devices, so that name and help text are the same."""

from pathlib import Path
from typing import Annotated

import typer

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
    str, typer.Option(metavar="A,B", help="Keys that answer 1 and 2 in addition to the digits, such as f,j.")
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


def choose_protocol(protocol: str | None, model: Path | None) -> str:
    """Return the name or path of the protocol; for None or an empty text the default, which depends on whether stimuli
    are equalized by a model."""
    return protocol or ("direction_threshold" if model is None else "equalized_threshold")
