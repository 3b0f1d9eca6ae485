"""Tables of the report of a threshold study: thresholds, one-way ANOVA, Tukey-Kramer pairs, tests within participants
and runs.

This module only formats values as text; `analysis.psychophysics` computes them.
"""

from collections.abc import Callable

from analysis.psychophysics.bias import CRITERION_DEFINITION
from analysis.psychophysics.repeated_trials import VOID_LIMITS_TEXT
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.psychophysics.thresholds import RunEnd, Threshold
from analysis.psychophysics.two_analyses import describe_measured_coverage
from analysis.reports.page import Table
from analysis.threshold_words import select_threshold_words
from analysis.wording import (
    MISSING,
    choose_decimals,
    format_count,
    format_number,
    format_p,
    format_p_text,
    format_signed,
    mark_cut,
)


def make_threshold_table(analysis: StudyAnalysis) -> Table:
    """Make the table of thresholds (N), a row per participant and a column per frequency. Thresholds that are limited
    by the largest permitted level (cap) are marked as cut; "stopped" stands where the trial limit ended the run."""
    thresholds = analysis.table
    rows = [
        (
            subject,
            *(
                "stopped" if is_stopped else mark_cut(threshold_n, is_cut)
                for threshold_n, is_cut, is_stopped in zip(*cells, strict=True)
            ),
        )
        for subject, *cells in zip(
            thresholds.subjects, thresholds.values, thresholds.censored, thresholds.stopped, strict=True
        )
    ]
    return Table(
        caption="Individual thresholds (N)",
        header=("Participant", *(f"{frequency:g} Hz" for frequency in thresholds.frequencies_hz)),
        rows=tuple(rows),
        notes=(
            f"{select_threshold_words(analysis.protocol.staircase).cut_note} stopped: by the trial limit, without a "
            "threshold. –: no completed run.",
        ),
    )


def make_group_table(analysis: StudyAnalysis) -> Table:
    """Make the table of the frequencies: number, mean and standard deviation of the thresholds (N), comparison
    interval, and how many were cut by the cap or stopped by the trial limit; the mean is marked where any was cut, and
    where it lacks the stopped ones."""
    intervals = {interval.name: interval for interval in analysis.comparisons.intervals}
    cut_counts, stop_counts = (
        [sum(column) for column in zip(*cells, strict=True)]
        for cells in (analysis.table.censored, analysis.table.stopped)
    )
    rows, decimals = [], _choose_decimals(analysis)
    for group, cut_count, stop_count in zip(analysis.anova.groups, cut_counts, stop_counts, strict=True):
        interval = intervals.get(group.name)
        limit_texts = [format_number(limit, decimals) for limit in (interval.lower, interval.upper)] if interval else []
        stop_remark = " (without stopped)" if stop_count and group.n else ""
        rows.append(
            (
                group.name,
                str(group.n),
                f"{mark_cut(group.mean, bool(cut_count))}{stop_remark}",
                format_number(group.sd, decimals),
                " to ".join(limit_texts) or MISSING,
                str(cut_count),
                str(stop_count),
            )
        )
    confidence_text = f"{100 * analysis.comparisons.confidence:g} %"
    return Table(
        caption="Groups (N)",
        header=(
            "Frequency",
            "n",
            "Mean",
            "SD",
            f"{confidence_text} comparison interval{_format_coverage_suffix(analysis)}",
            "Cut",
            "Stopped",
        ),
        rows=tuple(rows),
        notes=(
            "Comparison intervals are for comparing means with each other; they are not confidence intervals.",
            *_list_coverage_notes(analysis),
        ),
    )


def _choose_decimals(analysis: StudyAnalysis) -> int:
    """Choose the number of decimals of spreads and differences between thresholds in N: that of the largest mean."""
    return choose_decimals(*(group.mean for group in analysis.anova.groups))


def _format_coverage_suffix(analysis: StudyAnalysis) -> str:
    """Format the suffix for the name of an interval or effect size that includes cut or stopped runs: its confidence
    does not hold; empty where no run was cut or stopped."""
    return ", without coverage" if analysis.table.coverage_warning else ""


def _list_coverage_notes(analysis: StudyAnalysis) -> tuple[str, ...]:
    """List the note on why confidence levels do not hold (`ThresholdTable.coverage_warning`); empty without cut or
    stopped runs."""
    return (analysis.table.coverage_warning,) if analysis.table.coverage_warning else ()


def make_one_way_table(analysis: StudyAnalysis) -> Table:
    """Make the table of the one-way ANOVA between frequencies; without rows, but with the reason in the notes, where F
    cannot be computed."""
    anova = analysis.anova
    rows: tuple[tuple[str, ...], ...] = ()
    effect_notes: tuple[str, ...] = ()
    if anova.f is not None and anova.ss_between is not None and anova.df_between:
        decimals = 2 * _choose_decimals(analysis) - 1  # of squares of forces, N²
        between_cells = (
            format_number(anova.ss_between, decimals),
            format_count(anova.df_between),
            format_number(anova.ss_between / anova.df_between, decimals),
        )
        within_cells = (
            format_number(anova.ss_within, decimals),
            format_count(anova.df_within),
            format_number(anova.mean_square_within, decimals),
        )
        rows = (
            ("Frequency", *between_cells, format_number(anova.f), format_p(anova.p)),
            ("Within", *within_cells, "", ""),
        )
        effect_notes = (
            f"Effect size{_format_coverage_suffix(analysis)}: η² = {format_number(anova.eta_squared)}, "
            f"ω² = {format_number(anova.omega_squared)}.",
        )
    return Table(
        caption="One-way analysis of variance, as published",
        header=("Source", "Sum of squares", "df", "Mean square", "F", "p"),
        rows=rows,
        notes=effect_notes
        + anova.notes
        + describe_measured_coverage(("one-way",), analysis.table, analysis.protocol.staircase),
    )


def make_pair_table(analysis: StudyAnalysis) -> Table:
    """Make the table of pairs of frequencies: difference of the means (second minus first, N), simultaneous interval
    and p value."""
    comparisons, decimals = analysis.comparisons, _choose_decimals(analysis)
    confidence_text = f"{100 * comparisons.confidence:g} %"
    return Table(
        caption="Pairs of frequencies (Tukey-Kramer)",
        header=("Pair", "Difference (N)", f"{confidence_text} interval{_format_coverage_suffix(analysis)}", "p"),
        rows=tuple(
            (
                f"{pair.second} − {pair.first}",
                format_signed(pair.difference, decimals),
                f"{format_signed(pair.lower, decimals)} to {format_signed(pair.upper, decimals)}",
                format_p(pair.p),
            )
            for pair in comparisons.pairs
        ),
        notes=(
            *comparisons.notes,
            *_list_coverage_notes(analysis),
            *describe_measured_coverage(("tukey",), analysis.table, analysis.protocol.staircase),
        ),
    )


def make_within_table(analysis: StudyAnalysis) -> Table:
    """Make the table of the repeated-measures tests that can be computed: ANOVA with Greenhouse-Geisser's and with
    Huynh-Feldt's correction (ε of 1 where that cannot be computed) and without one, and Friedman's test. The notes give
    effect sizes and Mauchly's test, and say why a test is missing."""
    anova, friedman = analysis.repeated_measures, analysis.friedman
    rows: list[tuple[str, ...]] = []
    notes = []
    if anova.epsilon is not None and anova.df_conditions is not None and anova.df_error is not None:
        f_text = f"F = {format_number(anova.f)}"
        corrected_df = f"{anova.epsilon * anova.df_conditions:.2f}, {anova.epsilon * anova.df_error:.2f}"
        rows.append(
            (f"Greenhouse-Geisser, ε = {format_number(anova.epsilon)}", corrected_df, f_text, format_p(anova.p))
        )
        huynh_epsilon = anova.epsilon_huynh_feldt or 1.0
        corrected_df = f"{huynh_epsilon * anova.df_conditions:.2f}, {huynh_epsilon * anova.df_error:.2f}"
        rows.append(
            (f"Huynh-Feldt, ε = {format_number(huynh_epsilon)}", corrected_df, f_text, format_p(anova.p_huynh_feldt))
        )
        rows.append(
            ("Without correction", f"{anova.df_conditions}, {anova.df_error}", f_text, format_p(anova.p_uncorrected))
        )
        notes.append(
            f"Effect size{_format_coverage_suffix(analysis)}: partial η² = {format_number(anova.partial_eta_squared)}, "
            f"generalized η² = {format_number(anova.generalized_eta_squared)}."
        )
    if anova.mauchly_w is not None:
        notes.append(f"Sphericity (Mauchly): W = {format_number(anova.mauchly_w)}, {format_p_text(anova.mauchly_p)}.")
    if friedman.p is not None:
        rows.append(
            (
                "Friedman (ranks)",
                format_count(friedman.df),
                f"χ² = {format_number(friedman.chi_squared)}",
                format_p(friedman.p),
            )
        )
        notes.append(f"Agreement of the rankings: Kendall's W = {format_number(friedman.kendall_w)}.")
    return Table(
        caption=f"Within participants ({anova.participants} without a gap)",
        header=("Test", "df", "Statistic", "p"),
        rows=tuple(rows),
        notes=(*notes, *anova.notes, *friedman.notes),
    )


REVERSALS_NOTE = "Reversals at the cap: of the averaged ones. Pushes: how often the rule required more than the cap."
"""Note below the table of runs, for staircases only."""


def make_run_table(analysis: StudyAnalysis) -> Table:
    """Make the table of all test runs, shown folded, with their trials, thresholds, d' and criterion. Only staircases
    have the columns of reversals and of steps that the rule required beyond the cap ("Pushes")."""
    has_reversals = not analysis.protocol.staircase.is_bayesian
    reversal_columns: tuple[tuple[str, Callable[[Threshold], str]], ...] = (
        ("Reversals", lambda row: str(row.reversals)),
        ("at cap", lambda row: str(row.cap_reversals)),
    )
    pushes: tuple[tuple[str, Callable[[Threshold], str]], ...] = (("Pushes", lambda row: str(row.pushes_against_cap)),)
    columns: tuple[tuple[str, Callable[[Threshold], str]], ...] = (
        ("Participant", lambda row: row.subject),
        ("Session", lambda row: row.session),
        ("Run", lambda row: str(row.run)),
        ("Hz", lambda row: f"{row.frequency_hz:g}"),
        ("N", lambda row: "stopped" if row.ended is RunEnd.TRIAL_LIMIT else mark_cut(row.threshold_n, row.censored)),
        ("dB re 1 N", lambda row: format_number(row.threshold_db)),
        ("m/s²", lambda row: format_number(row.threshold_mps2, choose_decimals(row.threshold_mps2, significant=1))),
        ("mm", lambda row: format_number(row.threshold_mm, choose_decimals(row.threshold_mm, least=3, significant=1))),
        *(reversal_columns if has_reversals else ()),
        ("Trials", lambda row: str(row.trials)),
        ("at cap", lambda row: str(row.trials_at_cap)),
        *(pushes if has_reversals else ()),
        ("Spoiled", lambda row: str(row.spoiled_trials)),
        ("At will", _format_repeats),
        ("% right", lambda row: format_number(row.percent_correct, 0)),
        ("d'", lambda row: format_number(row.d_prime)),
        ("Criterion", lambda row: format_number(row.criterion)),
    )
    return Table(
        caption="All runs",
        header=tuple(name for name, _ in columns),
        rows=tuple(tuple(format_cell(row) for _, format_cell in columns) for row in analysis.thresholds),
        notes=(
            *([REVERSALS_NOTE] if has_reversals else []),
            f"m/s² and mm: as measured in {select_threshold_words(analysis.protocol.staircase).measured_in}.",
            f"At will: presentations that the participant made void (asked for again, paused, left, answered outside "
            f"the time), with their share; ! {VOID_LIMITS_TEXT}.",
            f"Criterion: {CRITERION_DEFINITION}.",
        ),
        folded=True,
    )


def _format_repeats(row: Threshold) -> str:
    """Format number and percentage of the presentations that the participant made void, with "!" where they are
    frequent (`VOID_LIMITS_TEXT`)."""
    if not row.repeats_at_will:
        return "0"
    return f"{row.repeats_at_will} ({100 * row.repeat_rate:.1f} %){' !' * row.asked_often}"
