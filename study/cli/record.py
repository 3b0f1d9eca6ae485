"""Command `hapteq record`: plays a recording protocol on the device and records the response.

Options, notice before a real device moves, and output; `study.workflows.recording.record_device` records.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.motion_notice import announce_motion
from study.cli.results import print_notes
from study.cli.seed import check_seed
from study.cli.session_options import DeviceOption, HandsOffOption
from study.errors import WrongUseError

ORIGIN_M = (0.0, 0.0, 0.0)
"""Centre of the workspace, x y z (m): the default place of a recording."""


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
    place: Annotated[
        tuple[float, float, float], typer.Option(help="Place in the workspace, x y z in metres.")
    ] = ORIGIN_M,
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the simulated device's noise.")] = 1,
    hands_off: HandsOffOption = False,
) -> None:
    """Record the device's response to an excitation. If it is interrupted, the complete pieces are written.

    Where the accelerometer clips, a piece is played again with less force. Before a real device moves, a notice says
    whether a hand may be on the handle, and Enter is awaited; from a script only a free handle is moved, with
    --hands-off.
    """
    from functools import partial

    from study.cli.progress import show_late_bar
    from study.store.formats.protocol_files import read_recording_protocol
    from study.workflows.recording.record_device import RecordingPlan, record_device, require_new_output

    protocol_source = read_recording_protocol(protocol)
    is_held = protocol_source.protocol.hand == "held"
    if is_held and hands_off:
        raise WrongUseError(
            "Is a hand on the handle?",
            f"{protocol!r} is played into a hand, and --hands-off says that there is none.",
            "Leave --hands-off out, or choose a protocol for a free handle.",
            saved="Nothing moved.",
        )
    plan = RecordingPlan(protocol_source.protocol, device=device, place_m=place, seed=seed, out=out)
    require_new_output(out)
    with show_late_bar(f"{protocol_source.protocol.title} (s)", total=round(plan.total_s)) as show:
        recording = record_device(
            plan, on_progress=show, before_moving=partial(announce_motion, hands_off=hands_off, hand_on_handle=is_held)
        )
    typer.echo(str(recording.path))
    print_notes(recording.warnings)
