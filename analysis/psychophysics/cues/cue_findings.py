"""Test per frequency whether a cue other than the direction explains the answers, and word the warnings.

Two kinds of evidence: the d' that the cue alone would give a participant with a stated internal noise
(`cue_sensitivity`), and whether the answers depended on the cue among trials of the same direction
(`answers_on_delivery`), with Holm's correction over all cues and frequencies.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import NormalDist, fmean, median

from analysis.psychophysics.bias import estimate_response_bias
from analysis.psychophysics.cues.answers_on_delivery import AnswerRegression, regress_answers_on_delivery
from analysis.psychophysics.cues.cue_sensitivity import (
    INTERNAL_NOISE_DB,
    TYPICAL_NOISE_DB,
    CueSensitivity,
    estimate_cue_sensitivities,
)
from analysis.psychophysics.cues.delivered_cues import Cue, CueGap, DeliveredTrials, select_delivered_trials
from analysis.psychophysics.group_contrasts import apply_holm_correction
from analysis.wording import conjoin, format_number, format_p_text, format_signed
from protocols.trial import Trial

SIGNIFICANCE_LEVEL = 0.05
"""Significance level of the regressions of answers on a cue, after Holm's correction. The conventional 5 %."""


@dataclass(frozen=True, slots=True)
class CueFinding:
    """Findings on one cue at one frequency, over all participants. The names of the fields are keys of anova.json."""

    frequency_hz: float
    cue: Cue
    people: tuple[CueSensitivity, ...]
    """Sensitivities of the participants by this cue; at least one."""
    difference_db: float
    """Median of the participants' differences, the direction of side +1 minus the other (`DeliveredTrials.side`)."""
    largest_db: float
    """Difference of the participant with the largest magnitude of it, with its sign."""
    spread_db: float
    """Median of the participants' standard deviations within a direction."""
    abilities: tuple[float, ...]
    """Sensitivities d' that the cue alone would give: median over participants, for each internal noise of
    `INTERNAL_NOISE_DB`."""
    observed_d_prime: float | None
    """Mean over participants of the d' of their answers at this frequency, with any cues; None where no
    participant was shown both directions."""
    noticed_by: tuple[str, ...]
    """Participants for whom even the end of the difference's interval nearer to 0 gives a d' of 1 or more, with an
    internal noise of `TYPICAL_NOISE_DB`."""
    answers: AnswerRegression
    """Regression of the answers on the cue among trials of the same direction."""
    p_holm: float | None
    """p value of `answers` with Holm's correction over all cues and frequencies; None where no test was possible."""

    @property
    def affects_answers(self) -> bool:
        """Whether the answers followed the cue: a significant regression at `SIGNIFICANCE_LEVEL` after the correction;
        False where no test was possible."""
        return self.p_holm is not None and self.p_holm < SIGNIFICANCE_LEVEL


def compute_cue_findings(trials: Iterable[Trial]) -> tuple[CueFinding, ...]:
    """Compute the findings by frequency and cue over the measured test trials; empty without any. A cue without the
    sensitivity of any participant is left out, but its test counts in the correction."""
    regressions = [
        (group, estimate_cue_sensitivities(group), regression)
        for group in select_delivered_trials(trials)
        for regression in regress_answers_on_delivery(group)
    ]
    p_values = [regression.p for _, _, regression in regressions if regression.p is not None]
    corrected_p_values = iter(apply_holm_correction(p_values))
    findings = []
    for group, sensitivities, regression in regressions:
        p_holm = next(corrected_p_values) if regression.p is not None else None
        if cue_sensitivities := tuple(
            sensitivity for sensitivity in sensitivities if sensitivity.cue is regression.cue
        ):
            findings.append(_make_finding(group, cue_sensitivities, regression, p_holm))
    return tuple(findings)


def _make_finding(
    group: DeliveredTrials,
    sensitivities: tuple[CueSensitivity, ...],
    regression: AnswerRegression,
    p_holm: float | None,
) -> CueFinding:
    """Make the finding on the cue of `regression`. sensitivities: those of the participants by this cue, at least
    one."""
    return CueFinding(
        frequency_hz=group.frequency_hz,
        cue=regression.cue,
        people=sensitivities,
        difference_db=median([sensitivity.difference_db for sensitivity in sensitivities]),
        largest_db=max((sensitivity.difference_db for sensitivity in sensitivities), key=abs),
        spread_db=median([sensitivity.spread_db for sensitivity in sensitivities]),
        abilities=tuple(
            median([sensitivity.compute_d_prime(noise_db) for sensitivity in sensitivities])
            for noise_db in INTERNAL_NOISE_DB
        ),
        observed_d_prime=_average_d_prime(group),
        noticed_by=tuple(sensitivity.subject for sensitivity in sensitivities if sensitivity.is_noticeable),
        answers=regression,
        p_holm=p_holm,
    )


def _average_d_prime(group: DeliveredTrials) -> float | None:
    """Average the d' of the answers over the participants; None where no participant was shown both directions."""
    d_primes = []
    for person in range(len(group.subjects)):
        is_of_person = group.person == person
        directions = [1 if side > 0 else 2 for side in group.side[is_of_person]]
        bias = estimate_response_bias(
            directions, [bool(is_correct) for is_correct in (group.answer == group.side)[is_of_person]]
        )
        if bias is not None:
            d_primes.append(bias.d_prime)
    return fmean(d_primes) if d_primes else None


def make_cue_warnings(findings: Sequence[CueFinding], gaps: Sequence[CueGap] = ()) -> tuple[str, ...]:
    """Make the warnings for the interpretation of the thresholds, at most three; empty where no participant notices a
    cue, no answers follow one, and no measurement is missing. A gap is named only where some trials lack a measurement,
    not where all do, as in a study that measured no harmonics."""
    noticed_texts = [_describe_noticed_cue(finding) for finding in findings if finding.noticed_by]
    dependence_texts = [
        f"{finding.cue.value} at {finding.frequency_hz:g} Hz ({format_signed(finding.answers.slope or 0.0)} logits per "
        f"dB, Holm's {format_p_text(finding.p_holm)})"
        for finding in findings
        if finding.affects_answers
    ]
    sentences = []
    if noticed_texts:
        sentences.append(
            f"The two directions differed in more than their direction, by what a participant with an internal "
            f"noise of {TYPICAL_NOISE_DB:g} dB notices: {conjoin(noticed_texts)}. So those answers need not be "
            "about the direction."
        )
    if dependence_texts:
        sentences.append(
            f"Within a direction, answers followed what was delivered, so direction was not the only cue: "
            f"{conjoin(dependence_texts)}."
        )
    if gap_sentence := describe_cue_gaps([gap for gap in gaps if gap.missing < gap.trials]):
        sentences.append(gap_sentence)
    return tuple(sentences)


def describe_cue_gaps(gaps: Sequence[CueGap]) -> str:
    """Describe trials without a measurement of a cue in sentences; empty without gaps."""
    if not gaps:
        return ""
    gap_texts = [
        f"{gap.cue.value} at {gap.frequency_hz:g} Hz in "
        + ("any trial" if gap.missing == gap.trials else f"{gap.missing} of {gap.trials} trials")
        for gap in gaps
    ]
    return (
        f"Whether direction was the cue is judged by the trials measured for it. Not measured: {conjoin(gap_texts)}. "
        "All other analyses include these trials, too."
    )


def _describe_noticed_cue(finding: CueFinding) -> str:
    """Describe a noticed cue in a phrase, with its difference, the number of participants who notice it, and the
    percentage 100 Phi(d' / 2) of correct answers by this cue alone (Phi: standard normal distribution)."""
    d_prime = finding.abilities[INTERNAL_NOISE_DB.index(TYPICAL_NOISE_DB)]
    percent_correct = 100.0 * NormalDist().cdf(d_prime / 2.0)
    return (
        f"{finding.cue.value} at {finding.frequency_hz:g} Hz ({format_signed(finding.difference_db, 1)} dB at the "
        f"median, {len(finding.noticed_by)} of {len(finding.people)} participants; alone d' "
        f"{format_number(d_prime, 1)}, {percent_correct:.0f} % right; the answers' d' "
        f"{format_number(finding.observed_d_prime, 1)})"
    )
