"""What a sound device differs by from its re-tuned model, learned from recordings in which nothing is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.choose_measure import Chosen, measure_of
from analysis.diagnosis.clean_floor import CleanFloor
from analysis.diagnosis.error_measure import ErrorMeasure
from analysis.diagnosis.explain import Progress, retuned_alone
from analysis.diagnosis.mismatch_cells import MismatchCell, learn_floor
from analysis.diagnosis.mismatch_maps import cells_of
from analysis.diagnosis.rivalry import Arena, Contender
from analysis.diagnosis.screening import Mapper
from analysis.diagnosis.tuning import tuning_of
from analysis.wording import listed
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

LEARNING = "learning from the clean recordings"
BEGUN = 0.02
"""Of a diagnosis, that is done then."""
MUCH = 0.3
"""Share of the signal from which what a sound device differs by hides too much."""


class NothingLearned(ValueError):  # noqa: N818 - an answer that a user reads
    """Clean recordings that say nothing of those to diagnose; a sentence without a full stop."""


@dataclass(frozen=True, slots=True, eq=False)
class _Lesson:
    cells: tuple[MismatchCell, ...]
    channels: FloatArray
    """(c,): share of the signal."""


def learned_from(
    clean: Sequence[Recording], model: MechanicalModel, error: str, map_: Mapper, progress: Progress
) -> CleanFloor:
    """clean: of the same device, alike in channels and units; the model is re-tuned to each by itself, for days differ.
    error: how the recordings to diagnose are measured. Raises NothingLearned where these cannot be measured so."""
    lessons: list[_Lesson] = []
    for number, one in enumerate(clean):
        progress(LEARNING, BEGUN * number / len(clean))
        chosen = measure_of((one,), model)
        if chosen.measure.name != error:
            raise NothingLearned(
                f"the clean recordings can only be compared by {chosen.measure.name}, those to diagnose by {error}, so "
                "that one says nothing of the other"
            )
        lessons.append(_lesson(chosen, model, one, map_))
    floor = learn_floor([one.cells for one in lessons])
    largest = np.max([one.channels for one in lessons], axis=0)
    floor = replace(floor, error=error, recordings=len(clean))
    return replace(floor, channels=tuple((floor.beyond * largest).tolist()))


def _lesson(chosen: Chosen, model: MechanicalModel, recording: Recording, map_: Mapper) -> _Lesson:
    whole = chosen.measure
    arena = Arena(whole.shortened(), whole, tuning_of(model, recording.command.channels), map_)
    retuned = arena.confirmed(arena.contender(retuned_alone(arena)))
    return _Lesson(cells_of(whole, retuned, chosen.floors), _channel_shares(whole, retuned))


def _channel_shares(measure: ErrorMeasure, retuned: Contender) -> FloatArray:
    """(c,): the largest over the samples to fit, to choose and to test by."""
    stands = retuned.standing
    times = np.nanmax(np.maximum([stands.fit, stands.choose, stands.test], 1.0), axis=0)
    return np.asarray(np.sqrt(times**2 - 1) * measure.noise / np.maximum(_size(measure), np.finfo(float).tiny))


def floored(measure: ErrorMeasure, floor: CleanFloor) -> ErrorMeasure:
    """What a sound device differs by counts as noise."""
    return measure.with_floor(np.array(floor.channels) * _size(measure)) if floor.channels else measure


def _size(measure: ErrorMeasure) -> FloatArray:
    """(c,): rms of the signal."""
    return np.asarray(np.nanstd(np.vstack([one.measured for one in measure.records]), axis=0))


def learned_sentence(floor: CleanFloor, channels: Sequence[str]) -> str:
    """Empty where nothing was learned."""
    if not floor.channels:
        return ""
    shares = listed([f"{name} {100 * share:.2g} %" for name, share in zip(channels, floor.channels, strict=False)])
    count = f"{floor.recordings} clean recording{'s' if floor.recordings != 1 else ''}"
    said = (
        f"What a sound device differs by from its re-tuned model was learned from {count}: {shares} of the channel's "
        f"signal (the largest that was seen, times {floor.beyond:.2g}). So much counts as noise here, and as no "
        "mismatch in the map, octave by octave."
    )
    if max(floor.channels) <= MUCH:
        return said
    return f"{said} That is much: what the clean recordings hold, too, and what is smaller, cannot be found."
