"""Computation of the next trial: the presentation that follows from protocol, rules, seed and position in the session.

Order: draw direction and polarity, compute the level by the staircase, practice or catch trial, rove the level within
the safety cap. The same computation gives the trial to present, and the values that a logged one is checked against.
"""

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
from protocols.procedure.staircase import StaircaseState, compute_level_n, to_db
from protocols.trial import Phase
from study.session.facts.events import SessionOpened
from study.session.facts.level_scale import convert_level_to_acceleration
from study.session.state.rules import is_same_stimulus_repeated
from study.session.stimulus.stimulus import compute_direction_angle_deg

_ROVED_PHASES = (Phase.TRAINING, Phase.TEST)
"""Phases whose levels are roved: staircases on directions. Catch trials are at full level, and detection trials ask for
no direction."""


@dataclass(frozen=True, slots=True)
class PresentTrial:
    """A presentation: the stimulus to play and its correct answer. run, trial, attempt: indices from 0."""

    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_db: float
    """Level in dB relative to 1 N."""
    level_n: float
    """Amplitude of the force; for equalized stimuli, the level (`level_scale`)."""
    label: int
    """Number of the correct answer: of a direction or, in a detection run, of an interval."""
    direction: int
    """The protocol's direction to play, 1 or 2; may differ from the label (swapped labels, detection run)."""
    angle_deg: float
    """Angle of the direction in the protocol's plane (degrees)."""
    polarity: int
    """Sign of the first half period, +1 or -1."""
    wanted_mps2: float | None = None
    """Target acceleration that the level stands for (m/s²); None where levels are commanded forces."""
    nominal_n: float | None = None
    """Level of the staircase (N), around which `level_n` was drawn; None without roving."""


@dataclass(frozen=True, slots=True)
class Place:
    """Position of a trial in a session, and the state of the staircase there. trial, attempt: indices from 0."""

    run: Run
    trial: int
    attempt: int
    staircase: StaircaseState


def compute_due_trial(
    protocol: StudyProtocol, opening_event: SessionOpened, rule: StaircaseRule, place: Place
) -> PresentTrial:
    """Compute the presentation at this place. With `is_same_stimulus_repeated`, every attempt has the draw of the
    first attempt."""
    run, polarity = place.run, protocol.stimulus.onset_polarity
    draw_index = 0 if is_same_stimulus_repeated(opening_event) else place.attempt
    draw = draw_trial(protocol.schedule, polarity, opening_event.seed, run.index, place.trial, draw_index)
    label, direction = label_direction(draw.direction, has_swapped_labels(protocol, opening_event)), draw.direction
    if run.phase is Phase.DETECTION:  # the answer is an interval; the direction does not matter
        label = draw.direction
        direction = draw_detection_direction(opening_event.seed, run.index, place.trial, draw_index)
    phase, level_db = run.phase, place.staircase.level_db
    level_n = compute_level_n(rule, place.staircase)
    if run.practice:
        level_n = draw_practice_level_n(protocol.practice, opening_event.seed, run.index, place.trial, draw_index)
        level_db = to_db(level_n)
    elif run.phase is Phase.TEST and is_catch_trial(protocol.catch, opening_event.seed, run.index, place.trial):
        phase, level_n, level_db = Phase.CATCH, rule.cap_n, to_db(rule.cap_n)
    nominal_n = None
    if protocol.stimulus.rove_db and phase in _ROVED_PHASES and not run.practice:
        nominal_n = level_n
        drawn_n = rove_level_n(
            level_n, protocol.stimulus.rove_db, opening_event.seed, run.index, place.trial, draw_index
        )
        level_n = min(drawn_n, protocol.safety.stimulus_cap_n)
        level_db = to_db(level_n)
    return PresentTrial(
        run=run.index,
        trial=place.trial,
        attempt=place.attempt,
        phase=phase,
        frequency_hz=run.frequency_hz,
        level_db=level_db,
        level_n=level_n,
        label=label,
        direction=direction,
        angle_deg=compute_direction_angle_deg(protocol.directions, direction),
        polarity=draw.polarity,
        wanted_mps2=convert_level_to_acceleration(opening_event.equalized, level_n, run.frequency_hz),
        nominal_n=nominal_n,
    )


def has_swapped_labels(protocol: StudyProtocol, opening_event: SessionOpened) -> bool:
    """Whether the numbers 1 and 2 of the directions are exchanged for this participant."""
    return are_labels_swapped(
        protocol.schedule, len(protocol.stimulus.frequencies_hz), opening_event.participant_number
    )
