"""The next trial: everything about a presentation that follows from rules, seed and position in the session."""

from dataclasses import dataclass

from protocols.definition.staircase_rule import StaircaseRule
from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.schedule import (
    Run,
    are_labels_swapped,
    draw_detection_direction,
    draw_practice_level_n,
    draw_trial,
    is_catch_trial,
    label_direction,
    rove_level_n,
)
from protocols.procedure.staircase import StaircaseState, level_n, to_db
from protocols.trial import Phase
from study.session.facts.events import SessionOpened
from study.session.facts.level_scale import convert_level_to_acceleration
from study.session.state.rules import is_same_stimulus_repeated
from study.session.stimulus.stimulus import compute_direction_angle_deg

_ROVED = (Phase.TRAINING, Phase.TEST)
"""Trial phases of staircases on directions. Catch trials are at full level, and detection trials ask for no
direction."""


@dataclass(frozen=True, slots=True)
class PresentTrial:
    """Play this stimulus and ask for the answer."""

    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_db: float
    level_n: float
    label: int
    """Number of the correct answer: of a direction or, in a detection run, of an interval."""
    direction: int
    """The protocol's direction to play; differs from the label where labels are swapped."""
    angle_deg: float
    polarity: int
    wanted_mps2: float | None = None
    """Wanted acceleration of the level; None where levels are commanded forces."""
    nominal_n: float | None = None
    """Level of the staircase, around which `level_n` was drawn; None without roving."""


@dataclass(frozen=True, slots=True)
class Place:
    """Position of a trial in a session."""

    run: Run
    trial: int
    attempt: int
    staircase: StaircaseState


def due_trial(protocol: StudyProtocol, opened: SessionOpened, rule: StaircaseRule, place: Place) -> PresentTrial:
    """The presentation at this place."""
    run, polarity = place.run, protocol.stimulus.onset_polarity
    draws = 0 if is_same_stimulus_repeated(opened) else place.attempt
    draw = draw_trial(protocol.schedule, polarity, opened.seed, run.index, place.trial, draws)
    label, direction = label_direction(draw.direction, has_swapped_labels(protocol, opened)), draw.direction
    if run.phase is Phase.DETECTION:  # the answer is an interval; the direction does not matter
        label = draw.direction
        direction = draw_detection_direction(opened.seed, run.index, place.trial, draws)
    phase, level_db = run.phase, place.staircase.level_db
    force_n = level_n(rule, place.staircase)
    if run.practice:
        force_n = draw_practice_level_n(protocol.practice, opened.seed, run.index, place.trial, draws)
        level_db = to_db(force_n)
    elif run.phase is Phase.TEST and is_catch_trial(protocol.catch, opened.seed, run.index, place.trial):
        phase, force_n, level_db = Phase.CATCH, rule.cap_n, to_db(rule.cap_n)
    nominal_n = None
    if protocol.stimulus.rove_db and phase in _ROVED and not run.practice:
        nominal_n = force_n
        drawn_n = rove_level_n(force_n, protocol.stimulus.rove_db, opened.seed, run.index, place.trial, draws)
        force_n = min(drawn_n, protocol.safety.stimulus_cap_n)
        level_db = to_db(force_n)
    return PresentTrial(
        run=run.index,
        trial=place.trial,
        attempt=place.attempt,
        phase=phase,
        frequency_hz=run.frequency_hz,
        level_db=level_db,
        level_n=force_n,
        label=label,
        direction=direction,
        angle_deg=compute_direction_angle_deg(protocol.directions, direction),
        polarity=draw.polarity,
        wanted_mps2=convert_level_to_acceleration(opened.equalized, force_n, run.frequency_hz),
        nominal_n=nominal_n,
    )


def has_swapped_labels(protocol: StudyProtocol, opened: SessionOpened) -> bool:
    """Whether the numbers 1 and 2 are exchanged for this participant."""
    return are_labels_swapped(protocol.schedule, len(protocol.stimulus.frequencies_hz), opened.participant_number)
