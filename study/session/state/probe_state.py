"""State of a session's probes and references, computed from its log, and which of them is due next.

A probe is a known multisine force of about a second, played between two trials; the acceleration that it causes gives
the apparent mass of the handle with the hand on it, and so shows whether device or grip changed during the session. A
reference is a longer force with no hand on the handle, played once per sitting and again after a long pause or rest
(`apply_break`); it shows the device alone. Their forces: `study.session.stimulus.probe_stimulus`; their settings:
`[probes]` of a protocol.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from study.session.facts.sitting_events import PauseTaken, ProbeMeasured, ProbePlayed, RestTaken
from study.session.state.presentation_check import LogContradictionError

if TYPE_CHECKING:
    from protocols.definition.probes import ProbeSettings

LARGEST_WEIGHT_HZ = 11.4
"""Frequency (Hz) at which the weighting Wh of hand-arm vibration (`vibration_dose.compute_hand_arm_weight`, ISO 5349-1)
is largest. A probe has many frequencies; its whole acceleration is weighted as if it were at this one, so that the
weight is never underestimated."""


@dataclass(frozen=True, slots=True)
class ProbeState:
    """State of the probes and references of a session that determines which of them is due next."""

    probe_count: int = 0
    """Number of probes of all kinds so far: with a hand, tests of a free handle, and references. Serves as the next
    number."""
    hand_probe_count: int = 0
    """Number of probes with the hand on the handle, which determines the level of the next."""
    open: ProbePlayed | None = None
    """The probe whose measurement is not in the log: it is playing, or the program ended while it played."""
    since_probe_s: float | None = None
    """Time (s) since the last probe with a hand in this sitting, or since the end of a shorter pause after it; None
    before the first, and after a long pause or rest."""
    is_reference_done: bool = False
    """Whether the reference of this sitting, or since a long pause or rest, was declined or begun; it begins with the
    test whether the handle is free."""
    hand_mass_kg: float | None = None
    """Apparent mass of the handle at the last probe with a hand since a long pause or rest; None where not known."""
    hand_level_n: float = 0.0
    """Level (N) of the probe that gave `hand_mass_kg`."""


@dataclass(frozen=True, slots=True)
class Probe:
    """A probe with the hand on the handle is due."""

    level_n: float
    """Peak of the norm of the force (N)."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference is due, with no hand on the handle."""


def find_due_probe(state: ProbeState, settings: ProbeSettings) -> Probe | None:
    """Find the next probe with a hand; None where none is due yet, or the protocol has none. The levels are used in
    turn."""
    if not settings.levels_n or (state.since_probe_s is not None and state.since_probe_s < settings.interval_s):
        return None
    return Probe(settings.levels_n[state.hand_probe_count % len(settings.levels_n)])


def find_due_reference(state: ProbeState, settings: ProbeSettings) -> Reference | None:
    """Return the reference if it is due: not done yet, and a probe with a hand was played, because a comparison with
    that probe shows whether the handle is free. None where it is not due or the protocol has none."""
    is_due = settings.reference_s > 0 and not state.is_reference_done and state.since_probe_s is not None
    return Reference() if is_due else None


def begin_probe(state: ProbeState, event: ProbePlayed, settings: ProbeSettings) -> ProbeState:
    """Return the state after the event that a probe or a reference begins to play.

    Raises LogContradictionError where the protocol has no probes, the force is above its cap, or the number is not the
    next.
    """
    is_hand_probe = event.kind == "hand"
    highest_n = settings.reference_n if event.kind == "reference" else settings.probe_cap_n
    if not settings.is_enabled:
        raise LogContradictionError(f"a probe of {event.level_n:g} N, but the protocol has no probes")
    if event.level_n > highest_n:
        raise LogContradictionError(f"a probe of {event.level_n:g} N, but the protocol allows {highest_n:g} N at most")
    if event.number != state.probe_count:
        raise LogContradictionError(f"probe {event.number}, but probe {state.probe_count} is the next")
    return replace(
        state,
        probe_count=state.probe_count + 1,
        hand_probe_count=state.hand_probe_count + is_hand_probe,
        open=event,
        since_probe_s=0.0 if is_hand_probe else state.since_probe_s,
        is_reference_done=state.is_reference_done or not is_hand_probe,
    )


def end_probe(state: ProbeState, event: ProbeMeasured) -> ProbeState:
    """Return the state after the measurement of a probe, or after a reference that the experimenter declined (it has
    the next number and no recording). Raises LogContradictionError where this probe is not playing."""
    is_declined = event.number == state.probe_count and event.recording is None
    if not is_declined and (state.open is None or state.open.number != event.number):
        raise LogContradictionError(f"a measurement of probe {event.number}, which is not playing")
    updated_state = replace(state, open=None, is_reference_done=state.is_reference_done or is_declined)
    if state.open is None or state.open.kind != "hand":
        return updated_state
    return replace(updated_state, hand_mass_kg=event.apparent_mass_kg, hand_level_n=state.open.level_n)


def apply_break(state: ProbeState, event: PauseTaken | RestTaken, settings: ProbeSettings) -> ProbeState:
    """Return the state after a pause or a rest.

    After `reference_after_pause_s` or longer the grip may have changed: a probe and a reference are due again. After a
    shorter pause the interval to the next probe starts anew, because the participant has just taken the handle again. A
    shorter rest changes nothing.
    """
    break_s = event.paused_s if isinstance(event, PauseTaken) else event.rested_s
    if break_s >= settings.reference_after_pause_s:
        return replace(state, is_reference_done=False, since_probe_s=None, hand_mass_kg=None)
    if isinstance(event, RestTaken) or state.since_probe_s is None:
        return state
    return replace(state, since_probe_s=0.0)
