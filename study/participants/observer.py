"""Interface of simulated participants: the perceived stimulus, the reply to it, and the protocol `Observer`.

The participants of this package implement `Observer`, and `observer_catalogue` makes them by name.
"""

from dataclasses import dataclass
from typing import Protocol

from protocols.trial import Phase
from study.session.stimulus.delivered import DeliveredMotion


@dataclass(frozen=True, slots=True)
class PerceivedStimulus:
    """One stimulus as a participant can perceive it, and its position in the session. Run, trial and attempt are
    indices from 0."""

    run: int
    trial: int
    attempt: int
    phase: Phase
    """Kind of the trial; the alternatives are directions, or intervals in `Phase.DETECTION`."""
    frequency_hz: float
    level_n: float
    """Level (N): amplitude of the commanded force; with an equalizer, see `study.session.facts.level_scale`."""
    direction_shown: int
    """Number of the direction on the screen, 1 or 2; in a detection trial, number of the interval with the
    vibration."""
    trials_before: int
    """Number of trials answered so far in this session, training included."""
    nominal_n: float | None = None
    """Level of the staircase (N), where `level_n` was roved around it."""
    delivered: DeliveredMotion | None = None
    """The stimulus as delivered by the device; None where it was not felt or not measured."""


@dataclass(frozen=True, slots=True)
class Reply:
    """Reply of a simulated participant to a presentation."""

    answer: int
    """Number of the direction or interval, 1 or 2."""
    response_time_s: float
    """Time from the onset to the answer (s)."""
    ask_again: bool = False
    """Whether the participant asks for the same trial again. Where that is not allowed, the answer counts."""


class Observer(Protocol):
    """A stateless participant: the reply depends on the stimulus and the seed, not on earlier answers. A resumed
    session therefore gets the same replies as an uninterrupted one."""

    @property
    def name(self) -> str:
        """The name by which `--observer` selects this participant."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Reply to this stimulus. seed: of the session; together with run, trial and attempt of the stimulus it
        determines all random draws."""
