"""Search by simulation for the physical effects that a model lacks: select the effects to try, run `search`, and add
rattling play (impacts within a clearance) where that explains a mismatch that remains.

Where force balances were fitted first, only effects that they cannot observe are tried, if any. With clean recordings
(without the fault), the model error learned from these counts as noise.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from analysis.diagnosis.confirm.fitting_measures import FittingMeasure
from analysis.diagnosis.confirm.require_gain import require_enough_gain, withdraw_doubtful_names
from analysis.diagnosis.data.measured_motion import select_time_unit
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.localisation.model_error_floor import ModelErrorFloor
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search import HUM, FurtherSearches, repeat_with_wider_bound, search_effects
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from analysis.diagnosis.search.verdict import SearchResult, judge
from analysis.diagnosis.types import Mapper, Progress
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import Effect
from equalizer.effects.law_entry import make_library_effects
from equalizer.effects.placing import find_device_part
from equalizer.plant.mechanical_model import MechanicalModel, adopt_recording_units
from equalizer.signals.recording import Recording

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


BALANCE_TESTED_EFFECTS = ("force_deadband", "force_saturation", "force_nonlinearity")
"""Names of the effects of the actuator that a force balance tests; those that it does not name are taken as absent."""
LOWEST_MAINS_HZ = 45.0
"""Lowest frequency (Hz) at which a tone is accepted as mains hum: power grids run at 50 or 60 Hz."""
GAIN_EFFECTS = ("force_gain", "sensor_gain")
"""Names of the effects that a model fitted to the same recordings absorbs."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchOutcome:
    """The result of a search, with the model error that was learned from clean recordings."""

    result: SearchResult
    floor: ModelErrorFloor
    """Model error of the clean recordings; empty without any."""


def make_search_context(
    recording: Recording, fitting: FittingMeasure, settings: DiagnosisSettings, map_: Mapper
) -> SearchContext:
    """Make the shared state of the search. recording: as given by the user, for names and units, because the records of
    a measure that compares forces have others."""
    measure = fitting.chosen.measure
    model = adopt_recording_units(
        fitting.model, recording.command.units, recording.response.units, select_time_unit(recording)
    )
    tuning = make_tuning(model, recording.command.channels)
    return SearchContext(measure.shorten(), measure, tuning, map_, frozenset(settings.without), guard=settings.guard)


def search_by_simulation(
    recordings: Sequence[Recording],
    fitting: FittingMeasure,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: "Sequence[Balance]",
) -> SearchOutcome:
    """Search by simulation for the missing effects. balances: force balances of the same recordings; where one names a
    law, no effect is tried, else only effects of the actuator and the sensor that a balance cannot observe; empty: all
    effects are tried. Raises IncomparableRecordingsError with clean recordings from which no model error can be
    learned."""
    chosen, context = fitting.chosen, make_search_context(recordings[0], fitting, settings, map_)
    catalogue = _select_catalogue(settings, recordings[0], context.excluded)
    nameable_effects = [effect for effect in catalogue if effect.name not in context.excluded]
    if balances:
        has_named_law = any(balance.named for balance in balances)
        # Effects of the actuator show only in complete commands: not in those reduced by the force of other motions.
        is_complete_command = not fitting.is_reduced and not recordings[0].meta.get("imposed")
        catalogue = [
            entry
            for entry in catalogue
            if not has_named_law and _is_unobservable(entry.name, find_device_part(entry), is_complete_command)
        ]
        nameable_effects = []
    impact_search = _ImpactSearch(fitting, nameable_effects, settings, progress)
    if settings.clean:
        observable_effects = [effect for effect in nameable_effects if chosen.measure.can_observe(effect)]
        outcome = _search_with_learned_error(
            recordings, fitting.model, (context, catalogue, observable_effects), settings, progress
        )
    else:
        outcome = _search(context, catalogue, settings, progress, impact_search)
        if has_low_hum(outcome.result.found):
            catalogue = [effect for effect in catalogue if effect.name != HUM]
            impact_search = _ImpactSearch(fitting, nameable_effects, settings, progress)
            outcome = _search(context, catalogue, settings, progress, impact_search)
    if balances and outcome.result.judgement.named:
        is_repeated = all(floor.method == "repeats" for floor in chosen.floors)
        outcome = replace(outcome, result=withdraw_doubtful_names(require_enough_gain(outcome.result, is_repeated)))
    return replace(outcome, result=impact_search.explain_at_end(outcome.result))


class _ImpactSearch:
    """Search for rattling play, compared by band power. It runs once, before a second or third effect or at the end,
    and again only where it did not reject play and the result has gained effects since: these are rivals of play."""

    def __init__(
        self, fitting: FittingMeasure, catalogue: Sequence[Effect], settings: DiagnosisSettings, progress: Progress
    ) -> None:
        """catalogue: the effects that may be named."""
        self._fitting, self._catalogue, self._settings, self._progress = fitting, catalogue, settings, progress
        self._play_result: SearchResult | None = None
        self._searched_step_count = -1  # number of effects of the result that was last searched; -1: none yet

    def explain_before_second_effect(self, result: SearchResult) -> SearchResult:
        """Return the result as `explain_before_third_effect` does where no single effect was worth adding; else the
        result unchanged. Play takes no longer than a search of pairs of which neither effect alone is worth adding."""
        return result if result.found.steps else self.explain_before_third_effect(result)

    def explain_before_third_effect(self, result: SearchResult) -> SearchResult:
        """Return the result with play, where the drive repeats, the mismatch is unexplained, and play explains all of
        it; else the result unchanged, also with hum below the mains frequency. A third effect would take much time and
        could not predict a chaotic waveform."""
        is_repeated = any(floor.method == "repeats" for floor in self._fitting.chosen.floors)
        is_unexplained = not result.judgement.named and judge(result.found).verdict == "unexplained"
        if not is_repeated or not is_unexplained or has_low_hum(result.found) or not self._settings.time_left():
            return result
        result_with_play = self._search_for_play(result)
        return (
            result_with_play
            if result_with_play is not None and result_with_play.judgement.verdict == "explained"
            else result
        )

    def explain_at_end(self, result: SearchResult) -> SearchResult:
        """Return the result with play, where the search leaves a mismatch that play explains; the result with a remark
        where the time ended before this was known; else the result unchanged, also where a discovered law is named, a
        sensor fault is certain, or no time is left."""
        has_mismatch = result.judgement.verdict in ("unexplained", "partly_explained") and not has_discovered_law(
            result
        )
        if not has_mismatch or result.context.certain or not self._settings.time_left():
            return result
        return self._search_for_play(result) or result

    def _search_for_play(self, result: SearchResult) -> SearchResult | None:
        """Return the result with play, or None where play does not explain the recordings, or its search crashed
        (`Guard`); the result with the remark `OUT_OF_TIME` where the time ended before this was known. The return value
        is cached: None for good, a result until `result` has more effects."""
        if self._searched_step_count < 0 or (
            self._play_result is not None and len(result.found.steps) > self._searched_step_count
        ):
            # Imported here, because only a diagnosis that leaves a mismatch looks for impacts.
            from analysis.diagnosis.result.impact_wording import IMPACTS_COMPARED
            from analysis.diagnosis.search.impacts import explain_impacts

            self._progress("looking for rattling play", 0.9)
            floors, time_left = self._fitting.chosen.floors, self._settings.time_left
            explanation = result.context.guard.run(
                "rattling play",
                "its search",
                lambda: explain_impacts(result.context, result.found, floors, self._catalogue, time_left),
                None,
            )
            self._play_result, self._searched_step_count = None, len(result.found.steps)
            if explanation is None and not time_left():
                self._play_result = replace(result, remarks=tuple(dict.fromkeys((*result.remarks, OUT_OF_TIME))))
            elif explanation is not None:
                remarks = (IMPACTS_COMPARED, *((OUT_OF_TIME,) if explanation.ended_early else ()))
                self._play_result = SearchResult(result.context, explanation, judge(explanation), remarks)
        return self._play_result


def _search_with_learned_error(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    search_inputs: tuple[SearchContext, Sequence[Effect], Sequence[Effect]],
    settings: DiagnosisSettings,
    progress: Progress,
) -> SearchOutcome:
    """Search while the model error on the clean recordings counts as noise. search_inputs: the shared state, the
    effects to try, and the effects that may be named as sensor faults without a search. Raises
    IncomparableRecordingsError where no model error can be learned."""
    from analysis.diagnosis.reference.learn_model_error import learn_model_error
    from analysis.diagnosis.reference.model_free_faults import find_sensor_faults
    from analysis.diagnosis.reference.search_with_reference import search_with_reference

    context, catalogue, observable_effects = search_inputs
    learned_error = learn_model_error(settings.clean, model, recordings, context.map_, progress)
    context = replace(context, certain=find_sensor_faults(recordings, settings.clean, observable_effects))
    result = search_with_reference(context, learned_error, catalogue, progress, settings.time_left)
    return SearchOutcome(result, learned_error.floor)


def _search(
    context: SearchContext,
    catalogue: Sequence[Effect],
    settings: DiagnosisSettings,
    progress: Progress,
    impact_search: _ImpactSearch,
) -> SearchOutcome:
    """Search without clean recordings; unless the model was fitted to the recordings, also for laws outside the
    catalogue where `settings` asks for them, and again with a wider bound where needed."""
    play_searches = impact_search.explain_before_second_effect, impact_search.explain_before_third_effect
    further_searches = FurtherSearches(*play_searches)
    if settings.discovery and not settings.fitted:
        # Imported here, because only a diagnosis that searches for laws needs their grammar.
        from analysis.diagnosis.discovery.add_laws import LawSearch

        law_search = LawSearch(progress, settings.time_left)
        further_searches = FurtherSearches(
            _search_in_turn(play_searches[0], _skip_law_search_with_hum(law_search.add_short_laws)),
            _search_in_turn(play_searches[1], _skip_law_search_with_hum(law_search.add_laws_before_third_effect)),
            _skip_law_search_with_hum(law_search.add_laws),
        )
    result = search_effects(context, catalogue, progress, settings.time_left, further_searches)
    # A model that was fitted to the recordings has no calibration, hence no bound to widen.
    if not settings.fitted:
        result = repeat_with_wider_bound(context, result, catalogue, progress, settings.time_left)
    return SearchOutcome(result, ModelErrorFloor())


def _search_in_turn(
    search: Callable[[SearchResult], SearchResult], next_search: Callable[[SearchResult], SearchResult]
) -> Callable[[SearchResult], SearchResult]:
    """Combine two searches: the second one is made where the first one leaves the explanation unchanged."""

    def search_both(result: SearchResult) -> SearchResult:
        searched = search(result)
        return next_search(result) if searched.found is result.found else searched

    return search_both


def _skip_law_search_with_hum(
    add_laws: Callable[[SearchResult], SearchResult],
) -> Callable[[SearchResult], SearchResult]:
    """Wrap the law search: skip it where hum below mains frequency was found, because the search is then repeated
    without hum before any law is added."""
    return lambda result: result if has_low_hum(result.found) else add_laws(result)


def _select_catalogue(settings: DiagnosisSettings, recording: Recording, excluded: frozenset[str]) -> list[Effect]:
    """Select the effects to try: the catalogue and the kept laws without the excluded effects, and without
    `GAIN_EFFECTS` for a fitted model unless there are clean recordings; excluded effects that others refine are
    included as rivals that cannot be named."""
    omitted = {*settings.without, *(GAIN_EFFECTS if settings.fitted and not settings.clean else ())}
    all_effects = (*CATALOGUE, *make_library_effects(settings.kept, recording))
    catalogue = [effect for effect in all_effects if effect.name not in omitted]
    refined_names = {name for effect in catalogue for name in effect.simpler}
    return catalogue + [effect for effect in CATALOGUE if effect.name in refined_names & excluded]


def _is_unobservable(name: str, place: str, is_complete_command: bool) -> bool:
    """Whether an effect is of the sensor or the actuator and a force balance cannot observe it. name, place: of the
    effect. is_complete_command: whether an actuator drives the device with the commands as recorded, neither reduced by
    other forces nor with an imposed motion."""
    is_untested = name != "body_on_actuator" and name not in BALANCE_TESTED_EFFECTS
    return place == "sensor" or (place == "actuator" and is_complete_command and is_untested)


def has_low_hum(explanation: Explanation) -> bool:
    """Whether the explanation contains mains hum at a frequency below `LOWEST_MAINS_HZ`: such a spectral line comes
    from the excitation, not from the power grid."""
    placed_effects = explanation.after.fitted.hypothesis.list_placed_effects()
    return any(effect.effect.name == HUM and effect.values["frequency"] < LOWEST_MAINS_HZ for effect in placed_effects)


def has_discovered_law(result: SearchResult) -> bool:
    """Whether a discovered law is among the named effects."""
    claims = result.found.after.fitted.hypothesis.claims
    return result.judgement.named and any(claim.effect.law is not None for claim in claims)
