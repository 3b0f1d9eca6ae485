"""Command `hapteq contact`: plays a recorded acceleration transient along the normal of a contact, on the device.

Parses the options, prints the notice before the device moves, and calls `study.workflows.equalizer.play_contact`.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.motion_notice import announce_motion
from study.cli.results import JsonOption, print_summary
from study.cli.seed import check_seed
from study.cli.session_options import DeviceOption, HandsOffOption


def contact(
    model: Annotated[Path, typer.Argument(metavar="MODEL.h5", help="Model of the device alone, from hapteq identify.")],
    transient: Annotated[
        Path,
        typer.Argument(metavar="TRANSIENT.csv", help="Columns time_s,a: acceleration in m/s^2 from the contact on."),
    ],
    normal: Annotated[tuple[float, float, float], typer.Option(help="Normal of the touched surface: x y z.")],
    out: Annotated[Path, typer.Option(help="Folder to write; it must not be there yet, or be empty.")],
    device: DeviceOption = "simulated",
    scale: Annotated[float, typer.Option(min=1e-6, max=1e6, help="Factor by which the transient is multiplied.")] = 1.0,
    weight: Annotated[float, typer.Option(min=0.0, help="Weight of |force|² against |error|², (m/s² per N)².")] = 1e-3,
    cap: Annotated[float, typer.Option(min=0.001, help="Highest force, in newtons.")] = 3.0,
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the simulated device's noise.")] = 1,
    hands_off: HandsOffOption = False,
    as_json: JsonOption = False,
) -> None:
    """Play an acceleration transient that begins at a contact; no force acts before the contact. No person may hold the
    handle; from a script, a real device moves with --hands-off only.

    Writes forces.csv, wanted.csv, measured.csv, contact.json and a picture that compares it with a force of one gain.
    """
    from functools import partial

    from study.cli.progress import show_share
    from study.workflows.equalizer.play_contact import ContactPlan, format_contact, play_contact, summarise_contact

    plan = ContactPlan(model, transient, normal, out, device, scale, weight, cap, seed)
    with show_share("Plays") as on_progress:
        playback = play_contact(plan, on_progress, partial(announce_motion, hands_off=hands_off))
    print_summary(summarise_contact(playback), (str(out), *format_contact(playback)), as_json)
