"""Catch trials: trials at full level within the test runs, where a wrong answer is likely a lapse of attention.

Likely, not surely: at high frequencies even the full level may have no direction for a hand, and a wrong answer
there is no proof of inattention.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest

from protocols.trial import Phase, Trial

CONFIDENCE = 0.95
"""Confidence of the interval of the lapse rate."""


@dataclass(frozen=True, slots=True)
class CatchTally:
    """Catch trials of a participant at a frequency, and the lapse rate with its 95 % interval."""

    subject: str
    frequency_hz: float
    given: int
    """Answered and counted; always above 0."""
    wrong: int
    lapse_rate: float
    lower: float
    upper: float
    """Wilson's interval of the rate."""


def catch_tallies(trials: Iterable[Trial]) -> tuple[CatchTally, ...]:
    """One per participant and frequency, over all sessions: participants as they occur, frequencies ascending."""
    answers: dict[str, dict[float, list[bool]]] = {}
    for trial in trials:
        if trial.phase is Phase.CATCH and trial.counts:
            answers.setdefault(trial.subject, {}).setdefault(trial.frequency_hz, []).append(not trial.correct)
    return tuple(
        _tally(subject, frequency_hz, sum(wrong), len(wrong))
        for subject, by_frequency in answers.items()
        for frequency_hz, wrong in sorted(by_frequency.items())
    )


def wilson_interval(wrong: int, given: int) -> tuple[float, float]:
    """Wilson interval of a rate. Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212."""
    interval = binomtest(wrong, given).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)


def _tally(subject: str, frequency_hz: float, wrong: int, given: int) -> CatchTally:
    return CatchTally(subject, frequency_hz, given, wrong, wrong / given, *wilson_interval(wrong, given))
