"""The whole diagnosis: from recordings and a model to findings, without files, clocks or screens.

There are three ways. Without a given model, laws are found by the force balance and confirmed by simulation; where that
names none, effects are searched by simulation. With a given model, effects are searched by simulation, then judged by
held-out gain and by the force balance with that model. With clean recordings of the device, faults are found by
comparison with them (`contrast`), and by search where no fault explains the difference.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from analysis.diagnosis.confirm.fitting_measures import FittingMeasure, choose_fitting_measure
from analysis.diagnosis.confirm.require_gain import require_enough_gain
from analysis.diagnosis.data.input_checks import is_too_short_to_name
from analysis.diagnosis.data.observed_parts import names_of_parts
from analysis.diagnosis.diagnosis_settings import BALANCE, DiagnosisSettings
from analysis.diagnosis.errors.choose_measure import measure_of
from analysis.diagnosis.errors.hypothesis import NOTHING
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.localisation.clean_floor import CleanFloor, NothingLearned
from analysis.diagnosis.result.assemble_findings import assemble_findings
from analysis.diagnosis.result.candidates import balance_errors, beside_given, linear_remarks, with_balances
from analysis.diagnosis.result.curves.state_maps import StateMaps, state_maps
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.unconfirmed import list_unconfirmed_candidates
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from analysis.diagnosis.search.verdict import Judgement, SearchResult
from analysis.diagnosis.search_by_simulation import SearchOutcome, search_by_simulation, search_context_of
from analysis.diagnosis.settings import FAULT_BEYOND
from analysis.diagnosis.types import Mapper, Progress
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


TOO_SHORT = "the recordings are so short that other laws would explain them equally well"
"""Reason not to name a law of short recordings (`is_too_short_to_name`)."""


def diagnose(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """Findings about the physics that the model lacks. recordings: of one device, alike in channels, units and rate;
    not checked here (see `input_checks`). map_: as `map`, may run in parallel. progress: receives a description of the
    current step and the share that is done. Raises NothingLearned where clean recordings cannot be compared."""
    balances: tuple[Balance, ...] = ()
    if settings.fitted and not settings.clean:
        progress("testing laws in the force balance", 0.0)
        known = settings.balances
        balances = known if known is not None else _balances(recordings, settings, map_)
        if is_too_short_to_name(recordings):
            balances = tuple(balance.without_names(TOO_SHORT) for balance in balances)
        named = _diagnose_by_balance(recordings, model, settings, map_, progress, balances)
        if named is not None:
            return named
    progress("measuring the noise", 0.3 if balances else 0.0)
    if settings.clean:
        return _diagnose_beside_clean(recordings, model, settings, map_, progress)
    return _diagnose_by_model(recordings, model, settings, map_, progress, balances)


def _diagnose_by_balance(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: "tuple[Balance, ...]",
) -> Findings | None:
    """Findings with the laws that the force balances name; None where they name none, or simulations confirm none."""
    # Imported here, as below: a given model is searched by simulation.
    from analysis.diagnosis.confirm.confirm_laws import leaves_open, search_by_balance
    from analysis.diagnosis.confirm.force_balance_measures import list_fitting_measures

    for number, fitting in enumerate(list_fitting_measures(recordings, model, balances, settings.compared)):
        progress("fitting the named laws", 0.2 + 0.3 * number)
        context = search_context_of(recordings[0], fitting, settings, map_)
        repeats = all(floor.how == "repeats" for floor in fitting.chosen.floors)
        weigh = partial(search_by_balance, context, balances, repeats)
        found = settings.guard.part(BALANCE, "the fit of its laws", weigh, None)
        if found is not None and not (fitting.narrow and leaves_open(found)):
            return _assemble(recordings, settings, fitting, SearchOutcome(found, CleanFloor()), balances)
    return None


def _diagnose_by_model(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: "tuple[Balance, ...]" = (),
) -> Findings:
    """Findings by search with simulations of the model. balances: force balances of a model fitted by the program."""
    fitting = choose_fitting_measure(recordings, model, settings.clean, settings.compared, about_mean=settings.fitted)
    if settings.fitted and balances:
        # Imported here, as above: only a model that was fitted has balances.
        from analysis.diagnosis.confirm.force_balance_measures import choose_forces_of_balance

        fitting = choose_forces_of_balance(recordings, fitting, balances)
    if settings.fitted and is_too_short_to_name(recordings):
        unsearched = SearchOutcome(_evaluate_given_model(recordings, fitting, settings, map_), CleanFloor())
        return _assemble(recordings, settings, fitting, unsearched, balances)
    outcome = search_by_simulation(recordings, fitting, settings, map_, progress, balances)
    if not settings.fitted and not settings.clean:
        progress("testing laws in the force balance", 0.9)
        outcome, balances = _judge_with_model(recordings, fitting, outcome, settings)
    progress("writing the results", 0.95)
    return _assemble(recordings, settings, fitting, outcome, balances)


def _diagnose_beside_clean(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """Findings by comparison with the clean recordings. A given model is searched by simulation instead where it
    predicts the clean recordings well or repeats show the noise, unless the comparison contradicts the result, and
    where the comparison leaves the fault open."""
    # Imported here, as below: only some diagnoses have clean recordings.
    from analysis.diagnosis.reference.compare_with_reference import contrast_of, noise_is_from_repeats, predicts_clean
    from analysis.diagnosis.reference.learn_model_error import learn_model_floor
    from analysis.diagnosis.result.contrast_findings import add_contrast

    fitting = FittingMeasure(model, measure_of(recordings, model))
    progress("comparing with the clean recordings", 0.1)
    contrast = contrast_of(recordings, settings.clean, frozenset(settings.without), settings.time_left)
    if is_too_short_to_name(recordings):
        contrast = contrast.without_name(TOO_SHORT)
    if not settings.fitted and (noise_is_from_repeats(fitting.chosen) or predicts_clean(model, settings.clean)):
        found_by_model = _diagnose_by_model(recordings, model, settings, map_, progress)
        by_model = found_by_model.diagnosis
        names = frozenset(name for effect in by_model.effects for name in (effect.effect, *effect.class_))
        if not contrast.contradicts(names, by_model.verdict == "explained"):
            return found_by_model
    elif not settings.fitted and contrast.left_open:
        unweighed = _search_beside_clean(recordings, model, settings, contrast.tested_effects, map_, progress)
        if unweighed is not None:
            return unweighed
    found = _evaluate_given_model(recordings, fitting, settings, map_)
    progress("writing the results", 0.95)
    floor = CleanFloor() if settings.fitted else learn_model_floor(settings.clean, model, recordings, map_, progress)
    whole = _assemble(recordings, settings, fitting, SearchOutcome(found, floor), ())
    return add_contrast(whole, contrast, recordings[0], FAULT_BEYOND)


def _evaluate_given_model(
    recordings: Sequence[Recording], fitting: FittingMeasure, settings: DiagnosisSettings, map_: Mapper
) -> SearchResult:
    """The search result of the given model without a search: nothing is named."""
    context = search_context_of(recordings[0], fitting, settings, map_)
    given = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NOTHING)
    stands = context.with_test_score(context.candidate(given))
    return SearchResult(context, Explanation(stands, stands, stands, (), ()), Judgement("unexplained", False))


def _search_beside_clean(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    weighed: frozenset[str],
    map_: Mapper,
    progress: Progress,
) -> Findings | None:
    """Findings by a search with clean recordings as the floor of the model error. weighed: effects that the comparison
    tested and did not find; the search leaves them out. None where it names no effect, or cannot be done."""
    fitting = choose_fitting_measure(recordings, model, settings.clean, settings.compared)
    rest = replace(settings, without=(*settings.without, *weighed))
    try:
        outcome = search_by_simulation(recordings, fitting, rest, map_, progress, ())
    except (NothingLearned, np.linalg.LinAlgError):
        return None
    context = outcome.result.context
    found = keep_identifiable(context, outcome.result.found, settings.time_left)
    result = require_enough_gain(replace(outcome.result, found=found, errors=None), False)
    if not (result.judgement.named and result.found.steps):
        return None
    return _assemble(recordings, settings, fitting, replace(outcome, result=result), ())


def _balances(recordings: Sequence[Recording], settings: DiagnosisSettings, map_: Mapper) -> "tuple[Balance, ...]":
    """Force balances of the recordings, one per command; none where the guard caught a crash."""
    # Imported here: a given model has a balance of its own.
    from analysis.diagnosis.balance.balances import find_balances

    weighed = partial(find_balances, recordings, frozenset(settings.without), settings.time_left, map_)
    return settings.guard.part(BALANCE, "its weighing", weighed, ())


def _judge_with_model(
    recordings: Sequence[Recording], fitting: FittingMeasure, outcome: SearchOutcome, settings: DiagnosisSettings
) -> "tuple[SearchOutcome, tuple[Balance, ...]]":
    """The outcome after the decision by held-out gain, and the force balances with the model as their base; unchanged,
    without balances, where nothing remains unexplained, or where a statistic such as band power was compared."""
    searched = outcome.result
    if searched.judgement.verdict not in ("unexplained", "partly_explained") or searched.found.statistic is not None:
        return outcome, ()
    # Imported here: only where a model is given, and the search leaves something unexplained.
    from analysis.diagnosis.confirm.decide_with_model import ResultWithModel, decide_with_model

    weigh = partial(decide_with_model, recordings, fitting, searched, settings.time_left)
    beside = settings.guard.part(BALANCE, "its weighing", weigh, ResultWithModel(searched))
    return replace(outcome, result=beside.result), beside.balances


def _assemble(
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    fitting: FittingMeasure,
    outcome: SearchOutcome,
    balances: "Sequence[Balance]",
) -> Findings:
    """The findings from the outcome of a search: named effects, candidates, maps of states, errors and remarks."""
    result, names = outcome.result, names_of_parts(recordings, settings.names)
    found = result.found if result.judgement.named else replace(result.found, after=result.found.retuned)
    whole = assemble_findings(replace(result, found=found), fitting.chosen.floors, names, outcome.floor)
    channels = recordings[0].command.channels
    found_too = list_unconfirmed_candidates(result.unconfirmed, whole.black_box, recordings[0], fitting.model)
    if settings.fitted:
        diagnosis = with_balances(whole.diagnosis, balances, channels, found_too)
    else:
        diagnosis = beside_given(whole.diagnosis, balances, found_too, channels)
    drawn = partial(state_maps, diagnosis, balances, whole.evidence, recordings[0])
    maps: tuple[StateMaps, ...] = settings.guard.part("the map of states", "its making", drawn, ())
    early = settings.guard.sentences + (() if all(balance.complete for balance in balances) else (OUT_OF_TIME,))
    linear = linear_remarks(balances, channels, not recordings[0].is_timed) if settings.fitted else ()
    remarks = tuple(dict.fromkeys((*early, *fitting.chosen.remarks, *result.remarks, *linear, *whole.remarks)))
    reached = balance_errors(diagnosis, balances, channels)
    named = {effect.effect for effect in diagnosis.effects}
    curves = tuple(curve for curve in whole.signatures if curve.effect in named)
    found_here = replace(whole, diagnosis=diagnosis, remarks=remarks, fitted=settings.fitted, signatures=curves)
    return replace(found_here, reached=reached, state_maps=maps)
