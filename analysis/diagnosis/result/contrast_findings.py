"""Add the result of a comparison with clean recordings to the findings: verdict, named fault, and candidates.

The comparison (`diagnosis.contrast`) replaces verdict, effects and errors of the search by simulation. A fault that the
recordings show without a model is named alone; where there is none and the sets could not be compared, the results of
the search are kept.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from analysis.diagnosis.contrast.choose_fault import T_QUANTILE, Decision
from analysis.diagnosis.contrast.comparison import Comparison, JudgedFault
from analysis.diagnosis.contrast.fault import Fault
from analysis.diagnosis.document import Candidate, Diagnosis, Errors, Estimate, Fit, NamedEffect, Rival, Verdict
from analysis.diagnosis.effect_words import get_parameter_unit
from analysis.diagnosis.errors.fit_score import compute_fit_score
from analysis.diagnosis.limits import CONTRAST_BLOCKS, SAME_DEVICE_EXCESS
from analysis.diagnosis.localisation.mismatch_maps import summarise_worst_channel
from analysis.diagnosis.reference.compare_with_reference import Contrast
from analysis.diagnosis.result.error_table import compute_fit_errors
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.placing import PlacingError, place_recorded_effects, shorten_axis_name
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME, Place
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.signals.unit_system import LINEAR, UnitSystem

MAX_LISTED_CANDIDATES = 6
"""Largest number of candidates that a diagnosis lists. Chosen."""
COMPARED_WITH_CLEAN = (
    "The recordings were compared with the clean ones by a model that was fitted to both sets at once, with all laws "
    "that they need: a fault is an effect that the clean recordings lack. It counts where its gain exceeds {:.3g} "
    "times the gain that it would have between stretches of one set."
)
"""Remark on the method of a comparison; the placeholder is `gain_factor` of `add_contrast`."""
NOT_COMPARED = (
    "The recordings could not be compared with the clean ones: too little was recorded without gaps, one set "
    "contains far less motion than the other, or the fits failed. The results here use the model alone."
)
"""Remark where no comparison was possible."""
SHOWN_DIRECTLY = "The recorded signal itself shows this fault, and the clean recordings do not; no model was used."
"""Remark on a fault found without a model."""
SIMULATED = (
    "The given model predicts the clean recordings. The errors here are those of its simulation, without and with the "
    "named fault."
)
"""Remark where the errors of `simulate_named_fault` are stated."""


def add_contrast(findings: Findings, contrast: Contrast, recording: Recording, gain_factor: float) -> Findings:
    """Put the result of a comparison into diagnosis, improved model and remarks of the findings; without a comparison
    and a directly shown fault, only the remark is added. recording: one of the faulty set. gain_factor: ratio of a
    fault's gain to that between stretches of one set, above which the fault counts; for the remark."""
    if contrast.comparison is None or contrast.decision is None:
        named_fault = _find_directly_shown_fault(contrast, recording)
        if named_fault is None:
            return replace(findings, remarks=(NOT_COMPARED, *findings.remarks))
        diagnosis = _replace_effects(findings.diagnosis, "partly_explained", (named_fault,), ())
        remarks: tuple[str, ...] = (SHOWN_DIRECTLY,)
    else:
        diagnosis = _apply_comparison(
            findings.diagnosis, contrast.comparison, contrast.decision, recording, findings.given.system
        )
        remarks = (COMPARED_WITH_CLEAN.format(gain_factor), *(() if contrast.comparison.complete else (OUT_OF_TIME,)))
    improved = _improve_model(findings.given, diagnosis.effects)
    return replace(
        findings,
        diagnosis=diagnosis,
        improved=improved,
        remarks=(*remarks, *findings.remarks),
        proposal=None,
        black_box=None,
    )


def _replace_effects(
    diagnosis: Diagnosis, verdict: Verdict, effects: tuple[NamedEffect, ...], candidates: tuple[Candidate, ...]
) -> Diagnosis:
    """Replace verdict, effects and candidates of a diagnosis; mismatch and remainder become what the verdict requires,
    and the proposed experiment is removed."""
    remainder = diagnosis.remainder or diagnosis.mismatch
    return replace(
        diagnosis,
        verdict=verdict,
        effects=effects,
        candidates=candidates,
        next_experiment=None,
        mismatch=diagnosis.mismatch if verdict != "no_mismatch" else (),
        remainder=remainder if verdict in ("partly_explained", "unexplained") else (),
    )


def _apply_comparison(
    diagnosis: Diagnosis, comparison: Comparison, decision: Decision, recording: Recording, system: UnitSystem
) -> Diagnosis:
    """Put the decision of a comparison into a diagnosis. Without a named fault the verdict is `no_mismatch` where the
    excess is at most `SAME_DEVICE_EXCESS`, else `unexplained`. Errors are those of the faulty set."""
    judged_fault = decision.named
    named_effects = () if judged_fault is None else (_name_fault(judged_fault, decision, recording, system),)
    candidates = tuple(_make_candidate(law, reason, recording) for law, reason in decision.unnamed)
    verdict: Verdict = (
        "partly_explained"
        if named_effects
        else "no_mismatch"
        if comparison.excess <= SAME_DEVICE_EXCESS
        else "unexplained"
    )
    fit = Fit(
        _compute_errors(
            comparison,
            comparison.block_squares[:CONTRAST_BLOCKS].sum(),
            (comparison.block_squares if judged_fault is None else judged_fault.block_squares)[:CONTRAST_BLOCKS].sum(),
        ),
        _compute_errors(
            comparison,
            comparison.held_out_squares,
            comparison.held_out_squares if judged_fault is None else judged_fault.held_out_squares,
        ),
    )
    error_kind = "predicted force" if comparison.by_force else f"windows of {comparison.step_s:.6f} s"
    updated_diagnosis = _replace_effects(diagnosis, verdict, named_effects, candidates[:MAX_LISTED_CANDIDATES])
    return replace(updated_diagnosis, fit=fit, error=error_kind)


def _compute_errors(comparison: Comparison, squares_before: float, squares_after: float) -> Errors:
    """Compute the errors of the faulty set before and after the fault is undone in its signals (`comparison`), rms over
    the rms of its signal. No model is re-tuned, so that both errors before are equal; the noise is not known.
    squares_before, squares_after: sums of squared errors."""
    relative_errors = [
        float(np.sqrt(square_sum / comparison.faulty_sample_count)) * comparison.faulty_share
        for square_sum in (squares_before, squares_after)
    ]
    return Errors(relative_errors[0], relative_errors[0], relative_errors[1], None)


def _name_fault(judged_fault: JudgedFault, decision: Decision, recording: Recording, system: UnitSystem) -> NamedEffect:
    """Convert the fault to a named effect of the document, with its equivalents as class and rivals."""
    effect = judged_fault.fault.effect
    rivals = tuple(
        Rival(name, 0.0, True, "equally good in its place on the compared data") for name in decision.equivalents
    )
    return NamedEffect(
        effect=effect,
        place=judged_fault.fault.place,
        axis=_find_axis_letter(judged_fault, recording),
        share=float(np.clip(judged_fault.share, 0.0, 1.0)),
        probability=decision.probability,
        parameters=_make_estimates(judged_fault, recording, system),
        rivals=rivals,
        class_=(effect, *decision.equivalents) if decision.equivalents else (),
    )


def _find_axis_letter(judged_fault: JudgedFault, recording: Recording) -> str | None:
    """Find the letter of the fault's axis or channel; None where its axis is no channel of the signal (all of them)."""
    channels = recording.response.channels if judged_fault.fault.place == "sensor" else recording.command.channels
    return shorten_axis_name(judged_fault.fault.axis, channels) if judged_fault.fault.axis in channels else None


def _make_estimates(judged_fault: JudgedFault, recording: Recording, system: UnitSystem) -> dict[str, Estimate]:
    """Make the parameters of the fault with units and 95 % intervals; without an interval where the standard error is
    0."""
    units = _find_units(judged_fault.fault, recording, system)
    return {
        name: Estimate(
            value,
            units.get(name, "1"),
            (value - T_QUANTILE * standard_error, value + T_QUANTILE * standard_error) if standard_error else None,
        )
        for (name, value), standard_error in zip(
            judged_fault.values.items(), judged_fault.standard_errors.values(), strict=True
        )
    }


def _find_units(fault: Fault, recording: Recording, system: UnitSystem) -> Mapping[str, str]:
    """Find the unit of each parameter of a fault: by the catalogue where it has the effect; else from the unit of the
    response for a sensor's fault, of the command for another."""
    if fault.effect in EFFECTS_BY_NAME:
        reading_unit = recording.response.units[max(fault.site, 0)] if fault.place == "sensor" else "1"
        return {
            parameter.name: parameter.find_unit(system, reading_unit)
            for parameter in EFFECTS_BY_NAME[fault.effect].parameters
        }
    signal = recording.response if fault.place == "sensor" else recording.command
    unit = signal.units[max(fault.site, 0)]
    stiffness_unit = get_parameter_unit(fault.effect, "stiffness", system)
    return {"stiffness": stiffness_unit, "offset": unit, "cubic": f"1/({unit})^2", "square": f"1/({unit})"}


def _make_candidate(judged_fault: JudgedFault, reason: str, recording: Recording) -> Candidate:
    """Convert the fault to a candidate. With the sums of squared errors E, and E' after undoing it, the gain
    g = E / E' - 1 becomes the share of the error that is removed, 1 - E' / E = 1 - 1 / (1 + g), limited to 0 to 1."""
    return Candidate(
        effect=judged_fault.fault.effect,
        place=judged_fault.fault.place,
        axis=_find_axis_letter(judged_fault, recording),
        parameters=judged_fault.values,
        held_out_gain=float(np.clip(1 - 1 / (1 + judged_fault.gain), 0.0, 1.0)),
        share_of_black_box=float(np.clip(judged_fault.share, 0.0, 1.0)),
        why_not=reason,
    )


def _find_directly_shown_fault(contrast: Contrast, recording: Recording) -> NamedEffect | None:
    """Find the fault that the recordings show without a model (`signal_faults`, then `model_free_faults`), such as hum
    or clipping; None without any. Its parameters have no intervals; share and probability are 1."""
    place: Place = "sensor"
    if contrast.signal_fault is not None:
        name, sites, values, place = (
            contrast.signal_fault.effect,
            contrast.signal_fault.channels,
            contrast.signal_fault.values,
            contrast.signal_fault.place,
        )
    elif contrast.sensor_fault is not None:
        claim = contrast.sensor_fault.claims[0]
        name, sites, values = (
            claim.effect.name,
            claim.sites,
            dict(contrast.sensor_fault.list_placed_effects()[0].values),
        )
    else:
        return None
    signal = recording.response if place == "sensor" else recording.command
    channels, unit = signal.channels, signal.units[sites[0]]
    effect = EFFECTS_BY_NAME.get(name)
    units = (
        dict.fromkeys(values, unit)
        if effect is None
        else {parameter.name: parameter.find_unit(LINEAR, unit) for parameter in effect.parameters}
    )
    estimates = {
        parameter_name: Estimate(value, units[parameter_name])
        for parameter_name, value in values.items()
        if parameter_name in units
    }
    axis = shorten_axis_name(channels[sites[0]], channels) if len(sites) < len(channels) or len(channels) == 1 else None
    return NamedEffect(name, place, axis, 1.0, 1.0, estimates)


def _improve_model(model: MechanicalModel, effects: tuple[NamedEffect, ...]) -> MechanicalModel:
    """Add to a model those of the effects that the catalogue can simulate."""
    model_effects = tuple(
        ModelEffect(effect.effect, effect.axis, {name: estimate.value for name, estimate in effect.parameters.items()})
        for effect in effects
        if effect.effect in EFFECTS
    )
    return replace(model, effects=(*model.effects, *model_effects))


def simulate_named_fault(findings: Findings, context: SearchContext, recording: Recording) -> Findings:
    """State the errors of a simulation of the given model with the fault that a comparison names, instead of the errors
    of the comparison's base model, and its largest error as the remainder; the verdict stays. Unchanged where no fault
    is named that can be simulated with the parameters of the comparison, or the simulation does not confirm it by a
    smaller error. context: of the given model, which predicts the clean recordings."""
    faults, measure = findings.improved.effects[len(findings.given.effects) :], context.full_measure
    if not faults:
        return findings
    model, given = replace(findings.given, effects=faults), findings.explanation.before
    try:
        residuals = measure.residuals(findings.given, place_recorded_effects(model, recording))
    except PlacingError:  # such as a delay below zero
        return findings
    score = compute_fit_score(measure, residuals)
    if not score.mean_log_error < given.score.mean_log_error:
        return findings
    completed = FittedCandidate(replace(given.fitted, residuals=residuals), score)
    errors = compute_fit_errors(measure, replace(findings.explanation, after=completed))
    remainder = summarise_worst_channel(measure, score, completed.fitted)
    diagnosis = replace(findings.diagnosis, fit=errors, error=measure.name, remainder=remainder)
    return replace(findings, diagnosis=diagnosis, remarks=(SIMULATED, *findings.remarks))
