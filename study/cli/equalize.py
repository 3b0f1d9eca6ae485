"""Command `hapteq equalize`: compute the feedforward forces for which the handle tracks an acceleration trajectory.

Options and output only. The forces are computed by `study.workflows.equalizer.equalize_trajectory`, and improved by
repeated plays on the device (iterative learning, `--repeat`) by `study.workflows.equalizer.repeat_trajectory`.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from study.cli.motion_notice import announce_motion
from study.cli.results import JsonOption, print_summary
from study.cli.seed import check_seed
from study.cli.session_options import HandsOffOption

if TYPE_CHECKING:
    from study.workflows.equalizer.equalize_trajectory import EqualizePlan
    from study.workflows.equalizer.repeat_trajectory import RepeatOptions

EarlierOption = Annotated[
    Path | None, typer.Option("--from", help="Forces of an earlier run with --repeat, from which to continue.")
]


def equalize(
    files: Annotated[
        list[Path], typer.Argument(metavar="MODEL.h5... WANTED.csv", help="Models, then the wanted accelerations.")
    ],
    out: Annotated[Path, typer.Option(help="The table of forces to write, FORCES.csv.")],
    at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Place in the workspace, x y z in metres, for models of several places."),
    ] = None,
    weight: Annotated[float, typer.Option(min=0.0, help="Weight of |force|² against |error|², (m/s² per N)².")] = 1e-3,
    cap: Annotated[float, typer.Option(min=0.001, help="Highest force, in newtons.")] = 3.0,
    constrain: Annotated[
        bool, typer.Option("--constrain", help="Above the cap, compute the best forces under it instead of refusing.")
    ] = False,
    physics: Annotated[
        Path | None, typer.Option(help="Mechanical model whose named effects are compensated, such as friction.")
    ] = None,
    repeat: Annotated[
        int | None,
        typer.Option(min=1, help="Play on the device, measure, correct, up to so many times. No person may hold it."),
    ] = None,
    device: Annotated[str | None, typer.Option(help="Device to repeat on: simulated, or a real one.")] = None,
    earlier: EarlierOption = None,
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of the simulated device's noise.")] = 1,
    hands_off: HandsOffOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute the forces (time_s,fx,fy,fz) that give wanted accelerations (time_s,ax,ay,az), row by row.

    Models of several places are interpolated at --at. Of one place, a narrow-band and a wide-band model may be given;
    the forces are then computed in three frequency bands.
    """
    from study.workflows.equalizer.equalize_trajectory import EqualizePlan
    from study.workflows.equalizer.repeat_trajectory import RepeatOptions

    _check_arguments(files, repeat, device, earlier)
    *models, trajectory = files
    plan = EqualizePlan(tuple(models), trajectory, out, at, weight, cap, constrain, physics)
    summary, lines = (
        _equalize_once(plan)
        if repeat is None or device is None
        else _repeat_on_device(plan, RepeatOptions(repeat, device, earlier, seed), hands_off)
    )
    print_summary(summary, (str(out), *lines), as_json)


def _check_arguments(files: list[Path], repeat: int | None, device: str | None, earlier: Path | None) -> None:
    """Raise WrongUseError for missing models or a missing table, for --repeat without --device or the reverse, and for
    --from without --repeat."""
    from study.errors import WrongUseError

    if len(files) < 2 or files[-1].suffix.lower() in (".h5", ".hdf5"):
        raise WrongUseError(
            "Models or the table are missing",
            "hapteq equalize takes one or more models and, last, a table of wanted accelerations.",
            "Give them in this order, such as: hapteq equalize model.h5 wanted.csv --out forces.csv",
        )
    if (repeat is None) != (device is None) or (earlier is not None and repeat is None):
        raise WrongUseError(
            "--repeat and --device need each other",
            "--repeat and --device must be given together, and --from only with them.",
            "Give both, such as: hapteq equalize model.h5 wanted.csv --repeat 10 --device simulated --out forces.csv",
        )


def _equalize_once(plan: "EqualizePlan") -> "tuple[dict[str, Any], tuple[str, ...]]":
    """Compute and write the forces. Returns the summary for JSON, and the same as lines of text."""
    from study.workflows.equalizer.equalize_trajectory import equalize_trajectory
    from study.workflows.equalizer.equalized_summary import format_equalization_lines, summarise_equalization

    equalized_trajectory = equalize_trajectory(plan)
    return summarise_equalization(equalized_trajectory), format_equalization_lines(equalized_trajectory)


def _repeat_on_device(
    plan: "EqualizePlan", options: "RepeatOptions", hands_off: bool
) -> "tuple[dict[str, Any], tuple[str, ...]]":
    """Compute the forces, play them on the device and correct them by the measured error, at most `options.repeats`
    times. Returns the summary for JSON, and the same as lines of text. hands_off: whether the user has confirmed that
    no person holds the handle."""
    from functools import partial

    from study.cli.progress import show_late_bar
    from study.workflows.equalizer.repeat_trajectory import (
        format_repeat_lines,
        repeat_trajectory,
        summarise_repeats,
    )

    confirm_motion = partial(announce_motion, hands_off=hands_off)
    with show_late_bar("Plays", total=options.repeats + 1) as show_plays:
        repeat_result = repeat_trajectory(
            plan, options, lambda number, share: show_plays(number + share), confirm_motion
        )
    return summarise_repeats(repeat_result), format_repeat_lines(repeat_result)
