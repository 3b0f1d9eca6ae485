"""Command `hapteq identify`: fits a state-space model of the device to its recordings.

The band is that of --band, or ends at the direction limit of a study (--limit-from). `study.workflows.equalizer` fits
the model, tests it on held-out data and writes it; a summary is printed, and remarks go to standard error. Raises
StudyError where the output exists or no model can be made from the recordings.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.results import JsonOption, print_notes, print_summary

LimitOption = Annotated[
    Path | None,
    typer.Option(metavar="ANOVA.json", help="Analysis of a study, whose direction limit is the upper end of the band."),
]

SmoothOption = Annotated[
    bool | None,
    typer.Option(
        "--smooth/--no-smooth", help="Fit to local averages over lines [default: where they scatter beyond noise]."
    ),
]


def identify(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings of sweeps or multisines, all at one place.")],
    out: Annotated[Path, typer.Option(help="The model to write, MODEL.h5.")],
    band: Annotated[tuple[float, float], typer.Option(help="Band to fit, low and high in hertz.")] = (5.0, 35.0),
    limit_from: LimitOption = None,
    order: Annotated[int, typer.Option(min=2, max=200, help="Number of states; even.")] = 26,
    smooth: SmoothOption = None,
    with_spring: Annotated[
        bool, typer.Option("--with-spring", help="Treat the virtual spring as a part of the device.")
    ] = False,
    physics: Annotated[
        Path | None, typer.Option(help="Mechanical model whose effects are subtracted from the recordings.")
    ] = None,
    longest_decay: Annotated[
        float | None,
        typer.Option(help="Longest decay of a pole, in seconds [default: 0.5, longer where the recordings show it]."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Folder for a page with transfer functions, bands and the choice of order.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Fit a stable model to the band, test it on held-out data, and write it."""
    from study.cli.progress import show_bar
    from study.workflows.equalizer.identified_summary import format_summary, summarise_model
    from study.workflows.equalizer.identify_model import IdentifyPlan, identify_model, require_new_output
    from study.workflows.equalizer.report_identification import report_identification

    chosen_band_hz = _choose_band(band, limit_from)
    plan = IdentifyPlan(tuple(recordings), out, chosen_band_hz, order, smooth, with_spring, physics, longest_decay)
    require_new_output(out)
    with show_bar("Identifying (%)", total=100) as show_percent:
        device = identify_model(plan, lambda share: show_percent(round(100 * share)))
    print_summary(summarise_model(device), (str(out), *format_summary(device)), as_json)
    print_notes(device.remarks)
    if report is not None:
        with show_bar("Report (%)", total=100) as show_percent:
            page_path = report_identification(device, report, lambda share: show_percent(round(100 * share)))
        typer.echo(f"Report: {page_path}", err=True)


def _choose_band(band: tuple[float, float], limit_from: Path | None) -> tuple[float, float]:
    """Choose the band (Hz): the stated one, or with `limit_from` from its lower end to the direction limit of that
    analysis, whose origin is printed as a note. Raises CannotReadError and UnusableFileError (`read_study_band`)."""
    if limit_from is None:
        return band
    from study.workflows.equalizer.direction_limit import read_study_band

    limited_band = read_study_band(limit_from, band[0])
    typer.echo(f"Note: {limited_band.origin}", err=True)
    return limited_band.band_hz
