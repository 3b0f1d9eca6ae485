"""The diagnosis: from recordings and a model to findings about missing physics. `diagnose` accesses no file or screen.

The method depends on what is given:

* no model (it was fitted to the recordings): laws are selected by a force balance (regression of the command on the
  motion) and confirmed by simulation; where none is named, effects of the catalogue are searched by simulation;
* a model: effects are searched by simulation, then judged by held-out gain and by the force balance with that model;
* clean recordings of the same device: faults are found by comparison with them (`contrast`) and, with a given model,
  by a search where it predicts them well or no fault explains the difference.

Called by `study.workflows.diagnosis.diagnose_recordings` (the command `hapteq diagnose`) and `diagnose_values`.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from analysis.diagnosis.confirm.fitting_measures import FittingMeasure, choose_fitting_measure
from analysis.diagnosis.confirm.require_gain import require_enough_gain
from analysis.diagnosis.data.input_checks import is_too_short_to_name
from analysis.diagnosis.data.observed_parts import name_parts
from analysis.diagnosis.diagnosis_settings import BALANCE, DiagnosisSettings
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import FAULT_GAIN_FACTOR
from analysis.diagnosis.localisation.model_error_floor import IncomparableRecordingsError, ModelErrorFloor
from analysis.diagnosis.result.assemble_findings import assemble_findings, list_reading_units
from analysis.diagnosis.result.candidates import (
    add_balances_with_fitted_model,
    add_balances_with_given_model,
    collect_balance_errors,
    describe_linear_terms,
)
from analysis.diagnosis.result.curves.state_maps import StateMaps, compute_state_maps
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.unconfirmed_candidates import list_unconfirmed_candidates
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from analysis.diagnosis.search.verdict import Judgement, SearchResult
from analysis.diagnosis.search_by_simulation import SearchOutcome, make_search_context, search_by_simulation
from analysis.diagnosis.types import Mapper, Progress
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance
    from analysis.diagnosis.document import Diagnosis


TOO_SHORT_TO_NAME = "the recordings are so short that other laws would explain them equally well"
"""Reason not to name a law of short recordings (`is_too_short_to_name`)."""


def diagnose(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """Diagnose the physics that the model lacks. recordings: of one device, with the same channels, units and rate; not
    checked here (see `input_checks`). map_: as `map`, may run in parallel. progress: receives a description of the
    current step and the completed fraction, 0 to 1 (a rough estimate). Raises IncomparableRecordingsError where clean
    recordings cannot be compared."""
    balances: tuple[Balance, ...] = ()
    if settings.fitted and not settings.clean:
        progress("testing laws in the force balance", 0.0)
        computed_balances = settings.balances
        balances = computed_balances if computed_balances is not None else _compute_balances(recordings, settings, map_)
        if is_too_short_to_name(recordings):
            balances = tuple(balance.withdraw_names(TOO_SHORT_TO_NAME) for balance in balances)
        findings = _diagnose_by_balance(recordings, model, settings, map_, progress, balances)
        if findings is not None:
            return findings
    progress("measuring the noise", 0.3 if balances else 0.0)
    if settings.clean:
        return _diagnose_with_clean(recordings, model, settings, map_, progress)
    return _diagnose_by_model(recordings, model, settings, map_, progress, balances)


def _diagnose_by_balance(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: "tuple[Balance, ...]",
) -> Findings | None:
    """Diagnose the laws that the force balances name; None where they name none, or simulations confirm none."""
    # Imported on demand, to shorten the start of the program.
    from analysis.diagnosis.confirm.confirm_laws import has_open_parameter, search_by_balance
    from analysis.diagnosis.confirm.force_balance_measures import list_fitting_measures
    from analysis.diagnosis.confirm.laws_for_simulation import judge_special_cases

    for measure_index, fitting in enumerate(list_fitting_measures(recordings, model, balances, settings.compared)):
        progress("fitting the named laws", 0.2 + 0.3 * measure_index)
        context = make_search_context(recordings[0], fitting, settings, map_)
        noise_known = all(floor.method == "repeats" for floor in fitting.chosen.floors)
        search_laws = partial(search_by_balance, context, balances, noise_known)
        result = settings.guard.run(BALANCE, "the fit of its laws", search_laws, None)
        if result is not None and not (fitting.is_narrow_band and has_open_parameter(result)):
            balances = judge_special_cases(balances, result.found.steps[-1].fitted.hypothesis.claims)
            return _assemble(recordings, settings, fitting, SearchOutcome(result, ModelErrorFloor()), balances)
    return None


def _diagnose_by_model(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: "tuple[Balance, ...]" = (),
) -> Findings:
    """Diagnose by a search with simulations of the model. balances: force balances, where the model was fitted to the
    recordings."""
    fitting = choose_fitting_measure(recordings, model, settings.clean, settings.compared, about_mean=settings.fitted)
    if settings.fitted and balances:
        # Imported on demand: only a fitted model has balances.
        from analysis.diagnosis.confirm.force_balance_measures import choose_forces_of_balance

        fitting = choose_forces_of_balance(recordings, fitting, balances)
    if settings.fitted and is_too_short_to_name(recordings):
        given_outcome = SearchOutcome(_evaluate_given_model(recordings, fitting, settings, map_), ModelErrorFloor())
        return _assemble(recordings, settings, fitting, given_outcome, balances)
    outcome = search_by_simulation(recordings, fitting, settings, map_, progress, balances)
    if not settings.fitted and not settings.clean:
        progress("testing laws in the force balance", 0.9)
        outcome, balances = _judge_with_model(recordings, fitting, outcome, settings)
    progress("writing the results", 0.95)
    return _assemble(recordings, settings, fitting, outcome, balances)


def _diagnose_with_clean(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """Diagnose by comparison with the clean recordings, or by a search with simulations of a given model.

    A model that was given is searched where it predicts the clean recordings well or the noise is known from repeats,
    unless the comparison contradicts the result; otherwise where the comparison leaves a difference unexplained. For a
    model that was fitted, only the comparison is used."""
    # Imported on demand: only some diagnoses have clean recordings.
    from analysis.diagnosis.reference.compare_with_reference import find_contrast, is_noise_from_repeats, predicts_clean
    from analysis.diagnosis.reference.learn_model_error import learn_model_floor
    from analysis.diagnosis.result.contrast_findings import add_contrast, simulate_named_fault

    fitting = FittingMeasure(model, make_measure(recordings, model))
    progress("comparing with the clean recordings", 0.1)
    contrast = find_contrast(recordings, settings.clean, frozenset(settings.without), settings.time_left)
    if is_too_short_to_name(recordings):
        contrast = contrast.withdraw_name(TOO_SHORT_TO_NAME)
    is_clean_predicted = not settings.fitted and predicts_clean(model, settings.clean)
    if is_clean_predicted or (not settings.fitted and is_noise_from_repeats(fitting.chosen)):
        findings_by_model = _diagnose_by_model(recordings, model, settings, map_, progress)
        diagnosis_by_model = findings_by_model.diagnosis
        names = frozenset(name for effect in diagnosis_by_model.effects for name in (effect.effect, *effect.class_))
        if not contrast.contradicts(names, diagnosis_by_model.verdict == "explained"):
            return findings_by_model
    elif not settings.fitted and contrast.is_unexplained:
        searched_findings = _search_with_clean(recordings, model, settings, contrast.tested_effects, map_, progress)
        if searched_findings is not None:
            return searched_findings
    given_result = _evaluate_given_model(recordings, fitting, settings, map_)
    progress("writing the results", 0.95)
    floor = (
        ModelErrorFloor() if settings.fitted else learn_model_floor(settings.clean, model, recordings, map_, progress)
    )
    findings = _assemble(recordings, settings, fitting, SearchOutcome(given_result, floor), ())
    findings = add_contrast(findings, contrast, recordings[0], FAULT_GAIN_FACTOR)
    return simulate_named_fault(findings, given_result.context, recordings[0]) if is_clean_predicted else findings


def _evaluate_given_model(
    recordings: Sequence[Recording], fitting: FittingMeasure, settings: DiagnosisSettings, map_: Mapper
) -> SearchResult:
    """Evaluate the given model without effects, as a search result that names nothing."""
    context = make_search_context(recordings[0], fitting, settings, map_)
    given_fit = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    candidate = context.with_test_score(context.score_fit(given_fit))
    return SearchResult(context, Explanation(candidate, candidate, candidate, (), ()), Judgement("unexplained", False))


def _search_with_clean(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    tested_effects: frozenset[str],
    map_: Mapper,
    progress: Progress,
) -> Findings | None:
    """Diagnose by a search with clean recordings as the floor of the model error. tested_effects: effects that the
    comparison tested and did not find; the search leaves them out. None where it names no effect, or cannot be done."""
    fitting = choose_fitting_measure(recordings, model, settings.clean, settings.compared)
    search_settings = replace(settings, without=(*settings.without, *tested_effects))
    try:
        outcome = search_by_simulation(recordings, fitting, search_settings, map_, progress, ())
    except (IncomparableRecordingsError, np.linalg.LinAlgError):
        return None
    context = outcome.result.context
    explanation = keep_identifiable(context, outcome.result.found, settings.time_left)
    result = require_enough_gain(replace(outcome.result, found=explanation, errors=None), False)
    if not (result.judgement.named and result.found.steps):
        return None
    return _assemble(recordings, settings, fitting, replace(outcome, result=result), ())


def _compute_balances(
    recordings: Sequence[Recording], settings: DiagnosisSettings, map_: Mapper
) -> "tuple[Balance, ...]":
    """Compute the force balances of the recordings, one per command; none where the guard caught a crash."""
    # Imported on demand: a diagnosis with a given model computes its balances in `decide_with_model`.
    from analysis.diagnosis.balance.balances import find_balances
    from analysis.diagnosis.balance.laws.free_laws import list_excluded_laws

    excluded = list_excluded_laws(settings.without, settings.discovery)
    fit_balances = partial(find_balances, recordings, excluded, settings.time_left, map_)
    return settings.guard.run(BALANCE, "its calculation", fit_balances, ())


def _judge_with_model(
    recordings: Sequence[Recording], fitting: FittingMeasure, outcome: SearchOutcome, settings: DiagnosisSettings
) -> "tuple[SearchOutcome, tuple[Balance, ...]]":
    """Decide by held-out gain which effects of an outcome are named; also returns the force balances with the model as
    their base. The outcome is unchanged, without balances, where nothing remains unexplained, or where a statistic of
    the response such as band power was compared."""
    result = outcome.result
    if result.judgement.verdict not in ("unexplained", "partly_explained") or result.found.statistic is not None:
        return outcome, ()
    # Imported on demand: only some diagnoses need it.
    from analysis.diagnosis.confirm.decide_with_model import ResultWithModel, decide_with_model

    decide = partial(decide_with_model, recordings, fitting, result, settings.time_left)
    decision = settings.guard.run(BALANCE, "its calculation", decide, ResultWithModel(result))
    return replace(outcome, result=decision.result), decision.balances


def _assemble(
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    fitting: FittingMeasure,
    outcome: SearchOutcome,
    balances: "Sequence[Balance]",
) -> Findings:
    """Assemble the findings from the outcome of a search: named effects, candidates, maps of states, errors,
    remarks."""
    result, names = outcome.result, name_parts(recordings, settings.names)
    explanation = result.found if result.judgement.named else replace(result.found, after=result.found.retuned)
    findings = assemble_findings(replace(result, found=explanation), fitting.chosen.floors, names, outcome.floor)
    channels = recordings[0].command.channels
    unconfirmed = list_unconfirmed_candidates(result.unconfirmed, findings.black_box, recordings[0], fitting.model)
    if settings.fitted:
        diagnosis = add_balances_with_fitted_model(findings.diagnosis, balances, channels, unconfirmed)
    else:
        diagnosis = add_balances_with_given_model(findings.diagnosis, balances, unconfirmed, channels)
    compute_maps = partial(compute_state_maps, diagnosis, balances, findings.evidence, recordings[0])
    maps: tuple[StateMaps, ...] = settings.guard.run("the map of states", "its calculation", compute_maps, ())
    part_remarks = _compare_parts(settings, diagnosis, balances, channels)
    guard_remarks = settings.guard.sentences + (() if all(balance.complete for balance in balances) else (OUT_OF_TIME,))
    linear_remarks = describe_linear_terms(balances, channels, not recordings[0].is_timed) if settings.fitted else ()
    remarks = (*guard_remarks, *part_remarks, *fitting.chosen.remarks, *result.remarks, *linear_remarks)
    errors_by_balance = collect_balance_errors(diagnosis, balances, channels)
    named_effects = {effect.effect for effect in diagnosis.effects}
    curves = tuple(curve for curve in findings.signatures if curve.effect in named_effects)
    completed = replace(
        findings,
        diagnosis=diagnosis,
        remarks=tuple(dict.fromkeys((*remarks, *findings.remarks))),
        fitted=settings.fitted,
        signatures=curves,
    )
    return replace(
        completed,
        balance_errors=errors_by_balance,
        state_maps=maps,
        reading_units=list_reading_units(recordings[0]),
    )


def _compare_parts(
    settings: DiagnosisSettings, diagnosis: "Diagnosis", balances: "Sequence[Balance]", channels: tuple[str, ...]
) -> tuple[str, ...]:
    """Compare the named laws of the balances between the parts (`describe_changed_strengths`)."""
    if not any(balance.named for balance in balances):
        return ()
    from analysis.diagnosis.result.plausibility import describe_changed_strengths

    compare = partial(describe_changed_strengths, diagnosis.effects, balances, channels)
    sentences: tuple[str, ...] = settings.guard.run("the comparison of parts", "its calculation", compare, ())
    return sentences
