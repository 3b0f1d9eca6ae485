"""From recordings and a model to findings: the whole diagnosis, without files, clocks or screens."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.diagnosis.data.observed_parts import names_of_parts
from analysis.diagnosis.errors.choose_measure import measure_of
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.result.assemble_findings import assembled
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.impact_wording import IMPACTS_COMPARED
from analysis.diagnosis.search.impacts import rattling
from analysis.diagnosis.search.learn_clean_floor import learned_from
from analysis.diagnosis.search.patience import always
from analysis.diagnosis.search.rivalry import Arena
from analysis.diagnosis.search.search import Searched, searched
from analysis.diagnosis.search.search_beside_sound import searched_beside_sound
from analysis.diagnosis.search.seen_directly import seen_directly
from analysis.diagnosis.search.verdict import judge
from analysis.diagnosis.types import Mapper, Patience, Progress
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    without: tuple[str, ...] = ()
    """Effects that are not to be considered."""
    names: tuple[str, ...] = ()
    """Of the recordings, for the reader."""
    clean: tuple[Recording, ...] = ()
    """Of the device when it was in order: what it differed by then from its model, re-tuned, is no mismatch."""
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
    progress("measuring the noise", 0.0)
    chosen = measure_of(recordings, model, settings.clean)
    tuning = tuning_of(model, recordings[0].command.channels)
    catalogue = [effect for effect in CATALOGUE if effect.name not in settings.without]
    refined = {name for effect in catalogue for name in effect.simpler}
    arena = Arena(chosen.measure.shortened(), chosen.measure, tuning, map_, frozenset(settings.without))
    catalogue += [effect for effect in CATALOGUE if effect.name in refined & arena.barred]
    may_be_named = [effect for effect in catalogue if effect.name not in arena.barred]
    if settings.clean:
        learned = learned_from(settings.clean, model, recordings, map_, progress)
        told = [effect for effect in may_be_named if chosen.measure.tells(effect)]
        arena = replace(arena, certain=seen_directly(recordings, settings.clean, told))
        seen, floor = searched_beside_sound(arena, learned, catalogue, progress, settings.patient), learned.floor
    else:
        seen, floor = searched(arena, catalogue, progress, settings.patient), CleanFloor()
    if seen.judged.verdict in ("unexplained", "partly_explained") and not arena.certain and settings.patient():
        progress("looking for play that rattles", 0.9)
        rattled = rattling(seen.arena, seen.found, chosen.floors, may_be_named)
        seen = seen if rattled is None else Searched(seen.arena, rattled, judge(rattled), (IMPACTS_COMPARED,))
    progress("writing down what was found", 0.95)
    found = seen.found if seen.judged.named else replace(seen.found, after=seen.found.retuned)
    whole = assembled(seen.arena, found, seen.judged, chosen.floors, names_of_parts(recordings, settings.names), floor)
    return replace(whole, remarks=(*chosen.remarks, *seen.remarks, *whole.remarks))
