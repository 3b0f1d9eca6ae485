"""Complete analysis of a study's trials: thresholds, statistics and warnings.

The published analysis (one-way ANOVA of the thresholds of runs between groups, with Tukey-Kramer comparisons; R. P.
Wilson, S. Chan, J. K. Salisbury, G. Niemeyer, "Multi-DOF Equalization of Haptic Devices for Accurate Rendering at High
Frequencies") is reproduced and compared with analyses that fit the design: repeated measures, Friedman's test, and, as
primary analysis, a hierarchical model of all answers. Equations and sources are in the modules that are called here.
Begin at `analyse_study`."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from analysis.psychophysics.anova import OneWayAnova, compute_one_way_anova
from analysis.psychophysics.catch_trials import CatchTally, tally_catch_trials
from analysis.psychophysics.comparisons import Comparisons, compare_group_means
from analysis.psychophysics.cues.cue_findings import CueFinding, compute_cue_findings, make_cue_warnings
from analysis.psychophysics.cues.delivered_cues import CueGap, find_cue_gaps
from analysis.psychophysics.declared_result import DeclaredResult, compute_declared_result
from analysis.psychophysics.detection import compute_detection_thresholds
from analysis.psychophysics.equalized_delivery import compute_deliveries, make_delivery_warning
from analysis.psychophysics.group_contrasts import Contrast, compute_contrasts
from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.hierarchy.primary import CONFIDENCE, PrimaryAnalysis, compute_primary_analysis
from analysis.psychophysics.hierarchy.single_persons import SinglePersons, fit_single_persons
from analysis.psychophysics.population import Population, split_by_population
from analysis.psychophysics.repeated_measures import (
    FriedmanTest,
    RepeatedMeasures,
    analyse_repeated_measures,
    compute_friedman_test,
)
from analysis.psychophysics.repeated_trials import format_repeat_warning
from analysis.psychophysics.runs import InconsistentTrialsError, Run, recompute_runs
from analysis.psychophysics.study_warnings import list_catch_and_detection_warnings, list_study_warnings
from analysis.psychophysics.threshold_table import ThresholdTable, tabulate_thresholds
from analysis.psychophysics.thresholds import Threshold, compute_run_threshold
from analysis.psychophysics.tobit import compute_tobit_contrasts
from analysis.psychophysics.two_analyses import describe_comparison, describe_declaration
from analysis.wording import format_f_text, format_p_text
from equalizer.signals.summary import Summary, SummaryDisplay
from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.practice import PracticeState, count_right_of_last, is_practice_over, is_practice_passed
from protocols.trial import Phase, Trial


@dataclass(frozen=True, slots=True)
class PracticeRun:
    """A practice run: short, at a fixed or roved level, passed or not passed. Practice enters no other result."""

    subject: str
    session: str
    run: int
    frequency_hz: float
    trials: int
    """Number of answered trials that count."""
    right: int
    """Number of correct answers among them."""
    right_of_last: int
    """Correct answers among the last `practice.of_last` trials of the protocol, which the criterion covers."""
    passed: bool
    over: bool
    """Whether the run ended by its rule: passed, or its trials used up. False: it was broken off before."""


def evaluate_practice_runs(trials: Iterable[Trial], protocol: StudyProtocol) -> tuple[PracticeRun, ...]:
    """Evaluate the practice runs, in the order in which they first occur. Their trials have the phase TRAINING, and
    their run numbers follow those of the training staircases."""
    first_number = len(protocol.training.frequencies_hz)
    practice_numbers = range(first_number, first_number + len(protocol.practice.frequencies_hz))
    trials_by_run: dict[tuple[str, str, int], list[Trial]] = {}
    for trial in trials:
        if trial.phase is Phase.TRAINING and trial.run in practice_numbers:
            trials_by_run.setdefault((trial.subject, trial.session, trial.run), []).append(trial)
    return tuple(_evaluate_practice_run(rows, protocol) for rows in trials_by_run.values())


def _evaluate_practice_run(rows: list[Trial], protocol: StudyProtocol) -> PracticeRun:
    """Evaluate the practice run of these trials, at least one, of one subject, session and run number."""
    first_trial, settings = rows[0], protocol.practice
    valid_trials = sorted((trial for trial in rows if trial.is_valid), key=lambda trial: trial.trial)
    state = PracticeState(tuple(bool(trial.correct) for trial in valid_trials))
    return PracticeRun(
        subject=first_trial.subject,
        session=first_trial.session,
        run=first_trial.run,
        frequency_hz=first_trial.frequency_hz,
        trials=len(valid_trials),
        right=sum(state.correct),
        right_of_last=count_right_of_last(settings, state),
        passed=is_practice_passed(settings, state),
        over=is_practice_over(settings, state),
    )


@dataclass(frozen=True, repr=False, slots=True)
class StudyAnalysis(SummaryDisplay):
    """Thresholds and statistics of one study's trials, of one population."""

    protocol: StudyProtocol
    population: Population | None
    """None when there is no trial at all."""
    trials: tuple[Trial, ...]
    """Trials of the test phase."""
    runs: tuple[Run, ...]
    thresholds: tuple[Threshold, ...]
    """One per run, in the same order."""
    table: ThresholdTable
    anova: OneWayAnova
    comparisons: Comparisons
    repeated_measures: RepeatedMeasures
    friedman: FriedmanTest
    design_difference: str
    """Difference between the published one-way analysis and the analysis within participants, in words."""
    primary: PrimaryAnalysis | None
    """The hierarchical model of all answers; None with fewer than two participants or two frequencies with answers."""
    single_persons: SinglePersons | None
    """Each person's thresholds by maximum a posteriori; None where there is a hierarchical model, or no answer."""
    mean_contrasts: tuple[Contrast, ...]
    """Differences of runs' thresholds (dB) from the lowest frequency (of `primary`, if any), within participants."""
    tobit: tuple[Contrast, ...]
    """The same contrasts by a Tobit model (sensitivity analysis); empty where `compute_tobit_contrasts` gives none."""
    declaration: str
    """The analysis that the protocol declares before any data, in words."""
    declared_result: DeclaredResult
    comparison_text: str
    """Differences between the published and the primary analysis, in words."""
    warnings: tuple[str, ...]
    detection: tuple[Threshold, ...]
    """Detection thresholds, one per detection run."""
    detection_table: ThresholdTable
    catches: tuple[CatchTally, ...]
    practice: tuple[PracticeRun, ...]
    cues: tuple[CueFinding, ...]
    """Differences between the two directions in the delivered stimulus, and whether answers followed them."""
    cue_gaps: tuple[CueGap, ...]

    def summary(self) -> Summary:
        table = self.table
        return Summary(
            f"{len(table.subjects)} participants, {len(self.runs)} runs, {len(self.trials)} trials",
            (
                *((name, _format_mean(values)) for name, values in table.group_by_frequency().items()),
                *(("warning", warning) for warning in self.warnings),
            ),
        )


def _format_mean(thresholds_n: Sequence[float | None]) -> str:
    """Format mean (N) and number of the thresholds that are not None."""
    known_n = [threshold_n for threshold_n in thresholds_n if threshold_n is not None]
    return f"mean threshold {sum(known_n) / len(known_n):.3g} N of {len(known_n)}" if known_n else "no threshold"


def analyse_study(trials: Iterable[Trial], protocol: StudyProtocol, left_out: Sequence[str] = ()) -> StudyAnalysis:
    """Compute thresholds, statistics and warnings from trials of one population under one protocol.

    left_out: sessions and trials that are not among these, with the reason, in sentences; listed in `declared_result`.
    Raises InconsistentTrialsError (a ValueError) when the trials mix people, simulated participants and people who felt
    nothing (split them with `split_by_population` first), and where they contradict the protocol's staircase.
    """
    trials, rule = tuple(trials), protocol.staircase
    population, runs = _find_single_population(trials), recompute_runs(trials, rule, rove_db=protocol.stimulus.rove_db)
    thresholds = tuple(compute_run_threshold(run, rule) for run in runs)
    test_trials = tuple(trial for trial in trials if trial.phase is Phase.TEST)
    table = tabulate_thresholds(thresholds, protocol.stimulus.frequencies_hz)
    detection, catches = compute_detection_thresholds(trials, protocol), tally_catch_trials(trials)
    detection_table = tabulate_thresholds(detection, protocol.detection.frequencies_hz, is_detection=True)
    anova, repeated_measures = (
        compute_one_way_anova(table.group_by_frequency()), analyse_repeated_measures(table.subjects, table.values),
    )  # fmt: skip
    comparisons, (primary, single_persons) = compare_group_means(anova, CONFIDENCE), _fit_models(test_trials, protocol)
    (mean_contrasts, tobit), cues, cue_gaps = (
        _compute_mean_contrasts(thresholds, primary, protocol),
        compute_cue_findings(test_trials), find_cue_gaps(test_trials),
    )  # fmt: skip
    return StudyAnalysis(
        protocol=protocol, population=population, trials=test_trials, runs=runs, thresholds=thresholds, table=table,
        anova=anova, comparisons=comparisons, repeated_measures=repeated_measures,
        friedman=compute_friedman_test(table.values),
        design_difference=describe_design_difference(anova, repeated_measures),
        primary=primary,
        single_persons=single_persons, mean_contrasts=mean_contrasts, tobit=tobit,
        declaration=describe_declaration(protocol.analysis),
        declared_result=compute_declared_result(protocol.analysis, primary, comparisons, table, left_out, rule),
        comparison_text=describe_comparison(primary, mean_contrasts, comparisons, table, rule),
        warnings=(
            *list_study_warnings(test_trials, thresholds, table, protocol),
            *filter(None, [format_repeat_warning(trials), make_delivery_warning(compute_deliveries(test_trials)),
                           *make_cue_warnings(cues, cue_gaps)]),
            *list_catch_and_detection_warnings(catches, detection, table, detection_table),
        ),
        detection=detection, detection_table=detection_table, catches=catches,
        practice=evaluate_practice_runs(trials, protocol), cues=cues, cue_gaps=cue_gaps,
    )  # fmt: skip


def _find_single_population(trials: Sequence[Trial]) -> Population | None:
    """Find the population of all trials; None without any. Raises InconsistentTrialsError for several."""
    by_population = split_by_population(trials)
    if len(by_population) > 1:
        raise InconsistentTrialsError(
            f"trials of {' and '.join(kind.value for kind in by_population)} cannot enter one analysis; analyse each "
            "kind separately"
        )
    return next(iter(by_population), None)


def _fit_models(
    trials: Sequence[Trial], protocol: StudyProtocol
) -> tuple[PrimaryAnalysis | None, SinglePersons | None]:
    """Fit the hierarchical model or, where there are too few participants or frequencies for it, single persons. At
    most one of the two results is not None; both are None without answers."""
    answers, cap_n = count_answers(trials, protocol.stimulus.frequencies_hz), protocol.staircase.cap_n
    primary = compute_primary_analysis(answers, cap_n, declared_hz=protocol.analysis.contrast_hz)
    return primary, fit_single_persons(answers, cap_n) if primary is None and answers is not None else None


def _compute_mean_contrasts(
    thresholds: Sequence[Threshold], primary: PrimaryAnalysis | None, protocol: StudyProtocol
) -> tuple[tuple[Contrast, ...], tuple[Contrast, ...]]:
    """Compute the contrasts of runs' thresholds (dB) and of the Tobit model of them; both empty without runs. They use
    the frequencies of the primary model where it exists, so that all have the same reference frequency."""
    frequencies_hz = primary.frequencies_hz if primary is not None else protocol.stimulus.frequencies_hz
    table = tabulate_thresholds(thresholds, frequencies_hz, "threshold_db")
    if not table.subjects or not table.frequencies_hz:
        return (), ()
    values_db = np.array(table.values, dtype=np.float64)
    contrasts = compute_contrasts(table.frequencies_hz, values_db, CONFIDENCE)
    return contrasts, compute_tobit_contrasts(table.frequencies_hz, values_db, np.array(table.censored), CONFIDENCE)


def make_anova_document(analysis: StudyAnalysis) -> dict[str, Any]:
    """Convert the statistics to JSON values, format `hapteq-anova`, version 1. A number that the data do not determine
    is None; where the entry has notes, they give the reason."""
    return {
        "format": "hapteq-anova",
        "version": 1,
        "population": analysis.population.value if analysis.population else None,
        "unit": "N",
        "participants": list(analysis.table.subjects),
        "frequencies_hz": list(analysis.table.frequencies_hz),
        "cut_by_cap": analysis.table.censored_count,
        "lower_bounds": analysis.table.censored_count,  # older name of cut_by_cap, kept for programs that read it
        "stopped_by_trial_limit": sum(map(sum, analysis.table.stopped)),
        "coverage": analysis.table.coverage_warning or None,
        "one_way": asdict(analysis.anova),
        "comparisons": asdict(analysis.comparisons),
        "within_participants": asdict(analysis.repeated_measures),
        "friedman": asdict(analysis.friedman),
        "difference": analysis.design_difference,
        "primary": asdict(analysis.primary) if analysis.primary else None,
        "single_persons": asdict(analysis.single_persons) if analysis.single_persons else None,
        "mean_contrasts_db": [asdict(contrast) for contrast in analysis.mean_contrasts],
        "tobit_contrasts_db": [asdict(contrast) for contrast in analysis.tobit],
        "declared": asdict(analysis.protocol.analysis),
        "declared_result": _anonymise_declared_result(analysis.declared_result),
        "compared": analysis.comparison_text,
        "cues": [asdict(cue) for cue in analysis.cues],
        "cue_gaps": [asdict(gap) for gap in analysis.cue_gaps],
        "warnings": list(analysis.warnings),
    }


def _anonymise_declared_result(result: DeclaredResult) -> dict[str, Any]:
    """Convert the declared result to JSON values, with the number of left-out sessions and trials in place of the
    sentences about them, which name sessions of people who withdrew."""
    document = asdict(result)
    document["left_out_count"] = len(document.pop("left_out"))
    return document


def describe_design_difference(anova: OneWayAnova, within: RepeatedMeasures) -> str:
    """Compare in words the published one-way analysis with the repeated-measures analysis, at 1 - `CONFIDENCE`."""
    if anova.p is None or within.p is None:
        text = "neither" if anova.p is None and within.p is None else "only one"
        return (
            f"The published analysis is one-way, between groups; the design is within participants. Of the two, {text} "
            "can be computed from these data, so they cannot be compared."
        )
    is_same_verdict = (anova.p < 1 - CONFIDENCE) == (within.p < 1 - CONFIDENCE)
    return (
        "The published analysis is one-way: it treats every threshold as that of another person, so differences "
        f"between people count as error: {format_f_text(anova.df_between, anova.df_within, anova.f)}, "
        f"{format_p_text(anova.p)}. "
        "The analysis within participants takes those with thresholds at all frequencies, and removes such differences "
        f"({_format_removed_percent(within)} of the spread within frequencies, {within.participants} participants): "
        f"{format_f_text(within.df_conditions, within.df_error, within.f)}, Greenhouse-Geisser epsilon "
        f"{within.epsilon:.2f}, {format_p_text(within.p)}. "
        + ("Both agree at the 5 % level. " if is_same_verdict else "They disagree at the 5 % level. ")
        + "The second matches the design; the first is given for comparison with the published result."
    )


def _format_removed_percent(within: RepeatedMeasures) -> str:
    """Format the share of the sum of squares within frequencies that is due to participants, SS_participants /
    (SS_participants + SS_error), in per cent. One of the two must be above 0."""
    ss_participants, ss_error = within.ss_participants or 0.0, within.ss_error or 0.0
    return f"{100 * ss_participants / (ss_participants + ss_error):.0f} %"
