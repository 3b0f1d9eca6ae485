"""Sensitivity d' and response bias (criterion c) of one-interval, two-alternative identification.

The task shows one of two directions per trial, so an unbiased observer's proportion correct is Phi(d' / 2): the
79.4 % of a 1-up 3-down staircase is d' = 1.64, not the 1.16 of a two-interval task. A bias towards one answer lowers
the proportion correct at equal d' and so raises a staircase threshold: at d' = 1.64 a criterion of 0.5 leaves 76.6 %
and one of 1.0 leaves 69.7 %.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapters 1, 2 and 6;
the log-linear correction is that of M. J. Hautus, Behav. Res. Methods Instrum. Comput. 27 (1995), 46-51.

Sign of the criterion: c = -(z(H) + z(F)) / 2 (Macmillan and Creelman, equation 2.1), where a hit is the answer 1 to a
1 and a false alarm the answer 1 to a 2. So c > 0 is a tendency to answer 2 (in a detection run, the second interval),
c < 0 a tendency to answer 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

CRITERION_DEFINITION = "c = −(z(H) + z(F)) / 2 with answer 1 as the hit; positive: a tendency to answer 2"
"""Definition of the criterion, for tables of a report."""


@dataclass(frozen=True, slots=True)
class ResponseBias:
    """Sensitivity d' and criterion c of a run by signal detection theory."""

    d_prime: float
    """d' over all levels of the run: it describes the run and is not a threshold."""
    criterion: float
    """c, in units of d'; positive: a tendency to answer 2."""


def estimate_response_bias(directions_shown: Sequence[int], correct: Sequence[bool]) -> ResponseBias | None:
    """Estimate sensitivity d' = z(H) - z(F) and criterion c from identification answers. directions_shown: 1 or 2 per
    trial; correct: whether the answer was right. None where one of the directions was never shown."""
    hits = [is_correct for direction, is_correct in zip(directions_shown, correct, strict=True) if direction == 1]
    false_alarms = [
        not is_correct for direction, is_correct in zip(directions_shown, correct, strict=True) if direction == 2
    ]
    if not hits or not false_alarms:
        return None
    z_hit, z_false_alarm = _compute_corrected_z(hits), _compute_corrected_z(false_alarms)
    return ResponseBias(d_prime=z_hit - z_false_alarm, criterion=-0.5 * (z_hit + z_false_alarm))


def compute_criterion_variance(correct_count: int, first_trials: float, second_trials: float) -> float:
    """Compute the binomial variance of c of an unbiased observer by the delta method:

        p (1 - p) / phi(z)^2 (1 / n1 + 1 / n2) / 4

    Here p is the share of right answers with the log-linear correction, z = z(p) the common mean of z(H) and -z(F), and
    phi the normal density. correct_count: number of right answers; first_trials, second_trials: n1, n2, trials of each
    direction, above 0."""
    share_correct = (correct_count + 0.5) / (first_trials + second_trials + 1.0)
    z_variance = share_correct * (1.0 - share_correct) / NormalDist().pdf(NormalDist().inv_cdf(share_correct)) ** 2
    return z_variance * (1.0 / first_trials + 1.0 / second_trials) / 4.0


def _compute_corrected_z(answers: Sequence[bool]) -> float:
    """Compute z of the rate of True with the log-linear correction: 0.5 is added to the counts of True and of False, so
    that z is finite for rates of 0 and 1."""
    return NormalDist().inv_cdf((sum(answers) + 0.5) / (len(answers) + 1.0))
