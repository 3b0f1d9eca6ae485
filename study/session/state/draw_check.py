"""Check of a logged presentation against the presentation that follows from rules, seed and position in the session.

The state is computed from the log; a log that was written under other rules, or altered, is refused here instead of
giving a wrong state.
"""

import math

from study.session.facts.events import AnswerGiven, TrialMeasured, TrialPresented, TrialSpoiled
from study.session.state.due_trial import PresentTrial


class LogContradiction(ValueError):  # noqa: N818 - a contradiction is what it is
    """A logged event cannot follow the previous events, or its values differ from those that the rules give."""


def check_draw(event: TrialPresented, expected: PresentTrial) -> None:
    """Raise LogContradiction unless the logged presentation agrees with `expected`: position, phase, frequency (Hz),
    level (N, dB), direction, angle (degrees), polarity, wanted acceleration (m/s²)."""
    place = (expected.run, expected.trial, expected.attempt)
    if (event.run, event.trial, event.attempt) != place:
        raise LogContradiction(
            f"{describe_place(event)} presented where run {place[0]}, trial {place[1]}, attempt {place[2]} was due"
        )
    compared = {
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
    wrong = [
        f"{name} {logged} where {expected_value} is due"
        for name, (logged, expected_value) in compared.items()
        if not _is_equal(logged, expected_value)
    ]
    if wrong:
        raise LogContradiction(
            f"{describe_place(event)} was presented with {', '.join(wrong)}: "
            "this session was begun with different rules"
        )


def _is_equal(logged: str | float | None, expected_value: str | float | None) -> bool:
    """Whether the values are equal; floats up to 1e-9 relative or absolute, because the last bits of floating-point
    powers differ between computers."""
    if isinstance(logged, float) and isinstance(expected_value, float):
        return math.isclose(logged, expected_value, rel_tol=1e-9, abs_tol=1e-9)
    return logged == expected_value


def describe_place(event: TrialPresented | AnswerGiven | TrialMeasured | TrialSpoiled) -> str:
    """Run, trial and attempt in words, for messages."""
    return f"run {event.run}, trial {event.trial}, attempt {event.attempt}"
