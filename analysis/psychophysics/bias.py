"""Sensitivity and response bias of one-interval, two-alternative identification.

The task shows one of two directions per trial, so an unbiased observer's proportion correct is Phi(d' / 2): the
79.4 % of a 1-up 3-down staircase is d' = 1.64, not the 1.16 of a two-interval task. A bias towards one answer lowers
the proportion correct at equal d' and so raises a staircase threshold: at d' = 1.64 a criterion of 0.5 leaves 76.6 %
and one of 1.0 leaves 69.7 %.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapters 1, 2 and 6;
the log-linear correction is that of M. J. Hautus, Behav. Res. Methods Instrum. Comput. 27 (1995), 46-51.

Sign of the criterion, everywhere in hapteq: c = -(z(H) + z(F)) / 2 (Macmillan and Creelman, equation 2.1), where a hit
is the answer 1 to a 1 and a false alarm the answer 1 to a 2. So c > 0 is a tendency to answer 2 (in a detection run,
the second interval), c < 0 a tendency to answer 1. Simulated participants state theirs in the same way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

CRITERION_WORDS = "c = −(z(H) + z(F)) / 2 with answer 1 as the hit; positive: a tendency to answer 2"


@dataclass(frozen=True, slots=True)
class ResponseBias:
    """Sensitivity d' and criterion c of a run by signal detection theory."""

    d_prime: float
    """d' over all levels of the run: it describes the run and is not a threshold."""
    criterion: float
    """c, in units of d'. 0: no tendency; positive: a tendency to answer 2; negative: to answer 1."""


def response_bias(directions_shown: Sequence[int], correct: Sequence[bool]) -> ResponseBias | None:
    """Sensitivity d' = z(H) - z(F) and criterion c of identification answers. directions_shown: 1 or 2 per trial, as
    many as `correct`. None where one of the directions was never shown."""
    hits = [is_correct for direction, is_correct in zip(directions_shown, correct, strict=True) if direction == 1]
    false_alarms = [
        not is_correct for direction, is_correct in zip(directions_shown, correct, strict=True) if direction == 2
    ]
    if not hits or not false_alarms:
        return None
    z_hit, z_false_alarm = _correct_z(hits), _correct_z(false_alarms)
    return ResponseBias(d_prime=z_hit - z_false_alarm, criterion=-0.5 * (z_hit + z_false_alarm))


def criterion_variance(correct_count: int, first: float, second: float) -> float:
    """Binomial variance of c of an unbiased observer, for whom z(H) and -z(F) have the same mean, z at the share p of
    right answers: p (1 - p) / phi(z)^2 (1 / first + 1 / second) / 4 by the delta method, with the log-linear correction
    of p. correct_count: correct answers; first, second: trials of each direction, above 0."""
    share_correct = (correct_count + 0.5) / (first + second + 1.0)
    z_variance = share_correct * (1.0 - share_correct) / NormalDist().pdf(NormalDist().inv_cdf(share_correct)) ** 2
    return z_variance * (1.0 / first + 1.0 / second) / 4.0


def _correct_z(answers: Sequence[bool]) -> float:
    """z of a rate with the log-linear correction: half an answer is added to either count, so that z is finite for
    rates of 0 and 1."""
    return NormalDist().inv_cdf((sum(answers) + 0.5) / (len(answers) + 1.0))
