"""`hapteq record`: play a recording protocol on the device and keep what came back."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from study.cli.seed import check_seed
from study.cli.study import DeviceOption


def record(
    protocol: Annotated[
        str,
        typer.Argument(
            help="A shipped recording protocol (ellipsoid, sweep, sweep_band, sweep_study, sweep_hand, multisine, "
            "daily_check), or a file."
        ),
    ],
    out: Annotated[Path, typer.Option(help="The recording to write, REC.h5.")],
    device: DeviceOption = "simulated",
    place: Annotated[tuple[float, float, float], typer.Option(help="Place in the workspace, x y z in metres.")] = (
        0.0,
        0.0,
        0.0,
    ),
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the simulated device's noise.")] = 1,
) -> None:
    """Record the device's answer to an excitation. Interrupted, what is whole so far is written.

    Where the accelerometer clips, a piece is played again with less force. A real device says first whether a hand
    may be on the handle, and waits for Enter.
    """
    from study.cli.progress import late_bar
    from study.store.formats.protocol_files import read_recording_protocol
    from study.workflows.recording.record_device import RecordingPlan, check_free, record_device

    source = read_recording_protocol(protocol)
    plan = RecordingPlan(source.protocol, device=device, place_m=place, seed=seed, out=out)
    check_free(out)
    with late_bar(f"{source.protocol.title} (s)", total=round(plan.total_s)) as show:
        written = record_device(plan, on_progress=show, before_moving=announce)
    typer.echo(str(written.path))
    for warning in written.warnings:
        typer.echo(f"Note: {warning}", err=True)


def announce(notice: str) -> None:
    """Print the notice, and wait for Enter if there is a keyboard."""
    from study.cli.screen import has_keys

    typer.echo(notice, err=True)
    if has_keys():
        typer.echo("Press Enter to begin. ", err=True, nl=False)
        if not sys.stdin.readline():  # closed, as by Ctrl-D: that is no yes
            raise KeyboardInterrupt
