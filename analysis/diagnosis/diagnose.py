"""From recordings and a model to findings: the whole diagnosis, without files, clocks or screens."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.first_model import first_model
from analysis.diagnosis.balance.weigh import Balance
from analysis.diagnosis.data.observed_parts import names_of_parts
from analysis.diagnosis.errors.choose_measure import Chosen, Compared, measure_by_force, measure_of
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.result.assemble_findings import assembled
from analysis.diagnosis.result.candidates import reached_of, with_balances
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.impact_wording import IMPACTS_COMPARED
from analysis.diagnosis.result.state_maps import state_maps
from analysis.diagnosis.search.by_balance import balances_of, searched_by_balance
from analysis.diagnosis.search.impacts import rattling
from analysis.diagnosis.search.learn_clean_floor import learned_from
from analysis.diagnosis.search.patience import OUT_OF_TIME, always
from analysis.diagnosis.search.rivalry import Arena
from analysis.diagnosis.search.search import Searched, searched
from analysis.diagnosis.search.search_beside_sound import searched_beside_sound
from analysis.diagnosis.search.seen_directly import seen_directly
from analysis.diagnosis.search.verdict import judge
from analysis.diagnosis.types import Mapper, Patience, Progress
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording

HUM, LOWEST_MAINS_HZ = "mains_hum", 45.0


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    without: tuple[str, ...] = ()
    """Effects that are not to be considered."""
    names: tuple[str, ...] = ()
    """Of the recordings, for the reader."""
    clean: tuple[Recording, ...] = ()
    """Of the device when it was in order: what it differed by then from its model, re-tuned, is no mismatch."""
    fitted: bool = False
    """The model was fitted to these recordings by the program: evidence is then weighed in the force balance."""
    compared: Compared = "auto"
    """What is compared: motion, force, or what suits."""
    patient: Patience = always
    """Asked before each piece of the search; once it says no, what was found until then stands."""


def diagnose(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """recordings: of one device, alike in channels, units and rate; see `belonging` for what is refused. Raises
    NothingLearned where the clean recordings say nothing of these."""
    balances: tuple[Balance, ...] = ()
    if settings.fitted and not settings.clean:
        progress("weighing laws in the force balance", 0.0)
        balances = balances_of(recordings, frozenset(settings.without), settings.patient)
        for number, look in enumerate(_looks(recordings, model, balances, settings.compared)):
            progress("fitting the named laws", 0.2 + 0.3 * number)
            arena = _arena(look, settings, map_)
            repeats = all(floor.how == "repeats" for floor in look.chosen.floors)
            found = searched_by_balance(arena, balances, repeats)
            if found is not None:
                return _assembled(recordings, settings, look, _Seen(found, CleanFloor()), balances)
    progress("measuring the noise", 0.3 if balances else 0.0)
    look = _Look(model, measure_of(recordings, model, settings.clean, settings.compared))
    seen = _by_search(recordings, look, settings, map_, progress, balances)
    progress("writing down what was found", 0.95)
    return _assembled(recordings, settings, look, seen, balances)


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A model, and how its errors are measured."""

    model: MechanicalModel
    chosen: Chosen


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    searched: Searched
    floor: CleanFloor


def _looks(
    recordings: Sequence[Recording], model: MechanicalModel, balances: Sequence[Balance], compared: Compared
) -> Iterator[_Look]:
    """In a free simulation, the strictest, where the fitted model bears one; else along the measured motion, with the
    balance's own linear numbers."""
    if not any(balance.named for balance in balances):
        return
    chosen = measure_of(recordings, model)
    if chosen.measure.name == "free simulation" and compared != "force":
        yield _Look(model, chosen)
    if compared == "motion":
        return
    try:
        rigid = first_model(balances, recordings[0], model.name)
        if rigid is not None:
            band_hz = balances[0].searched.regression.motions[0].band_hz
            yield _Look(rigid, measure_by_force(recordings, rigid, band_hz))
    except (MechanicalModelError, np.linalg.LinAlgError):
        return


def _arena(look: _Look, settings: DiagnosisSettings, map_: Mapper) -> Arena:
    measure, tuning = (
        look.chosen.measure,
        tuning_of(look.model, look.chosen.measure.records[0].recording.command.channels),
    )
    return Arena(measure.shortened(), measure, tuning, map_, frozenset(settings.without))


def _by_search(
    recordings: Sequence[Recording],
    look: _Look,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
    balances: Sequence[Balance],
) -> _Seen:
    """balances: where they name a law of the motion, nothing else is looked for; where they were weighed and name none,
    effects of actuator and sensor are."""
    chosen, arena = look.chosen, _arena(look, settings, map_)
    catalogue = [effect for effect in CATALOGUE if effect.name not in settings.without]
    refined = {name for effect in catalogue for name in effect.simpler}
    catalogue += [effect for effect in CATALOGUE if effect.name in refined & arena.barred]
    may_be_named = [effect for effect in catalogue if effect.name not in arena.barred]
    if balances:
        named = any(balance.named for balance in balances)
        catalogue = [] if named else [effect for effect in catalogue if _beside_motion(effect.name)]
        may_be_named = []
    if settings.clean:
        learned = learned_from(settings.clean, look.model, recordings, map_, progress)
        told = [effect for effect in may_be_named if chosen.measure.tells(effect)]
        arena = replace(arena, certain=seen_directly(recordings, settings.clean, told))
        found = _Seen(searched_beside_sound(arena, learned, catalogue, progress, settings.patient), learned.floor)
    else:
        found = _Seen(searched(arena, catalogue, progress, settings.patient), CleanFloor())
        if balances and _hums_low(found.searched):
            catalogue = [effect for effect in catalogue if effect.name != HUM]
            found = _Seen(searched(arena, catalogue, progress, settings.patient), CleanFloor())
    seen = found.searched
    if seen.judged.verdict in ("unexplained", "partly_explained") and not arena.certain and settings.patient():
        progress("looking for play that rattles", 0.9)
        rattled = rattling(seen.arena, seen.found, chosen.floors, may_be_named)
        if rattled is not None:
            return replace(found, searched=Searched(seen.arena, rattled, judge(rattled), (IMPACTS_COMPARED,)))
    return found


def _hums_low(seen: Searched) -> bool:
    """A line far below any mains is a harmonic of what drives the device."""
    placed = seen.found.after.fitted.hypothesis.placed()
    return any(one.effect.name == HUM and one.values["frequency"] < LOWEST_MAINS_HZ for one in placed)


def _beside_motion(name: str) -> bool:
    """An effect of the actuator or sensor, of which a force balance tells nothing."""
    return EFFECTS_BY_NAME[name].place in ("actuator", "sensor") and name != "body_on_actuator"


def _assembled(
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    look: _Look,
    seen: _Seen,
    balances: Sequence[Balance],
) -> Findings:
    searched, names = seen.searched, names_of_parts(recordings, settings.names)
    found = searched.found if searched.judged.named else replace(searched.found, after=searched.found.retuned)
    whole = assembled(searched.arena, found, searched.judged, look.chosen.floors, names, seen.floor)
    diagnosis = with_balances(whole.diagnosis, balances, recordings[0].command.channels)
    early = (OUT_OF_TIME,) if not all(balance.complete for balance in balances) else ()
    remarks = tuple(dict.fromkeys((*look.chosen.remarks, *searched.remarks, *early, *whole.remarks)))
    reached = reached_of(diagnosis, balances, recordings[0].command.channels)
    maps = state_maps(diagnosis, balances, whole.evidence, recordings[0])
    return replace(whole, diagnosis=diagnosis, remarks=remarks, reached=reached, state_maps=maps)
