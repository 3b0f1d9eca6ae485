"""Report section on faults injected into real recordings: how often the diagnosis named them.

A known fault of mechanism, actuator or sensor is added to one of two stretches of a real recording; the diagnosis gets
both stretches and the model. The section has the rates of right answers with 95 % intervals, tallies by kind of fault
and by recording, and every miss. `analysis.evaluation.blind_test.injected` judges the answers.
"""

from collections.abc import Sequence

from analysis.evaluation.blind_test.confidence_intervals import Figure
from analysis.evaluation.blind_test.injected import (
    ANSWER_CLASSES,
    DETECTABLE,
    InjectedOutcome,
    Tally,
    make_tallies,
    score_injections,
)
from analysis.reports.page import Section, Table


def make_injected_section(outcomes: Sequence[InjectedOutcome]) -> Section:
    """Section with rates of right answers, tallies by kind and by recording, and all misses; without empty tables."""
    rates = Table(
        "How often it was right",
        ("what", "rate, 95 % interval"),
        tuple((injected_figure.name, figure_text(injected_figure)) for injected_figure in score_injections(outcomes)),
    )
    by_kind = _tally_table("Detectable faults by kind", "injected", make_tallies(outcomes, kind_of))
    by_recording = _tally_table(
        "Detectable faults by recording", "recording", make_tallies(outcomes, lambda outcome: outcome.recording)
    )
    missed = [
        outcome for outcome in outcomes if not outcome.right and (outcome.detectable or outcome.answer_class == "wrong")
    ]
    miss_table = Table(
        "Every miss, and every wrong fault named",
        ("recording", "injected", "error changes by", "judged", "named"),
        tuple(
            (
                miss.recording,
                miss.injected or "nothing",
                _change_text(miss.change),
                miss.answer_class,
                ", ".join(miss.named) or "-",
            )
            for miss in missed
        ),
    )
    return Section(
        "Faults injected into real recordings",
        paragraphs=(
            "Two stretches were cut from a recording. One was left unchanged and served as the clean recording; into "
            "the other a fault of mechanism, actuator or sensor, drawn and sealed beforehand, was injected, or none. "
            "The diagnosis was given the model of the real device, both stretches, and nothing else.",
            f"A fault is detectable where it changes the held-out error of a base model, fitted to the clean stretch "
            f"alone, by a factor of {DETECTABLE} or more, up or down.",
        ),
        tables=tuple(table for table in (rates, by_kind, by_recording, miss_table) if table.rows),
    )


def kind_of(injected_outcome: InjectedOutcome) -> str:
    """Kind of a case: name of the injected fault, "two at once" for two faults, or empty without a fault."""
    return "two at once" if len(injected_outcome.effects) > 1 else injected_outcome.injected


def _tally_table(title: str, heading: str, rows: Sequence[Tally]) -> Table:
    """Table of tallies, one row each. heading: heading of the first column."""
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
                row.name,
                str(row.fault_count),
                str(row.right.of),
                *map(str, row.counts),
                figure_text(row.right),
                figure_text(row.faultless),
            )
            for row in rows
        ),
    )


def _change_text(change: float | None) -> str:
    """Ratio of the held-out errors with and without the fault."""
    return "unknown" if change is None else f"{change:.2f}"


def figure_text(figure: Figure) -> str:
    """A share with its 95 % interval and number of cases: 88 % [69, 96] of 24; "none was drawn" without cases."""
    if figure.value is None or figure.low is None or figure.high is None:
        return "none was drawn"
    return f"{100 * figure.value:.0f} % [{100 * figure.low:.0f}, {100 * figure.high:.0f}] of {figure.of}"
