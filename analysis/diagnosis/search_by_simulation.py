"""The search by simulation: the effects to try, the error measure, and the use of its result."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from analysis.diagnosis.confirm.fitting_measures import FittingMeasure
from analysis.diagnosis.confirm.require_gain import require_enough_gain, unname_doubtful_effects
from analysis.diagnosis.data.measured_motion import time_unit
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search import HUM, Beyond, move_model_further, search_effects
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import SearchResult, judge
from analysis.diagnosis.types import Mapper, Progress
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import Effect
from equalizer.effects.law_entry import kept_effects
from equalizer.effects.placing import place_of_effect
from equalizer.plant.mechanical_model import MechanicalModel, with_units_of
from equalizer.signals.recording import Recording

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance


TESTED_BY_BALANCE = ("force_deadband", "force_saturation", "force_nonlinearity")
"""Laws of the command that a force balance tests: those that it does not name are absent."""
LOWEST_MAINS_HZ = 45.0
"""Lowest frequency of a tone that is taken for mains hum (Hz): grids run at 50 or 60 Hz."""
GAINS = ("force_gain", "sensor_gain")
"""Effects that a model fitted to the recordings absorbs: only with a calibrated model can a gain be found wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchOutcome:
    """A search's result with the model error that was learned from clean recordings."""

    result: SearchResult
    floor: CleanFloor
    """Model error of the clean recordings; empty without any."""


def search_context_of(
    recording: Recording, fitting: FittingMeasure, settings: DiagnosisSettings, map_: Mapper
) -> SearchContext:
    """The shared state of the search. recording: as given; where forces are compared, the measure's own differ."""
    measure = fitting.chosen.measure
    model = with_units_of(fitting.model, recording.command.units, recording.response.units, time_unit(recording))
    tuning = tuning_of(model, recording.command.channels)
    return SearchContext(measure.shorten(), measure, tuning, map_, frozenset(settings.without), guard=settings.guard)


def search_by_simulation(
    recordings: Sequence[Recording],
    fitting: FittingMeasure,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: "Sequence[Balance]",
) -> SearchOutcome:
    """The result of the search by simulation. balances: where they name a law of the motion, nothing else is tried;
    where they name none, only effects of actuator and sensor are."""
    chosen, context = fitting.chosen, search_context_of(recordings[0], fitting, settings, map_)
    catalogue = _catalogue(settings, recordings[0], context.barred)
    may_be_named = [effect for effect in catalogue if effect.name not in context.barred]
    if balances:
        named = any(balance.named for balance in balances)
        # From commands without the force of other motions no effect of the actuator can be told.
        driven = not fitting.is_reduced and not recordings[0].meta.get("imposed")
        catalogue = [] if named else [e for e in catalogue if _unseen_by_balance(e.name, place_of_effect(e), driven)]
        may_be_named = []
    impacts = _ImpactSearch(fitting, may_be_named, settings, progress)
    if settings.clean:
        observable = [effect for effect in may_be_named if chosen.measure.can_observe(effect)]
        found = _search_with_learned_error(
            recordings, fitting.model, (context, catalogue, observable), settings, progress
        )
    else:
        found = _search(context, catalogue, settings, progress, impacts)
        if hums_low(found.result.found):
            catalogue = [effect for effect in catalogue if effect.name != HUM]
            impacts = _ImpactSearch(fitting, may_be_named, settings, progress)
            found = _search(context, catalogue, settings, progress, impacts)
    if balances and found.result.judgement.named:
        repeats = all(floor.how == "repeats" for floor in chosen.floors)
        found = replace(found, result=unname_doubtful_effects(require_enough_gain(found.result, repeats)))
    return replace(found, result=impacts.at_end(found.result))


class _ImpactSearch:
    """The search for play that rattles, compared by band power; made once, early or at the end, and again only where
    the result has more effects by then: these are its rivals."""

    def __init__(
        self, fitting: FittingMeasure, catalogue: Sequence[Effect], settings: DiagnosisSettings, progress: Progress
    ) -> None:
        """catalogue: the effects that may be named."""
        self._fitting, self._catalogue, self._settings, self._progress = fitting, catalogue, settings, progress
        self._found: SearchResult | None = None
        self._steps = -1

    def before_thirds(self, seen: SearchResult) -> SearchResult:
        """The result with play, where periods differ, two effects leave much of the mismatch, and play explains all of
        it: further effects would take all the time, and none of them predicts the waveform."""
        repeats = any(floor.how == "repeats" for floor in self._fitting.chosen.floors)
        left = not seen.judgement.named and judge(seen.found).verdict == "unexplained"
        if not repeats or not left or hums_low(seen.found) or not self._settings.time_left():
            return seen
        rattled = self._look(seen)
        return rattled if rattled is not None and rattled.judgement.verdict == "explained" else seen

    def at_end(self, seen: SearchResult) -> SearchResult:
        """The result with play, where the search leaves something open that play explains, in part at least."""
        left = seen.judgement.verdict in ("unexplained", "partly_explained") and not has_law(seen)
        if not left or seen.context.certain or not self._settings.time_left():
            return seen
        return self._look(seen) or seen

    def _look(self, seen: SearchResult) -> SearchResult | None:
        if self._steps < 0 or (self._found is not None and len(seen.found.steps) > self._steps):
            # Imported here: only a diagnosis that leaves something open looks for impacts.
            from analysis.diagnosis.result.impact_wording import IMPACTS_COMPARED
            from analysis.diagnosis.search.impacts import explain_impacts

            self._progress("looking for play that rattles", 0.9)
            floors, time_left = self._fitting.chosen.floors, self._settings.time_left
            found = explain_impacts(seen.context, seen.found, floors, self._catalogue, time_left)
            self._found, self._steps = None, len(seen.found.steps)
            if found is not None:
                self._found = SearchResult(seen.context, found, judge(found), (IMPACTS_COMPARED,))
        return self._found


def _search_with_learned_error(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    given: tuple[SearchContext, Sequence[Effect], Sequence[Effect]],
    settings: DiagnosisSettings,
    progress: Progress,
) -> SearchOutcome:
    """The search with what the model lacks on the clean recordings counted as noise. given: the shared state, the
    effects to try, and those that sensor faults may be named of. Raises NothingLearned."""
    from analysis.diagnosis.reference.learn_model_error import learn_model_error
    from analysis.diagnosis.reference.model_free_faults import find_sensor_faults
    from analysis.diagnosis.reference.search_with_reference import search_with_reference

    context, catalogue, observable = given
    learned = learn_model_error(settings.clean, model, recordings, context.map_, progress)
    context = replace(context, certain=find_sensor_faults(recordings, settings.clean, observable))
    found = search_with_reference(context, learned, catalogue, progress, settings.time_left)
    return SearchOutcome(found, learned.floor)


def _search(
    context: SearchContext,
    catalogue: Sequence[Effect],
    settings: DiagnosisSettings,
    progress: Progress,
    impacts: _ImpactSearch,
) -> SearchOutcome:
    beyond = Beyond(before_thirds=impacts.before_thirds)
    if settings.discovery and not settings.fitted:
        # Imported here: only a diagnosis that looks for laws needs their grammar.
        from analysis.diagnosis.discovery.add_laws import LawSearch

        laws = LawSearch(progress, settings.time_left)
        beyond = Beyond(_unless_hum(laws.add_short), impacts.before_thirds, _unless_hum(laws.add_any))
    found = search_effects(context, catalogue, progress, settings.time_left, beyond)
    # A model that was fitted to the recordings has no calibration to leave.
    if not settings.fitted:
        found = move_model_further(context, found, catalogue, progress, settings.time_left)
    return SearchOutcome(found, CleanFloor())


def _unless_hum(add_laws: Callable[[SearchResult], SearchResult]) -> Callable[[SearchResult], SearchResult]:
    """Low-frequency hum is not accepted as an answer: the search is repeated without it, before any law is added."""
    return lambda seen: seen if hums_low(seen.found) else add_laws(seen)


def _catalogue(settings: DiagnosisSettings, recording: Recording, barred: frozenset[str]) -> list[Effect]:
    """The effects to try; with barred effects that others refine, as rivals."""
    left_out = {*settings.without, *(GAINS if settings.fitted and not settings.clean else ())}
    known = (*CATALOGUE, *kept_effects(settings.kept, recording))
    catalogue = [effect for effect in known if effect.name not in left_out]
    refined = {name for effect in catalogue for name in effect.simpler}
    return catalogue + [effect for effect in CATALOGUE if effect.name in refined & barred]


def _unseen_by_balance(name: str, place: str, driven: bool) -> bool:
    """Whether a force balance cannot observe an effect of the actuator or sensor. driven: by an actuator with the
    commands as they are; no actuator drives an imposed motion."""
    untested = name != "body_on_actuator" and name not in TESTED_BY_BALANCE
    return place == "sensor" or (place == "actuator" and driven and untested)


def hums_low(found: Explanation) -> bool:
    """A line far below any mains is a harmonic of what drives the device."""
    placed = found.after.fitted.hypothesis.list_placed_effects()
    return any(each.effect.name == HUM and each.values["frequency"] < LOWEST_MAINS_HZ for each in placed)


def has_law(result: SearchResult) -> bool:
    """Whether a discovered law is among what is named."""
    claims = result.found.after.fitted.hypothesis.claims
    return result.judgement.named and any(claim.effect.law is not None for claim in claims)
