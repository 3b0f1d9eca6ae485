"""What to do next in a session. Decides nothing by itself: it reads the state that the events made."""

from dataclasses import dataclass

from protocols.schedule import draw_trial, label_of
from protocols.staircase import level_n
from protocols.trial import Phase
from study.session.state import SessionState, current_rule, labels_are_swapped
from study.session.stimulus import direction_angle_deg


@dataclass(frozen=True, slots=True)
class Present:
    """Play this stimulus and ask for the answer."""

    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_db: float
    level_n: float
    label: int
    """The number that is the right answer."""
    direction: int
    """The protocol's direction to play; another number than the label where labels are swapped."""
    angle_deg: float
    polarity: int


@dataclass(frozen=True, slots=True)
class Rest:
    seconds: float


@dataclass(frozen=True, slots=True)
class Finish:
    """Nothing is left to do."""


Action = Present | Rest | Finish


def next_action(state: SessionState) -> Action:
    """Raises ValueError while a trial is open: it must be answered, measured or spoiled first."""
    if state.presented is not None:
        raise ValueError("a trial is open; it must be closed before the next action")
    if state.finished:
        return Finish()
    if state.rest_due_s > 0:
        return Rest(seconds=state.rest_due_s)
    return _present(state)


def _present(state: SessionState) -> Present:
    protocol, opened, run = state.protocol, state.opened, state.runs[state.run]
    polarity = protocol.stimulus.onset_polarity
    draw = draw_trial(protocol.schedule, polarity, opened.seed, run.index, state.trial, state.attempt)
    return Present(
        run=run.index,
        trial=state.trial,
        attempt=state.attempt,
        phase=run.phase,
        frequency_hz=run.frequency_hz,
        level_db=state.staircase.level_db,
        level_n=level_n(current_rule(state), state.staircase),
        label=label_of(draw.direction, labels_are_swapped(state)),
        direction=draw.direction,
        angle_deg=direction_angle_deg(protocol.directions, draw.direction),
        polarity=draw.polarity,
    )
