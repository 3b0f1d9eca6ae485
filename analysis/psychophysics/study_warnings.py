"""Warnings about the results of a study, as sentences for its report.

They cover runs without a threshold, censored thresholds, samples, chance, response bias and its drift, spoiled (void),
flagged and unmeasured trials, lapses, and detection. Each `_warn_of_...` returns a paragraph, empty without a finding.
"""

import math
from collections.abc import Iterable, Sequence

from scipy.stats import binom

from analysis.psychophysics.bias import compute_criterion_variance
from analysis.psychophysics.catch_trials import CatchTally, compute_wilson_interval
from analysis.psychophysics.criterion_drift import estimate_criterion_drifts
from analysis.psychophysics.detection import find_thresholds_below_detection
from analysis.psychophysics.threshold_table import ThresholdTable
from analysis.psychophysics.thresholds import RunEnd, Threshold
from analysis.threshold_words import select_threshold_words
from analysis.wording import conjoin, format_newtons, format_signed
from protocols.definition.staircase_rule import StaircaseRule
from protocols.definition.study_protocol import StudyProtocol
from protocols.trial import Trial, TrialStatus

FEW_PARTICIPANTS = 5
"""Number of participants below which means and tests hardly generalise to the population. Chosen."""
STRONG_BIAS = 0.6
"""Magnitude of the criterion c (units of d') above which a run is listed as biased: at d' = 1.64 it lowers the share of
right answers by 0.04. An unbiased observer exceeds it by chance in about one of 250 complete runs."""
BIAS_Z = 2.58
"""Standard errors by which a criterion must also differ from 0 (two-sided 1 % normal quantile): in unfinished runs of
3 to 12 trials, one in ten of an unbiased observer exceeds `STRONG_BIAS`."""
DRIFT_LEVEL, LEAVE_ONE_OUT_LEVEL = 0.02, 0.2
"""Significance levels of the test for a drift of the criterion in a session: of all runs, and of the worst result with
one run left out. Together they flag 3 of 1000 simulated sessions with a constant criterion, and 438 of
1000 with a drift of 0.3 in 100 trials (tests/references/drift_flag.py)."""
MANY_LAPSES = 0.1
"""Share of wrong catch trials (lapse rate) above which a participant is listed. Chosen."""
PERCEIVED_BY_ALL_HZ = 15.0
"""Highest frequency (Hz) at which all participants are expected to feel the direction at full level, so that an error
in a catch trial there is a lapse. Chosen."""
REPEAT_SD_DB = 2.4
"""Standard deviation of the difference of two runs with the same true threshold: sqrt(2) times 1.7 dB, the spread of
500 simulated runs under the published rule (Weibull slope 2, 2 % lapses)."""


def list_study_warnings(
    trials: Sequence[Trial], thresholds: Sequence[Threshold], table: ThresholdTable, protocol: StudyProtocol
) -> tuple[str, ...]:
    """List all warnings about the direction thresholds. trials: of the test phase. thresholds: of their runs; table:
    the same (N) by participant and frequency. Without thresholds the only warning is that there are none."""
    if not thresholds:
        return ("There are no test trials, so there is no threshold of direction.",)
    candidates = (
        _warn_of_stopped_runs(thresholds, protocol.staircase),
        _warn_of_incomplete_runs(thresholds, protocol.staircase),
        _warn_of_missing_thresholds(table),
        _warn_of_censoring(table, protocol.staircase),
        _warn_of_few_participants(table),
        _warn_of_unequal_sizes(table),
        _warn_of_chance_level(thresholds),
        _warn_of_bias(thresholds),
        _warn_of_drift(trials),
        _warn_of_spoiled_trials(trials),
        _warn_of_flagged_trials(trials),
        _warn_of_unmeasured_trials(trials),
        *table.notes,
    )
    return tuple(sentence for sentence in candidates if sentence)


def list_catch_and_detection_warnings(
    catches: Sequence[CatchTally],
    detection: Sequence[Threshold],
    table: ThresholdTable,
    detection_table: ThresholdTable,
) -> tuple[str, ...]:
    """List the warnings about catch trials and detection runs. detection: thresholds of the detection runs. table,
    detection_table: direction and detection thresholds (N) by participant and frequency."""
    incomplete = [_describe_run(run) for run in detection if not run.complete]
    censored = [_describe_run(run) for run in detection if run.complete and run.censored]
    candidates = (
        _warn_of_lapses(catches),
        f"{_format_count(incomplete, 'detection run')} not complete and without a threshold: {conjoin(incomplete)}."
        if incomplete
        else "",
        f"{_format_count(censored, 'detection threshold')} cut by the cap: {conjoin(censored)}." if censored else "",
        _warn_of_detection_at_chance(detection),
        _warn_of_direction_below_detection(table, detection_table),
        *detection_table.notes,
    )
    return tuple(sentence for sentence in candidates if sentence)


def _warn_of_incomplete_runs(thresholds: Sequence[Threshold], rule: StaircaseRule) -> str:
    runs = [
        f"{_describe_run(run)} ({_describe_progress(run, rule)})"
        for run in thresholds
        if not run.complete and run.ended is not RunEnd.TRIAL_LIMIT
    ]
    return f"{_format_count(runs, 'run')} not complete and without a threshold: {conjoin(runs)}." if runs else ""


def _warn_of_stopped_runs(thresholds: Sequence[Threshold], rule: StaircaseRule) -> str:
    stopped_runs = [
        f"{_describe_run(run)} ({_describe_progress(run, rule)}, {run.trials_at_cap} trials at the cap)"
        for run in thresholds
        if run.ended is RunEnd.TRIAL_LIMIT
    ]
    if not stopped_runs:
        return ""
    return (
        f"{_format_count(stopped_runs, 'run')} stopped by the limit of {rule.trial_limit} trials, without a threshold: "
        f"{conjoin(stopped_runs)}. The limit stops participants who cannot discriminate the directions far more often "
        "than others, so the remaining means are too low."
    )


def _describe_progress(run: Threshold, rule: StaircaseRule) -> str:
    """Describe the progress of an incomplete run: its reversals, or with the Psi method its trials."""
    return f"{run.trials} trials" if rule.is_bayesian else f"{run.reversals} of {rule.reversals} reversals"


def _warn_of_missing_thresholds(table: ThresholdTable) -> str:
    missing_cells = [f"{subject} at {frequency:g} Hz" for subject, frequency in table.list_gaps()]
    return f"No threshold for {conjoin(missing_cells)}." if missing_cells else ""


def _warn_of_censoring(table: ThresholdTable, rule: StaircaseRule) -> str:
    cells = [
        f"{subject} at {frequency:g} Hz"
        for subject, row in zip(table.subjects, table.censored, strict=True)
        for frequency, censored in zip(table.frequencies_hz, row, strict=True)
        if censored
    ]
    if not cells:
        return ""
    count, clause = _format_count(cells, "threshold"), select_threshold_words(rule).cut_clause
    return (
        f"{count} cut by the cap of {rule.cap_n:g} N, {clause}: {conjoin(cells)}. As in the published analysis they "
        "enter means and tests as plain numbers, so means near the cap are too low, differences towards it too small, "
        "and intervals and effect sizes without coverage."
    )


def _warn_of_few_participants(table: ThresholdTable) -> str:
    count = len(table.subjects)
    if count >= FEW_PARTICIPANTS:
        return ""
    if count == 1:
        return "There is one participant: individual thresholds can be shown, nothing can be tested."
    return f"There are only {count} participants: means and tests say little about people in general."


def _warn_of_unequal_sizes(table: ThresholdTable) -> str:
    threshold_counts = {sum(value is not None for value in column) for column in table.group_by_frequency().values()}
    if len(threshold_counts) < 2:
        return ""
    return "The frequencies have unequally many thresholds, so the comparison intervals are approximate."


def _warn_of_chance_level(thresholds: Sequence[Threshold]) -> str:
    chance_runs = _describe_runs_at_chance(thresholds)
    return (
        "Answers not shown to be better than chance (one-sided binomial test, 5 %; a threshold far above the cap looks "
        f"the same): {conjoin(chance_runs)}."
        if chance_runs
        else ""
    )


def _describe_runs_at_chance(thresholds: Sequence[Threshold]) -> list[str]:
    """Describe the runs whose answers are not significantly better than chance; runs without answers are left out."""
    return [
        f"{_describe_run(run)} ({run.percent_correct:.0f} % right of {run.trials})"
        for run in thresholds
        if run.percent_correct is not None and not _is_above_chance(run.percent_correct, run.trials)
    ]


def _is_above_chance(percent_correct: float, trials: int) -> bool:
    """Whether a one-sided binomial test at the 5 % level rejects a probability of 1/2 for a right answer."""
    correct_count = round(percent_correct / 100.0 * trials)
    return bool(binom.sf(correct_count - 1, trials, 0.5) < 0.05)


def _warn_of_bias(thresholds: Sequence[Threshold]) -> str:
    biased_runs = [
        f"{_describe_run(run)} (criterion {format_signed(run.criterion)})"
        for run in thresholds
        if run.criterion is not None and _is_biased(run, run.criterion)
    ]
    if not biased_runs:
        return ""
    return f"A bias towards one of the two answers, which raises a threshold, was found in {conjoin(biased_runs)}."


def _is_biased(run: Threshold, criterion: float) -> bool:
    """Whether the magnitude of the criterion exceeds `STRONG_BIAS` and `BIAS_Z` standard errors, as if both directions
    had been shown equally often."""
    n_each, correct = run.trials / 2.0, round(run.trials * (run.percent_correct or 0.0) / 100.0)
    return abs(criterion) > max(STRONG_BIAS, BIAS_Z * math.sqrt(compute_criterion_variance(correct, n_each, n_each)))


def _warn_of_drift(trials: Iterable[Trial]) -> str:
    """Warn of sessions whose criterion drifts over the runs, by `DRIFT_LEVEL` and `LEAVE_ONE_OUT_LEVEL`."""
    sessions: dict[tuple[str, str], dict[int, list[Trial]]] = {}
    for trial in trials:
        if trial.is_valid:
            sessions.setdefault((trial.subject, trial.session), {}).setdefault(trial.run, []).append(trial)
    drifts = estimate_criterion_drifts(
        [[_extract_answers(runs[run_number]) for run_number in sorted(runs)] for runs in sessions.values()]
    )
    drifting_sessions = [
        f"{subject} ({session}, criterion {format_signed(drift.per_100_trials)} per 100 trials)"
        for (subject, session), drift in zip(sessions, drifts, strict=True)
        if drift is not None and drift.p < DRIFT_LEVEL and drift.p_without_a_run < LEAVE_ONE_OUT_LEVEL
    ]
    if not drifting_sessions:
        return ""
    return (
        f"A bias towards one of the two answers changed from run to run of a session (p < {DRIFT_LEVEL:g} each, in "
        "addition to the variation between runs without a trend), which raises thresholds if strong: "
        f"{conjoin(drifting_sessions)}."
    )


def _extract_answers(run_trials: Sequence[Trial]) -> tuple[list[int], list[bool]]:
    """Extract the directions shown (1 or 2), and whether each answer was right, from valid trials."""
    return [trial.direction_shown for trial in run_trials], [bool(trial.correct) for trial in run_trials]


def _warn_of_spoiled_trials(trials: Iterable[Trial]) -> str:
    count = sum(trial.status is TrialStatus.SPOILED for trial in trials)
    return f"{count} spoiled presentation{'s' if count != 1 else ''}, played again; the answers do not count." * bool(
        count
    )


def _warn_of_flagged_trials(trials: Iterable[Trial]) -> str:
    count = sum(trial.status is TrialStatus.FLAGGED for trial in trials)
    return f"{count} trial{'s' if count != 1 else ''} flagged: counted, but the stimulus should be checked." * bool(
        count
    )


def _warn_of_unmeasured_trials(trials: Iterable[Trial]) -> str:
    count = sum(trial.is_valid and trial.delivered_mps2 is None for trial in trials)
    if not count:
        return ""
    return (
        f"{count} counted trial{'s' if count != 1 else ''} without a measured acceleration: answered before a full "
        "period of the steady stimulus was recorded, or the recording was lost. The answers count."
    )


def _warn_of_lapses(catches: Sequence[CatchTally]) -> str:
    """Warn of participants with a share of more than `MANY_LAPSES` wrong catch trials up to `PERCEIVED_BY_ALL_HZ`."""
    lapses = []
    perceptible_tallies = [tally for tally in catches if tally.frequency_hz <= PERCEIVED_BY_ALL_HZ]
    for subject in dict.fromkeys(tally.subject for tally in perceptible_tallies):
        wrong = sum(tally.wrong for tally in perceptible_tallies if tally.subject == subject)
        answers = sum(tally.given for tally in perceptible_tallies if tally.subject == subject)
        if wrong > MANY_LAPSES * answers:
            lower, upper = compute_wilson_interval(wrong, answers)
            lapses.append(f"{subject} ({wrong} of {answers}; 95 % interval {100 * lower:.0f} to {100 * upper:.0f} %)")
    if not lapses:
        return ""
    return (
        f"More than {100 * MANY_LAPSES:.0f} % wrong in catch trials at full level, up to {PERCEIVED_BY_ALL_HZ:g} Hz, "
        f"where inattention raises a threshold: {conjoin(lapses)}."
    )


def _warn_of_detection_at_chance(detection: Sequence[Threshold]) -> str:
    chance_runs = _describe_runs_at_chance(detection)
    return f"Detection not shown to be better than chance: {conjoin(chance_runs)}." if chance_runs else ""


def _warn_of_direction_below_detection(table: ThresholdTable, detection_table: ThresholdTable) -> str:
    cells = [
        f"{case.subject} at {case.frequency_hz:g} Hz ({format_newtons(case.direction_n)} N, detected from "
        f"{format_newtons(case.detection_n)} N)"
        for case in find_thresholds_below_detection(table, detection_table)
    ]
    if not cells:
        return ""
    return (
        f"The direction was identified at a level below the detection threshold of the vibration: {conjoin(cells)}. "
        f"Two runs of one threshold differ by {REPEAT_SD_DB:g} dB (standard deviation); a difference of more than "
        "twice that suggests another cue than touch, or a lapse of attention in the detection run."
    )


def _describe_run(run: Threshold) -> str:
    return f"{run.subject} at {run.frequency_hz:g} Hz"


def _format_count(items: Sequence[str], noun: str) -> str:
    """Format the number of items with noun and verb, as the start of a sentence: "2 runs are"."""
    return f"1 {noun} is" if len(items) == 1 else f"{len(items)} {noun}s are"
