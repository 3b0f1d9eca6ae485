"""Command `hapteq diagnose`: locates the mismatch of model and recording, and names the physics that the model lacks.

Parses the options, calls `study.workflows.diagnosis.diagnose_recordings` and prints its answer.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from study.cli.results import JsonOption

CompareOption = Annotated[
    Literal["auto", "motion", "force"],
    typer.Option(help="What is compared: the motion, the force along the measured motion, or what suits."),
]

SecondsOption = Annotated[
    float | None,
    typer.Option(min=1.0, help="Processor time for the search; what was found by then is kept. [default: no limit]"),
]

DiscoveryOption = Annotated[
    bool,
    typer.Option(
        "--discovery/--no-discovery",
        help="Where no effect of the catalogue explains what is missing, look for a formula that does.",
    ),
]

CleanOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="CLEAN.h5",
        help="A recording of the device when it was in order: differences from the model that it already shows are "
        "not counted as mismatch; may be repeated.",
    ),
]

ForceConstantOption = Annotated[
    list[float] | None,
    typer.Option(
        help="N or N m that an ampere, a volt or a unit of a command gives, where commands are no forces; once for "
        "all, or once for each."
    ),
]

EffectFileOption = Annotated[
    list[Path] | None,
    typer.Option(metavar="EFFECT.py", help="A law of your own to look for, of `hapteq effect`; may be repeated."),
]

WithoutOption = Annotated[
    list[str] | None, typer.Option(metavar="EFFECT", help="An effect not to be considered; may be repeated.")
]


def diagnose(
    sources: Annotated[
        list[Path],
        typer.Argument(metavar="REC.h5... | SESSION", help="Recordings of one device, or a session's folder."),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the results; new, or empty.")],
    model: Annotated[
        Path | None,
        typer.Option(help="Mechanical model MODEL.toml [default: fitted to the recordings; for a session, the twin]."),
    ] = None,
    without: WithoutOption = None,
    clean: CleanOption = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Draws which trials of a session are used, and which are kept for the test.")
    ] = 1,
    compare: CompareOption = "auto",
    seconds: SecondsOption = None,
    discovery: DiscoveryOption = True,
    effect_file: EffectFileOption = None,
    force_constant: ForceConstantOption = None,
    as_json: JsonOption = False,
) -> None:
    """Locate the mismatch, name what is missing, and test it on held-out data.

    Writes diagnosis.json, improved.toml, report.html and figures.
    """
    from study.cli.progress import show_steps
    from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, run_diagnosis, write_result_folder
    from study.workflows.diagnosis.diagnosed_summary import format_answer, format_paths, list_new_remarks, make_json

    plan = DiagnosePlan(tuple(sources), out, model, tuple(without or ()), tuple(clean or ()), seed, compare)
    plan = replace(plan, seconds=seconds, discovery=discovery, effect_files=tuple(effect_file or ()))
    plan = replace(plan, force_constants=tuple(force_constant or ()))
    with show_steps("Diagnosing") as show_step:
        answer = run_diagnosis(plan, show_step)
    findings = answer.findings
    # Printed before the report and its figures are made, because they take much longer.
    typer.echo(json.dumps(make_json(findings), indent=2) if as_json else "\n".join(format_answer(findings)))
    with show_steps("Diagnosing") as show_step:
        reported_answer = write_result_folder(answer, show_step)
    if not as_json:
        typer.echo("\n".join((*list_new_remarks(reported_answer.findings, findings), *format_paths(out))))
