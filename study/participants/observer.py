"""Interface of simulated participants: what is felt, what is answered."""

from dataclasses import dataclass
from typing import Protocol

from protocols.trial import Phase
from study.session.stimulus.delivered import Delivered


@dataclass(frozen=True, slots=True)
class PerceivedStimulus:
    """One stimulus as far as a participant could perceive it, and its place in the session."""

    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_n: float
    direction_shown: int
    """Number of the direction on the screen, 1 or 2; in a detection trial, of the interval in which it shook."""
    trials_before: int
    """Trials answered so far in this session, training included."""
    nominal_n: float | None = None
    """Level of the staircase, where `level_n` was roved around it."""
    delivered: Delivered | None = None
    """The stimulus as delivered by the device; None where it was not felt or not measured."""


@dataclass(frozen=True, slots=True)
class Reply:
    """Reply of a simulated participant to a presentation."""

    answer: int
    """1 or 2."""
    response_time_s: float
    """Time from the onset to the answer."""
    ask_again: bool = False
    """The same trial is asked for once more, if that is allowed; else the answer counts."""


class Observer(Protocol):
    """A stateless participant: the reply depends on the stimulus and the seed, not on earlier answers. So a resumed
    session gets the same replies as an uninterrupted one."""

    @property
    def name(self) -> str:
        """The name that `--observer` takes."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The reply to this stimulus. seed: of the session; with the stimulus's place in it, it gives all draws."""
