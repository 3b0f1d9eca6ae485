"""Comparison of the published and the primary analysis as text for reports.

The published analysis is a one-way analysis of variance of the thresholds of runs with Tukey's comparisons; the primary
analysis is the hierarchical model of all answers. The text states which analysis the protocol declared, where estimates
differ by 1 dB or more, where significance at the 5 % level differs, and the measured coverage near the cap.
"""

from collections.abc import Sequence

from analysis.psychophysics.comparisons import Comparisons
from analysis.psychophysics.coverage.coverage_words import describe_coverage
from analysis.psychophysics.coverage.measured_coverage import MEASURED_COVERAGES
from analysis.psychophysics.group_contrasts import Contrast
from analysis.psychophysics.hierarchy.primary import PrimaryAnalysis
from analysis.psychophysics.threshold_table import ThresholdTable, format_frequency
from analysis.threshold_words import select_threshold_words
from analysis.wording import capitalise, conjoin, format_p_text, format_signed
from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.staircase_rule import StaircaseRule, StepPhase

NOTABLE_DIFFERENCE_DB = 1.0
"""Least difference (dB) between the two analyses that is reported: the small step of the published staircase."""
SIMULATED_RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)
"""The published staircase: starts at 1 N, cap 3 N, down after three right answers and up after a wrong one, steps of 4
dB and then 1 dB. `measured_coverage` was simulated with it, so its counts hold for no other rule."""
NOTHING_DECLARED_NOTE = (
    "The protocol declares no primary analysis, contrast, sample size or exclusions; the hierarchical model is given "
    "first because the cap distorts it least; a choice made after the data were seen is not a "
    "declaration."
)
NEAR_CAP_WARNING = (
    "Near the cap the published intervals do not have their stated coverage, and the published 'not significant' is "
    "weak evidence."
)


_ANALYSIS_NOUNS = {
    "hierarchical": "the hierarchical model of all answers",
    "published": "the published one-way analysis",
}
"""Name of each analysis that a protocol can declare as primary."""
_INTERVAL_DESCRIPTIONS = {
    "hierarchical": "95 %, over people's pseudo-thresholds in dB, paired, t with n − 1 "
    "degrees of freedom; a single test, so uncorrected.",
    "published": "95 %, Tukey's of means of runs in newtons, which holds for all pairs together.",
}
"""Description of the interval of each such analysis."""


def describe_declaration(declared: AnalysisSettings) -> str:
    """Describe what the protocol declares before the data (analysis, contrast, sample size, exclusions), and what it
    does not declare."""
    if declared == AnalysisSettings():
        return NOTHING_DECLARED_NOTE
    if declared.primary == "undeclared":
        primary_sentences = (
            "The protocol declares no primary analysis. The hierarchical model is given first because the "
            "cap distorts it least; a choice made after the data were seen is not a declaration."
        )
    else:
        interval_label = (
            "Its interval" if declared.interval == "undeclared" else f"Declared interval ({declared.interval})"
        )
        primary_sentences = (
            f"Declared as primary in the protocol: {_ANALYSIS_NOUNS[declared.primary]}. "
            f"{interval_label} of the contrast: {_INTERVAL_DESCRIPTIONS[declared.primary]}"
        )
    first_hz, second_hz = declared.contrast_hz or (0.0, 0.0)
    declared_sentences = [
        f"Primary contrast: {first_hz:g} Hz minus {second_hz:g} Hz." if declared.contrast_hz else "",
        f"Planned participants: {declared.participants}." if declared.participants else "",
        f"Exclusions: {' '.join(declared.exclusions)}" if declared.exclusions else "",
    ]
    part_names = ("primary contrast", "sample size", "exclusions")
    undeclared_parts = [
        part_name for part_name, sentence in zip(part_names, declared_sentences, strict=True) if not sentence
    ]
    if declared.primary == "undeclared":
        undeclared_parts.insert(0, "interval method")
    return " ".join(
        filter(
            None,
            [
                primary_sentences,
                *declared_sentences,
                f"Not declared: {conjoin(undeclared_parts)}." if undeclared_parts else "",
            ],
        )
    )


def describe_comparison(
    primary: PrimaryAnalysis | None,
    mean_contrasts: Sequence[Contrast],
    comparisons: Comparisons,
    table: ThresholdTable,
    rule: StaircaseRule,
) -> str:
    """Describe the differences between the published and the primary analysis. primary: None without a fit.
    mean_contrasts: contrasts of the thresholds of runs in dB (reversal means; Psi: posterior means), against the same
    frequency as those of the primary analysis. rule: the staircase of the study."""
    if primary is None:
        return (
            "The hierarchical model needs answers of two participants, at two frequencies; these data have fewer, so "
            "only the published analysis is given."
        )
    missing_frequencies = [f"{frequency_hz:g} Hz" for frequency_hz in primary.missing_hz]
    missing_text = (
        f"The model leaves {conjoin(missing_frequencies)} out, where there is no answer yet."
        if missing_frequencies
        else ""
    )
    cap_sentences = (
        [NEAR_CAP_WARNING, *describe_measured_coverage(("means", "tukey", "one-way"), table, rule)]
        if table.censored_count
        else []
    )
    return " ".join(
        filter(
            None,
            [
                missing_text,
                _describe_differences(primary, mean_contrasts, rule),
                _describe_significance(primary, comparisons),
                *cap_sentences,
            ],
        )
    )


def describe_measured_coverage(analyses: Sequence[str], table: ThresholdTable, rule: StaircaseRule) -> tuple[str, ...]:
    """Describe the measured coverage of the intervals of these analyses (keys of `coverage_words.INTERVAL_TITLES`).
    Empty where neither the cap nor the trial limit affected a threshold, and for a rule other than `SIMULATED_RULE`."""
    if not table.coverage_warning or rule != SIMULATED_RULE:
        return ()
    return tuple(filter(None, (describe_coverage(MEASURED_COVERAGES, analysis) for analysis in analyses)))


def _describe_differences(primary: PrimaryAnalysis, mean_contrasts: Sequence[Contrast], rule: StaircaseRule) -> str:
    """Describe the frequencies at which the differences in dB by the model and by the thresholds of runs differ by at
    least `NOTABLE_DIFFERENCE_DB`, that there are none, or that either gives no difference to compare."""
    means_noun = select_threshold_words(rule).noun
    means_by_frequency = {contrast.frequency_hz: contrast for contrast in mean_contrasts}
    reference = f"{primary.frequencies_hz[0]:g} Hz"
    pairs = [(contrast, means_by_frequency.get(contrast.frequency_hz)) for contrast in primary.contrasts]
    if not pairs:
        return f"The model gives no difference to {reference}."
    if not any(means_contrast for _, means_contrast in pairs):
        return (
            f"{capitalise(means_noun)} give no difference to {reference} yet that could be compared with the model's."
        )
    differing_texts = [
        f"at {contrast.frequency_hz:g} Hz {format_signed(contrast.difference_db, 1)} dB compared with "
        f"{format_signed(means_contrast.difference_db, 1)} dB"
        for contrast, means_contrast in pairs
        if means_contrast is not None
        and abs(contrast.difference_db - means_contrast.difference_db) >= NOTABLE_DIFFERENCE_DB
    ]
    if differing_texts:
        return f"Differences to {reference} by the model and by {means_noun} differ: {conjoin(differing_texts)}."
    return f"Differences to {reference} by the model and by {means_noun} agree within {NOTABLE_DIFFERENCE_DB:g} dB."


def _describe_significance(primary: PrimaryAnalysis, comparisons: Comparisons) -> str:
    """Describe the frequencies at which only one analysis finds a difference at the 5 % level, or that there are none;
    empty where the analyses have no pair in common."""
    reference_name = format_frequency(primary.frequencies_hz[0])
    tukey_p_values = {pair.second: pair.p for pair in comparisons.pairs if pair.first == reference_name}
    disagreeing_texts = [
        f"{contrast.frequency_hz:g} Hz (Holm {format_p_text(contrast.p_holm)}, Tukey {format_p_text(tukey_p)})"
        for contrast in primary.contrasts
        if (tukey_p := tukey_p_values.get(format_frequency(contrast.frequency_hz))) is not None
        and (tukey_p < 0.05) != (contrast.p_holm < 0.05)
    ]
    if not any(format_frequency(contrast.frequency_hz) in tukey_p_values for contrast in primary.contrasts):
        return ""
    if not disagreeing_texts:
        return f"Both agree which frequencies differ from {reference_name} at the 5 % level."
    return f"At the 5 % level they disagree whether these differ from {reference_name}: {conjoin(disagreeing_texts)}."
