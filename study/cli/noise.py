"""Command `hapteq noise`: writes a sound file of pink masking noise, so that a participant does not hear the device."""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.seed import check_seed


def noise(
    out: Annotated[Path, typer.Argument(help="The sound to write, OUT.wav.")],
    minutes: Annotated[float, typer.Option(min=0.05, max=15, help="Length; it is made to be looped.")] = 5.0,
    seed: Annotated[
        int, typer.Option(min=0, callback=check_seed, help="Another seed gives other noise of the same kind.")
    ] = 1,
    low_hz: Annotated[float, typer.Option(min=1, max=20_000, help="Lower corner.")] = 40.0,
    high_hz: Annotated[float, typer.Option(min=1, max=20_000, help="Upper corner.")] = 8000.0,
) -> None:
    """Write pink noise that hides the sound of the device, and say how to use it."""
    from study.workflows.session.write_masking_noise import PLAYBACK_INSTRUCTIONS, NoisePlan, write_masking_noise

    write_masking_noise(out, NoisePlan(minutes=minutes, low_hz=low_hz, high_hz=high_hz, seed=seed))
    typer.echo(str(out))
    for sentence in PLAYBACK_INSTRUCTIONS:
        typer.echo(sentence, err=True)
