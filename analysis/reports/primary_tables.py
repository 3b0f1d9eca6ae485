"""Section of a study report on the primary analysis, a hierarchical psychometric model of all answers.

Tables: median thresholds by frequency, contrasts between frequencies, likelihood thresholds of single persons,
estimates per person, and goodness of fit. Begin with `make_primary_section`. This module only formats; the values come
from `analysis.psychophysics`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from analysis.psychophysics.declared_result import NOT_CONVERGED_NOTE
from analysis.psychophysics.group_contrasts import EQUIVALENCE_DB, Contrast
from analysis.psychophysics.hierarchy.curve import TARGET_PROPORTION
from analysis.psychophysics.hierarchy.inference import MedianThreshold
from analysis.psychophysics.hierarchy.likelihood_thresholds import LikelihoodThreshold, convert_to_newton
from analysis.psychophysics.hierarchy.objective import LOG_SD_BOUNDS, LOG_SLOPE_BOUNDS
from analysis.psychophysics.hierarchy.primary import PrimaryAnalysis
from analysis.psychophysics.hierarchy.single_persons import CRITERION_SD, SLOPE_LOG_SD
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.psychophysics.two_analyses import describe_measured_coverage
from analysis.reports.page import Section, Table
from analysis.threshold_words import select_threshold_words
from analysis.wording import MISSING, conjoin, format_newtons, format_number, format_p, format_p_text, format_signed

BOUND_TOLERANCE_LOG = 0.01
"""Distance of the log of a standard deviation or slope from its bound, below which it counts as there. Chosen."""
INTRODUCTION = (
    "One psychometric model of all answers: thresholds differ by frequency, by person, and by person at each "
    "frequency; slopes and response biases differ by person. An answer at the cap is an answer like any other, so "
    "nothing is censored and no participant is left out; levels that follow the answers do not bias the likelihood. "
    "Threshold: the level at which an attentive answer without a bias towards one direction is right in "
    f"{100 * TARGET_PROPORTION:.2f} %."
)
RUN_NOTE = (
    "From the answers at this frequency alone, with the person's slope and criterion and the lapse rate of the model. "
    "Above the cap, or below the levels played (right answers only): no size, a one-sided bound."
)
"""Note below the thresholds of single persons, where the model of all answers was fitted."""
SINGLE_RUN_NOTE = (
    "From the answers at this frequency alone. What a run does not determine is averaged over typical participants: "
    f"slopes within a factor of {math.exp(SLOPE_LOG_SD):.1f}, response biases within {CRITERION_SD:g} d', few lapses. "
    "Above the cap, or below the levels played (right answers only): no size, a one-sided bound."
)
"""Note below the thresholds of single persons, where there is no model of all answers."""
CAP_NOTE = "* (†): first (second) median above the cap; the interval has only its lower (upper) end; with both, none."
"""Note below the contrasts by the model, where a median is above the cap."""
TOBIT_NOTE = (
    "A mean that the cap cut counts as at least this. A sensitivity analysis: {too_low}. Wald's intervals, t with "
    "n − 1 degrees of freedom."
)
"""Note below the contrasts by the Tobit model (values censored at the cap)."""


def make_primary_section(analysis: StudyAnalysis) -> Section:
    """Make the section on the model of all answers; without that model, on the thresholds by likelihood of single
    persons, or on the reason why there are none."""
    primary, means = analysis.primary, analysis.mean_contrasts
    if primary is None:
        return _make_single_section(analysis)
    phrases = select_threshold_words(analysis.protocol.staircase)
    mean_tables = [
        _make_contrast_table(f"Differences by {phrases.noun} (dB)", means, (), _describe_coverage(analysis, "means"))
    ]
    if analysis.tobit:
        tobit_notes = (TOBIT_NOTE.format(too_low=phrases.tobit_caveat), *_describe_coverage(analysis, "tobit"))
        mean_tables.append(
            _make_contrast_table("Sensitivity: differences by Tobit's model (dB)", analysis.tobit, (), tobit_notes)
        )
    coverage_notes = _describe_coverage(analysis, "model")
    return Section(
        "All answers in one model",
        paragraphs=(INTRODUCTION, analysis.comparison_text, _describe_fit(primary), describe_direction_limit(primary)),
        tables=(
            _make_median_table(primary),
            _make_contrast_table("Differences by the model (dB)", primary.contrasts, primary.medians, coverage_notes),
            *(mean_tables if means else []),
            _make_run_table(primary.runs, primary.confidence, (RUN_NOTE, *_describe_coverage(analysis, "run"))),
            _make_person_table(primary),
            _make_goodness_table(primary),
        ),
    )


def _make_single_section(analysis: StudyAnalysis) -> Section:
    """Make the section without a model of all answers: thresholds of single persons, or the reason for their lack."""
    single_persons = analysis.single_persons
    if single_persons is None:
        return Section("All answers in one model", paragraphs=(analysis.comparison_text,))
    run_notes = (SINGLE_RUN_NOTE, *_describe_coverage(analysis, "single"))
    table = _make_run_table(single_persons.runs, single_persons.confidence, run_notes)
    return Section(
        "Thresholds by likelihood", paragraphs=(analysis.comparison_text,), tables=(replace(table, folded=False),)
    )


def _describe_coverage(analysis: StudyAnalysis, analysis_name: str) -> tuple[str, ...]:
    """Describe the measured coverage of the intervals of an analysis (a name of `coverage_words.INTERVAL_TITLES`)."""
    return describe_measured_coverage((analysis_name,), analysis.table, analysis.protocol.staircase)


def _describe_fit(primary: PrimaryAnalysis) -> str:
    """Describe the test over all frequencies, the standard deviations between persons and the common parameters, with
    warnings where the fit did not converge or does not determine them."""
    overall = primary.overall
    participant_note = f" ({overall.participants} people with enough answers at each)" if overall.left_out else ""
    test_text = (
        f"Frequencies differ{participant_note}: F = {format_number(overall.f)}, Huynh-Feldt epsilon "
        f"{format_number(overall.epsilon_huynh_feldt)}, {format_p_text(overall.p_huynh_feldt)}. "
        if overall.f is not None
        else ""
    )
    return (
        f"{test_text}People differ by {format_number(primary.person_sd_db, 1)} dB (standard deviation) at all "
        f"frequencies, and by {format_number(primary.frequency_sd_db, 1)} dB more from frequency to frequency. "
        f"Median slope {format_number(primary.slope)} ({primary.family.value}), lapse rate "
        f"{format_number(100 * primary.lapse, 1)} %, response bias "
        f"{format_number(primary.criterion_sd)} (standard deviation, in units of d')."
        + describe_undetermined(primary)
        + describe_far_above(primary)
    )


def describe_far_above(primary: PrimaryAnalysis) -> str:
    """Describe the medians too far above the cap to be compared: a sentence with a leading space; empty below two."""
    if len(primary.far_above_hz) < 2:
        return ""
    hz_text = conjoin([f"{frequency_hz:g} Hz" for frequency_hz in primary.far_above_hz])
    return f" At {hz_text} the medians lie at more than twice the cap: the differences between these are not known."


def describe_undetermined(primary: PrimaryAnalysis) -> str:
    """Describe that the fit did not converge, and that the search ended at a bound of the median slope, or at the upper
    one of standard deviations between persons: sentences with a leading space; empty without either."""
    convergence_text = "" if primary.converged else f" {NOT_CONVERGED_NOTE}"
    sds = (primary.person_sd_db, primary.frequency_sd_db, primary.slope_log_sd, primary.criterion_sd)
    quantity_names = ("thresholds", "thresholds from frequency to frequency", "slopes", "response biases")
    undetermined = [
        name
        for name, sd, (_, upper_bound) in zip(quantity_names, sds, LOG_SD_BOUNDS, strict=True)
        if math.log(sd) > upper_bound - BOUND_TOLERANCE_LOG
    ]
    slope_margin_log = min(abs(math.log(primary.slope) - bound) for bound in LOG_SLOPE_BOUNDS)
    subjects = ["the median slope"] if slope_margin_log < BOUND_TOLERANCE_LOG else []
    subjects += [f"how much people differ in their {conjoin(undetermined)}"] if undetermined else []
    bound_text = (
        f" The answers do not determine {conjoin(subjects)}: the search ended at its bound. Do not use the median "
        "slope, nor single curves."
    )
    return convergence_text + (bound_text if subjects else "")


def describe_direction_limit(primary: PrimaryAnalysis) -> str:
    """Describe the direction limit in a sentence: the frequency (Hz) at which the median participant's threshold
    reaches the cap, with its interval; or that there is none within the tested frequencies."""
    limit = primary.limit
    lowest_hz, highest_hz = primary.frequencies_hz[0], primary.frequencies_hz[-1]
    lower_text = f"{limit.lower_hz:.1f} Hz" if limit.lower_hz is not None else f"below {lowest_hz:g} Hz"
    upper_text = f"{limit.upper_hz:.1f} Hz" if limit.upper_hz is not None else f"above {highest_hz:g} Hz"
    if limit.frequency_hz is None:
        return f"Direction limit: none within {lowest_hz:g} to {highest_hz:g} Hz. {limit.words}"
    return (
        f"Direction limit: the median participant's threshold reaches the cap at {limit.frequency_hz:.1f} Hz "
        f"({100 * primary.confidence:g} % interval: {lower_text} to {upper_text}). {limit.words}"
    )


def _make_median_table(primary: PrimaryAnalysis) -> Table:
    """Make the table of the median thresholds with intervals, in N and in dB re 1 N."""
    rows = []
    for median in primary.medians:
        interval_n = format_median_interval(median.lower_n, median.upper_n, median.above_cap)
        interval_db = format_median_interval(
            median.lower_db, median.upper_db, median.above_cap, partial(format_number, digits=1)
        )
        threshold_text = "above the cap" if median.above_cap else format_newtons(median.newton)
        db_text = MISSING if median.above_cap else format_number(median.db, 1)
        rows.append((f"{median.frequency_hz:g} Hz", threshold_text, interval_n, db_text, interval_db))
    percent = f"{100 * primary.confidence:g} %"
    return Table(
        caption="Median participant",
        header=("Frequency", "Threshold (N)", f"{percent} interval (N)", "dB re 1 N", f"{percent} interval (dB)"),
        rows=tuple(rows),
        notes=("Above the cap: no size, a one-sided bound by profile likelihood.",),
    )


def format_median_interval(
    lower: float | None,
    upper: float | None,
    above_cap: bool,
    format_limit: Callable[[float], str] = format_newtons,
) -> str:
    """Format the interval of a median threshold. upper: None above the cap. lower: None where there are too few people,
    or, above the cap, where no lower bound was found. format_limit: formats a limit in its unit."""
    if lower is None:
        return "no lower bound" if above_cap else "no interval: too few people"
    return f"above {format_limit(lower)}" if upper is None else f"{format_limit(lower)} to {format_limit(upper)}"


def _make_contrast_table(
    caption: str, contrasts: Sequence[Contrast], medians: Sequence[MedianThreshold], notes: Sequence[str]
) -> Table:
    """Make the table of contrasts (dB) between two frequencies, either marked where its median is above the cap."""
    above_cap_hz = {median.frequency_hz for median in medians if median.above_cap}
    return Table(
        caption=caption,
        header=("Contrast", "n", "Difference", "95 % interval", "p", "p (Holm)", "d_z", "p equivalent", "p spread"),
        rows=tuple(
            (
                f"{contrast.frequency_hz:g} − {contrast.against_hz:g} Hz"
                f"{' *' * (contrast.frequency_hz in above_cap_hz)}{' †' * (contrast.against_hz in above_cap_hz)}",
                str(contrast.participants),
                format_signed(contrast.difference_db, 1),
                f"{format_signed(contrast.lower_db, 1)} to {format_signed(contrast.upper_db, 1)}",
                format_p(contrast.p),
                format_p(contrast.p_holm),
                format_number(contrast.effect_size),
                format_p(contrast.p_equivalence),
                format_p(contrast.p_spread),
            )
            for contrast in contrasts
        ),
        notes=(
            "Within participants, t with n − 1 degrees of freedom; n have enough answers at both. Equivalent: two "
            f"one-sided tests within ±{EQUIVALENCE_DB:g} dB. Spread: Pitman and Morgan, whether people differ equally "
            "much at both.",
            *((CAP_NOTE,) if above_cap_hz else ()),
            *notes,
        ),
    )


def _make_run_table(runs: Sequence[LikelihoodThreshold], confidence: float, notes: tuple[str, ...]) -> Table:
    """Make the folded table of the maximum-likelihood thresholds of single persons by frequency. confidence: 0 to 1."""
    return Table(
        caption="Single thresholds by maximum likelihood (N)",
        header=("Participant", "Frequency", "Trials", "Threshold", f"{100 * confidence:g} % likelihood interval"),
        rows=tuple((run.subject, f"{run.frequency_hz:g} Hz", str(run.trials), *format_run(run)) for run in runs),
        notes=notes,
        folded=True,
    )


def format_run(run: LikelihoodThreshold) -> tuple[str, str]:
    """Format a person's threshold at a frequency and its likelihood interval (N): one-sided without one end, `MISSING`
    without both."""
    lower_n, upper_n = convert_to_newton(run.lower_db), convert_to_newton(run.upper_db)
    if run.below:
        threshold_text = "below the levels played"
    else:
        threshold_text = "above the cap" if run.db is None else format_newtons(convert_to_newton(run.db))
    if lower_n is not None and upper_n is not None:
        return threshold_text, f"{format_newtons(lower_n)} to {format_newtons(upper_n)}"
    if upper_n is not None:
        return threshold_text, f"below {format_newtons(upper_n)}"
    return threshold_text, MISSING if lower_n is None else f"above {format_newtons(lower_n)}"


def _make_person_table(primary: PrimaryAnalysis) -> Table:
    """Make the folded table of the model's estimates per person; the criterion is in units of d'."""
    return Table(
        caption="Thresholds of the participants by the model (N)",
        header=("Participant", *(f"{hz:g} Hz" for hz in primary.frequencies_hz), "Slope", "Criterion"),
        rows=tuple(
            (
                person.subject,
                *(
                    "above the cap" if is_above_cap else format_newtons(threshold_n)
                    for threshold_n, is_above_cap in zip(person.thresholds_n, person.above_cap, strict=True)
                ),
                format_number(person.slope),
                format_signed(person.criterion),
            )
            for person in primary.persons
        ),
        notes=(
            "Shrunk towards the other participants' thresholds where a participant's own answers carry little "
            "information.",
        ),
        folded=True,
    )


def _make_goodness_table(primary: PrimaryAnalysis) -> Table:
    """Make the folded table of predicted and observed shares of correct answers, by bins of trials."""
    return Table(
        caption="Predicted and observed shares of right answers",
        header=("Trials", "Predicted", "Observed", "z"),
        rows=tuple(
            (str(row.trials), f"{100 * row.predicted:.1f} %", f"{100 * row.observed:.1f} %", format_signed(row.z, 1))
            for row in primary.goodness.bins
        ),
        notes=(
            "Levels follow answers and persons were fitted to theirs, so single shares deviate by up to three "
            "standard errors even where the model is right. Look for systematic departures.",
        ),
        folded=True,
    )
