"""Check of a logged presentation against the presentation that follows from protocol, rules, seed and position.

The state of a session is computed from its log. A log that was written under other rules, or altered, would give a
wrong state; where its presentations disagree, it is refused here.
"""

import math

from study.session.facts.events import AnswerGiven, TrialMeasured, TrialPresented, TrialSpoiled
from study.session.state.due_trial import PresentTrial


class LogContradictionError(ValueError):
    """A logged event cannot follow the previous events, or its values differ from those that the rules give."""


def check_presentation(event: TrialPresented, expected: PresentTrial) -> None:
    """Raise LogContradictionError unless the logged presentation agrees with `expected`: position in the session,
    phase, frequency, level in N and dB, nominal level, direction, angle, polarity, target acceleration."""
    due_place = (expected.run, expected.trial, expected.attempt)
    if (event.run, event.trial, event.attempt) != due_place:
        raise LogContradictionError(
            f"{describe_place(event)} presented where run {due_place[0]}, trial {due_place[1]}, "
            f"attempt {due_place[2]} was due"
        )
    compared_values = {
        "phase": (event.phase.value, expected.phase.value),
        "frequency_hz": (event.frequency_hz, expected.frequency_hz),
        "level_n": (event.level_n, expected.level_n),
        "level_db": (event.level_db, expected.level_db),
        "direction": (event.direction, expected.label),
        "angle_deg": (event.angle_deg, expected.angle_deg),
        "polarity": (event.polarity, expected.polarity),
        "wanted_mps2": (event.wanted_mps2, expected.wanted_mps2),
        "nominal_n": (event.nominal_n, expected.nominal_n),
    }
    contradictions = [
        f"{name} {logged_value} where {expected_value} is due"
        for name, (logged_value, expected_value) in compared_values.items()
        if not _is_equal(logged_value, expected_value)
    ]
    if contradictions:
        raise LogContradictionError(
            f"{describe_place(event)} was presented with {', '.join(contradictions)}: "
            "this session was begun with different rules"
        )


def _is_equal(logged_value: str | float | None, expected_value: str | float | None) -> bool:
    """Whether the values are equal; floats up to 1e-9 relative or absolute (chosen), because the last bits of
    floating-point powers differ between computers."""
    if isinstance(logged_value, float) and isinstance(expected_value, float):
        return math.isclose(logged_value, expected_value, rel_tol=1e-9, abs_tol=1e-9)
    return logged_value == expected_value


def describe_place(event: TrialPresented | AnswerGiven | TrialMeasured | TrialSpoiled) -> str:
    """Describe run, trial and attempt (indices from 0) in words, for messages."""
    return f"run {event.run}, trial {event.trial}, attempt {event.attempt}"
