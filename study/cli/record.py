"""`hapteq record`: play a recording protocol on the device and keep what came back."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.study import DeviceOption


def record(
    protocol: Annotated[str, typer.Argument(help="A shipped recording protocol (ellipsoid, sweep), or a file.")],
    out: Annotated[Path, typer.Option(help="The recording to write, REC.h5.")],
    device: DeviceOption = "simulated",
    place: Annotated[tuple[float, float, float], typer.Option(help="Place in the workspace, x y z in metres.")] = (
        0.0,
        0.0,
        0.0,
    ),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated device's noise.")] = 1,
) -> None:
    """Record the device's answer to an excitation. Interrupted, what is whole so far is written."""
    from study.cli.progress import bar
    from study.store.protocol_files import read_recording_protocol
    from study.workflows.record_device import RecordingPlan, check_free, record_device

    source = read_recording_protocol(protocol)
    plan = RecordingPlan(source.protocol, device=device, place_m=place, seed=seed, out=out)
    check_free(out)
    with bar(f"{source.protocol.title} (s)", total=round(plan.total_s)) as show:
        written = record_device(plan, on_progress=show)
    typer.echo(str(written.path))
    for warning in written.warnings:
        typer.echo(f"Note: {warning}", err=True)
