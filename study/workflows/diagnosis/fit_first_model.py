"""Fit a first mechanical model (mass, damping, stiffness, modes) to recordings and write it (`hapteq model`).

The structure is given or chosen by `analysis.diagnosis.first_model.choose_structure`. The file also states why the
structure was chosen and its largest error, over the channels, on held-out parts.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from analysis.diagnosis.data.recorded_conditions import adapt_to_recorded_commands, has_payload
from analysis.diagnosis.first_model.choose_structure import ChosenStructure, choose_structure
from analysis.diagnosis.first_model.model_structures import KINDS, Kind, ParameterEstimate, StructureFitError
from analysis.diagnosis.result.unit_doubt import describe_unknown_units
from analysis.wording import typeset
from equalizer.plant.mechanical_model import suggest_word
from study.errors import StudyError, WrongUseError
from study.store.disk.provenance import gather_provenance
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.workflows.diagnosis.diagnosis_input import read_input
from study.workflows.output_paths import require_new_outputs

ERROR_TITLE = "The model was not made"
"""Title of the errors about the output file, a folder as input, and recordings that cannot be fitted."""


@dataclass(frozen=True, slots=True)
class FirstModelPlan:
    """Arguments of `fit_and_write_first_model`: recordings, model file to write, and the name of a structure of
    `KINDS`; "auto": the best is chosen."""

    recordings: tuple[Path, ...]
    out: Path
    structure: str = "auto"
    force_constants: tuple[float, ...] = ()
    """Force or torque per unit of a command (N or N m), where commands are not forces: for all, or for each."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedFirstModel:
    """A mechanical model that was fitted and written to `plan.out`, and how its structure was chosen."""

    plan: FirstModelPlan
    choice: ChosenStructure
    remarks: tuple[str, ...]
    """Sentences on the input, on the units and on the fit."""


def fit_and_write_first_model(plan: FirstModelPlan, on_progress: Callable[[float], None]) -> FittedFirstModel:
    """Fit a model and write it. `on_progress(share)`, 0 to 1. Raises StudyError, among others for a folder, for
    recordings with an added weight, and where no structure fits; nothing is written then."""
    requested_kind = _parse_structure(plan.structure)
    require_new_outputs(plan.out, title=ERROR_TITLE, kind="models")
    if folders := [path for path in plan.recordings if path.is_dir()]:
        raise StudyError(
            ERROR_TITLE, f"{folders[0]} is a folder, and a model is fitted to recordings.",
            "Give its recordings, REC.h5.",
            saved="Nothing was written.",
        )  # fmt: skip
    # The seed 1 has no effect: only the trials of a session are drawn at random.
    diagnosis_input = read_input(plan.recordings, 1, True, plan.force_constants)
    if has_payload(diagnosis_input.recordings):
        raise _make_refusal_error(
            "A recording was made with a weight on the handle, and a model fitted to it would include the weight."
        )
    try:
        choice = choose_structure(diagnosis_input.recordings, requested_kind, on_progress)
    except StructureFitError as refusal:
        subject, verb = (
            ("No structure", "can") if requested_kind is None else (f"The structure {requested_kind}", "cannot")
        )
        raise _make_refusal_error(f"{subject} {verb} be fitted to these recordings: {refusal}.") from refusal
    provenance = {
        **gather_provenance(parents=diagnosis_input.parents).as_dict(),
        "structure": choice.fit.kind,
        "reason": choice.reason,
        "compared": choice.fit.error_signal,
        "held_out_error": max(choice.fit.held_out),
    }
    write_mechanical_model(
        plan.out,
        replace(adapt_to_recorded_commands(choice.fit.model, diagnosis_input.recordings[0]), provenance=provenance),
    )
    on_progress(1.0)
    return FittedFirstModel(
        plan,
        choice,
        (*diagnosis_input.remarks, *filter(None, [describe_unknown_units(choice.fit.model)]), *choice.fit.remarks),
    )


def format_first_model(first_model: FittedFirstModel) -> tuple[str, ...]:
    """Format lines for the terminal: the chosen structure and the reason, errors of the structures tried, parameters,
    held-out error of each channel (%), and a sentence on the error that remains."""
    choice, fit = first_model.choice, first_model.choice.fit
    parameter_lines = [_format_parameter(parameter) for parameter in fit.parameters]
    error_lines = [
        f"Held-out error at {name}: {100 * error:.3g} % of the {fit.error_signal}"
        for name, error in zip(fit.channels, fit.held_out, strict=True)
    ]
    attempt_lines = [
        f"  {attempt.kind}: " + (attempt.refusal if attempt.error is None else f"{100 * attempt.error:.3g} %")
        for attempt in choice.tried
    ]
    return (
        str(first_model.plan.out),
        f"Structure: {fit.kind}. {choice.reason}",
        *attempt_lines,
        *parameter_lines,
        *error_lines,
        choice.remains,
    )


def summarise_first_model(first_model: FittedFirstModel) -> dict[str, Any]:
    """Summarise the fitted model as plain values, for a JSON document."""
    choice, fit = first_model.choice, first_model.choice.fit
    return {
        "model": str(first_model.plan.out),
        "structure": fit.kind,
        "reason": choice.reason,
        "numbers": [
            {"name": parameter.name, "unit": parameter.unit, "value": parameter.value,
             "ci95": None if parameter.half_width is None
             else [parameter.value - parameter.half_width, parameter.value + parameter.half_width]}
            for parameter in fit.parameters
        ],
        "compared": fit.error_signal,
        "held_out": dict(zip(fit.channels, fit.held_out, strict=True)),
        "tried": [
            {"structure": attempt.kind, "error": attempt.error, "why_not": attempt.refusal} for attempt in choice.tried
        ],
        "remains": choice.remains,
        "remarks": list(first_model.remarks),
    }  # fmt: skip


def _format_parameter(estimate: ParameterEstimate) -> str:
    """Format a parameter with its unit and, where it is known, its 95 % interval."""
    value_text = typeset(f"{estimate.value:.4g}")
    if estimate.half_width is None:
        return f"  {estimate.name}: {value_text} {estimate.unit}"
    low_text, high_text = (typeset(f"{estimate.value + sign * estimate.half_width:.4g}") for sign in (-1, 1))
    return f"  {estimate.name}: {value_text} {estimate.unit} (95 %: {low_text} to {high_text})"


def _parse_structure(structure: str) -> Kind | None:
    """Find the requested structure; None for "auto". Raises WrongUseError for an unknown name."""
    if structure == "auto":
        return None
    for kind in KINDS:
        if kind == structure:
            return kind
    raise WrongUseError(
        f"There is no structure '{structure}'",
        f"A first model has none of that name{suggest_word(structure, KINDS)}.",
        f"Its names are auto, {', '.join(KINDS)}.",
        saved="Nothing was written.",
    )


def _make_refusal_error(explanation: str) -> StudyError:
    """Make the error for recordings to which no first model can be fitted. explanation: why, as a sentence."""
    return StudyError(
        ERROR_TITLE, explanation,
        "Choose another --structure, or record positions or velocities along every command, without a weight.",
        saved="Nothing was written.",
    )  # fmt: skip
