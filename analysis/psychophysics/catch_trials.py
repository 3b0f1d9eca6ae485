"""Lapse rate from catch trials: trials at full level within the test runs, where a wrong answer is probably a lapse.

A wrong answer is no proof of inattention: at high frequencies a person may not perceive a direction even at full level.
The rate per participant and frequency is wrong over answered trials, with Wilson's 95 % interval.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest

from protocols.trial import Phase, Trial

CONFIDENCE = 0.95
"""Confidence level of Wilson's interval."""


@dataclass(frozen=True, slots=True)
class CatchTally:
    """Catch trials of a participant at a frequency, and the lapse rate with its 95 % interval."""

    subject: str
    """Code of the participant."""
    frequency_hz: float
    given: int
    """Number of answered catch trials that count; always above 0."""
    wrong: int
    """Number of wrong answers among them."""
    lapse_rate: float
    """wrong / given, 0 to 1."""
    lower: float
    upper: float
    """Limits of Wilson's 95 % interval of the lapse rate."""


def tally_catch_trials(trials: Iterable[Trial]) -> tuple[CatchTally, ...]:
    """Tally the valid catch trials per participant and frequency, over all sessions: participants in the order of their
    first catch trial, frequencies ascending."""
    wrong_by_subject: dict[str, dict[float, list[bool]]] = {}
    for trial in trials:
        if trial.phase is Phase.CATCH and trial.is_valid:
            wrong_by_subject.setdefault(trial.subject, {}).setdefault(trial.frequency_hz, []).append(not trial.correct)
    return tuple(
        _make_tally(subject, frequency_hz, sum(is_wrong), len(is_wrong))
        for subject, wrong_by_frequency in wrong_by_subject.items()
        for frequency_hz, is_wrong in sorted(wrong_by_frequency.items())
    )


def compute_wilson_interval(event_count: int, trial_count: int) -> tuple[float, float]:
    """Compute the limits of Wilson's score interval (95 %) of the rate event_count / trial_count; trial_count >= 1.
    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212."""
    interval = binomtest(event_count, trial_count).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)


def _make_tally(subject: str, frequency_hz: float, wrong_count: int, answered_count: int) -> CatchTally:
    """Make the tally; answered_count: at least 1."""
    return CatchTally(
        subject,
        frequency_hz,
        answered_count,
        wrong_count,
        wrong_count / answered_count,
        *compute_wilson_interval(wrong_count, answered_count),
    )
