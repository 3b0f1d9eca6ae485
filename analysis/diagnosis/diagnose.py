"""The whole diagnosis: from recordings and a model to findings, without files, clocks or screens."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from analysis.diagnosis.balance.balances import find_balances
from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.confirm.confirm_laws import (
    leaves_open,
    require_enough_gain,
    search_by_balance,
    unname_doubtful_effects,
)
from analysis.diagnosis.confirm.fitting_measures import FittingMeasure, choose_fitting_measure, list_fitting_measures
from analysis.diagnosis.confirm.laws_beside_model import ResultBesideModel, judge_beside_model
from analysis.diagnosis.contrast.decide import BEYOND
from analysis.diagnosis.data.measured_motion import time_unit
from analysis.diagnosis.data.observed_parts import names_of_parts
from analysis.diagnosis.discovery.add_laws import add_laws, has_law
from analysis.diagnosis.errors.choose_measure import Compared, measure_of
from analysis.diagnosis.errors.hypothesis import NOTHING
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.reference.compare_with_reference import (
    HUM,
    contrast_of,
    hums_low,
    noise_is_from_repeats,
    predicts_clean,
)
from analysis.diagnosis.reference.learn_model_error import NothingLearned, learn_model_error, learn_model_floor
from analysis.diagnosis.reference.model_free_faults import find_sensor_faults
from analysis.diagnosis.reference.search_beside_reference import search_beside_reference
from analysis.diagnosis.result.assemble_findings import assemble_findings
from analysis.diagnosis.result.candidates import balance_errors, beside_given, linear_remarks, with_balances
from analysis.diagnosis.result.contrast_findings import add_contrast
from analysis.diagnosis.result.curves.state_maps import StateMaps, state_maps
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.impact_wording import IMPACTS_COMPARED
from analysis.diagnosis.result.unconfirmed import unconfirmed_candidates
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.impacts import explain_impacts
from analysis.diagnosis.search.search import SearchResult, search_effects
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.time_budget import OUT_OF_TIME, always
from analysis.diagnosis.search.verdict import Judgement, judge
from analysis.diagnosis.types import Mapper, Progress, TimeBudget
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import Effect
from equalizer.effects.law_entry import LawEntry, kept_effects
from equalizer.effects.placing import place_of_effect
from equalizer.plant.mechanical_model import MechanicalModel, with_units_of
from equalizer.signals.recording import Recording

BALANCE = "the force balance"
TESTED_BY_BALANCE = ("force_deadband", "force_saturation", "force_nonlinearity")
"""Laws of the command that a force balance tests: what it does not name is absent."""
GAINS = ("force_gain", "sensor_gain")
"""A model fitted to the recordings contains these: only against a calibrated one can a gain be wrong."""


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    """What a diagnosis considers, what it compares, and how long it may look."""

    without: tuple[str, ...] = ()
    """Effects that are not to be considered."""
    names: tuple[str, ...] = ()
    """Names of the recordings, for the reader."""
    clean: tuple[Recording, ...] = ()
    """Recordings of the device without the fault: its difference from the re-tuned model there is no mismatch."""
    fitted: bool = False
    """The model was fitted to these recordings by the program: laws are then tested in the force balance."""
    balances: tuple[Balance, ...] | None = None
    """`find_balances` of these recordings, where known already."""
    compared: Compared = "auto"
    """What is compared: motion, force, or what suits."""
    discovery: bool = False
    """Whether laws are discovered where no effect of the catalogue is named."""
    kept: tuple[LawEntry, ...] = ()
    """Laws discovered elsewhere, to be tried beside the catalogue."""
    time_left: TimeBudget = always
    """Asked before each piece of the search; once it says no, what was found until then stands."""
    guard: Guard = field(default_factory=Guard)
    """Where it is on, an effect that crashes is left out, with a remark."""


def diagnose(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """What the model lacks. recordings: of one device, alike in channels, units and rate; see `input_checks` for what
    is refused. Raises NothingLearned where the clean recordings cannot be compared with these."""
    balances: tuple[Balance, ...] = ()
    if settings.fitted and not settings.clean:
        progress("weighing laws in the force balance", 0.0)
        known = settings.balances
        balances = known if known is not None else _balances(recordings, settings)
        for number, look in enumerate(list_fitting_measures(recordings, model, balances, settings.compared)):
            progress("fitting the named laws", 0.2 + 0.3 * number)
            context = _search_context(recordings[0], look, settings, map_)
            repeats = all(floor.how == "repeats" for floor in look.chosen.floors)
            weigh = partial(search_by_balance, context, balances, repeats)
            found = settings.guard.part(BALANCE, "the fit of its laws", weigh, None)
            if found is not None and not (look.narrow and leaves_open(found)):
                return _assemble(recordings, settings, look, _Result(found, CleanFloor()), balances)
    progress("measuring the noise", 0.3 if balances else 0.0)
    if settings.clean and (beside := _compare_with_clean(recordings, model, settings, map_, progress)) is not None:
        return beside
    look = choose_fitting_measure(recordings, model, settings.clean, settings.compared, about_mean=settings.fitted)
    seen = _by_search(recordings, look, settings, map_, progress, balances)
    if not settings.fitted and not settings.clean:
        progress("weighing laws in the force balance", 0.9)
        seen, balances = _judge_beside_model(recordings, look, seen, settings)
    progress("writing down what was found", 0.95)
    return _assemble(recordings, settings, look, seen, balances)


def _compare_with_clean(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings | None:
    """Findings by comparison with the clean recordings, or by search where no fault explains the difference. None where
    the given model predicts the clean ones well enough to be used itself, or repeats show that noise is small."""
    look = FittingMeasure(model, measure_of(recordings, model))
    if not settings.fitted and (noise_is_from_repeats(look.chosen) or predicts_clean(model, settings.clean)):
        return None
    progress("comparing with the clean recordings", 0.1)
    contrast = contrast_of(recordings, settings.clean, frozenset(settings.without), settings.time_left)
    if not settings.fitted and contrast.left_open:
        unweighed = _search_beside_clean(recordings, model, settings, contrast.tested_effects, map_, progress)
        if unweighed is not None:
            return unweighed
    context = _search_context(recordings[0], look, settings, map_)
    given = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NOTHING)
    stands = context.with_test_score(context.candidate(given))
    found = SearchResult(context, Explanation(stands, stands, stands, (), ()), Judgement("unexplained", False))
    progress("writing down what was found", 0.95)
    floor = CleanFloor() if settings.fitted else learn_model_floor(settings.clean, model, recordings, map_, progress)
    whole = _assemble(recordings, settings, look, _Result(found, floor), ())
    return add_contrast(whole, contrast, recordings[0], BEYOND)


def _search_beside_clean(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    weighed: frozenset[str],
    map_: Mapper,
    progress: Progress,
) -> Findings | None:
    """Findings by the search beside clean recordings. weighed: effects that the comparison tested, and did not find.
    None where the search names nothing else, or cannot be done."""
    look = choose_fitting_measure(recordings, model, settings.clean, settings.compared)
    rest = replace(settings, without=(*settings.without, *weighed))
    try:
        seen = _by_search(recordings, look, rest, map_, progress, ())
    except (NothingLearned, np.linalg.LinAlgError):
        return None
    context = seen.result.context
    found = keep_identifiable(context, seen.result.found, settings.time_left)
    result = require_enough_gain(replace(seen.result, found=found, errors=None), False)
    if not (result.judgement.named and result.found.steps):
        return None
    return _assemble(recordings, settings, look, replace(seen, result=result), ())


def _balances(recordings: Sequence[Recording], settings: DiagnosisSettings) -> tuple[Balance, ...]:
    weighed = partial(find_balances, recordings, frozenset(settings.without), settings.time_left)
    return settings.guard.part(BALANCE, "its weighing", weighed, ())


@dataclass(frozen=True, slots=True, eq=False)
class _Result:
    result: SearchResult
    floor: CleanFloor


def _judge_beside_model(
    recordings: Sequence[Recording], look: FittingMeasure, seen: _Result, settings: DiagnosisSettings
) -> tuple[_Result, tuple[Balance, ...]]:
    weigh = partial(judge_beside_model, recordings, look, seen.result, settings.time_left)
    beside = settings.guard.part(BALANCE, "its weighing", weigh, ResultBesideModel(seen.result))
    return replace(seen, result=beside.result), beside.balances


def _search_context(
    recording: Recording, look: FittingMeasure, settings: DiagnosisSettings, map_: Mapper
) -> SearchContext:
    """The shared state of the search. recording: as given; where forces are compared, the measure's own differ."""
    measure = look.chosen.measure
    model = with_units_of(look.model, recording.command.units, recording.response.units, time_unit(recording))
    tuning = tuning_of(model, recording.command.channels)
    return SearchContext(measure.shorten(), measure, tuning, map_, frozenset(settings.without), guard=settings.guard)


def _by_search(
    recordings: Sequence[Recording],
    look: FittingMeasure,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: Sequence[Balance],
) -> _Result:
    """The result of the search by simulation. balances: where they name a law of the motion, nothing else is tried;
    where they name none, only effects of actuator and sensor are."""
    chosen, context = look.chosen, _search_context(recordings[0], look, settings, map_)
    catalogue = _catalogue(settings, recordings[0], context.barred)
    may_be_named = [effect for effect in catalogue if effect.name not in context.barred]
    if balances:
        named = any(balance.named for balance in balances)
        imposed = bool(recordings[0].meta.get("imposed"))
        catalogue = [] if named else [e for e in catalogue if _beside_motion(e.name, place_of_effect(e), imposed)]
        may_be_named = []
    if settings.clean:
        learned = learn_model_error(settings.clean, look.model, recordings, map_, progress)
        observable = [effect for effect in may_be_named if chosen.measure.can_observe(effect)]
        context = replace(context, certain=find_sensor_faults(recordings, settings.clean, observable))
        beside = search_beside_reference(context, learned, catalogue, progress, settings.time_left)
        found = _Result(beside, learned.floor)
    else:
        found = _search(context, catalogue, settings, progress)
        if hums_low(found.result.found):
            catalogue = [effect for effect in catalogue if effect.name != HUM]
            found = _search(context, catalogue, settings, progress)
    if balances and found.result.judgement.named:
        repeats = all(floor.how == "repeats" for floor in chosen.floors)
        found = replace(found, result=unname_doubtful_effects(require_enough_gain(found.result, repeats)))
    seen = found.result
    left = seen.judgement.verdict in ("unexplained", "partly_explained") and not has_law(seen)
    if left and not context.certain and settings.time_left():
        progress("looking for play that rattles", 0.9)
        rattled = explain_impacts(seen.context, seen.found, chosen.floors, may_be_named)
        if rattled is not None:
            return replace(found, result=SearchResult(seen.context, rattled, judge(rattled), (IMPACTS_COMPARED,)))
    return found


def _search(
    context: SearchContext, catalogue: Sequence[Effect], settings: DiagnosisSettings, progress: Progress
) -> _Result:
    def beyond(seen: SearchResult) -> SearchResult:
        wanted = settings.discovery and not settings.fitted
        return add_laws(seen, progress, settings.time_left) if wanted else seen

    return _Result(search_effects(context, catalogue, progress, settings.time_left, beyond), CleanFloor())


def _catalogue(settings: DiagnosisSettings, recording: Recording, barred: frozenset[str]) -> list[Effect]:
    """The effects to try; with barred effects that others refine, as rivals."""
    left_out = {*settings.without, *(GAINS if settings.fitted and not settings.clean else ())}
    known = (*CATALOGUE, *kept_effects(settings.kept, recording))
    catalogue = [effect for effect in known if effect.name not in left_out]
    refined = {name for effect in catalogue for name in effect.simpler}
    return catalogue + [effect for effect in CATALOGUE if effect.name in refined & barred]


def _beside_motion(name: str, place: str, imposed: bool) -> bool:
    """Whether an effect of the actuator or sensor cannot be seen by a force balance."""
    tested = name == "body_on_actuator" or (name in TESTED_BY_BALANCE and not imposed)
    return place in ("actuator", "sensor") and not tested


def _assemble(
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    look: FittingMeasure,
    seen: _Result,
    balances: Sequence[Balance],
) -> Findings:
    result, names = seen.result, names_of_parts(recordings, settings.names)
    found = result.found if result.judgement.named else replace(result.found, after=result.found.retuned)
    whole = assemble_findings(replace(result, found=found), look.chosen.floors, names, seen.floor)
    channels = recordings[0].command.channels
    found_too = unconfirmed_candidates(result.unconfirmed, whole.black_box, recordings[0], look.model)
    if settings.fitted:
        diagnosis = with_balances(whole.diagnosis, balances, channels, found_too)
    else:
        diagnosis = beside_given(whole.diagnosis, balances, found_too, channels)
    drawn = partial(state_maps, diagnosis, balances, whole.evidence, recordings[0])
    maps: tuple[StateMaps, ...] = settings.guard.part("the map of states", "its making", drawn, ())
    early = settings.guard.sentences + (() if all(balance.complete for balance in balances) else (OUT_OF_TIME,))
    linear = linear_remarks(balances, channels) if settings.fitted else ()
    remarks = tuple(dict.fromkeys((*early, *look.chosen.remarks, *result.remarks, *linear, *whole.remarks)))
    reached = balance_errors(diagnosis, balances, channels)
    found_here = replace(whole, diagnosis=diagnosis, remarks=remarks, fitted=settings.fitted)
    return replace(found_here, reached=reached, state_maps=maps)
