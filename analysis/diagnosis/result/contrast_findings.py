"""Adds the result of a comparison with clean recordings to the findings: verdict, named fault, and candidates.

The comparison (`contrast`) replaces verdict, effects and errors of the search by simulation. Where the sets could
not be compared, only a fault that the readings show by themselves is named.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from analysis.diagnosis.contrast.comparison import Comparison, JudgedFault
from analysis.diagnosis.contrast.decide import BOUND, Decision
from analysis.diagnosis.contrast.fault import Fault
from analysis.diagnosis.document import Candidate, Diagnosis, Errors, Estimate, Fit, NamedEffect, Rival, Verdict
from analysis.diagnosis.effect_words import unit_of
from analysis.diagnosis.reference.compare_with_reference import Contrast
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from analysis.diagnosis.settings import CONTRAST_BLOCKS, SETS_AS_ONE
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.placing import axis_letter
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME, Place
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.signals.unit_system import LINEAR, UnitSystem

MOST = 6
"""Most candidates that a diagnosis lists."""
BESIDE = (
    "The recordings were compared with the clean ones by a model that was fitted to both sets at once, with all laws "
    "that they need: a fault is an effect that the clean recordings lack. It counts where its gain exceeds {:.3g} "
    "times the gain that it would have between stretches of one set."
)
NOT_COMPARED = (
    "The recordings could not be compared with the clean ones: too little was recorded without gaps, one recording "
    "contains hardly any motion, or the fits failed. The results here use the model alone."
)
BY_ITSELF = "The sensor's signal itself shows this fault, and the clean recordings do not; no model was used."


def add_contrast(whole: Findings, found: Contrast, recording: Recording, beyond: float) -> Findings:
    """The findings with the result of a comparison in their diagnosis, model and remarks. recording: one of the faulty
    set. beyond: factor on the usual gain from which a fault counts."""
    if found.comparison is None or found.decision is None:
        named = _directly_shown_fault(found, recording)
        if named is None:
            return replace(whole, remarks=(NOT_COMPARED, *whole.remarks))
        diagnosis = _with_effects(whole.diagnosis, "partly_explained", (named,), ())
        remarks: tuple[str, ...] = (BY_ITSELF,)
    else:
        diagnosis = _with_comparison(whole.diagnosis, found.comparison, found.decision, recording, whole.given.system)
        remarks = (BESIDE.format(beyond), *(() if found.comparison.complete else (OUT_OF_TIME,)))
    improved = _improve_model(whole.given, diagnosis.effects)
    return replace(
        whole, diagnosis=diagnosis, improved=improved, remarks=(*remarks, *whole.remarks), proposal=None, black_box=None
    )


def _with_effects(
    diagnosis: Diagnosis, verdict: Verdict, effects: tuple[NamedEffect, ...], candidates: tuple[Candidate, ...]
) -> Diagnosis:
    """The diagnosis with other verdict, effects and candidates; mismatch and remainder as the verdict requires."""
    left = diagnosis.remainder or diagnosis.mismatch
    return replace(
        diagnosis,
        verdict=verdict,
        effects=effects,
        candidates=candidates,
        next_experiment=None,
        mismatch=diagnosis.mismatch if verdict != "no_mismatch" else (),
        remainder=left if verdict in ("partly_explained", "unexplained") else (),
    )


def _with_comparison(
    diagnosis: Diagnosis, found: Comparison, decided: Decision, recording: Recording, system: UnitSystem
) -> Diagnosis:
    """The diagnosis with the decision of a comparison. Errors are those of the faulty set."""
    best = decided.named
    named = () if best is None else (_name_fault(best, decided, recording, system),)
    candidates = tuple(_candidate(law, why, recording) for law, why in decided.others)
    verdict: Verdict = "partly_explained" if named else "no_mismatch" if found.excess <= SETS_AS_ONE else "unexplained"
    fit = Fit(
        _errors(
            found,
            found.plain[:CONTRAST_BLOCKS].sum(),
            (found.plain if best is None else best.errors)[:CONTRAST_BLOCKS].sum(),
        ),
        _errors(found, found.held_out, found.held_out if best is None else best.held_out),
    )
    error = "predicted force" if found.by_force else f"windows of {found.step_s:.6f} s"
    changed = _with_effects(diagnosis, verdict, named, candidates[:MOST])
    return replace(changed, fit=fit, error=error)


def _errors(found: Comparison, before: float, after: float) -> Errors:
    """Errors of the faulty set before and after a fault was undone, rms over the rms of its signal. before, after: sums
    of squares."""
    sizes = [float(np.sqrt(left / found.faulty_samples)) * found.faulty_share for left in (before, after)]
    return Errors(sizes[0], sizes[0], sizes[1], None)


def _name_fault(best: JudgedFault, decided: Decision, recording: Recording, system: UnitSystem) -> NamedEffect:
    """The fault as a named effect of the document, with its class."""
    effect = best.fault.effect
    rivals = tuple(Rival(name, 0.0, True, "equally good in its place on the compared data") for name in decided.alike)
    return NamedEffect(
        effect=effect,
        place=best.fault.place,
        axis=_axis(best, recording),
        share=float(np.clip(best.share, 0.0, 1.0)),
        probability=decided.probability,
        parameters=_estimates(best, recording, system),
        rivals=rivals,
        class_=(effect, *decided.alike) if decided.alike else (),
    )


def _axis(weighed: JudgedFault, recording: Recording) -> str | None:
    """Letter of the fault's axis or channel; None where it concerns all."""
    channels = recording.response.channels if weighed.fault.place == "sensor" else recording.command.channels
    return axis_letter(weighed.fault.axis, channels) if weighed.fault.axis in channels else None


def _estimates(weighed: JudgedFault, recording: Recording, system: UnitSystem) -> dict[str, Estimate]:
    """Parameters of the fault with units and 95 % intervals; without an interval where the standard error is 0."""
    units = _units(weighed.fault, recording, system)
    return {
        name: Estimate(
            value, units.get(name, "1"), (value - BOUND * spread, value + BOUND * spread) if spread else None
        )
        for (name, value), spread in zip(weighed.values.items(), weighed.spread.values(), strict=True)
    }


def _units(fault: Fault, recording: Recording, system: UnitSystem) -> Mapping[str, str]:
    """Unit of each parameter of a fault: that of the reading for a sensor's, of the command for an actuator's."""
    if fault.effect in EFFECTS_BY_NAME:
        read = recording.response.units[max(fault.site, 0)] if fault.place == "sensor" else "1"
        return {each.name: each.unit_in(system, read) for each in EFFECTS_BY_NAME[fault.effect].parameters}
    signal = recording.response if fault.place == "sensor" else recording.command
    unit = signal.units[max(fault.site, 0)]
    stiffness = unit_of(fault.effect, "stiffness", system)
    return {"stiffness": stiffness, "offset": unit, "cubic": f"1/({unit})^2", "square": f"1/({unit})"}


def _candidate(weighed: JudgedFault, why: str, recording: Recording) -> Candidate:
    """The fault as a candidate. Its gain E / E' - 1 becomes the share 1 - E' / E of the error with the fault."""
    return Candidate(
        effect=weighed.fault.effect,
        place=weighed.fault.place,
        axis=_axis(weighed, recording),
        parameters=weighed.values,
        held_out_gain=float(np.clip(1 - 1 / (1 + weighed.gain), 0.0, 1.0)),
        share_of_black_box=float(np.clip(weighed.share, 0.0, 1.0)),
        why_not=why,
    )


def _directly_shown_fault(found: Contrast, recording: Recording) -> NamedEffect | None:
    """The fault that the readings show without a model (`signal_faults`, `model_free_faults`), such as hum or clipping;
    None without any. It has no interval."""
    place: Place = "sensor"
    if found.line is not None:
        name, sites, values, place = found.line.effect, found.line.channels, found.line.values, found.line.place
    elif found.shown is not None:
        claim = found.shown.claims[0]
        name, sites, values = claim.effect.name, claim.sites, dict(found.shown.list_placed_effects()[0].values)
    else:
        return None
    signal = recording.response if place == "sensor" else recording.command
    channels, unit = signal.channels, signal.units[sites[0]]
    effect = EFFECTS_BY_NAME.get(name)
    units = (
        dict.fromkeys(values, unit)
        if effect is None
        else {parameter.name: parameter.unit_in(LINEAR, unit) for parameter in effect.parameters}
    )
    known = {key: Estimate(value, units[key]) for key, value in values.items() if key in units}
    axis = axis_letter(channels[sites[0]], channels) if len(sites) < len(channels) or len(channels) == 1 else None
    return NamedEffect(name, place, axis, 1.0, 1.0, known)


def _improve_model(given: MechanicalModel, effects: tuple[NamedEffect, ...]) -> MechanicalModel:
    """The given model with the faults that have a simulation, among its effects."""
    played = tuple(
        ModelEffect(effect.effect, effect.axis, {name: estimate.value for name, estimate in effect.parameters.items()})
        for effect in effects
        if effect.effect in EFFECTS
    )
    return replace(given, effects=(*given.effects, *played))
