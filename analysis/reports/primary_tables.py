"""Section of a study report on the primary analysis, a hierarchical psychometric model of all answers.

Tables: median thresholds by frequency, contrasts between frequencies, likelihood thresholds of single runs, estimates
per person, and goodness of fit. Forces are in N, level differences in dB. `psychophysics.hierarchy.primary` computes
the values; this module only words them.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from analysis.psychophysics.group_contrasts import EQUIVALENCE_DB, Contrast
from analysis.psychophysics.hierarchy.inference import MedianThreshold
from analysis.psychophysics.hierarchy.objective import LOG_SD_BOUNDS
from analysis.psychophysics.hierarchy.primary import PrimaryAnalysis
from analysis.psychophysics.hierarchy.run_likelihood import RunLikelihood, convert_to_newton
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.psychophysics.two_analyses import describe_measured_coverage
from analysis.reports.page import Section, Table
from analysis.threshold_words import threshold_words
from analysis.wording import MISSING, conjoin, format_number, format_p, format_p_text, format_signed

AT_BOUND = 0.01
"""Distance of the logarithm of a spread from its upper bound below which the search counts as ended at the bound."""
MEANING = (
    "One psychometric model of all answers: thresholds differ by frequency, by person, and by person at each "
    "frequency; slopes and response biases differ by person. An answer at the cap is an answer like any other, "
    "so nothing is censored and no participant is left out; levels that follow the answers do not bias the "
    "likelihood. Threshold: the level at which an attentive answer without a bias towards one direction is right in "
    "79.37 %."
)
"""Introduction of the section on the model of all answers."""

RUN_MEANING = (
    "From the answers at this frequency alone, with the person's slope and criterion and the lapse rate of the model. "
    "Above the cap, or below the levels played (right answers only): no size, a one-sided bound."
)
"""Note on the thresholds of single runs."""
SINGLE_MEANING = (
    "From the answers at this frequency alone. What a run does not determine is averaged over typical participants: "
    "slopes within a factor of 1.5, response biases within 0.3 d', few lapses. Above the cap, or below the levels "
    "played (right answers only): no size, a one-sided bound."
)
"""Note on thresholds by likelihood where there is no model of all answers."""
TOBIT_MEANING = (
    "A mean that the cap cut counts as at least this. A sensitivity analysis: {too_low}. Wald's intervals, t with "
    "n − 1 degrees of freedom."
)
"""Note on the contrasts by Tobit's model (values censored at the cap)."""


def primary_section(analysis: StudyAnalysis) -> Section:
    """Section on the model of all answers: medians, contrasts, runs, persons and goodness of fit. Without that model, a
    section on thresholds by likelihood of single persons, or on the reason why there are none."""
    primary, means = analysis.primary, analysis.mean_contrasts
    if primary is None:
        return _single_section(analysis)
    words = threshold_words(analysis.protocol.staircase)
    by_means = [_contrast_table(f"Differences by {words.means} (dB)", means, (), _coverage_notes(analysis, "means"))]
    if analysis.tobit:
        notes = (TOBIT_MEANING.format(too_low=words.too_low), *_coverage_notes(analysis, "tobit"))
        by_means.append(_contrast_table("Sensitivity: differences by Tobit's model (dB)", analysis.tobit, (), notes))
    model = _coverage_notes(analysis, "model")
    return Section(
        "All answers in one model",
        paragraphs=(MEANING, analysis.compared, _overall_paragraph(primary), limit_words(primary)),
        tables=(
            _median_table(primary),
            _contrast_table("Differences by the model (dB)", primary.contrasts, primary.medians, model),
            *(by_means if means else []),
            _run_table(primary.runs, primary.confidence, (RUN_MEANING, *_coverage_notes(analysis, "run"))),
            _person_table(primary),
            _goodness_table(primary),
        ),
    )


def _single_section(analysis: StudyAnalysis) -> Section:
    """Section without a model of all answers: thresholds of single persons, or the reason why there are none."""
    single = analysis.single
    if single is None:
        return Section("All answers in one model", paragraphs=(analysis.compared,))
    notes = (SINGLE_MEANING, *_coverage_notes(analysis, "single"))
    table = _run_table(single.runs, single.confidence, notes)
    return Section("Thresholds by likelihood", paragraphs=(analysis.compared,), tables=(replace(table, folded=False),))


def _coverage_notes(analysis: StudyAnalysis, name: str) -> tuple[str, ...]:
    """Notes on the measured coverage of an analysis's intervals where the cap cut the data
    (`describe_measured_coverage`)."""
    return describe_measured_coverage((name,), analysis.table, analysis.protocol.staircase)


def _overall_paragraph(primary: PrimaryAnalysis) -> str:
    """Paragraph on the test over all frequencies, the spread between people, and the common parameters."""
    overall = primary.overall
    people = f" ({overall.participants} people with enough answers at each)" if overall.left_out else ""
    test = (
        f"Frequencies differ{people}: F = {format_number(overall.f)}, Huynh-Feldt epsilon "
        f"{format_number(overall.epsilon_huynh_feldt)}, {format_p_text(overall.p_huynh_feldt)}. "
        if overall.f is not None
        else ""
    )
    return (
        f"{test}People differ by {format_number(primary.person_sd_db, 1)} dB (standard deviation) at all frequencies, "
        f"and by {format_number(primary.frequency_sd_db, 1)} dB more from frequency to frequency. Median slope "
        f"{format_number(primary.slope)} ({primary.family.value}), lapse rate "
        f"{format_number(100 * primary.lapse, 1)} %, response bias "
        f"{format_number(primary.criterion_sd)} (standard deviation, in units of d')."
        + ("" if primary.converged else " The fit did not converge: do not use these numbers.")
        + describe_undetermined(primary)
        + far_above_words(primary)
    )


def far_above_words(primary: PrimaryAnalysis) -> str:
    """Sentence, with a leading space, on frequencies whose medians lie so far above the cap that they cannot be
    compared with each other; empty with fewer than two such frequencies."""
    if len(primary.far_above_hz) < 2:
        return ""
    names = conjoin([f"{frequency_hz:g} Hz" for frequency_hz in primary.far_above_hz])
    return f" At {names} the medians lie at more than twice the cap: the differences between these are not known."


def describe_undetermined(primary: PrimaryAnalysis) -> str:
    """Sentences, with a leading space, where a spread between people ended at the upper bound of its search; else
    empty. This happens with few people, whose answers make slopes of 2 and of 20 almost equally likely."""
    spreads = (primary.person_sd_db, primary.frequency_sd_db, primary.slope_log_sd, primary.criterion_sd)
    names = ("thresholds", "thresholds from frequency to frequency", "slopes", "response biases")
    at_bound = [
        name
        for name, spread, (_, highest) in zip(names, spreads, LOG_SD_BOUNDS, strict=True)
        if math.log(spread) > highest - AT_BOUND
    ]
    if not at_bound:
        return ""
    return (
        f" The answers do not determine how much people differ in their {conjoin(at_bound)}: the search ended at its "
        "bound. Do not use the median slope, nor single curves."
    )


def limit_words(primary: PrimaryAnalysis) -> str:
    """Sentence on the direction limit: the frequency (Hz) at which the median participant's threshold reaches the cap,
    with its interval."""
    limit = primary.limit
    low, high = primary.frequencies_hz[0], primary.frequencies_hz[-1]
    lower = f"{limit.lower_hz:.1f} Hz" if limit.lower_hz is not None else f"below {low:g} Hz"
    upper = f"{limit.upper_hz:.1f} Hz" if limit.upper_hz is not None else f"above {high:g} Hz"
    if limit.frequency_hz is None:
        return f"Direction limit: none within {low:g} to {high:g} Hz. {limit.words}"
    percent = f"{100 * primary.confidence:g} %"
    return (
        f"Direction limit: the median participant's threshold reaches the cap at {limit.frequency_hz:.1f} Hz "
        f"({percent} interval: {lower} to {upper}). {limit.words}"
    )


def _median_table(primary: PrimaryAnalysis) -> Table:
    """Table of the median thresholds with intervals, in N and in dB re 1 N."""
    rows = []
    for median in primary.medians:
        interval_n = interval_words(median.lower_n, median.upper_n, median.above_cap)
        interval_db = interval_words(median.lower_db, median.upper_db, median.above_cap, 1)
        size = "above the cap" if median.above_cap else format_number(median.newton)
        rows.append(
            (
                f"{median.frequency_hz:g} Hz",
                size,
                interval_n,
                MISSING if median.above_cap else format_number(median.db, 1),
                interval_db,
            )
        )
    percent = f"{100 * primary.confidence:g} %"
    return Table(
        caption="Median participant",
        header=("Frequency", "Threshold (N)", f"{percent} interval (N)", "dB re 1 N", f"{percent} interval (dB)"),
        rows=tuple(rows),
        notes=("Above the cap: no size, a one-sided bound by profile likelihood.",),
    )


def interval_words(lower: float | None, upper: float | None, above_cap: bool, digits: int = 2) -> str:
    """Interval of a median as text. upper: None above the cap. lower: None where there are too few people, or where no
    lower bound was found above the cap."""
    if lower is None:
        return "no lower bound" if above_cap else "no interval: too few people"
    return (
        f"above {format_number(lower, digits)}"
        if upper is None
        else f"{format_number(lower, digits)} to {format_number(upper, digits)}"
    )


def _contrast_table(
    caption: str, rows: Sequence[Contrast], medians: Sequence[MedianThreshold], notes: Sequence[str]
) -> Table:
    """Table of differences between two frequencies in dB; frequencies whose medians are above the cap are marked."""
    above = {median.frequency_hz for median in medians if median.above_cap}
    return Table(
        caption=caption,
        header=("Contrast", "n", "Difference", "95 % interval", "p", "p (Holm)", "d_z", "p equivalent", "p spread"),
        rows=tuple(
            (
                f"{c.frequency_hz:g} − {c.against_hz:g} Hz{' *' * (c.frequency_hz in above)}",
                str(c.participants),
                format_signed(c.difference_db, 1),
                f"{format_signed(c.lower_db, 1)} to {format_signed(c.upper_db, 1)}",
                format_p(c.p),
                format_p(c.p_holm),
                format_number(c.effect_size),
                format_p(c.p_equivalence),
                format_p(c.p_spread),
            )
            for c in rows
        ),
        notes=(
            "Within participants, t with n − 1 degrees of freedom; n have enough answers at both. Equivalent: two "
            f"one-sided tests within ±{EQUIVALENCE_DB:g} dB. Spread: Pitman and Morgan, whether people differ equally "
            "much at both.",
            *(("* The median is above the cap: only the lower end of the interval is known.",) if above else ()),
            *notes,
        ),
    )


def _run_table(runs: Sequence[RunLikelihood], confidence: float, notes: tuple[str, ...]) -> Table:
    """Table of the maximum-likelihood thresholds of single runs, in N."""
    return Table(
        caption="Single thresholds by maximum likelihood (N)",
        header=("Participant", "Frequency", "Trials", "Threshold", f"{100 * confidence:g} % likelihood interval"),
        rows=tuple((run.subject, f"{run.frequency_hz:g} Hz", str(run.trials), *run_words(run)) for run in runs),
        notes=notes,
        folded=True,
    )


def run_words(run: RunLikelihood) -> tuple[str, str]:
    """Threshold and likelihood interval in N; a dash for an interval that excludes no threshold."""
    lower, upper = convert_to_newton(run.lower_db), convert_to_newton(run.upper_db)
    if run.below:
        size = "below the levels played"
    else:
        size = "above the cap" if run.db is None else format_number(convert_to_newton(run.db))
    if lower is not None and upper is not None:
        return size, f"{format_number(lower)} to {format_number(upper)}"
    if upper is not None:
        return size, f"below {format_number(upper)}"
    return size, MISSING if lower is None else f"above {format_number(lower)}"


def _person_table(primary: PrimaryAnalysis) -> Table:
    """Table of the model's estimates per person: thresholds in N, slope, criterion (shrunk towards the population)."""
    return Table(
        caption="Thresholds of the participants by the model (N)",
        header=("Participant", *(f"{f:g} Hz" for f in primary.frequencies_hz), "Slope", "Criterion"),
        rows=tuple(
            (
                person.subject,
                *(
                    "above the cap" if above else format_number(value)
                    for value, above in zip(person.thresholds_n, person.above_cap, strict=True)
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


def _goodness_table(primary: PrimaryAnalysis) -> Table:
    """Table of predicted and observed shares of right answers, by bins of trials."""
    return Table(
        caption="Predicted and observed shares of right answers",
        header=("Trials", "Predicted", "Observed", "z"),
        rows=tuple(
            (str(b.trials), f"{100 * b.predicted:.1f} %", f"{100 * b.observed:.1f} %", format_signed(b.z, 1))
            for b in primary.goodness.bins
        ),
        notes=(
            "Levels follow answers and persons were fitted to theirs, so single shares deviate by up to three "
            "standard errors even where the model is right. Look for systematic departures.",
        ),
        folded=True,
    )
