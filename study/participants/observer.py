"""The port of simulated participants: what one feels, what one answers."""

from dataclasses import dataclass
from typing import Protocol

from protocols.trial import Phase


@dataclass(frozen=True, slots=True)
class Felt:
    """One stimulus, as far as a participant could know it, and where in the session it comes."""

    run: int
    trial: int
    attempt: int
    phase: Phase
    frequency_hz: float
    level_n: float
    direction_shown: int
    """Its number on the screen, 1 or 2; in a detection trial, of the interval in which it shook."""
    trials_before: int
    """Answered so far in this session, training included."""


@dataclass(frozen=True, slots=True)
class Reply:
    answer: int
    """1 or 2."""
    response_time_s: float
    """From the onset to the answer."""


class Observer(Protocol):
    """Stateless: the reply depends on what is felt, on the seed, and on nothing answered before. So a resumed
    session gets the replies that the uninterrupted one would have got."""

    @property
    def name(self) -> str: ...

    def reply(self, felt: Felt, seed: int) -> Reply: ...
