"""Section of a study report on whether the direction was the cue, or another difference between the stimuli.

The experiment asks for the direction of a vibration. The device may deliver the two directions with different
amplitudes, harmonics or motion across the direction, and a participant may answer by such a difference instead. Two
tables with a row per cue and frequency: the sensitivity d' that the cue alone would give (`cue_sensitivity`), and
whether the answers depended on the cue (`answers_on_delivery`, logistic regression).
"""

from collections.abc import Sequence

from analysis.psychophysics.cues.answers_on_delivery import CUE_ONLY_SLOPE, AnswerRegression
from analysis.psychophysics.cues.cue_findings import CueFinding, describe_cue_gaps, make_cue_warnings
from analysis.psychophysics.cues.cue_sensitivity import INTERNAL_NOISE_DB, TYPICAL_NOISE_DB
from analysis.psychophysics.cues.delivered_cues import CueGap
from analysis.reports.page import Section, Table
from analysis.threshold_words import select_threshold_words
from analysis.wording import MISSING, conjoin, format_number, format_p, format_signed
from protocols.definition.staircase_rule import StaircaseRule

_INTRODUCTION = (
    "A device seldom delivers both directions equally. A participant may notice another difference instead of the "
    "direction: the amplitude along the direction (intensity), the harmonics (spectrum), or the motion across the "
    "direction (coupling). Each is in dB; harmonics and motion across count by the most that they can add to the "
    "amplitude."
)


def make_cue_sections(findings: Sequence[CueFinding], gaps: Sequence[CueGap], rule: StaircaseRule) -> list[Section]:
    """Make the section on cues other than the direction; empty without findings. findings: one per cue and frequency.
    gaps: trials without a measurement of a cue. rule: the staircase rule, which determines a note on d' of the
    answers."""
    if not findings:
        return []
    sentences = (
        *(make_cue_warnings(findings) or (_describe_no_cue(findings),)),
        *filter(None, [describe_cue_gaps(gaps)]),
    )
    tables = (
        _tabulate_sensitivity(findings, select_threshold_words(rule).d_prime_note),
        _tabulate_regressions(findings),
    )
    return [Section("Was direction the cue?", paragraphs=(_INTRODUCTION, *sentences), tables=tables)]


def _describe_no_cue(findings: Sequence[CueFinding]) -> str:
    """Describe the result where no cue is shown to be noticeable or followed, with the cues that could not be
    tested."""
    untestable_cues = [
        f"{finding.cue.value} at {finding.frequency_hz:g} Hz"
        for finding in findings
        if not finding.answers.is_conclusive
    ]
    return (
        f"No measured difference is one that a participant with an internal noise of {TYPICAL_NOISE_DB:g} dB notices, "
        "and no answers are shown to depend on what was delivered."
        + (
            " Within a direction, these data cannot test whether answers depend on the delivery: "
            f"{conjoin(untestable_cues)}. A roved level (rove_db of [stimulus]) allows the test for intensity."
            if untestable_cues
            else ""
        )
    )


def _tabulate_sensitivity(findings: Sequence[CueFinding], d_prime_note: str) -> Table:
    """Tabulate d' by each cue alone, a row per cue and frequency. d_prime_note: sentence on the d' of the answers."""
    return Table(
        caption="Sensitivity that each cue alone would give",
        header=(
            "Cue", "Frequency", "Difference (dB)", "Largest", "Spread (dB)",
            *(f"d' at {noise_db:g} dB" for noise_db in INTERNAL_NOISE_DB), "d' of the answers", "Noticeable for",
        ),
        rows=tuple(
            (
                finding.cue.value, f"{finding.frequency_hz:g} Hz", format_signed(finding.difference_db),
                format_signed(finding.largest_db), format_number(finding.spread_db),
                *(format_number(d_prime) for d_prime in finding.abilities), format_number(finding.observed_d_prime),
                f"{len(finding.noticed_by)} of {len(finding.people)}",
            )
            for finding in findings
        ),
        notes=(
            "Difference: direction at the smaller angle minus that at the larger (without angles: number 1 minus 2); "
            "medians over participants, and the largest of any. Spread: standard deviation over trials of a direction "
            "at one level, roving included. d' = difference over internal noise and spread (root of the sum of "
            "squares), for three internal noises; d' = 1 is one just noticeable difference.",
            f"Noticeable: shown, by a 95 % interval of the difference, to reach d' 1 at an internal noise of "
            f"{TYPICAL_NOISE_DB:g} dB. {d_prime_note}",
        ),
    )  # fmt: skip


def _tabulate_regressions(findings: Sequence[CueFinding]) -> Table:
    """Tabulate the logistic regression of answers on each cue, a row per cue and frequency."""
    return Table(
        caption="Whether answers depend on the delivery within a direction",
        header=("Cue", "Frequency", "Trials", "Spread (dB)", "Logits per dB", "95 % interval", "p (Holm)", "Answers"),
        rows=tuple(
            (
                finding.cue.value, f"{finding.frequency_hz:g} Hz", str(finding.answers.trials),
                format_number(finding.answers.residual_sd_db, 3), *_format_slope_and_interval(finding.answers),
                format_p(finding.p_holm), _describe_dependence(finding),
            )
            for finding in findings
        ),
        notes=(
            "Logistic regression of answers on each trial's deviation from the others of that participant, direction "
            "and level. Positive: more of the cue with answers of the direction at the smaller angle (without angles: "
            "number 1). "
            f"A participant with an internal noise of {TYPICAL_NOISE_DB:g} dB who answers by the cue alone has "
            f"{format_number(CUE_ONLY_SLOPE, 1)} logits per dB; a participant who answers by the direction has 0.",
        ),
        folded=True,
    )  # fmt: skip


def _format_slope_and_interval(answers: AnswerRegression) -> tuple[str, str]:
    """Format the slope of the regression (logits per dB) and its 95 % interval; `MISSING` where they are not
    determined."""
    if answers.slope is None or answers.lower is None or answers.upper is None:
        return MISSING, MISSING
    return format_signed(answers.slope), f"{format_signed(answers.lower)} to {format_signed(answers.upper)}"


def _describe_dependence(finding: CueFinding) -> str:
    """Describe in a table cell whether the answers depend on the cue, after Holm's correction, or that the data cannot
    test it."""
    if finding.affects_answers:
        return "depend on the cue"
    return "do not" if finding.answers.is_conclusive else "not testable"
