"""Report section on faults injected into real recordings: how often the diagnosis named them.

A known fault of mechanism, actuator or sensor, or none, is added to one of two stretches of a real recording; the
diagnosis gets both stretches and the model. `analysis.evaluation.blind_test.injected_faults` judges the answers.
"""

from collections.abc import Sequence

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate
from analysis.evaluation.blind_test.injected_faults import (
    ANSWER_CLASSES,
    LEAST_DETECTABLE_CHANGE,
    InjectedOutcome,
    Tally,
    make_tallies,
    score_injections,
)
from analysis.reports.page import Section, Table


def make_injected_section(outcomes: Sequence[InjectedOutcome]) -> Section:
    """Make the section with rates of right answers, tallies by kind and by recording, and all misses: wrong answers
    where the fault was detectable or a wrong fault was named. Tables without rows are left out."""
    rate_table = Table(
        "Rates of correct answers",
        ("rate", "value, 95 % interval"),
        tuple((rate.name, format_rate(rate)) for rate in score_injections(outcomes)),
    )
    kind_table = _make_tally_table("Detectable faults by kind", "injected", make_tallies(outcomes, classify_injection))
    recording_table = _make_tally_table(
        "Detectable faults by recording", "recording", make_tallies(outcomes, lambda outcome: outcome.recording)
    )
    missed_outcomes = [
        outcome
        for outcome in outcomes
        if not outcome.is_correct and (outcome.detectable or outcome.answer_class == "wrong")
    ]
    miss_table = Table(
        "Every miss, and every wrong fault named",
        ("recording", "injected", "error changes by", "judged", "named"),
        tuple(
            (
                missed_outcome.recording,
                missed_outcome.injected or "nothing",
                "unknown" if missed_outcome.change is None else f"{missed_outcome.change:.2f}",
                missed_outcome.answer_class,
                ", ".join(missed_outcome.named) or "-",
            )
            for missed_outcome in missed_outcomes
        ),
    )
    return Section(
        "Faults injected into real recordings",
        paragraphs=(
            "Two stretches were cut from a recording. One was left unchanged and served as the clean recording; into "
            "the other a fault of mechanism, actuator or sensor, drawn and sealed beforehand, was injected, or none. "
            "The diagnosis was given the model of the real device, both stretches, and nothing else.",
            f"A fault is detectable where it changes the held-out error of a base model, fitted to the clean stretch "
            f"alone, by a factor of {LEAST_DETECTABLE_CHANGE} or more, up or down.",
        ),
        tables=tuple(table for table in (rate_table, kind_table, recording_table, miss_table) if table.rows),
    )


def classify_injection(injected_outcome: InjectedOutcome) -> str:
    """Classify a case: name of the injected fault, "two at once" for more than one fault, or empty without a fault."""
    return "two at once" if len(injected_outcome.effects) > 1 else injected_outcome.injected


def _make_tally_table(title: str, heading: str, tallies: Sequence[Tally]) -> Table:
    """Make a table of tallies, one row each. heading: that of the first column."""
    header = (
        heading,
        "drawn",
        "detectable",
        *ANSWER_CLASSES[:-1],
        "named or in class",
        "nothing injected, nothing named",
    )
    return Table(
        title,
        header,
        tuple(
            (
                tally.name,
                str(tally.fault_count),
                str(tally.correct_share.of),
                *map(str, tally.counts),
                format_rate(tally.correct_share),
                format_rate(tally.faultless),
            )
            for tally in tallies
        ),
    )


def format_rate(rate: IntervalEstimate) -> str:
    """Format a share with its 95 % interval and number of cases: 88 % [69, 96] of 24; "none was drawn" without
    cases."""
    if rate.value is None or rate.low is None or rate.high is None:
        return "none was drawn"
    return f"{100 * rate.value:.0f} % [{100 * rate.low:.0f}, {100 * rate.high:.0f}] of {rate.of}"
