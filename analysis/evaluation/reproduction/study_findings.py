"""Findings on the published figure 2: thresholds of direction discrimination by frequency, from simulated participants.

Group means are compared pairwise with simultaneous p-values (Tukey-Kramer, `PairDifference`). Thresholds are force
amplitudes in N, and those at the cap are censored. The limit of direction perception follows `LIMIT_RULE`. Called by
`write_reproduction`.
"""

from dataclasses import dataclass
from statistics import mean

from analysis.evaluation.reproduction.document import FigureFindings, Finding
from analysis.psychophysics.comparisons import PairDifference
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.psychophysics.threshold_table import format_frequency
from analysis.wording import format_signed

SIGNIFICANT_P = 0.05
"""Level of significance of the published analysis."""
MAX_MEAN_DIFFERENCE = 0.25
"""Largest difference of two means, as a share of the larger mean, that counts as "fairly similar". Chosen by
hand."""

LIMIT_RULE = (
    "the lowest tested frequency at which the group mean lies significantly above that of the lowest frequency and at "
    "least one threshold is cut by the cap"
)
"""Rule of `find_direction_limit`, in words for the report."""

_DIFFERENCES = (
    "No person took part: the participants are simulated, and how their thresholds rise with frequency was set "
    "beforehand so that a study of ten resembles the published one in its main lines. That it does is no evidence "
    "about people; this is a test of the procedure, the analysis and the figure.",
    "The paper prints no threshold as a number, so levels are not compared, only the statements of its text about "
    "them.",
    "As in the paper, thresholds that the cap cut off enter means as plain numbers, and means near the cap are too "
    "low.",
)
"""Differences from the publication, for the report."""


@dataclass(frozen=True, slots=True)
class _Means:
    """Access to the study's means, comparisons and censored thresholds by frequency."""

    analysis: StudyAnalysis

    def compute_mean(self, frequency_hz: float) -> float | None:
        """Compute the group mean of the thresholds in N; None where no run was completed."""
        thresholds_n = [
            threshold_n
            for threshold_n in self.analysis.table.group_by_frequency().get(format_frequency(frequency_hz), ())
            if threshold_n
        ]
        return mean(thresholds_n) if thresholds_n else None

    def find_pair(self, first_hz: float, second_hz: float) -> PairDifference | None:
        """Find the difference of the means at two frequencies, second minus first; None where they were not
        compared."""
        names = (format_frequency(first_hz), format_frequency(second_hz))
        return next((pair for pair in self.analysis.comparisons.pairs if (pair.first, pair.second) == names), None)

    def count_censored(self, frequency_hz: float) -> int:
        """Count the thresholds that the cap censored at this frequency."""
        table = self.analysis.table
        if frequency_hz not in table.frequencies_hz:
            return 0
        column = table.frequencies_hz.index(frequency_hz)
        return sum(row[column] for row in table.censored)


def find_direction_limit(analysis: StudyAnalysis) -> float | None:
    """Find the limit of direction perception (Hz) by `LIMIT_RULE`; None where no tested frequency fulfils it."""
    means = _Means(analysis)
    lowest_hz, *higher_hz = analysis.table.frequencies_hz
    for frequency_hz in higher_hz:
        pair = means.find_pair(lowest_hz, frequency_hz)
        if pair is not None and pair.difference > 0 and pair.p < SIGNIFICANT_P and means.count_censored(frequency_hz):
            return frequency_hz
    return None


def make_study_findings(analysis: StudyAnalysis) -> FigureFindings:
    """Make the findings on the published figure 2: means, differences and censoring of the thresholds over
    frequency."""
    means = _Means(analysis)
    tested_hz = analysis.table.frequencies_hz
    findings = [
        *(_find_mean_threshold(means, frequency_hz) for frequency_hz in tested_hz),
        _find_rise(means, 5.0, 15.0, "apparently up, not significant with ten participants", significant=False),
        _find_rise(means, 15.0, 25.0, "apparently up, not significant", significant=False),
        _find_rise(means, 5.0, 35.0, "significantly up at 35 Hz (p < 0.05)", significant=True),
        _find_censoring(means, analysis),
        _find_similarity(means),
    ]
    return FigureFindings(
        figure=2,
        title="Thresholds for discriminating two directions",
        source="Figure 2 and section III A",
        published="Ten participants, five frequencies, a staircase each. The paper sees performance fall from 5 to "
        "15 Hz and again to 25 Hz, without significance, a significantly higher mean and a wide spread at 35 Hz, where "
        "some participants end at the cap of 3 N, and much the same at 45 Hz. It takes 35 Hz as a cautious limit of "
        "direction.",
        findings=tuple(finding for finding in findings if finding is not None),
        differs=_DIFFERENCES,
        remarks=analysis.warnings,
    )


def _find_mean_threshold(means: _Means, frequency_hz: float) -> Finding:
    """Find the mean threshold (N) at one frequency, compared with nothing, because the paper prints no number."""
    mean_threshold_n, censored_count = means.compute_mean(frequency_hz), means.count_censored(frequency_hz)
    censored_text = (
        f", {censored_count} of {len(means.analysis.table.subjects)} thresholds cut by the cap"
        if censored_count
        else ""
    )
    return Finding(
        what=f"Mean threshold at {frequency_hz:g} Hz",
        published="",
        here="no completed run" if mean_threshold_n is None else f"{mean_threshold_n:.2f} N{censored_text}",
        value=mean_threshold_n,
        unit="N",
        as_published=None,
    )


def _find_rise(means: _Means, low_hz: float, high_hz: float, published: str, significant: bool) -> Finding | None:
    """Find whether the mean rises between two frequencies, with the published significance at
    `SIGNIFICANT_P`; None where means or comparison are missing."""
    pair, low_mean_n, high_mean_n = (
        means.find_pair(low_hz, high_hz),
        means.compute_mean(low_hz),
        means.compute_mean(high_hz),
    )
    if pair is None or low_mean_n is None or high_mean_n is None:
        return None
    is_rising = pair.difference > 0
    rule = f"up, and {'significant' if significant else 'not significant'} at 5 %, in all pairs at once"
    return Finding(
        what=f"From {low_hz:g} to {high_hz:g} Hz",
        published=published,
        here=f"{format_signed(pair.difference)} N, p {_format_p(pair.p)} (all pairs at once)",
        value=pair.difference,
        unit="N",
        as_published=is_rising and (pair.p < SIGNIFICANT_P) == significant,
        rule=rule,
    )


def _find_censoring(means: _Means, analysis: StudyAnalysis) -> Finding | None:
    """Find whether the cap censors some thresholds at 35 Hz, but not all; None where 35 Hz was not tested."""
    if 35.0 not in analysis.table.frequencies_hz:
        return None
    censored_count, participant_count = means.count_censored(35.0), len(analysis.table.subjects)
    return Finding(
        what="Cut by the cap at 35 Hz",
        published="several participants, while others converge",
        here=f"{censored_count} of {participant_count}",
        value=float(censored_count),
        unit="1",
        as_published=0 < censored_count < participant_count,
        rule="some, but not all",
    )


def _find_similarity(means: _Means) -> Finding | None:
    """Find whether the means at 35 and 45 Hz are fairly similar (`MAX_MEAN_DIFFERENCE`); None where one is missing."""
    mean_35_hz_n, mean_45_hz_n = means.compute_mean(35.0), means.compute_mean(45.0)
    if mean_35_hz_n is None or mean_45_hz_n is None:
        return None
    relative_difference = abs(mean_35_hz_n - mean_45_hz_n) / max(mean_35_hz_n, mean_45_hz_n)
    return Finding(
        what="35 and 45 Hz",
        published="fairly similar",
        here=f"the means differ by {100 * relative_difference:.0f} % of the larger",
        value=relative_difference,
        unit="1",
        as_published=relative_difference < MAX_MEAN_DIFFERENCE,
        rule=f"less than {MAX_MEAN_DIFFERENCE:.0%} apart",
    )


def _format_p(p: float) -> str:
    """Format a p-value with three decimals, or "< 0.001"."""
    return "< 0.001" if p < 0.001 else f"= {p:.3f}"
