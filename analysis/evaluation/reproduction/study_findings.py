"""Findings on the published figure 2: thresholds of direction discrimination by frequency, from simulated participants.

Group means are compared pairwise with simultaneous p-values (Tukey-Kramer, `PairDifference`). Thresholds are force
amplitudes in N, and those that the cap cut are censored. The limit of direction perception follows `LIMIT_RULE`.
"""

from dataclasses import dataclass
from statistics import mean

from analysis.evaluation.reproduction.document import FigureFindings, Finding
from analysis.psychophysics.comparisons import PairDifference
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.psychophysics.threshold_table import format_frequency
from analysis.wording import format_signed

SIGNIFICANT_P = 0.05
MAX_MEAN_DIFFERENCE = 0.25
"""Difference of two means, as a share of the larger mean, below which they count as "fairly similar". Chosen."""

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


@dataclass(frozen=True, slots=True)
class _ThresholdSummary:
    """Means, pairwise comparisons and censored thresholds of a study, by frequency."""

    analysis: StudyAnalysis

    def compute_mean(self, frequency_hz: float) -> float | None:
        """Compute the group mean of the thresholds in N; None where no run was completed at this frequency."""
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
    """Find the limit of direction perception (Hz) by `LIMIT_RULE`; None where no tested frequency fulfils it. Raises
    ValueError where no frequency was tested."""
    summary = _ThresholdSummary(analysis)
    lowest_hz, *higher_hz = analysis.table.frequencies_hz
    for frequency_hz in higher_hz:
        pair = summary.find_pair(lowest_hz, frequency_hz)
        if pair is not None and pair.difference > 0 and pair.p < SIGNIFICANT_P and summary.count_censored(frequency_hz):
            return frequency_hz
    return None


def make_study_findings(analysis: StudyAnalysis) -> FigureFindings:
    """Make the findings on means, differences and censoring of the thresholds over frequency."""
    summary = _ThresholdSummary(analysis)
    tested_hz = analysis.table.frequencies_hz
    findings = [
        *(_make_mean_finding(summary, frequency_hz) for frequency_hz in tested_hz),
        _make_rise_finding(
            summary, 5.0, 15.0, "apparently up, not significant with ten participants", published_as_significant=False
        ),
        _make_rise_finding(summary, 15.0, 25.0, "apparently up, not significant", published_as_significant=False),
        _make_rise_finding(summary, 5.0, 35.0, "significantly up at 35 Hz (p < 0.05)", published_as_significant=True),
        _make_censoring_finding(summary, analysis),
        _make_similarity_finding(summary),
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


def _make_mean_finding(summary: _ThresholdSummary, frequency_hz: float) -> Finding:
    """Make the finding on the mean threshold (N) at one frequency, without a comparison: the paper prints no number."""
    mean_threshold_n, censored_count = summary.compute_mean(frequency_hz), summary.count_censored(frequency_hz)
    censored_text = (
        f", {censored_count} of {len(summary.analysis.table.subjects)} thresholds cut by the cap"
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


def _make_rise_finding(
    summary: _ThresholdSummary, low_hz: float, high_hz: float, published: str, published_as_significant: bool
) -> Finding | None:
    """Make the finding on the rise of the mean between two frequencies: as published where it rises and its
    significance at `SIGNIFICANT_P` is the published one. None where a mean or the comparison is missing."""
    pair, low_mean_n, high_mean_n = (
        summary.find_pair(low_hz, high_hz),
        summary.compute_mean(low_hz),
        summary.compute_mean(high_hz),
    )
    if pair is None or low_mean_n is None or high_mean_n is None:
        return None
    is_rising = pair.difference > 0
    rule = f"up, and {'significant' if published_as_significant else 'not significant'} at 5 %, in all pairs at once"
    return Finding(
        what=f"From {low_hz:g} to {high_hz:g} Hz",
        published=published,
        here=f"{format_signed(pair.difference)} N, p {_format_p(pair.p)} (all pairs at once)",
        value=pair.difference,
        unit="N",
        as_published=is_rising and (pair.p < SIGNIFICANT_P) == published_as_significant,
        rule=rule,
    )


def _make_censoring_finding(summary: _ThresholdSummary, analysis: StudyAnalysis) -> Finding | None:
    """Make the finding on censoring at 35 Hz: as published where the cap censors some thresholds, but not all. None
    where 35 Hz was not tested."""
    if 35.0 not in analysis.table.frequencies_hz:
        return None
    censored_count, participant_count = summary.count_censored(35.0), len(analysis.table.subjects)
    return Finding(
        what="Cut by the cap at 35 Hz",
        published="several participants, while others converge",
        here=f"{censored_count} of {participant_count}",
        value=float(censored_count),
        unit="1",
        as_published=0 < censored_count < participant_count,
        rule="some, but not all",
    )


def _make_similarity_finding(summary: _ThresholdSummary) -> Finding | None:
    """Make the finding on the means at 35 and 45 Hz: as published where they differ by less than `MAX_MEAN_DIFFERENCE`.
    None where a mean is missing."""
    mean_35_hz_n, mean_45_hz_n = summary.compute_mean(35.0), summary.compute_mean(45.0)
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
    """Format a p-value as "= 0.012", with three decimals, or as "< 0.001"."""
    return "< 0.001" if p < 0.001 else f"= {p:.3f}"
