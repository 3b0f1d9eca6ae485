"""Probes and references of a session, folded from its log, and which one is due next."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from study.session.facts.sitting_events import PauseTaken, ProbeMeasured, ProbePlayed, RestTaken
from study.session.state.draw_check import LogContradiction

if TYPE_CHECKING:
    from protocols.definition.probes import ProbeSettings

STRONGEST_WEIGHT_HZ = 12.5
"""Frequency of the largest weight of hand-arm vibration: a probe's acceleration counts as if it were all at it."""


@dataclass(frozen=True, slots=True)
class ProbingState:
    """State of the probes and references of a session, as far as they decide what is due next."""

    played: int = 0
    """Number of probes in the session, of all kinds."""
    with_hand: int = 0
    """Number with the hand on the handle, which determines the next level."""
    open: ProbePlayed | None = None
    """The probe that was played and is not measured yet, or was cut off by the program's end."""
    since_s: float | None = None
    """Seconds since the last probe with a hand in this sitting; None before the first."""
    referenced: bool = False
    """Whether the reference of this sitting, since its last long pause, was played, tried or declined."""
    hand_mass_kg: float | None = None
    """Apparent mass of the handle with the hand at the last such probe since a long pause; None where not known."""
    hand_level_n: float = 0.0
    """Level of that probe."""


@dataclass(frozen=True, slots=True)
class Probe:
    """A probe with the hand on the handle is due."""

    level_n: float


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference is due, with a free handle."""


def due_probe(probing: ProbingState, settings: ProbeSettings) -> Probe | None:
    """The next probe with a hand; None if none is due yet."""
    if not settings.levels_n or (probing.since_s is not None and probing.since_s < settings.interval_s):
        return None
    return Probe(settings.levels_n[probing.with_hand % len(settings.levels_n)])


def due_reference(probing: ProbingState, settings: ProbeSettings) -> Reference | None:
    """The next test for a free handle, after the first probe with a hand, with which it is compared."""
    due = settings.reference_s > 0 and not probing.referenced and probing.since_s is not None
    return Reference() if due else None


def begin_probe(probing: ProbingState, event: ProbePlayed, settings: ProbeSettings) -> ProbingState:
    """The state with this probe playing. Raises LogContradiction where the protocol does not allow it."""
    hand = event.kind == "hand"
    highest_n = settings.reference_n if event.kind == "reference" else settings.probe_cap_n
    if event.level_n > highest_n or not settings.played:
        raise LogContradiction(f"a probe of {event.level_n:g} N, where the protocol allows {highest_n:g} N")
    if event.number != probing.played:
        raise LogContradiction(f"probe {event.number} after {probing.played} probes")
    return replace(
        probing,
        played=probing.played + 1,
        with_hand=probing.with_hand + hand,
        open=event,
        since_s=0.0 if hand else probing.since_s,
        referenced=probing.referenced or not hand,
    )


def end_probe(probing: ProbingState, event: ProbeMeasured) -> ProbingState:
    """The state after a measurement, or after a reference that was declined. Raises LogContradiction."""
    declined = event.number == probing.played and event.recording is None
    if not declined and (probing.open is None or probing.open.number != event.number):
        raise LogContradiction(f"probe {event.number} was measured, which is not playing")
    ended = replace(probing, open=None, referenced=probing.referenced or declined)
    if probing.open is None or probing.open.kind != "hand":
        return ended
    return replace(ended, hand_mass_kg=event.apparent_mass_kg, hand_level_n=probing.open.level_n)


def after_break(probing: ProbingState, event: PauseTaken | RestTaken, settings: ProbeSettings) -> ProbingState:
    """The state after a pause or rest. A long one asks for another reference, and so for a probe of the grip as it is
    then; after a shorter pause the next probe waits as long as after another: the handle is only being taken again."""
    seconds = event.paused_s if isinstance(event, PauseTaken) else event.rested_s
    if seconds >= settings.reference_after_pause_s:
        return replace(probing, referenced=False, since_s=None, hand_mass_kg=None)
    if isinstance(event, RestTaken) or probing.since_s is None:
        return probing
    return replace(probing, since_s=0.0)
