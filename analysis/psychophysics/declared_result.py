"""The declared (preregistered) result: contrast, sample and exclusions that the protocol fixed before data collection.

The contrast is the threshold at one frequency minus that at another, by two analyses: the hierarchical model of all
answers (dB, t interval over participants) and the published one-way analysis (N, Tukey's interval). The protocol may
state which is primary; both are reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from analysis.psychophysics.comparisons import Comparisons
from analysis.psychophysics.hierarchy.primary import FAR_ABOVE_NOTE, PrimaryAnalysis
from analysis.psychophysics.threshold_table import ThresholdTable, format_frequency
from analysis.threshold_words import select_threshold_words
from analysis.wording import capitalise, conjoin
from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.staircase_rule import StaircaseRule

NOT_CONVERGED_NOTE = "The fit did not converge: do not use these numbers."
TUKEY_NOTE = "{means} in newtons, one-way; Tukey's interval and p, which hold for all pairs together."
NO_MODEL_NOTE = "The model needs answers of two participants, at two frequencies."
NO_DIFFERENCE_NOTE = (
    "It needs two participants with enough answers at both frequencies, and differences that are not all equal."
)
NO_PAIR_NOTE = "It needs thresholds at both frequencies, and a spread within frequencies."
"""Sentences in `ContrastResult.notes`: the first two qualify a result, the other three state why there is none
(`NO_MODEL_NOTE`, `NO_DIFFERENCE_NOTE`: hierarchical model; `NO_PAIR_NOTE`: one-way analysis)."""


@dataclass(frozen=True, slots=True)
class ContrastResult:
    """The declared contrast by one of the analyses: threshold at the first frequency minus that at the second."""

    analysis: Literal["hierarchical", "published"]
    declared: bool
    """Whether this analysis is the declared primary one."""
    unit: Literal["dB", "N"]
    participants: tuple[int, int]
    """Number at the first and at the second frequency; for the hierarchical model the same number twice."""
    difference: float | None
    """In `unit`, as the interval. Difference, interval and p are None where the data do not determine them; `notes`
    state the reason."""
    lower: float | None
    upper: float | None
    p: float | None
    """Two-sided; with Tukey's interval adjusted for all pairs."""
    notes: tuple[str, ...]
    """Sentences that qualify the result, or state why there is none."""


@dataclass(frozen=True, slots=True)
class DeclaredResult:
    """The declared contrast by each analysis, and sample and exclusions, declared and actual."""

    primary: Literal["undeclared", "hierarchical", "published"]
    contrast_hz: tuple[float, ...]
    """The two frequencies of the contrast; empty where none is declared."""
    confidence: float
    """Confidence level of the intervals, 0 to 1."""
    results: tuple[ContrastResult, ...]
    """The declared analysis first, then the other (hierarchical first where none is declared); none without a declared
    contrast."""
    participants_declared: int
    """Declared sample size; 0: none declared."""
    participants_analysed: int
    """Number of participants in the analysis: those with a test run."""
    exclusions: tuple[str, ...]
    """Declared rules of exclusion, in sentences."""
    left_out: tuple[str, ...]
    """Data that were excluded, with the reason, in sentences."""
    interval: Literal["undeclared", "paired_t", "tukey"] = "undeclared"
    """Declared method of the interval; undeclared: the method that belongs to `primary`."""


def compute_declared_result(
    declared: AnalysisSettings,
    primary: PrimaryAnalysis | None,
    comparisons: Comparisons,
    table: ThresholdTable,
    left_out: Sequence[str],
    rule: StaircaseRule,
) -> DeclaredResult:
    """Compute the declared contrast by both analyses, the declared one first. primary: with the contrast of `declared`;
    None without a fit. table: thresholds in newtons, from which `comparisons` come. left_out: excluded data, in
    sentences. rule: staircase rule of the runs."""
    results = []
    if declared.contrast_hz:
        pair_hz = (declared.contrast_hz[0], declared.contrast_hz[1])
        results = [
            _make_model_contrast(pair_hz, primary, declared.primary == "hierarchical"),
            _make_published_contrast(
                pair_hz,
                comparisons,
                table,
                declared.primary == "published",
                TUKEY_NOTE.format(means=capitalise(select_threshold_words(rule).noun)),
            ),
        ]
        results.sort(key=lambda result: not result.declared)
    return DeclaredResult(
        primary=declared.primary,
        contrast_hz=declared.contrast_hz,
        confidence=comparisons.confidence,
        results=tuple(results),
        participants_declared=declared.participants,
        participants_analysed=len(table.subjects),
        exclusions=declared.exclusions,
        left_out=tuple(left_out),
        interval=declared.interval,
    )


def _make_model_contrast(
    pair_hz: tuple[float, float], primary: PrimaryAnalysis | None, is_declared: bool
) -> ContrastResult:
    """Make the contrast by the hierarchical model, in dB; without values, but with the reason, where the model does not
    give it."""
    contrast = primary.declared_contrast if primary is not None else None
    if primary is None or contrast is None:
        participant_count, reason = (
            (0, NO_MODEL_NOTE)
            if primary is None
            else (len(primary.persons), _explain_missing_contrast(pair_hz, primary))
        )
        return ContrastResult(
            "hierarchical", is_declared, "dB", (participant_count, participant_count), None, None, None, None, (reason,)
        )
    return ContrastResult(
        analysis="hierarchical",
        declared=is_declared,
        unit="dB",
        participants=(contrast.participants, contrast.participants),
        difference=contrast.difference_db,
        lower=contrast.lower_db,
        upper=contrast.upper_db,
        p=contrast.p,
        notes=(*_describe_cap_effects(pair_hz, primary), *(() if primary.converged else (NOT_CONVERGED_NOTE,))),
    )


def _explain_missing_contrast(pair_hz: tuple[float, float], primary: PrimaryAnalysis) -> str:
    """Explain in a sentence why the fitted model gives no contrast of this pair."""
    if set(pair_hz) <= set(primary.far_above_hz):
        return FAR_ABOVE_NOTE
    missing_frequencies = [f"{frequency_hz:g} Hz" for frequency_hz in pair_hz if frequency_hz in primary.missing_hz]
    return f"There is no answer at {conjoin(missing_frequencies)} yet." if missing_frequencies else NO_DIFFERENCE_NOTE


def _describe_cap_effects(pair_hz: tuple[float, float], primary: PrimaryAnalysis) -> tuple[str, ...]:
    """Describe the limits of a contrast's interval where a median lies above the cap. Such a median is known only to be
    high, so the difference, first minus second, has a valid lower end for the first and a valid upper end for the
    second."""
    above_cap_hz = [
        median.frequency_hz for median in primary.medians if median.above_cap and median.frequency_hz in pair_hz
    ]
    if len(above_cap_hz) == 2:
        return ("Both medians are above the cap: the size of their difference is not known.",)
    valid_end = {pair_hz[0]: "lower", pair_hz[1]: "upper"}
    return tuple(
        f"The median at {frequency_hz:g} Hz is above the cap: the interval holds at its {valid_end[frequency_hz]} end."
        for frequency_hz in above_cap_hz
    )


def _make_published_contrast(
    pair_hz: tuple[float, float], comparisons: Comparisons, table: ThresholdTable, is_declared: bool, method_note: str
) -> ContrastResult:
    """Make the contrast by the one-way analysis, in newtons, with Tukey's interval. method_note: the first of its
    notes. Without values, and with the reason as the only note, where the comparisons lack this pair."""
    first_name, second_name = (format_frequency(frequency_hz) for frequency_hz in pair_hz)
    groups = table.group_by_frequency()
    participant_counts = [
        sum(value is not None for value in groups.get(name, ())) for name in (first_name, second_name)
    ]
    participants = (participant_counts[0], participant_counts[1])
    notes = (method_note, *filter(None, [table.coverage_warning]))
    pair = next((pair for pair in comparisons.pairs if {pair.first, pair.second} == {first_name, second_name}), None)
    if pair is None:
        return ContrastResult("published", is_declared, "N", participants, None, None, None, None, (NO_PAIR_NOTE,))
    # A pair is stored as its second group minus its first.
    limits = (pair.lower, pair.upper) if pair.second == first_name else (-pair.upper, -pair.lower)
    difference = pair.difference if pair.second == first_name else -pair.difference
    return ContrastResult("published", is_declared, "N", participants, difference, *limits, pair.p, notes)
